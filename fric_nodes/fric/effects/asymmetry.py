"""Asymmetric friction: other coefficients in one direction of motion than in the other.

Equation: F = D_C |sgn(v)| + D_v |v|: the Coulomb level is F_C + D_C forward and F_C - D_C backward, the viscous coefficient
F_v + D_v forward and F_v - D_v backward. While the body slides, D_C acts exactly as a constant bias force does; the two differ
only at rest, where a bias pushes and an asymmetric level does not. Where the rise at low speed differs, too:
``asymmetry/low_speed``.
Source: de Marchi 1998 (asymmetric kinetic and viscous friction, mean and half difference of the two directions).
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, force: float, coefficient: float) -> float:
    return base + c.direction * force


@kernel
def force(c: Context, force: float, coefficient: float) -> float:
    return coefficient * abs(c.velocity)


EFFECT = Effect(
    id="asymmetry",
    law="linear",
    usual=True,
    place=Place.SLIP_LEVEL,
    order=20,
    title="direction-dependent friction",
    equation="F = D_C + D_v |v|, on top of F_C sgn(v) + F_v v",
    source="de Marchi 1998, asymmetric kinetic and viscous friction",
    parameters=(
        Parameter(
            "force", "D_C", "F", "half the difference of the Coulomb levels, forward minus backward", default=0.0, linear=True
        ),
        Parameter(
            "coefficient",
            "D_v",
            "F s/x",
            "half the difference of the viscous coefficients, forward minus backward",
            default=0.0,
            linear=True,
        ),
    ),
    level=level,
    force=force,
    regime="one direction of motion against the other, at the same speed",
    looks_like={
        "bias": "push the resting body from both sides: a bias shifts both break-away forces alike, an asymmetry doesn't push"
    },
)
