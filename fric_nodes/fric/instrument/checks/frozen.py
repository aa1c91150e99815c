"""Frozen or missing: a signal that stands although what it measures goes on.

An effort that is zero throughout while the axis is kept moving is missing; where its speed only ever falls it may coast, and a
constant force other than zero may be one that was commanded: these can't be told. A sensor that stops being read repeats its
last value bit by bit. A command does so too, rightly, where nothing that it is computed from changes. So an effort is called
frozen only where it would have changed: by its noise, when it changes with nearly every sample while the position stands
elsewhere; by the motion, when it does so wherever the position changes, and stands for many such samples. A position may
rightly stand, so that it is called frozen only when it jumps afterwards by much more than it ever moves between two samples.
The value is the longest time frozen.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from ...record import Array
from ..check import Check, Evidence, Finding, each
from ..view import View, runs

__all__ = ["CHECK"]

_LEAST = 20  # samples
_NOISY = 0.9  # share of samples at which a signal with noise on it changes
_JUMP = 8.0
_ENOUGH = 100  # samples from which that share is taken
_EIGHTHS = 8  # of a recording, in which speeds are compared
_COASTS = 1.05  # by how much noise may raise the highest speed from one eighth to the next
_AROUND = 11  # samples over which the position has to stand to be at rest
_NOISE = -0.25  # correlation of a noise's steps with the next, at most
_LIMIT = 1e-3  # of the range: a run that near an extreme is a limit, not a frozen sensor


def _standing(values: Array, least: int) -> list[tuple[int, int]]:
    """Runs of at least ``least`` equal values, first sample and the one after the last."""
    return [(a, b + 1) for a, b in runs(np.diff(values) == 0.0) if b + 1 - a >= least]


def _frozen_effort(values: Array, position: Array) -> list[tuple[int, int]]:
    found = _standing(values, _LEAST)
    inside = np.zeros(values.size, dtype=np.bool_)
    for a, b in found:
        inside[a:b] = True
    outside = ~inside[1:] & ~inside[:-1]
    changes, moved = np.diff(values) != 0.0, np.diff(position) != 0.0
    # What would have made it change: its own noise, at rest too, or the motion.
    still = ~maximum_filter1d(moved, _AROUND)
    alive = [kind for kind in (moved, still) if np.sum(outside & kind) >= _ENOUGH and np.mean(changes[outside & kind]) > _NOISY]
    step = np.diff(values)
    pairs = (outside & still)[1:] & (outside & still)[:-1]
    # Steps of white noise have a correlation of -1/2 with the next; those of a command that changes at rest have none or more.
    noisy = float(np.sum((step[1:] * step[:-1])[pairs])) < _NOISE * float(np.sum((step[1:] ** 2)[pairs]))
    alive = alive if noisy else [kind for kind in alive if kind is not still]
    low, high = float(np.min(values)), float(np.max(values))
    margin = _LIMIT * (high - low)
    # Exactly zero is a drive that is switched off.
    free = [(a, b) for a, b in found if low + margin < values[a] < high - margin and values[a] != 0.0]
    return [(a, b) for a, b in free if any(np.sum(kind[a : b - 1]) >= _LEAST - 1 for kind in alive)]


def _frozen_position(view: View) -> list[tuple[int, int]]:
    values = view.record.position
    steps = np.abs(np.diff(values))
    most = float(np.quantile(steps, 0.999))
    found = []
    for a, b in _standing(values, 5):
        if b < values.size and steps[b - 1] > max(_JUMP * float(np.max(steps[b : b + 5], initial=0.0)), 1.5 * most):
            found.append((a, b))
    return found


def _coasts(view: View) -> bool:
    """Whether the speed only ever falls, as that of an axis that nothing drives."""
    parts = np.array_split(np.abs(view.velocity[view.usable]), _EIGHTHS)
    most = np.array([float(np.max(part)) for part in parts if part.size])
    return bool(np.all(most[1:] <= _COASTS * most[:-1] + 5.0 * view.velocity_noise))


def _constant(view: View) -> Finding:
    """An effort that never changes."""
    value, unit = view.record.effort[0], view.record.units.force
    remedy = "record the effort, the motor current or the force command"
    if not view.moves:
        return Finding("frozen", "unknown", "neither effort nor position changes: at rest, or not recorded", remedy=remedy)
    if value != 0.0:
        detail = f"the effort is {value:.4g} {unit} throughout: a constant force, or a signal that isn't read"
        return Finding("frozen", "unknown", detail, remedy=remedy)
    if _coasts(view):
        detail = "the effort is 0 throughout and the speed only falls: the axis coasts, or the effort is missing"
        return Finding("frozen", "unknown", detail, remedy=remedy)
    return Finding("frozen", "fault", "the effort is 0 throughout although the axis is driven: it is missing", remedy=remedy)


def _judge(view: View, evidence: Evidence) -> Finding:
    record = view.record
    if float(np.ptp(record.effort)) == 0.0:
        return _constant(view)
    if view.travel == 0.0:
        pushed = "the position never changes while the effort does: it rests, or the sensor gives no signal"
        return Finding("frozen", "unknown", pushed, remedy="push harder, or check the position sensor")
    spans, names = [], []
    for name, found in (("effort", _frozen_effort(record.effort, record.position)), ("position", _frozen_position(view))):
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
