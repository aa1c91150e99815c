"""From one instant to the next, event by event: a Runge-Kutta pair of order 5 and 4, and a bisection for where a mode ends.

Dormand, Prince, "A family of embedded Runge-Kutta formulae", J. Comp. Appl. Math. 6 (1980), table 2. An event is found by steps
from the same beginning that are cut in half until the end of the mode is known to 1e-13 s; the step that is kept is the one
that ends just behind it, so that no error of an interpolation is added.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .events_physics import N_STATES, compiled, margins, settled, slopes

__all__ = ["CHATTERS", "advance"]

_A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
_C = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
_E = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
_RELATIVE = 1e-8
_LONGEST = 5e-4  # [s]: no two events of one inequality lie closer than they show
_LEAST = 1e-10  # [s]: a step that is taken whatever its error, as at the corner of a limited command
_NEAR = 1e-13  # [s], to which an event is found
_TOO_MANY = 500  # events between two instants, which are no further apart than two samples
CHATTERS = -1.0
"""Instead of a length of step: more events than anything but an endless chain of them has."""


@compiled
def _stepped(p: Any, x: Any, mode: Any, now: Any, t: float, h: float, k: Any, after: Any, absolute: Any) -> float:
    """``after`` a step of ``h`` [s]; its error over what is allowed."""
    for stage in range(7):
        for i in range(N_STATES):
            total = 0.0
            for j in range(stage):
                total += _A[stage, j] * k[j, i]
            after[i] = x[i] + h * total
        slopes(p, after, mode, now, t + _C[stage] * h, k[stage])
    worst = 0.0
    for i in range(N_STATES):
        off = 0.0
        for stage in range(7):
            off += _E[stage] * k[stage, i]
        worst = max(worst, abs(h * off) / (absolute[i] + _RELATIVE * max(abs(x[i]), abs(after[i]))))
    return worst


@compiled
def _ended(p: Any, x: Any, mode: Any, now: Any, t: float, dx: Any) -> bool:
    contact, side = margins(p, x, mode, now, t, dx)
    return bool(contact > 0.0 or side > 0.0)


@compiled
def advance(
    p: Any, x: Any, mode: Any, now: Any, begin: float, end: float, h: float, work: Any, absolute: Any, turned: Any
) -> float:
    """Lead the states from ``begin`` to ``end`` [s]; the step that would come next [s], or :data:`CHATTERS`.

    ``work`` has shape ``(9, N_STATES)``; ``turned[0]`` is added the time in which the encoder goes forward less backward.
    """
    k, after, dx = work[:7], work[7], work[8]
    two = p.load_share > 0.0
    t, events = begin, 0
    while True:
        contact, side = margins(p, x, mode, now, t, dx)
        if contact > 0.0 or side > 0.0:
            settled(p, x, mode, now, t, contact, side)
            events += 1
            if events > _TOO_MANY:
                return CHATTERS
            continue
        if end - t <= _NEAR:
            return h
        step = min(h, end - t, _LONGEST)
        low, high = 0.0, math.inf  # the mode ends between the two
        while True:
            error = _stepped(p, x, mode, now, t, step, k, after, absolute)
            if high == math.inf:
                if error > 1.0 and step > _LEAST:
                    step *= max(0.2, 0.9 * error**-0.2)
                    continue
                h = max(step * min(5.0, 0.9 * max(error, 1e-9) ** -0.2), _LEAST)
            if _ended(p, after, mode, now, t + step, dx):
                high = step
                if high - low <= _NEAR:
                    break
            elif high == math.inf:
                break
            else:
                low = step
            step = 0.5 * (low + high) if high - low > _NEAR else high
        before = x[3] if two else x[1]
        for i in range(N_STATES):  # quicker to compile than an assignment of arrays, which may raise
            x[i] = after[i]
        t += step
        mode[2] = min(max(mode[2], x[0] - p.cable_play), x[0] + p.cable_play)
        turned[0] += step * _way(before, x[3] if two else x[1])


@compiled
def _way(before: float, after: float) -> float:
    """Mean sign of a speed that goes from ``before`` to ``after`` in a straight line."""
    size = abs(before) + abs(after)
    return float((before + after) / size) if size > 0.0 else 0.0
