"""Frozen or missing: a signal that stands although what it measures goes on.

An effort that is zero or constant throughout is missing. A sensor that stops being read repeats its last value bit by bit:
for an effort with noise on it, that alone gives it away; a position may rightly stand, so that it is called frozen only when
it jumps afterwards by much more than it ever moves between two samples. The value is the longest time frozen.
"""

from __future__ import annotations

import numpy as np

from ..record import Array
from .check import Check, Evidence, Finding, each
from .view import View, runs

__all__ = ["CHECK"]

_LEAST = 20  # samples
_NOISY = 0.9  # share of samples at which a signal with noise on it changes
_JUMP = 8.0
_LIMIT = 1e-3  # of the range: a run that near an extreme is a limit, not a frozen sensor


def _standing(values: Array, least: int) -> list[tuple[int, int]]:
    """Runs of at least ``least`` equal values, first sample and the one after the last."""
    return [(a, b + 1) for a, b in runs(np.diff(values) == 0.0) if b + 1 - a >= least]


def _frozen_effort(values: Array) -> list[tuple[int, int]]:
    found = _standing(values, _LEAST)
    inside = np.zeros(values.size, dtype=np.bool_)
    for a, b in found:
        inside[a:b] = True
    outside = ~inside[1:] & ~inside[:-1]
    if np.sum(outside) < 100 or float(np.mean(np.diff(values)[outside] != 0.0)) < _NOISY:
        return []
    low, high = float(np.min(values)), float(np.max(values))
    margin = _LIMIT * (high - low)
    # Exactly zero is a drive that is switched off.
    return [(a, b) for a, b in found if low + margin < values[a] < high - margin and values[a] != 0.0]


def _frozen_position(view: View) -> list[tuple[int, int]]:
    values = view.record.position
    steps = np.abs(np.diff(values))
    most = float(np.quantile(steps, 0.999))
    found = []
    for a, b in _standing(values, 5):
        if b < values.size and steps[b - 1] > max(_JUMP * float(np.max(steps[b : b + 5], initial=0.0)), 1.5 * most):
            found.append((a, b))
    return found


def _judge(view: View, evidence: Evidence) -> Finding:
    record = view.record
    if float(np.ptp(record.effort)) == 0.0:
        remedy = "record the effort, the motor current or the force command"
        if view.moves:
            return Finding("frozen", "fault", f"the effort is {record.effort[0]:.4g} throughout: it is missing", remedy=remedy)
        return Finding("frozen", "fault", "neither effort nor position changes", remedy=remedy)
    if view.travel == 0.0:
        pushed = "the position never changes while the effort does: it rests, or the sensor is dead"
        return Finding("frozen", "warning", pushed, remedy="push harder, or check the position sensor")
    spans, names = [], []
    for name, found in (("effort", _frozen_effort(record.effort)), ("position", _frozen_position(view))):
        if found:
            names.append(name)
            spans += [(float(record.time[a]), float(record.time[b - 1])) for a, b in found]
    if not spans:
        return Finding("frozen", "ok", "no signal stands still where it should not", 0.0, "s")
    longest = max(b - a for a, b in spans)
    detail = f"{' and '.join(names)} frozen {len(spans)} time(s), for up to {longest:.3g} s"
    remedy = "leave these parts out (--start, --end) and check cable and driver of the sensor"
    return Finding("frozen", "fault", detail, longest, "s", remedy=remedy, time=tuple(sorted(spans)[:20]))


CHECK = Check("frozen", "missing and frozen signals", "position and effort", each(_judge))
