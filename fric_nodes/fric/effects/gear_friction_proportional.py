"""Friction that follows the driving force: gears, screws and belts rub the more the more force they pass on.

Equation: g = mu |f|, on top of the other slip levels, with f the force that pushes the body: the actuator's, or what a
transmission passes on. It is a contact of its own: what scales the friction of a guideway, over place, load or temperature,
doesn't scale it. Driving takes 1/(1 - mu) times the force that it takes without; driven by the load, 1/(1 + mu) times
the force comes back.
Source: efficiency of gears and screws (Niemann and Winter, Machine Elements); the load-dependent part of servo gear friction,
Duclusaud et al. 2024 (Better Actuator Models).
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, coefficient: float) -> float:
    return base + coefficient * abs(c.push)


EFFECT = Effect(
    id="gear_friction",
    law="proportional",
    usual=True,
    place=Place.SLIP_LEVEL,
    order=40,
    title="friction that follows the driving force",
    equation="g = mu |f|",
    source="efficiency of gears and screws; Duclusaud et al. 2024",
    parameters=(
        Parameter(
            "coefficient",
            "mu",
            "1",
            "friction per driving force; the efficiency is 1 - mu",
            lower=0.0,
            upper=0.9,
            default=0.0,
        ),
    ),
    level=level,
    absent={"coefficient": 0.0},
    uses_push=True,
    regime="large driving forces: more friction while the axis is accelerated hard, or held against a load",
    looks_like={
        "saturation": "drive hard into the load and back: gear friction takes force in both directions, a limit none below it",
        "load_dependence": "load the axis across its motion: only friction by the normal load changes",
    },
)
