"""A quantity that follows another with an equation of second order, exact over a step in which the other is constant.

Equation: T^2 d^2y/dt^2 + 2 zeta T dy/dt + y = u. With e = y - u and g = T de/dt, over a step of the length r T

    e(r) = e(0) (C + zeta S) + g(0) S,    g(r) = g(0) (C - zeta S) - e(0) S,

where C and S are exp(-zeta r) times cosh(r s) and sinh(r s)/s with s^2 = zeta^2 - 1, or cos and sin where that is negative.
The mean of e follows from the equation itself, (g(0) - g(r) + 2 zeta (e(0) - e(r)))/r; over short steps, where these
differences have no digits left, from its Taylor series. Neither has a limit on the step.
"""

from __future__ import annotations

import math

from ..engine.kernel import kernel
from .first_order import mean_decay

__all__ = ["decayed"]

_SHORT = 0.3  # of the step times the fastest rate: the Taylor series is exact to the last digit
_TERMS = 13


@kernel
def _mean(e: float, g: float, r: float, damping: float) -> float:
    """Mean of e over a short step, from its derivatives at the begin: each follows from the two before."""
    before, at = e, g
    total, factor = e, 1.0
    for n in range(1, _TERMS):
        factor *= r / (n + 1.0)
        total += at * factor
        before, at = at, -2.0 * damping * at - before
    return total


@kernel
def decayed(e: float, g: float, r: float, damping: float) -> tuple[float, float, float]:
    """The mean of e over a step of the length ``r`` T, and e and g at its end."""
    d = damping * damping - 1.0
    if d < 0.0:
        w = math.sqrt(-d)
        decay = math.exp(-damping * r)
        c, s = decay * math.cos(w * r), decay * math.sin(w * r) / w
    else:
        w = math.sqrt(d)
        slow = math.exp(-r / (damping + w))
        s = slow * r * mean_decay(2.0 * w * r)
        c = slow - w * s
    after, change = e * (c + damping * s) + g * s, g * (c - damping * s) - e * s
    if r * (1.0 + 2.0 * damping) < _SHORT:
        return _mean(e, g, r, damping), after, change
    return (g - change + 2.0 * damping * (e - after)) / r, after, change
