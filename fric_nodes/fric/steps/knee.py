"""A straight line that bends into a level over a knee instead of at a corner.

Equation: with the limit L and the half width k <= L of the knee, odd in u,

    s(u) = u                            for u <= L - k,
    s(u) = u - (u - L + k)^2 / (4 k)    for L - k < u < L + k,
    s(u) = L                            for u >= L + k.

Value and slope are continuous, s(L) = L - k/4, and k = 0 is the corner. Both s and u - s(u) can be inverted in closed form.
"""

from __future__ import annotations

import math

from ..engine.kernel import kernel

__all__ = ["limited", "limited_by", "swallowed_by"]


@kernel
def limited(u: float, limit: float, knee: float) -> float:
    """``u`` bent into the level ``limit`` over a knee of the half width ``knee``."""
    size = abs(u)
    if size >= limit + knee:
        return math.copysign(limit, u)
    into = size - limit + knee
    return u if into <= 0.0 else math.copysign(size - into * into / (4.0 * knee), u)


@kernel
def limited_by(f: float, limit: float, knee: float) -> float:
    """The smallest u for which :func:`limited` is ``f``, or comes closest to it."""
    size = abs(f)
    if size >= limit:
        return math.copysign(limit + knee, f)
    into = size - limit + knee
    return f if into <= 0.0 else math.copysign(limit - knee + 2.0 * knee * (1.0 - math.sqrt(max(1.0 - into / knee, 0.0))), f)


@kernel
def swallowed_by(f: float, limit: float, knee: float) -> float:
    """The smallest u that :func:`limited` leaves ``f`` of: u - limited(u) = ``f``."""
    size = abs(f)
    if size == 0.0:
        return 0.0
    return math.copysign(limit + size if size >= knee else limit - knee + 2.0 * math.sqrt(knee * size), f)
