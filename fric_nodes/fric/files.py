"""Writing a file all or nothing: aside first, then renamed, so that a failed write leaves the old file as it was."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from .errors import InputError

__all__ = ["write_text"]


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write ``text`` to ``path``, making its folder when missing.

    Raises:
        InputError: the file can't be written.
    """
    target = Path(path)
    aside: Path | None = None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=target.parent, suffix=".tmp", delete=False, encoding="utf-8") as file:
            aside = Path(file.name)
            file.write(text)
        aside.chmod(0o644)
        aside.replace(target)
    except OSError as error:
        if aside is not None:
            aside.unlink(missing_ok=True)
        raise InputError(path, f"cannot be written ({error})", "choose a folder that you can write to") from None
