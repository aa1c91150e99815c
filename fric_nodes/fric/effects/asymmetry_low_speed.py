"""Asymmetric friction with a low-speed part: the Stribeck effect, too, is larger in one direction of motion than in the other.

Equation: F = D_C |sgn(v)| + D_v |v| + D_S exp(-(|v|/v_D)^delta): as in ``asymmetry/linear``, and beside a ``stribeck`` term of
the surplus S the rise at low speed is S + D_S forward and S - D_S backward. With v_D = v_S both directions have the same
Stribeck velocity; a v_D of its own also covers directions that differ in it, to first order. At rest the break-away forces
differ by D_C and D_S together, while at high speed D_C alone is left: it is D_C - not D_S - that a bias force may be mistaken
for.
Assumption: other slip levels keep the sum positive; the sum of all never goes below zero.
Source: Canudas de Wit, Olsson, Astrom, Lischinsky 1995, after Eq. 3 (the level g(v) "need not be symmetrical", by which
direction-dependent behaviour is captured); the exponential of Szell, Eq. 10, as in ``stribeck``; mean and half difference of
the two directions as in de Marchi 1998.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from .asymmetry import EFFECT as LINEAR
from .asymmetry import force as linear_force
from .asymmetry import level as linear_level
from .stribeck import level as stribeck_level

__all__ = ["EFFECT"]


@kernel
def level(
    c: Context, base: float, force: float, coefficient: float, low_speed: float, velocity: float, exponent: float
) -> float:
    return stribeck_level(c, linear_level(c, base, force, coefficient), c.direction * low_speed, velocity, exponent)


@kernel
def force(c: Context, force: float, coefficient: float, low_speed: float, velocity: float, exponent: float) -> float:
    return linear_force(c, force, coefficient)


def _rate(mass: float, force: float, coefficient: float, low_speed: float, velocity: float, exponent: float) -> float:
    """As of the Stribeck effect: growth rate of a velocity while friction falls, over 16 [1/s]."""
    return abs(low_speed) / (16.0 * velocity * mass)


EFFECT = Effect(
    id="asymmetry",
    law="low_speed",
    place=Place.SLIP_LEVEL,
    order=20,
    title="direction-dependent friction, also at low speed",
    equation="F = D_C + D_v |v| + D_S exp(-(|v|/v_D)^delta), on top of F_C sgn(v) + F_v v + Stribeck",
    source="Canudas de Wit, Olsson, Astrom, Lischinsky 1995, after Eq. 3; Szell, Eq. 10; de Marchi 1998",
    parameters=(
        *LINEAR.parameters,
        Parameter(
            "low_speed",
            "D_S",
            "F",
            "half the difference of the rises at low speed, forward minus backward",
            default=0.0,
            linear=True,
        ),
        Parameter("velocity", "v_D", "x/s", "velocity at which that difference has fallen to 1/e", positive=True),
        Parameter("exponent", "delta", "1", "shape of the fall", lower=0.1, upper=10.0, default=2.0, shape=True, also=(1.0,)),
    ),
    level=level,
    force=force,
    form_of=LINEAR.law,
    shows_alone=True,
    rate=_rate,
    regime="low speed: more force over that at moderate speed in one direction than in the other",
    looks_like={
        "bias": "slow and fast strokes both ways: a bias shifts both alike, this one only the slow ones",
        "stribeck": "slow strokes both ways: a Stribeck effect raises the force by the same amount forward and backward",
        "ripple": "slow strokes from several starts: this follows the speed wherever it is driven, a ripple the place",
    },
)
