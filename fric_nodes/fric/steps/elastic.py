"""The mean force of an elastic connection over a step in which its deflection changes at a constant rate.

Equation: F = k e + k_3 e^3 + c de/dt, over a deflection that goes linearly from e_0 to e_1. The mean of a spring's force along
that line is the difference of its potential over e_1 - e_0 (a discrete gradient), so that the spring gives back exactly the
energy it took, whatever the step; the damper's mean force is c (e_1 - e_0)/h.

A stop that only pushes acts on its compression a > 0, and never with a negative force: where the damper would pull harder
than the spring pushes, the sides part. Along the line that happens at the compression where k a + k_3 a^3 = c |da/dt|, below
which nothing acts, so that the mean force is again a closed form.
Source: discrete gradients, Gonzalez 1996; the mean over the part of the step in contact is derived here.
"""

from __future__ import annotations

import math

from ..engine.kernel import kernel

__all__ = ["bonded", "parting", "pushing", "stops"]


@kernel
def bonded(e_0: float, e_1: float, h: float, k: float, k_3: float, c: float) -> float:
    """Mean force [F] over ``h`` [s] of a connection without play, which pushes and pulls."""
    return 0.5 * (e_0 + e_1) * (k + 0.5 * k_3 * (e_0 * e_0 + e_1 * e_1)) + c * (e_1 - e_0) / h


@kernel
def parting(pull: float, k: float, k_3: float) -> float:
    """The compression [x] at which the spring pushes with ``pull`` >= 0 [F]: the root of k a + k_3 a^3 = pull."""
    if k_3 <= 0.0:
        return pull / k
    scale = math.sqrt(k / (3.0 * k_3))
    return 2.0 * scale * math.sinh(math.asinh(1.5 * pull / (k * scale)) / 3.0)


@kernel
def pushing(a_0: float, a_1: float, h: float, k: float, k_3: float, c: float) -> float:
    """Mean force [F] over ``h`` [s] of a stop whose compression goes from ``a_0`` to ``a_1`` [x], negative where apart."""
    rate = (a_1 - a_0) / h
    high, low = max(a_0, a_1), min(a_0, a_1)
    end = parting(-c * rate, k, k_3) if rate < 0.0 and c > 0.0 else 0.0
    if high <= end:
        return 0.0
    share = 1.0
    if low < end:
        share = (high - end) / (high - low)
        low = end
    return share * (0.5 * (high + low) * (k + 0.5 * k_3 * (high * high + low * low)) + c * rate)


@kernel
def stops(e_0: float, e_1: float, h: float, free: float, k: float, k_3: float, c: float) -> float:
    """Mean force [F] over ``h`` [s] of a connection with the play ``free`` [x], half of it on either side."""
    half = 0.5 * free
    return pushing(e_0 - half, e_1 - half, h, k, k_3, c) - pushing(-e_0 - half, -e_1 - half, h, k, k_3, c)
