"""Cases on disk and the sealed key: what is concealed is written down, and its hash published, before any diagnosis begins.

A folder of an examination holds ``plan.json`` (what was asked for), ``cases/NNNN/`` (bags and nominal model, all that a
diagnosis is given), ``sealed/key.json`` and ``key.sha256``. The hash is of the key file's bytes; whoever has noted it can
check that the key that was opened in the end is the one from the beginning.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

from ...bagio import write_record
from ...errors import InputError
from ...files import write_text
from ...model_file import write_model
from .cases import Order, make

__all__ = ["case_folder", "open_key", "seal", "set_up"]

_RETRIES = 4


def case_folder(out: Path, number: int) -> Path:
    """Folder of a case."""
    return out / "cases" / f"{number:04d}"


def set_up(out: str, order: Order) -> dict[str, Any]:
    """Draw a case, write its folder, and give back its key.

    Raises:
        InputError: it can't be drawn, or the folder can't be written.
    """
    folder = case_folder(Path(out), order.number)
    shutil.rmtree(folder, ignore_errors=True)
    for retry in range(_RETRIES):
        try:
            case = make(Order(order.number, order.seed + retry, order.kind, order.names, order.variant))
            break
        except InputError:
            if retry == _RETRIES - 1:
                raise
    write_record(case.train[0], folder / "train")
    write_record(case.validation[0], folder / "validation")
    write_model(case.nominal, folder / "nominal.yaml")
    return dict(case.key)


def seal(out: Path, keys: list[dict[str, Any]]) -> str:
    """Write the keys away; their hash."""
    text = json.dumps({"format": "fric-prove-keys/1", "keys": keys}, sort_keys=True, allow_nan=True)
    write_text(out / "sealed" / "key.json", text)
    found = hashlib.sha256(text.encode()).hexdigest()
    write_text(out / "key.sha256", f"{found}  sealed/key.json\n")
    return found


def published(out: Path) -> str | None:
    """The hash that was published for ``out``, if any."""
    at = out / "key.sha256"
    return at.read_text().split()[0] if at.exists() else None


def open_key(out: Path) -> list[dict[str, Any]]:
    """The keys, if they are those whose hash was published.

    Raises:
        InputError: the key isn't the one that was sealed.
    """
    at = out / "sealed" / "key.json"
    content = at.read_bytes()
    if hashlib.sha256(content).hexdigest() != published(out):
        raise InputError(at, "isn't the key whose hash was published", "start again in another folder")
    keys: list[dict[str, Any]] = json.loads(content)["keys"]
    return keys
