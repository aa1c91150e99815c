"""A recording piece by piece, for recordings that don't fit into memory: what is in memory is one piece.

Pieces are cut by time of reception and found by the index of the storage (MCAP: of its chunks; SQLite: of the times), so that
each message is read once. A recording without an index is passed through for every piece; a note says so.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..record import Record, Units
from .effort import EffortFrom
from .errors import DamagedError
from .read import RecordReading, TimeFrom
from .source import Source
from .topics import Topics
from .window import Window

__all__ = ["Piece", "edges_of", "pieces"]

_How = tuple[Topics, TimeFrom, EffortFrom, bool, Window]
_SHORT = 0.5  # of a piece: a rest shorter than this belongs to the piece before, so that none is longer than 1.5 pieces
_NO_INDEX = "the recording has no index: it was passed through from its beginning"


class Piece(NamedTuple):
    """One piece of a recording.

    Attributes:
        begin: [s] from the first message of the recording.
        end: as that.
        record: the samples; None when they can't be used.
        refused: why not; empty otherwise.
    """

    begin: float
    end: float
    record: Record | None
    refused: str = ""


def edges_of(begin: float, end: float, seconds: float) -> list[float]:
    """Where pieces of ``seconds`` [s] between ``begin`` and ``end`` [s] begin and end; a short rest belongs to the last one."""
    number = max(int(np.floor((end - begin) / seconds + 1.0 - _SHORT)), 1)
    return [*(begin + seconds * k for k in range(number)), end]


def pieces(
    path: str | Path,
    seconds: float,
    *,
    joint: str | None = None,
    topics: Topics | None = None,
    time: TimeFrom = "stamp",
    repair: bool = False,
    start: float | None = None,
    end: float | None = None,
    effort: EffortFrom = "auto",
    units: Units | None = None,
) -> Iterator[Piece]:
    """Read one joint of a recording piece by piece.

    Args:
        path: bag folder, or a ``.mcap``, ``.db3`` or ``.bag`` file.
        seconds: length of a piece [s].
        joint: as for :func:`fric.bagio.read_record`, as are all the others.
        topics: names of the topics.
        time: clock of the samples.
        repair: drop or mark what is unusable.
        start: where the first piece begins [s] from the first message of the recording; None: with it.
        end: where the last piece ends, as ``start``; None: with the recording.
        effort: where the force comes from.
        units: of position and force.

    Yields:
        The pieces in their order. One that can't be used says why, and does not keep the others from being read.

    Raises:
        BagError: not a recording, or it has nothing in this time.
        InputError: ``seconds`` is no length.
    """
    if not (np.isfinite(seconds) and seconds > 0.0):
        raise InputError("pieces", f"are {seconds} s long", "give a positive number of seconds")
    names, wanted = topics or Topics(), (joint, units)
    with Source(path) as source:
        if source.recovered:
            source.notes.append(_NO_INDEX)
        whole = Window.of(source, 0.0 if start is None else start, np.inf if end is None else end)
        zero = source.start_ns or 0
        limits = ((whole.first_ns - zero) * 1e-9, (whole.stop_ns - zero) * 1e-9)
        before = 0 if whole.first_ns == zero else None
        for first, last in pairwise(edges_of(*limits, seconds)):
            window = Window(zero + round(first * 1e9), zero + round(last * 1e9), before)
            piece, n_states = _read(source, Piece(first, last, None), (names, time, effort, repair, window), wanted)
            before = None if before is None or not n_states else before + n_states
            if source.late:
                piece = _with_note(piece, f"{source.late} messages so far were written too late to be in their piece")
            yield piece
            del piece  # before the next one is read


def _with_note(piece: Piece, note: str) -> Piece:
    record = piece.record
    return piece if record is None else piece._replace(record=replace(record, notes=(*record.notes, note)))


def _read(source: Source, piece: Piece, how: _How, wanted: tuple[str | None, Units | None]) -> tuple[Piece, int]:
    """A piece with its record or why it has none, and how many joint states it holds; 0 where that is not known."""
    reading = RecordReading(source, *how)
    try:
        return piece._replace(record=reading.record(*wanted)), reading.n_states
    except DamagedError as damage:
        if source.recovered:
            return piece._replace(refused=damage.problem), 0
        try:
            with Source(source.path, recover=True) as scan:
                scan.notes.insert(0, f"the bag {damage.problem}; this piece was read record by record")
                return _read(scan, piece, how, wanted)[0], 0
        except InputError as error:
            return piece._replace(refused=error.problem), 0
    except InputError as error:
        return piece._replace(refused=error.problem), reading.n_states
