"""Viscous friction: proportional to velocity.

Equation: F = F_v v.
Source: Szell, Eq. 8.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def force(c: Context, coefficient: float) -> float:
    return coefficient * c.velocity


EFFECT = Effect(
    id="viscous",
    place=Place.FORCE,
    title="viscous friction",
    equation="F = F_v v",
    source="Szell, Eq. 8",
    parameters=(Parameter("coefficient", "F_v", "F s/x", "force per velocity", lower=0.0, linear=True),),
    force=force,
    regime="high speed: the force grows in proportion to velocity",
    looks_like={"quadratic_drag": "ladder of constant velocities: the viscous part is a straight line through them"},
)
