"""A pure delay of a sampled quantity, for steps of any length, in a fixed number of cells.

Equation: y(t) = u(t - T).

The line holds what has gone in lately as a ring of cells, each with the mean of what went in and how long that took. What
goes in during a step joins the newest cell while that is shorter than T/64, else it starts a new one, so that the ring
never holds more than 68 cells: steps longer than that get a cell each, shorter ones share one. The oldest cells are
dropped as soon as nothing of them can be asked for any more.

Two readings. :func:`mean_before` is the mean over a step of what went in a time T before: exact for a quantity that is
held constant for T/64 at least (a sampled command), since equal values join as well, and whatever is held shorter keeps
its mean. :func:`value_before` interpolates between the middles of the cells, for a quantity that changes smoothly: its
error falls with the square of the cell. Both hold for a step that is longer than the delay, which then sees part of what
goes in during the step itself.

Layout of the states: number of the oldest cell, number of cells, total duration, values, durations.
"""

from __future__ import annotations

from typing import Any

from ..engine.kernel import kernel

__all__ = ["N_STATES", "begin", "mean_before", "put", "value_before"]

_RESOLUTION = 64  # cells over the delay
_RING = _RESOLUTION + 8
_NOTHING = 1e-10  # share of a step that is rounding
_VALUES = 3
_DURATIONS = _VALUES + _RING

N_STATES = _DURATIONS + _RING
"""States of a line; all zero before anything has gone in."""


@kernel
def _cell(y: Any, i: int, number: int) -> int:
    """Where in the ring the cell ``number`` is, counted from the oldest."""
    at = int(y[i]) + number
    return at - _RING if at >= _RING else at


@kernel
def begin(y: Any, i: int, value: float, delay: float) -> None:
    """Fill the line with ``value`` for the time ``delay`` [s]."""
    y[i] = 0.0
    y[i + 1] = 1.0
    y[i + 2] = delay
    y[i + _VALUES] = value
    y[i + _DURATIONS] = delay


@kernel
def put(y: Any, i: int, value: float, h: float, delay: float, joins_equal: bool) -> None:
    """Let ``value`` in for the time ``h`` [s], and drop what nobody can ask for any more.

    Equal values join without end where ``joins_equal``, which suits :func:`mean_before`.
    """
    n = int(y[i + 1])
    total = y[i + 2]
    newest = _cell(y, i, max(n - 1, 0))
    held = y[i + _VALUES + newest]
    lasted = y[i + _DURATIONS + newest]
    if n > 0 and (lasted * _RESOLUTION < delay or (joins_equal and held == value)):
        if held != value:
            y[i + _VALUES + newest] = (held * lasted + value * h) / (lasted + h)
        # No cell needs to be longer than the delay.
        y[i + _DURATIONS + newest] = max(min(lasted + h, delay), lasted)
        total += y[i + _DURATIONS + newest] - lasted
    else:
        newest = _cell(y, i, n)
        y[i + _VALUES + newest] = value
        y[i + _DURATIONS + newest] = h
        total += h
        n += 1
    # One cell that has left the delay behind stays, to interpolate from.
    while n > 2 and total - y[i + _DURATIONS + _cell(y, i, 0)] - y[i + _DURATIONS + _cell(y, i, 1)] >= delay:
        total -= y[i + _DURATIONS + _cell(y, i, 0)]
        y[i] = _cell(y, i, 1)
        n -= 1
        if y[i] == 0.0:
            # The ring has come round: added up anew, so that rounding doesn't grow over a long run.
            total = 0.0
            for number in range(n):
                total += y[i + _DURATIONS + number]
    y[i + 1] = n
    y[i + 2] = total


@kernel
def mean_before(y: Any, i: int, value: float, h: float, delay: float) -> float:
    """Mean over a step of ``h`` [s], during which ``value`` goes in, of what went in ``delay`` [s] before."""
    # Times before the start of the step: the line reaches back by ``older``; the window goes from ``first`` to ``last``.
    older = max(y[i + 2], delay)
    first = delay
    last = max(delay - h, 0.0)
    known = y[i + _VALUES + _cell(y, i, 0)]
    area = 0.0  # of what differs from ``known``, so that a constant comes out as it went in
    seen = False
    for number in range(int(y[i + 1])):
        at = _cell(y, i, number)
        younger = older - y[i + _DURATIONS + at]
        overlap = min(older, first) - max(younger, last)
        if overlap > _NOTHING * h:
            if not seen:
                known = y[i + _VALUES + at]
                seen = True
            area += overlap * (y[i + _VALUES + at] - known)
        older = younger
        if older <= last:
            break
    if h > delay:
        area += (h - delay) * (value - known)
    return float(known + area / h)


@kernel
def value_before(y: Any, i: int, value: float, h: float, delay: float) -> float:
    """The quantity ``delay`` [s] before the middle of a step of ``h`` [s], where it is ``value`` in the middle itself."""
    wanted = delay - 0.5 * h  # before the start of the step
    total = y[i + 2]
    n = int(y[i + 1])
    begins = total
    older = total
    held = y[i + _VALUES + _cell(y, i, 0)]
    for number in range(n):
        at = _cell(y, i, number)
        lasted = y[i + _DURATIONS + at]
        middle = begins - 0.5 * lasted
        now = y[i + _VALUES + at]
        if middle <= wanted:
            return float(now if number == 0 else held + (now - held) * (older - wanted) / (older - middle))
        older = middle
        held = now
        begins -= lasted
    middle = -0.5 * h
    return float(held + (value - held) * (older - wanted) / (older - middle))
