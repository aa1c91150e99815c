"""A recording made ready for use: what its instruments did to it is undone where the recording itself tells it, and said."""

from __future__ import annotations

from ..record import Record
from .hold import resolved
from .stamps import evened

__all__ = ["conditioned"]


def conditioned(record: Record) -> Record:
    """``record`` with the stamps that its motion has and the hold of its force found; each change is among its notes."""
    return resolved(evened(record))
