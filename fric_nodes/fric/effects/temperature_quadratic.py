"""Temperature, to the second order: level and viscous coefficient that don't change with it in proportion.

Equation: g -> g (1 + alpha T + beta T^2), F = (kappa T + lambda T^2) v, with T the difference from the reference temperature.
Source: second-order expansion at the reference temperature. The viscosity of oil falls exponentially with the temperature
(Vogel 1921), and so does what is measured on joints: Bittencourt and Gunnarsson 2012, with an exponential viscous part; Simoni
et al. 2015, with polynomials.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, level_change: float, viscous_change: float, level_bend: float, viscous_bend: float) -> float:
    return base * (1.0 + (level_change + level_bend * c.temperature) * c.temperature)


@kernel
def force(c: Context, level_change: float, viscous_change: float, level_bend: float, viscous_bend: float) -> float:
    return (viscous_change + viscous_bend * c.temperature) * c.temperature * c.velocity


EFFECT = Effect(
    id="temperature",
    law="quadratic",
    place=Place.SLIP_LEVEL,
    order=30,
    title="temperature-dependent friction, bent",
    equation="g = g_0 (1 + alpha T + beta T^2), F = (kappa T + lambda T^2) v",
    source="second-order expansion at the reference temperature; Simoni et al. 2015",
    parameters=(
        Parameter("level_change", "alpha", "1/K", "relative change of the level per kelvin", default=0.0),
        Parameter(
            "viscous_change", "kappa", "F s/x/K", "change of the viscous coefficient per kelvin", default=0.0, linear=True
        ),
        Parameter("level_bend", "beta", "1/K^2", "relative change of the level per kelvin squared", default=0.0),
        Parameter(
            "viscous_bend",
            "lambda",
            "F s/x/K^2",
            "change of the viscous coefficient per kelvin squared",
            default=0.0,
            linear=True,
        ),
    ),
    level=level,
    force=force,
    absent={"level_change": 0.0, "viscous_change": 0.0, "level_bend": 0.0, "viscous_bend": 0.0},
    regime="a warm machine against a cold one, at the same motion",
    looks_like={
        "time_drift": "stop for long, let it cool, run again: what comes back is temperature",
        "viscous": "record at two temperatures: a plain viscous coefficient is the same at both",
    },
)
