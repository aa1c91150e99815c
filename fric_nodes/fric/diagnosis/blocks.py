"""One recording, to learn from and to judge by: contiguous blocks of it, every other one held back.

Both halves are the whole recording, with the other's blocks marked as not to be used: so time goes on where a block begins, and
what depends on it, as a slow drift does, is the same in both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..record import Record, RecordError

__all__ = ["in_blocks", "one_sided"]

_SHORTEST = 200  # samples of a block
_HARDLY, _PLENTY = 0.15, 0.3  # of the way, in one direction


def in_blocks(records: Sequence[Record], n_blocks: int) -> tuple[list[Record], list[Record]]:
    """The ``records`` to learn from and the same to be held back, each cut into ``n_blocks``, odd and even ones.

    Raises:
        RecordError: a record is too short for as many blocks, or goes back and forth in step with them.
    """
    if n_blocks < 2 or n_blocks > _most(records):
        shortest = min(records, key=lambda each: each.time.shape[0])
        what = f"{n_blocks} blocks of its {shortest.time.shape[0]} samples can't be diagnosed"
        raise RecordError(shortest.source, what, _instead(records, n_blocks))
    learnt, kept_apart = _halves(records, n_blocks)
    problem = one_sided(learnt, kept_apart)
    if problem:
        raise RecordError(records[0].source, f"in {n_blocks} blocks {problem}", _instead(records, n_blocks))
    return learnt, kept_apart


def _halves(records: Sequence[Record], n_blocks: int) -> tuple[list[Record], list[Record]]:
    """The odd blocks of each record, and the even ones."""
    learnt, kept_apart = [], []
    for record in records:
        n = record.time.shape[0]
        odd = (np.arange(n) * n_blocks // n) % 2 == 0
        learnt.append(replace(record, valid=record.mask & odd))
        kept_apart.append(replace(record, valid=record.mask & ~odd))
    return learnt, kept_apart


def _most(records: Sequence[Record]) -> int:
    """Blocks that the shortest record has samples for."""
    return min(len(record.time) for record in records) // _SHORTEST


def _instead(records: Sequence[Record], n_blocks: int) -> str:
    """What could be asked for instead of ``n_blocks``: the nearest numbers that can be used."""

    def usable(n: int) -> bool:
        return not one_sided(*_halves(records, n))

    most = _most(records)
    fewer = next(filter(usable, range(min(n_blocks - 1, most), 1, -1)), None)
    more = next(filter(usable, range(max(n_blocks + 1, 2), most + 1)), None)
    good = " or ".join(str(n) for n in (fewer, more) if n is not None)
    return f"ask for {good} blocks" if good else "record for longer, with motion in both directions all the time"


def one_sided(train: Sequence[Record], validation: Sequence[Record]) -> str:
    """What is wrong where some of the records hardly go one way and the others do, in words; ``""`` where nothing is."""
    ahead = [_share_ahead(held) for held in (train, validation)]
    for (few, plenty), names in ((ahead, ("to learn from", "held back")), (ahead[::-1], ("held back", "to learn from"))):
        for way, rare, common in (("forward", few, plenty), ("backward", 1.0 - few, 1.0 - plenty)):
            if rare < _HARDLY and common > _PLENTY:
                return (
                    f"what is {names[0]} hardly moves {way} ({100.0 * rare:.0f} % of its way), what is {names[1]} does "
                    f"({100.0 * common:.0f} %)"
                )
    return ""


def _share_ahead(records: Sequence[Record]) -> float:
    """Share of the way that goes forward; a half where nothing moves."""
    ahead = total = 0.0
    for record in records:
        change = np.diff(record.position)[record.mask[1:] & record.mask[:-1]]
        ahead += float(np.sum(change[change > 0.0]))
        total += float(np.sum(np.abs(change)))
    return ahead / total if total > 0.0 else 0.5
