"""A position that is updated more slowly than it is logged: every value stands for several samples, then jumps to the next.

A logger that runs faster than the bus repeats the last value it has got. Between updates such a log says that the axis rests,
and at each that it leaps: no derivative of it is of any use. Where the axis moves on by several steps of its encoder per
sample, a value that is repeated can't be the motion's. What tells it from stick-slip is that nearly every change stands alone:
an axis that slips moves through several samples on end. Then only the samples at which a new value came are kept, with the mean
force from each to the next, which is what a force that is held from its stamp to the next is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..record import Array, Index, Record
from .resolution import step_of

__all__ = ["NOTE", "updated"]

NOTE = "the position is updated"
"""How the note begins that says what was made of such a recording."""

_AROUND = 32  # samples to either side, over which the speed is told
_STEPS = 3.0  # of the encoder per sample: a position that moves so fast can't repeat itself
_FEWEST = 50  # such samples, and updates among them
_REPEATED = 0.4  # share of them that repeat the one before: half of them do where every value stands for two samples
_ALONE = 0.9  # share of the changes that are followed by a repeated value
_KEPT = 100  # samples that have to be left


def updated(record: Record) -> Record:
    """``record`` with the samples alone at which a new position came, and a note of it; as it is where each sample is new."""
    every = _update(record)
    if every is None:
        return record
    fresh = _fresh(record.position, every)
    if fresh.size < _KEPT:
        return record
    spans = np.diff(np.append(fresh, record.n_samples))
    effort = np.add.reduceat(record.effort, fresh) / spans

    def kept(signal: Array | None) -> Array | None:
        return None if signal is None else signal[fresh]

    period = 1e3 * float(np.median(np.diff(record.time[fresh])))
    note = (
        f"{NOTE} every {every:.3g} samples ({period:.3g} ms) only, and repeated between: the samples between updates were "
        "left out, the mean force over them kept; log at the rate at which the sensor is read"
    )
    return replace(
        record,
        time=record.time[fresh],
        position=record.position[fresh],
        effort=effort,
        velocity=kept(record.velocity),
        reference=kept(record.reference),
        valid=None if record.valid is None else np.logical_and.reduceat(record.valid, fresh),
        extra={name: signal[fresh] for name, signal in record.extra.items()},
        effort_hold="following",
        notes=(*record.notes, note),
    )


def _update(record: Record) -> float | None:
    """Samples from one update of the position to the next, on average; None where every sample is one."""
    q = record.position
    if q.shape[0] < 2 * _AROUND + _FEWEST:
        return None
    at = np.arange(_AROUND, q.shape[0] - _AROUND - 1)
    way = np.abs(q[at + _AROUND] - q[at - _AROUND]) / (2.0 * _AROUND)
    at = at[way > max(_STEPS * step_of(q), 1e-12 * float(np.ptp(q)))]
    if at.size < _FEWEST:
        return None
    changes = q[at] != q[at - 1]
    n_changes = int(np.sum(changes))
    if n_changes < _FEWEST or 1.0 - n_changes / at.size < _REPEATED:
        return None
    alone = float(np.mean(q[at[changes] + 1] == q[at[changes]]))
    return at.size / n_changes if alone > _ALONE else None


def _fresh(position: Array, every: float) -> Index:
    """Samples at which a new value came; where none comes for long, the axis rests, and samples as far apart are taken."""
    new = np.flatnonzero(np.concatenate([[True], np.diff(position) != 0.0]))
    step = max(round(every), 1)
    ends = np.append(new[1:], position.shape[0])
    rests = [
        np.arange(a + step, b - step + 1, step) for a, b in zip(new.tolist(), ends.tolist(), strict=True) if b - a >= 2 * step
    ]
    return np.asarray(np.unique(np.concatenate([new, *rests])), dtype=np.int64)
