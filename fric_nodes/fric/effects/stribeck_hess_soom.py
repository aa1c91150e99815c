"""Stribeck effect in the form of Hess and Soom: a fall with a long tail instead of an exponential one.

Equation: F = (F_S - F_C) / (1 + (v/v_S)^2) sgn(v), on top of the Coulomb level. The parameter is the surplus F_S - F_C.
Source: Szell, Eq. 11; Hess and Soom 1990.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, force: float, velocity: float) -> float:
    ratio = c.velocity * (1.0 / velocity)  # the division is the loop's, not the step's
    return base + force / (1.0 + ratio * ratio)


def _rate(mass: float, force: float, velocity: float) -> float:
    """As of the exponential form: growth rate of a velocity while friction falls, over 16 [1/s]."""
    return force / (16.0 * velocity * mass)


EFFECT = Effect(
    id="stribeck",
    law="hess_soom",
    place=Place.SLIP_LEVEL,
    title="Stribeck effect",
    equation="F = (F_S - F_C) / (1 + (v/v_S)^2) sgn(v)",
    source="Szell, Eq. 11; Hess and Soom 1990",
    parameters=(
        Parameter("force", "F_S - F_C", "F", "surplus of static friction over Coulomb friction", lower=0.0, linear=True),
        Parameter("velocity", "v_S", "x/s", "Stribeck velocity, where half of the surplus is left", positive=True),
    ),
    level=level,
    rate=_rate,
    regime="low speed, both directions: more force than at moderate speed, with a tail that falls as 1/v^2",
    looks_like={
        "coulomb": "ladder of constant velocities: Stribeck friction falls on it, a Coulomb level stays",
        "dwell_time": "repeat reversals with rests of graded length: only dwell time makes break-away depend on the rest",
        "accel_hysteresis": "cross low speed speeding up and slowing down: a Stribeck curve is the same both ways",
    },
)
