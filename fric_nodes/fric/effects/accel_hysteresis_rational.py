"""Acceleration-dependent hysteresis: the Stribeck surplus acts while speeding up, and is missing while slowing down.

Equation: F = (F_S - F_C) / (1 + (v/v_S)^2) sgn(v) where v dv/dt >= 0, else 0, on top of the Coulomb level.
Source: Szell, Eq. 23 (Model B). As printed the condition is dv/dt >= 0, which holds for v > 0 only, the direction of his
experiment; backward, speeding up means dv/dt < 0, so the condition is on sgn(v) dv/dt. The Coulomb and the viscous part
of Eq. 23 are the effects ``coulomb`` and ``viscous``. At constant velocity, and at rest, the upper branch holds, as
printed.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, force: float, velocity: float) -> float:
    if c.direction * c.acceleration < 0.0:
        return base
    ratio = c.velocity * (1.0 / velocity)
    return base + force / (1.0 + ratio * ratio)


def _rate(mass: float, force: float, velocity: float) -> float:
    """As of the Stribeck effect: growth rate of a velocity while friction falls, over 16 [1/s]."""
    return force / (16.0 * velocity * mass)


EFFECT = Effect(
    id="accel_hysteresis",
    law="rational",
    usual=True,
    place=Place.SLIP_LEVEL,
    title="acceleration-dependent friction hysteresis",
    equation="F = (F_S - F_C) / (1 + (v/v_S)^2) sgn(v) where v dv/dt >= 0, else 0",
    source="Szell, Eq. 23 (Model B)",
    parameters=(
        Parameter("force", "F_S - F_C", "F", "surplus while speeding up from rest", lower=0.0, linear=True),
        Parameter("velocity", "v_S", "x/s", "velocity at which half of the surplus is left", positive=True),
    ),
    level=level,
    uses_acceleration=True,
    rate=_rate,
    regime="low speed: more force while speeding up than while slowing down at the same velocity",
    looks_like={
        "frictional_lag": "cross low speed at graded accelerations: a lag's loop widens with them, this one doesn't change",
        "stribeck": "cross low speed speeding up and slowing down: a Stribeck curve is the same both ways",
    },
)
