"""Viscous friction by a power of the speed below one: the lubricant of rolling bearings and screws (2/3), power-law fluids.

Equation: F = F_p (|v|/v_0)^n sgn(v) with v_0 = 1 x/s, so that F_p is the force at that speed whatever the exponent is.
Source: Palmgren 1957: the friction torque of a lubricated rolling bearing without load grows with the power 2/3 of its speed;
Ostwald 1925 and de Waele 1923 for fluids in general.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def force(c: Context, force: float, exponent: float) -> float:
    if c.velocity == 0.0:
        return 0.0
    return force * math.copysign(abs(c.velocity) ** exponent, c.velocity)


EFFECT = Effect(
    id="shear_thinning",
    law="power",
    place=Place.FORCE,
    title="viscous friction by a power of the speed below one",
    equation="F = F_p (|v|/v_0)^n sgn(v), v_0 = 1 x/s",
    source="Palmgren 1957; Ostwald 1925, de Waele 1923",
    parameters=(
        Parameter("force", "F_p", "F", "force at a speed of 1 x/s", lower=0.0, linear=True),
        Parameter("exponent", "n", "1", "power of the speed", lower=0.1, upper=0.95, default=2.0 / 3.0),
    ),
    force=force,
    form_of="saturating",
    regime="low and moderate speed, both directions: steeper there than at high speed",
    looks_like={"viscous": "ladder of constant velocities: this bends downwards, a viscous friction is a straight line"},
)
