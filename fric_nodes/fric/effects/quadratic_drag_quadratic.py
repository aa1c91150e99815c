"""Quadratic drag: proportional to the square of the velocity (air, splashing lubricant, a fan on the shaft).

Equation: F = c v |v|.
Source: Newton's drag law; standard in friction models of fast drives and vehicles.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def force(c: Context, coefficient: float) -> float:
    return coefficient * c.velocity * abs(c.velocity)


EFFECT = Effect(
    id="quadratic_drag",
    law="quadratic",
    usual=True,
    place=Place.FORCE,
    title="quadratic drag",
    equation="F = c v |v|",
    source="Newton's drag law",
    parameters=(Parameter("coefficient", "c", "F s^2/x^2", "force per velocity squared", lower=0.0, linear=True),),
    force=force,
    regime="the highest speeds: the force grows with the square of velocity",
    looks_like={"viscous": "ladder of constant velocities: drag bends upwards, a viscous force is a straight line"},
)
