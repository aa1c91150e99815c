"""Dwell time, power of an exponential law: static friction that starts from nothing and settles at a value.

Equation: S = S_inf (1 - exp(-(theta/tau)^beta))^gamma, with theta the age of the contact (:mod:`fric.steps.ageing`) and S
the surplus over the slip level of the other terms.
Source: Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 35: F = F_inf [1 - exp(-C_1 t^C_2)]^C_3, after Gitis and Volpe.
The law holds for the whole of friction there, which it lets start at zero; as a surplus it is the whole where no other
term gives a slip level.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.ageing import CREEP_LENGTH, LOOKS_LIKE, REGIME, age, grow_older, raised, renewal_rate

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, i: int, force: float, time: float, exponent: float, power: float, length: float) -> float:
    risen = -math.expm1(-raised(age(c, i, length) / time, exponent))
    return float(base + force * raised(risen, power))


@kernel
def remember(c: Context, base: float, i: int, force: float, time: float, exponent: float, power: float, length: float) -> None:
    grow_older(c, i, length)


def _rate(mass: float, force: float, time: float, exponent: float, power: float, length: float) -> float:
    return renewal_rate(mass, force, length)


EFFECT = Effect(
    id="dwell_time",
    law="exponential_power",
    place=Place.SLIP_LEVEL,
    title="static friction that rises with dwell time",
    equation="S = S_inf (1 - exp(-(theta/tau)^beta))^gamma, d theta/dt = 1 - |v| theta / D_0",
    source="Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 35",
    parameters=(
        Parameter("force", "S_inf", "F", "surplus over the other terms' level after a long rest", lower=0.0, linear=True),
        Parameter("time", "tau", "s", "time over which the contact strengthens", positive=True),
        Parameter("exponent", "beta", "1", "shape of the rise", lower=0.05, upper=5.0, default=1.0, shape=True),
        Parameter("power", "gamma", "1", "power of the whole", lower=0.05, upper=20.0, default=1.0, shape=True),
        CREEP_LENGTH,
    ),
    level=level,
    remember=remember,
    n_memory=1,
    rate=_rate,
    regime=REGIME,
    looks_like=LOOKS_LIKE,
    near="exponential",
)
