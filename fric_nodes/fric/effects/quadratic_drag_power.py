"""Drag by another power of the speed than its square: turbulent lubricant (1.75), windage, a fan in a duct.

Equation: F = c v |v| |v/v_0|^(n - 2) with v_0 = 1 x/s, so that c is the force at that speed whatever the exponent is.
Source: Blasius 1913 (resistance of turbulent flow in smooth pipes grows with the power 1.75 of the speed); windage of discs.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def force(c: Context, coefficient: float, exponent: float) -> float:
    return coefficient * math.copysign(abs(c.velocity) ** exponent, c.velocity)


EFFECT = Effect(
    id="quadratic_drag",
    law="power",
    place=Place.FORCE,
    title="drag by a power of the speed",
    equation="F = c v |v| |v/v_0|^(n - 2), v_0 = 1 x/s",
    source="Blasius 1913",
    parameters=(
        Parameter("coefficient", "c", "F s^2/x^2", "force at a speed of 1 x/s", lower=0.0, linear=True),
        Parameter("exponent", "n", "1", "power of the speed", lower=1.2, upper=3.5, default=1.75),
    ),
    force=force,
    regime="the highest speeds: the force grows faster than velocity",
    looks_like={"viscous": "ladder of constant velocities: drag bends upwards, a viscous force is a straight line"},
)
