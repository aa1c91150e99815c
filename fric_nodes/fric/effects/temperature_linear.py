"""Temperature: level and viscous coefficient change with it, the second because oil gets thinner.

Equation: g -> g (1 + alpha T), F = kappa T v, with T the difference from the reference temperature.
Source: first-order expansion at the reference temperature. Bittencourt and Gunnarsson 2012 measured the effects of load and
temperature on a robot joint.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, level_change: float, viscous_change: float) -> float:
    return base * (1.0 + level_change * c.temperature)


@kernel
def force(c: Context, level_change: float, viscous_change: float) -> float:
    return viscous_change * c.temperature * c.velocity


EFFECT = Effect(
    id="temperature",
    law="linear",
    usual=True,
    place=Place.SLIP_LEVEL,
    order=30,
    title="temperature-dependent friction",
    equation="g = g_0 (1 + alpha T), F = kappa T v",
    source="first-order expansion at the reference temperature",
    parameters=(
        Parameter("level_change", "alpha", "1/K", "relative change of the level per kelvin", default=0.0),
        Parameter(
            "viscous_change", "kappa", "F s/x/K", "change of the viscous coefficient per kelvin", default=0.0, linear=True
        ),
    ),
    level=level,
    force=force,
    absent={"level_change": 0.0, "viscous_change": 0.0},
    regime="a warm machine against a cold one, at the same motion",
    looks_like={
        "time_drift": "stop for long, let it cool, run again: what comes back is temperature",
        "viscous": "record at two temperatures: a plain viscous coefficient is the same at both",
    },
)
