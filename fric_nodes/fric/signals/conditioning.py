"""A recording made ready for use: what its instruments did to it is undone where the recording itself tells it, and said.

Each step is a pure function of a record. Folds come first: their jumps would be taken for spikes where the motion turns back at
once, and neither stamps nor the hold of the force can be told from a motion that jumps.
"""

from __future__ import annotations

from ..record import Record
from .effort_wrap import unwrapped
from .folds import unfolded
from .held_position import updated
from .hold import resolved
from .spikes import without_spikes
from .stamps import evened

__all__ = ["changes", "conditioned"]

_SIGNALS = (unfolded, unwrapped, without_spikes)
_NOTES = ("position jumps", "effort jumps", "spike")  # how the notes of these begin


def conditioned(record: Record) -> Record:
    """``record`` with folds and spikes put right, its motion at its own updates and stamps, and the hold of its force found.

    Each change is among its notes.

    Raises:
        RecordError: a position jumps in a way that no motion and no known fold makes.
    """
    return resolved(evened(updated(_signals(record))))


def changes(record: Record) -> tuple[str, ...]:
    """What conditioning has changed in the signals of ``record``, or would change, one sentence each.

    Raises:
        RecordError: as :func:`conditioned`.
    """
    return tuple(note for note in _signals(record).notes if note.startswith(_NOTES))


def _signals(record: Record) -> Record:
    for step in _SIGNALS:
        record = step(record)
    return record
