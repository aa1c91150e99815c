"""Efforts that wrap: a 16-bit number that runs over and starts again at the other end of its range.

As for a position (:mod:`fric.signals.folds`) the jump C is at least as long as the range of the recording, and equal
each time. But friction that reverses and a relay jump from one end of an effort's range to the other as well, and an effort has
no inertia that would tell the two apart. The motion does: of the effort as recorded and the one with C added where it has
wrapped, that one is true which a rigid axis explains better,

    u = m a + F sgn v + c v + b,

by least squares over windows of samples, long enough for the noise of the acceleration. Of its variance a share has to be left
that is less than a quarter of the other's, and it has to reach further than C, or it would not have wrapped.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import savgol_filter

from ..record import Array, Index, Record
from .resolution import step_of

__all__ = ["unwrapped"]

_EQUAL = 0.1  # of the jump: what the effort does by itself between two samples
_BETTER = 0.25  # of the share of its variance that the recorded effort leaves
_WINDOWS = (11, 31, 101)  # samples
_LEAST_BITS = 8


def _at_ends(effort: Array) -> Index:
    """Steps from one end of the range to the other."""
    step = np.diff(effort)
    size = np.abs(step)
    which = np.flatnonzero(size > 0.5 * float(np.ptp(effort)))
    if which.size < 2:
        return which
    largest = float(np.median(size[which]))
    return which if float(np.max(np.abs(size[which] - largest))) <= _EQUAL * largest else which[:0]


def _size(effort: Array, which: Index) -> float:
    """The most likely size of a wrap [F]."""
    step = np.diff(effort)
    beside = 0.5 * (step[np.maximum(which - 1, 0)] + step[np.minimum(which + 1, step.size - 1)])
    size = float(np.median(np.abs(step[which] - beside)))
    grain = step_of(effort)
    if grain > 0.0:
        bits = round(np.log2(max(size / grain, 1.0)))
        whole = 2.0**bits * grain
        if bits >= _LEAST_BITS and abs(whole - size) <= _EQUAL * size:
            return float(whole)
    return size


def _left(record: Record, effort: Array) -> float:
    """Share of ``effort`` that a rigid axis leaves, the least over several windows."""
    h, least = record.sample_time, 1.0
    for window in _WINDOWS:
        if 4 * window > record.n_samples:
            continue
        velocity = savgol_filter(record.position, window, 3, deriv=1, delta=h)
        acceleration = savgol_filter(record.position, window, 3, deriv=2, delta=h)
        force = savgol_filter(effort, window, 3)
        direction = savgol_filter(np.sign(velocity), window, 3)
        columns = np.column_stack([acceleration, direction, velocity, np.ones_like(velocity)])[window:-window]
        target = force[window:-window]
        scale = np.linalg.norm(columns, axis=0)
        answer = np.linalg.lstsq(columns / np.where(scale > 0.0, scale, 1.0), target, rcond=1e-10)[0]
        rest = target - columns / np.where(scale > 0.0, scale, 1.0) @ answer
        spread = target - np.mean(target)
        least = min(least, float(rest @ rest) / max(float(spread @ spread), 1e-300))
    return least


def unwrapped(record: Record) -> Record:
    """``record`` with an effort that runs on where it wrapped, and a note that says so; ``record`` itself when it doesn't."""
    effort = record.effort
    which = _at_ends(effort) if record.n_samples > 4 * _WINDOWS[0] else np.zeros(0, dtype=np.int64)
    if which.size < 2 or which.size > 0.1 * record.n_samples:
        return record
    size = _size(effort, which)
    turns = np.zeros(effort.size)
    turns[which + 1] = -np.sign(np.diff(effort)[which])
    turns = np.cumsum(turns)
    # A drive's force lies around zero: the turn in which most of the samples were recorded is the true one.
    values, counts = np.unique(turns, return_counts=True)
    if values.size > 3:
        return record
    found = effort + size * (turns - values[int(np.argmax(counts))])
    # What a relay would become is a constant force.
    if float(np.ptp(found)) <= size or _left(record, found) > _BETTER * _left(record, effort):
        return record
    note = (
        f"effort jumps by {size:.4g} {record.units.force} {which.size} times, and the motion agrees with one without "
        "jumps: taken as a number that wraps"
    )
    return replace(record, effort=found, notes=(*record.notes, note))
