"""Acceleration-dependent hysteresis with a Stribeck surplus that falls exponentially.

Equation: F = (F_S - F_C) exp(-|v/v_S|^n) sgn(v) where sgn(v) dv/dt >= 0, else 0, on top of the Coulomb level.
Source: Szell, Eq. 23 (Model B, law ``rational``), for the two branches; Armstrong-Helouvry, Dupont, Canudas de Wit 1994, with
the Stribeck curve of Bo and Pavelescu 1982, for the fall.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]

_FAR = 80.0  # exp(-80) = 2e-35


@kernel
def level(c: Context, base: float, force: float, velocity: float, exponent: float) -> float:
    if c.direction * c.acceleration < 0.0:
        return base
    fall = (abs(c.velocity) / velocity) ** exponent
    # An exponential that underflows takes ten times as long as any other.
    return base if fall > _FAR else base + force * math.exp(-fall)


def _rate(mass: float, force: float, velocity: float, exponent: float) -> float:
    """As of the Stribeck effect: growth rate of a velocity while friction falls, over 16 [1/s]."""
    return force / (16.0 * velocity * mass)


EFFECT = Effect(
    id="accel_hysteresis",
    law="exponential",
    place=Place.SLIP_LEVEL,
    title="acceleration-dependent friction hysteresis with an exponential fall",
    equation="F = (F_S - F_C) exp(-|v/v_S|^n) sgn(v) where v dv/dt >= 0, else 0",
    source="Szell, Eq. 23 (Model B); Bo and Pavelescu 1982",
    parameters=(
        Parameter("force", "F_S - F_C", "F", "surplus while speeding up from rest", lower=0.0, linear=True),
        Parameter("velocity", "v_S", "x/s", "velocity at which 1/e of the surplus is left", positive=True),
        Parameter("exponent", "n", "1", "how suddenly it falls", lower=0.5, upper=4.0, default=2.0),
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
