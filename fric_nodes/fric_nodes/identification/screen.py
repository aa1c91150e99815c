"""What in a recording is not the free axis: end stops and saturated drives, recognised, left out and named.

End stop: the joint stands at one end of its travel although the force pushes outward harder than it ever had to while the
joint moved that way. Saturation: the force stays at its extreme with sharp corners. A smooth peak is as flat as that near
its top, but it widens: the time that a parabola spends within four tolerances of its top is twice the time within one,
that of a clipped signal hardly longer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_closing

from ..record import Array, Mask, Record

__all__ = ["screened"]

_MARGIN = 0.1  # [s] left out on either side of a stop: impact and ring-down
_SHORTEST = 0.05  # [s] of a plateau or a stop
_FLAT = 0.005  # of the force range: tolerance of a plateau
_RARE = 0.1  # share of a recording up to which a plateau is a limit and not the excitation
_WIDENING = 1.4  # between 1 for a clipped signal and 2 for a parabola


def screened(record: Record) -> Record:
    """``record`` with what is not the free axis marked invalid and named in its notes."""
    bad = np.zeros(record.n_samples, dtype=np.bool_)
    notes: list[str] = []
    for finder in (_end_stops, _saturation):
        for first, last, note in finder(record):
            bad[first:last] = True
            notes.append(f"{note}; left out")
    if not notes:
        return record
    return replace(record, valid=record.mask & ~bad, notes=(*record.notes, *notes))


def _runs(mask: Mask) -> Iterator[tuple[int, int]]:
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    yield from zip(bounds[::2].tolist(), bounds[1::2].tolist(), strict=True)


def _end_stops(record: Record) -> Iterator[tuple[int, int, str]]:
    position, effort, time = record.position, record.effort, record.time
    travel = float(np.ptp(position))
    if travel == 0.0:
        return
    width = max(round(0.05 / record.sample_time), 1)
    # A difference over 50 ms: slow enough for encoder steps, fast enough to see the stop.
    velocity = np.zeros_like(position)
    velocity[width:-width] = (position[2 * width :] - position[: -2 * width]) / (time[2 * width :] - time[: -2 * width])
    limit = 0.02 * float(np.quantile(np.abs(velocity), 0.98))
    for outward, end, name in ((-1.0, float(np.min(position)), "lowest"), (1.0, float(np.max(position)), "highest")):
        there = (np.abs(position - end) < 0.002 * travel) & (np.abs(velocity) <= limit)
        moving = velocity * outward > limit
        if not np.any(moving):
            continue
        needed = float(np.quantile(outward * effort[moving], 0.995))
        spread = float(np.ptp(effort))
        for first, last in _runs(there):
            push = float(np.max(outward * effort[first:last]))
            if time[last - 1] - time[first] < _SHORTEST or push < needed + 0.1 * spread:
                continue
            around = round(_MARGIN / record.sample_time)
            yield (
                max(first - around, 0),
                min(last + around, record.n_samples),
                f"end stop: stands at its {name} position, {end:.4g} {record.units.position}, from {time[first]:.2f} s to "
                f"{time[last - 1]:.2f} s while the force pushes on ({outward * push:+.3g} {record.units.force})",
            )


def _saturation(record: Record) -> Iterator[tuple[int, int, str]]:
    """Plateaus at either extreme; none when they fill much of the recording, as a bang-bang excitation's do."""
    found = list(_plateaus_with_notes(record))
    if sum(last - first for first, last, _ in found) <= _RARE * record.n_samples:
        yield from found


def _plateaus_with_notes(record: Record) -> Iterator[tuple[int, int, str]]:
    effort, time = record.effort, record.time
    spread = float(np.ptp(effort))
    if spread == 0.0:
        return
    for extreme in (float(np.min(effort)), float(np.max(effort))):
        for first, last in _plateaus(effort, extreme, spread):
            if time[last - 1] - time[first] < _SHORTEST or last - first < 5:
                continue
            yield (
                first,
                last,
                f"saturation: the force stays at {float(np.median(effort[first:last])):.4g} {record.units.force} from "
                f"{time[first]:.2f} s to {time[last - 1]:.2f} s",
            )


def _plateaus(effort: Array, extreme: float, spread: float) -> Iterator[tuple[int, int]]:
    """Runs near the extreme that don't widen as a smooth peak does."""
    # The extreme itself may be a spike on top of the plateau; what the force reaches most often near it is the plateau.
    near = effort[np.abs(effort - extreme) <= 4.0 * _FLAT * spread]
    level = float(np.median(near))
    wide_runs = list(_runs(np.abs(effort - level) <= 4.0 * _FLAT * spread))
    # Single samples of noise don't end a plateau.
    flat = binary_closing(np.abs(effort - level) <= _FLAT * spread, np.ones(5))
    for first, last in _runs(flat):
        around = sum(end - start for start, end in wide_runs if start < last and end > first)
        if around <= _WIDENING * (last - first):
            yield first, last
