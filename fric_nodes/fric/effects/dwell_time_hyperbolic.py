"""Dwell time, hyperbolic law: static friction settles at a value, slowly at the end.

Equation: S = S_0 + (S_inf - S_0) theta / (theta + tau), with theta the age of the contact (:mod:`fric.steps.ageing`) and
S the surplus over the slip level of the other terms.
Source: Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 36, after Gitis and Volpe. The print begins with F_inf and
falls to F_0 with time, F_inf - (F_inf - F_0) t/(t + C_1), while the text below it says that all functions rise; taken
from F_0 upwards it does. (So does F_inf - (F_inf - F_0) C_1/(t + C_1), which is the same function.)
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.ageing import CREEP_LENGTH, FRESH_SURPLUS, LOOKS_LIKE, REGIME, age, grow_older, renewal_rate

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, i: int, force: float, initial: float, time: float, length: float) -> float:
    theta = age(c, i, length)
    risen = theta / (theta + time)
    return base + initial * (1.0 - risen) + force * risen


@kernel
def remember(c: Context, base: float, i: int, force: float, initial: float, time: float, length: float) -> None:
    grow_older(c, i, length)


def _rate(mass: float, force: float, initial: float, time: float, length: float) -> float:
    return renewal_rate(mass, abs(force - initial), length)


EFFECT = Effect(
    id="dwell_time",
    law="hyperbolic",
    place=Place.SLIP_LEVEL,
    title="static friction that rises with dwell time",
    equation="S = S_0 + (S_inf - S_0) theta / (theta + tau), d theta/dt = 1 - |v| theta / D_0",
    source="Al-Bender, Lampaert, Swevers 2004, Appendix I, Eq. 36",
    parameters=(
        Parameter("force", "S_inf", "F", "surplus over the other terms' level after a long rest", lower=0.0, linear=True),
        FRESH_SURPLUS,
        Parameter("time", "tau", "s", "time in which half of the rise is done", positive=True),
        CREEP_LENGTH,
    ),
    level=level,
    remember=remember,
    n_memory=1,
    rate=_rate,
    regime=REGIME,
    looks_like=LOOKS_LIKE,
)
