"""Dwell time, square-root law: static friction settles at a value, with a tail that falls as one over the root of time.

Equation: S = S_inf / ((rho - 1) / sqrt(theta/tau + 1) + 1), rho = S_inf/S_0, with theta the age of the contact
(:mod:`fric.steps.ageing`) and S the surplus over the slip level of the other terms.
Source: Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 38, after Gitis and Volpe. The scanned fraction is taken as F =
F_inf / ((F_inf/F_0 - 1) / sqrt(C_1 t + 1) + 1), the arrangement of its parts that is F_0 at t = 0 and F_inf in the end;
C_1 is 1/tau. The law interpolates 1/F and so changes its form when a level is taken off: as a surplus it is the printed
law where no other term gives a slip level, and the same law for the surplus elsewhere.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.ageing import CREEP_LENGTH, LOOKS_LIKE, REGIME, age, grow_older, renewal_rate

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, i: int, force: float, ratio: float, time: float, length: float) -> float:
    left = 1.0 / math.sqrt(age(c, i, length) / time + 1.0)
    return base + force / ((ratio - 1.0) * left + 1.0)


@kernel
def remember(c: Context, base: float, i: int, force: float, ratio: float, time: float, length: float) -> None:
    grow_older(c, i, length)


def _rate(mass: float, force: float, ratio: float, time: float, length: float) -> float:
    return renewal_rate(mass, force, length)


EFFECT = Effect(
    id="dwell_time",
    law="root",
    place=Place.SLIP_LEVEL,
    title="static friction that rises with dwell time",
    equation="S = S_inf / ((rho - 1) / sqrt(theta/tau + 1) + 1), d theta/dt = 1 - |v| theta / D_0",
    source="Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 38",
    parameters=(
        Parameter("force", "S_inf", "F", "surplus over the other terms' level after a long rest", lower=0.0, linear=True),
        Parameter("ratio", "rho", "1", "surplus after a long rest over that of a fresh contact", lower=1.0, upper=1e6),
        Parameter("time", "tau", "s", "time over which the contact strengthens", positive=True),
        CREEP_LENGTH,
    ),
    level=level,
    remember=remember,
    n_memory=1,
    rate=_rate,
    regime=REGIME,
    looks_like=LOOKS_LIKE,
    near="logarithmic",
)
