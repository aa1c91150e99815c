"""The error of this room: a file or a mapping that cannot be imported."""

from __future__ import annotations

from ..record import RecordError

__all__ = ["ImportingError", "one_line"]

_LONGEST = 200  # characters of a foreign message or of a cell that are shown


def one_line(text: object) -> str:
    """A text from outside (a cell, a name, another program's message) as one short line of printable characters."""
    plain = " ".join("".join(sign if sign.isprintable() else " " for sign in str(text)).split())
    return plain if len(plain) <= _LONGEST else plain[: _LONGEST - 3] + "..."


class ImportingError(RecordError):
    """A file or a mapping that cannot be imported."""
