"""Viscous friction that grows with the logarithm of the speed: a thin lubricant film that is sheared hard.

Equation: F = F_e asinh(|v|/v_e) sgn(v): at low speed a viscous friction of the slope F_e/v_e, at high speed F_e ln(2 |v|/v_e).
Source: Eyring 1936 (flow as an activated process); Johnson and Tevaarwerk 1977 for lubricated contacts.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def force(c: Context, force: float, velocity: float) -> float:
    return force * math.asinh(c.velocity * (1.0 / velocity))


EFFECT = Effect(
    id="shear_thinning",
    law="eyring",
    place=Place.FORCE,
    title="viscous friction that grows with the logarithm of the speed",
    equation="F = F_e asinh(|v|/v_e) sgn(v)",
    source="Eyring 1936; Johnson and Tevaarwerk 1977",
    parameters=(
        Parameter("force", "F_e", "F", "scale of the force", lower=0.0, linear=True),
        Parameter("velocity", "v_e", "x/s", "velocity from which on it grows with the logarithm", positive=True),
    ),
    force=force,
    form_of="saturating",
    regime="low and moderate speed, both directions: steeper there than at high speed",
    looks_like={"viscous": "ladder of constant velocities: this bends downwards, a viscous friction is a straight line"},
)
