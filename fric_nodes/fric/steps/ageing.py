"""The age of a contact: how long its asperities have been touching on average.

Equation: d theta/dt = 1 - |v| theta / D_0. At rest theta grows as the clock; sliding by the creep length D_0 renews the
contacts, so that at constant velocity theta settles at D_0/|v|. A friction that depends on theta alone therefore obeys
F_static(t = D_0/v) = F_dynamic(v), as Rabinowicz and Baumberger found in experiments.
Source: Al-Bender, Lampaert, Swevers 2004, section "The lift-up effect" and Appendix I (the relation, and the creep length
D_0); the differential equation is the ageing law of rate-and-state friction (Dieterich 1979; Rice and Ruina 1983), which
has that relation as its steady state.

Over a step at constant velocity the equation is linear: with r = |v| h / D_0, theta(h) = theta(0) exp(-r) + h (1 -
exp(-r)) / r.
"""

from __future__ import annotations

import math

from ..effect import Context
from ..engine.kernel import hidden, kernel
from ..parameter import Parameter

__all__ = ["CREEP_LENGTH", "FRESH_SURPLUS", "LOOKS_LIKE", "REGIME", "age", "grow_older", "raised", "renewal_rate"]

CREEP_LENGTH = Parameter("length", "D_0", "x", "creep length: sliding by it renews the contacts", positive=True)
"""The parameter that every law of the contact's age shares."""

FRESH_SURPLUS = Parameter(
    "initial",
    "S_0",
    "F",
    "surplus over the other terms' level of a fresh contact",
    lower=0.0,
    default=0.0,
    linear=True,
    shape=True,
)
"""Not to be told from the level of another term by any motion, and so left alone unless it is asked for."""

REGIME = "the first moment of motion after a rest: the longer the rest, the higher the peak; and low speed"

LOOKS_LIKE = {
    "coulomb": "break away after rests of graded length: what has risen with the dwell time is less after short ones",
    "stribeck": "repeat reversals with rests of graded length: only with dwell time does break-away depend on the rest",
    "frictional_lag": "repeat break-away after rests of graded length: with a lag it stops rising after a few time constants",
    "temperature": "alternate short and long rests in random order: a temperature changes slowly and not with the last rest",
}


@kernel
def aged(theta: float, speed: float, h: float, length: float) -> float:
    """The age [s] after ``h`` [s] at ``speed`` [x/s] of a contact of the age ``theta``."""
    r = speed * h / length
    if r == 0.0:
        return theta + h
    fading = -math.expm1(-r)  # both of the solution's exponentials in one
    return theta * (1.0 - fading) + h * fading / r


@kernel
def raised(x: float, exponent: float) -> float:
    """``x`` to the power of ``exponent``; the usual one, 1, skips the general power, which costs more than all the rest."""
    return x if exponent == 1.0 else float(hidden(x) ** exponent)


@kernel
def age(c: Context, i: int, length: float) -> float:
    """The age of the contact [s] at the instant of ``c``, the middle of a step; ``c.memory[i]`` is the age at its start."""
    return aged(c.memory[i], abs(c.velocity), 0.5 * c.step, length)


@kernel
def grow_older(c: Context, i: int, length: float) -> None:
    """Lead the age of the contact over the step of ``c``."""
    c.memory[i] = aged(c.memory[i], abs(c.velocity), c.step, length)


def renewal_rate(mass: float, surplus: float, length: float) -> float:
    """How fast a body speeds up while break-away takes the surplus from it over the creep length, over 4 [1/s].

    From m d^2x/dt^2 = surplus x / length. As with the Stribeck effect, the fall is passed in a moment and its error doesn't
    add up.
    """
    return 0.25 * math.sqrt(max(surplus, 0.0) / (length * mass))
