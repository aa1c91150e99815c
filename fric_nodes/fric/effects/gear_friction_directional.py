"""Friction that follows the driving force, more where it drives than where it is driven, or the other way round.

Equation: g = mu_d |f| where the force drives the motion (f v > 0), mu_b |f| where the load drives it back, on top of the other
slip levels, with f the force that pushes the body.
Source: efficiencies of screws and worm gears differ between driving and back-driving (Niemann and Winter, Machine Elements);
Duclusaud et al. 2024 (Better Actuator Models) for servo gears.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, driving: float, driven: float) -> float:
    return base + (driving if c.push * c.direction > 0.0 else driven) * abs(c.push)


EFFECT = Effect(
    id="gear_friction",
    law="directional",
    place=Place.SLIP_LEVEL,
    order=40,
    title="friction that follows the driving force, by its direction",
    equation="g = mu_d |f| where f v > 0, else mu_b |f|",
    source="efficiencies of screws and worm gears; Duclusaud et al. 2024",
    parameters=(
        Parameter("driving", "mu_d", "1", "friction per force while it drives", lower=0.0, upper=0.9, default=0.05),
        Parameter("driven", "mu_b", "1", "friction per force while the load drives back", lower=0.0, upper=0.9, default=0.05),
    ),
    level=level,
    form_of="proportional",
    absent={"driving": 0.0, "driven": 0.0},
    uses_push=True,
    regime="large driving forces: friction differs between driving the load and being driven by it",
    looks_like={"saturation": "drive hard into the load and back: gear friction takes force in both directions"},
)
