"""Stribeck effect: friction falls from its static to its Coulomb level as the lubricant film builds up with speed.

Equation: F = (F_S - F_C) exp(-(|v|/v_S)^delta) sgn(v), on top of the Coulomb level. The parameter is the surplus
F_S - F_C, so that terms stay independent of each other: break-away takes the sum of both levels.
Source: Szell, Eq. 10; the printed exponent lacks the brackets that make delta act on |v/v_S|, as in Armstrong-Helouvry et al.
1994.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]

_FALLEN = 80.0  # exp(-80) = 2e-35


@kernel
def level(c: Context, base: float, force: float, velocity: float, exponent: float) -> float:
    ratio = abs(c.velocity) * (1.0 / velocity)  # the division is the loop's, not the step's
    # The common exponents skip the general power, which costs more than the rest of a step together.
    if exponent == 2.0:
        fall = ratio * ratio
    elif exponent == 1.0:
        fall = ratio
    else:
        fall = ratio**exponent
    # An exponential that underflows takes ten times as long as any other, and what is left there is beyond all precision.
    if fall > _FALLEN:
        return base
    return base + force * math.exp(-fall)


def _rate(mass: float, force: float, velocity: float, exponent: float) -> float:
    """Growth rate of a velocity while friction falls, force / (velocity mass), over 16 [1/s].

    The fall is passed in a moment, so that its error, unlike that of an oscillation, doesn't add up.
    """
    return force / (16.0 * velocity * mass)


EFFECT = Effect(
    id="stribeck",
    law="exponential",
    place=Place.SLIP_LEVEL,
    title="Stribeck effect",
    equation="F = (F_S - F_C) exp(-(|v|/v_S)^delta) sgn(v)",
    source="Szell, Eq. 10; Armstrong-Helouvry, Dupont, Canudas de Wit 1994",
    parameters=(
        Parameter("force", "F_S - F_C", "F", "surplus of static friction over Coulomb friction", lower=0.0, linear=True),
        Parameter("velocity", "v_S", "x/s", "Stribeck velocity, where the surplus has fallen to 1/e", positive=True),
        Parameter("exponent", "delta", "1", "shape of the fall", lower=0.1, upper=10.0, default=2.0, shape=True, also=(1.0,)),
    ),
    level=level,
    rate=_rate,
    regime="low speed, both directions: more force than at moderate speed",
    looks_like={
        "coulomb": "ladder of constant velocities: Stribeck friction falls on it, a Coulomb level stays",
        "dwell_time": "repeat reversals with rests of graded length: only dwell time makes break-away depend on the rest",
        "accel_hysteresis": "cross low speed speeding up and slowing down: a Stribeck curve is the same both ways",
        "frictional_lag": "cross low speed at graded accelerations: a lag opens a loop, the Stribeck curve alone is one line",
    },
    usual=True,
)
