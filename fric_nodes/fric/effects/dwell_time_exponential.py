"""Dwell time, exponential law: static friction settles at a value, as a stretched exponential of the time at rest.

Equation: S = S_inf - (S_inf - S_0) exp(-(theta/tau)^beta), with theta the age of the contact (:mod:`fric.steps.ageing`)
and S the surplus over the slip level of the other terms.
Source: Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 34: F = F_inf - (F_inf - F_0) exp(-C_1 t^C_2), after Gitis and
Volpe. C_1 is written here as tau^(-C_2), a time instead of a number whose unit depends on C_2. The law keeps its form
when the same level is taken off F, F_0 and F_inf.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.ageing import CREEP_LENGTH, FRESH_SURPLUS, LOOKS_LIKE, REGIME, age, grow_older, raised, renewal_rate

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, i: int, force: float, initial: float, time: float, exponent: float, length: float) -> float:
    left = math.exp(-raised(age(c, i, length) / time, exponent))
    return base + force * (1.0 - left) + initial * left


@kernel
def remember(
    c: Context, base: float, i: int, force: float, initial: float, time: float, exponent: float, length: float
) -> None:
    grow_older(c, i, length)


def _rate(mass: float, force: float, initial: float, time: float, exponent: float, length: float) -> float:
    return renewal_rate(mass, abs(force - initial), length)


EFFECT = Effect(
    id="dwell_time",
    law="exponential",
    place=Place.SLIP_LEVEL,
    title="static friction that rises with dwell time",
    equation="S = S_inf - (S_inf - S_0) exp(-(theta/tau)^beta), d theta/dt = 1 - |v| theta / D_0",
    source="Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 34",
    parameters=(
        Parameter("force", "S_inf", "F", "surplus over the other terms' level after a long rest", lower=0.0, linear=True),
        FRESH_SURPLUS,
        Parameter("time", "tau", "s", "time over which the contact strengthens", positive=True),
        Parameter("exponent", "beta", "1", "shape of the rise", lower=0.05, upper=5.0, default=1.0, shape=True),
        CREEP_LENGTH,
    ),
    level=level,
    remember=remember,
    n_memory=1,
    rate=_rate,
    regime=REGIME,
    looks_like=LOOKS_LIKE,
)
