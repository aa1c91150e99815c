"""Dwell time, power law: static friction rises without end, as Coulomb found it.

Equation: S = S_1 (theta / 1 s)^beta, with theta the age of the contact (:mod:`fric.steps.ageing`) and S the surplus over
the slip level of the other terms.
Source: Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 37: F = F_k + C_1 t^C_2, after Gitis and Volpe, where F_k is
kinetic friction: the surplus over it is the law itself. C_1 is S_1 over 1 s to the power C_2.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.ageing import CREEP_LENGTH, LOOKS_LIKE, REGIME, age, grow_older, raised, renewal_rate

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, i: int, force: float, exponent: float, length: float) -> float:
    return float(base + force * raised(age(c, i, length), exponent))


@kernel
def remember(c: Context, base: float, i: int, force: float, exponent: float, length: float) -> None:
    grow_older(c, i, length)


def _rate(mass: float, force: float, exponent: float, length: float) -> float:
    return renewal_rate(mass, force, length)


EFFECT = Effect(
    id="dwell_time",
    law="power",
    place=Place.SLIP_LEVEL,
    title="static friction that rises with dwell time",
    equation="S = S_1 (theta / 1 s)^beta, d theta/dt = 1 - |v| theta / D_0",
    source="Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 37",
    parameters=(
        Parameter(
            "force", "S_1", "F", "surplus over the other terms' level after a rest of one second", lower=0.0, linear=True
        ),
        Parameter("exponent", "beta", "1", "power of the rise", lower=0.01, upper=1.0, default=0.2, shape=True),
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
