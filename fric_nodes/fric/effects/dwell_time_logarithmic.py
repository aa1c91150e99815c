"""Dwell time, logarithmic law: static friction rises without end, by the same amount with every decade of rest.

Equation: S = S_0 + S_e log(1 + theta/tau), with theta the age of the contact (:mod:`fric.steps.ageing`) and S the surplus
over the slip level of the other terms.
Source: Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 39, after Gitis and Volpe. The print begins with F_inf and
falls without end, F_inf - (F_inf - F_0) log(C_1 t + 1), while the text below it says that all functions rise: from F_0
upwards it does. It has no last value; what is printed as F_inf - F_0 is the rise S_e while C_1 t + 1 grows by a factor of
e. C_1 is 1/tau.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.ageing import CREEP_LENGTH, FRESH_SURPLUS, LOOKS_LIKE, REGIME, age, grow_older, renewal_rate

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, i: int, force: float, initial: float, time: float, length: float) -> float:
    return base + initial + force * math.log1p(age(c, i, length) / time)


@kernel
def remember(c: Context, base: float, i: int, force: float, initial: float, time: float, length: float) -> None:
    grow_older(c, i, length)


def _rate(mass: float, force: float, initial: float, time: float, length: float) -> float:
    return renewal_rate(mass, force + initial, length)


EFFECT = Effect(
    id="dwell_time",
    law="logarithmic",
    place=Place.SLIP_LEVEL,
    title="static friction that rises with dwell time",
    equation="S = S_0 + S_e log(1 + theta/tau), d theta/dt = 1 - |v| theta / D_0",
    source="Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 39",
    parameters=(
        Parameter("force", "S_e", "F", "rise of the surplus with every factor e of the age", lower=0.0, linear=True),
        FRESH_SURPLUS,
        Parameter("time", "tau", "s", "age at which the rise turns logarithmic", positive=True),
        CREEP_LENGTH,
    ),
    level=level,
    remember=remember,
    n_memory=1,
    rate=_rate,
    regime=REGIME,
    looks_like=LOOKS_LIKE,
)
