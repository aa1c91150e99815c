"""What in a recording is not the free axis: end stops and saturated drives, recognised, left out and named.

Folds and spikes are put right before (:mod:`fric.signals.conditioning`): a stop is where an angle doesn't go on.

A drive at its limit is no reason to leave anything out as long as the force recorded is the one that acted.

How they are recognised: :mod:`fric.instrument.checks.end_stop` and :mod:`fric.instrument.checks.saturation`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..instrument.checks.end_stop import stops
from ..instrument.checks.saturation import clipped, plateaus
from ..instrument.view import View
from ..record import Record
from ..signals.conditioning import conditioned

__all__ = ["screened"]

_MARGIN = 0.1  # [s] left out on either side of a stop: impact and ring-down


def screened(record: Record) -> Record:
    """``record`` conditioned, with what is not the free axis marked invalid, all named in its notes.

    Raises:
        RecordError: a position jumps in a way that no motion and no known fold makes.
    """
    record = conditioned(record)
    bad = np.zeros(record.n_samples, dtype=np.bool_)
    notes: list[str] = []
    for first, last, note in (*_end_stops(View(record)), *_saturation(View(record))):
        bad[first:last] = True
        notes.append(f"{note}; left out")
    if not notes:
        return record
    return replace(record, valid=record.mask & ~bad, notes=(*record.notes, *notes))


def _end_stops(view: View) -> Iterator[tuple[int, int, str]]:
    record = view.record
    around = round(_MARGIN / record.sample_time)
    for stop in stops(view):
        yield (
            max(stop.first - around, 0),
            min(stop.last + around, record.n_samples),
            f"end stop: stands at its {stop.end} position, {stop.position:.4g} {record.units.position}, from "
            f"{record.time[stop.first]:.2f} s to {record.time[stop.last - 1]:.2f} s while the force pushes on "
            f"({stop.push:+.3g} {record.units.force})",
        )


def _saturation(view: View) -> Iterator[tuple[int, int, str]]:
    record = view.record
    for first, last, level in clipped(view, plateaus(view)):
        yield (
            first,
            last,
            f"saturation: the force stays at {level:.4g} {record.units.force} from {record.time[first]:.2f} s to "
            f"{record.time[last - 1]:.2f} s",
        )
