"""Viscous friction that levels off with speed: a lubricant that thins while it is sheared, bearings, seals, gears.

Equation: F = F_i (1 - exp(-|v|/v_i)) sgn(v): at low speed viscous friction of the slope F_i/v_i, at high speed a constant F_i.
Source: viscosity that falls with the shear rate, as of greases and boundary layers; the exponential is the curve of Bo and
Pavelescu 1982 (as in Armstrong-Helouvry et al. 1994) with the other sign, rising instead of falling.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]

_LEVEL = 80.0  # exp(-80) = 2e-35


@kernel
def force(c: Context, force: float, velocity: float) -> float:
    ratio = abs(c.velocity) * (1.0 / velocity)  # the division is the loop's, not the step's
    # An exponential that underflows takes ten times as long as any other, and what is left there is beyond all precision.
    if ratio > _LEVEL:
        return force * math.copysign(1.0, c.velocity)
    return force * math.copysign(1.0 - math.exp(-ratio), c.velocity)


EFFECT = Effect(
    id="shear_thinning",
    law="saturating",
    usual=True,
    place=Place.FORCE,
    title="viscous friction that levels off with speed",
    equation="F = F_i (1 - exp(-|v|/v_i)) sgn(v)",
    source="shear-thinning lubricant; Bo and Pavelescu 1982 for the exponential",
    parameters=(
        Parameter("force", "F_i", "F", "what it rises to with speed", lower=0.0, linear=True),
        Parameter("velocity", "v_i", "x/s", "velocity at which it has come to 63 % of that", positive=True),
    ),
    force=force,
    regime="low and moderate speed, both directions: steeper there than at high speed",
    looks_like={
        "viscous": "ladder of constant velocities: this bends downwards, a viscous friction is a straight line",
        "coulomb": "drive more slowly: Coulomb friction stays, this goes to zero with the speed",
        "presliding": "reverse at two accelerations: pre-sliding follows the way since the reversal, this the speed",
    },
)
