"""Two topics on one clock, and a topic at the stamps of another.

Topics without a header are compared by time of reception, on both sides, because the clock of the stamps may be another one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..record import Array
from .checks import Stamps, gap_length_ns
from .series import Series

__all__ = ["clocks", "held", "hermite", "reference_of", "stamp_of"]


def stamp_of(of: Series) -> Stamps:
    """Stamps of the headers of a series that has them [ns]."""
    assert of.stamp_ns is not None
    return of.stamp_ns


def clocks(states: Series, other: Series, by_log: bool) -> tuple[Stamps, Stamps, NDArray[np.intp]]:
    """Times of the joint states and, sorted, of another topic, on one clock; and the order that sorts the other topic.

    Args:
        states: the joint states.
        other: the other topic.
        by_log: True when the joint states are taken at their time of reception.
    """
    if not by_log and other.stamped:
        at, times = stamp_of(states), stamp_of(other)
    else:
        at, times = states.log_ns, other.log_ns
    order = np.argsort(times, kind="stable")
    return at, times[order], order


def held(at: Stamps, times: Stamps, values: Array) -> Array:
    """The last value at or before each time; NaN before the first.

    Args:
        at: where it is wanted [ns], shape ``(n,)``.
        times: of the values, sorted [ns], shape ``(m,)``.
        values: shape ``(m,)``.
    """
    last = np.searchsorted(times, at, side="right") - 1
    return np.where(last >= 0, values[np.maximum(last, 0)], np.nan)


def hermite(at: Stamps, times: Stamps, position: Array, velocity: Array) -> Array:
    """Position between samples of position and velocity, by the cubic through both at either end.

    Before the first sample, after the last and inside a gap the sample before is held (the first one, before it): a reference
    that is not being published does not move.

    Args:
        at: where it is wanted [ns], shape ``(n,)``.
        times: of the samples, increasing [ns], shape ``(m,)``.
        position: at these times [m or rad], shape ``(m,)``.
        velocity: at these times [m/s or rad/s], shape ``(m,)``.
    """
    if times.size < 2:
        return np.full(at.size, position[0])
    left = np.clip(np.searchsorted(times, at, side="right") - 1, 0, times.size - 2)
    step = times[left + 1] - times[left]
    inside = (at >= times[0]) & (at <= times[-1]) & (step <= gap_length_ns(times))
    h = step * 1e-9
    s = np.clip((at - times[left]) / step, 0.0, 1.0)
    p0, p1, v0, v1 = position[left], position[left + 1], velocity[left] * h, velocity[left + 1] * h
    # Hermite basis in nested form: p0 + s v0 + s^2 (3 d - 2 v0 - v1) + s^3 (v0 + v1 - 2 d), d = p1 - p0.
    d = p1 - p0
    curve = p0 + s * (v0 + s * (3 * d - 2 * v0 - v1 + s * (v0 + v1 - 2 * d)))
    held = np.where(at < times[0], position[0], np.where(at >= times[left + 1], p1, p0))
    return np.where(inside, curve, held)


def reference_of(of: Series) -> Series:
    """A reference with the field ``position``, and ``velocity`` if it has one; also that of a trajectory controller."""
    for point in ("reference.", "desired."):
        if f"{point}position" in of.fields:
            names = [name for name in ("position", "velocity") if f"{point}{name}" in of.fields]
            return of._replace(fields={name: of.fields[point + name] for name in names})
    return of
