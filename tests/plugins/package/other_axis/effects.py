"""Cubic drag, which fric has not."""

from __future__ import annotations

from fric.effect import Context, Effect, Place
from fric.engine.kernel import kernel
from fric.parameter import Parameter


@kernel
def force(c: Context, coefficient: float) -> float:
    return coefficient * c.velocity * c.velocity * c.velocity


EFFECT = Effect(
    id="cubic_drag",
    place=Place.FORCE,
    title="cubic drag",
    equation="F = F_3 v^3",
    source="this test",
    parameters=(Parameter("coefficient", "F_3", "F s^3/x^3", "force per cube of the velocity", lower=0.0, linear=True),),
    force=force,
    regime="high speed",
    looks_like={},
)
