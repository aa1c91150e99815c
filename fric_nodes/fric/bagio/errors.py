"""The errors of this room: a recording, or a file to be imported, that cannot be used."""

from __future__ import annotations

from ..importers.errors import ImportingError
from ..record import RecordError

__all__ = ["BagError", "DamagedError", "ImportingError", "WriteError"]


class BagError(RecordError):
    """A bag that cannot be read, or whose content cannot be used."""


class WriteError(RecordError):
    """A bag that cannot be written where it was asked for."""


class DamagedError(BagError):
    """A bag that opens but whose content turns out to be damaged; reading record by record may still give some of it."""
