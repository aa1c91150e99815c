"""Compliance: a spring and a damper between motor and load (a shaft, a belt, a screw).

Equation: L = k e + c de/dt, e = y - q. With play b of a backlash term besides, e is what lies beyond it,
|y - q| - b/2 > 0, and the link only pushes: max(k e + c de/dt, 0). The mean over a step is that of
:mod:`fric.steps.elastic`, which keeps the spring's energy.
Source: Hooke; de Marchi 1998, classical compliance.
"""

from __future__ import annotations

import math

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.elastic import bonded, stops

__all__ = ["EFFECT"]


@kernel
def link(e_0: float, e_1: float, h: float, free: float, stiffness: float, damping: float) -> float:
    if free <= 0.0:
        return bonded(e_0, e_1, h, stiffness, 0.0, damping)
    return stops(e_0, e_1, h, free, stiffness, 0.0, damping)


def _rate(mass: float, stiffness: float, damping: float) -> float:
    """Of both masses on the spring, and what the damper does to them."""
    return math.sqrt(stiffness / mass) + 0.5 * damping / mass


EFFECT = Effect(
    id="compliance",
    law="linear",
    usual=True,
    place=Place.TRANSMISSION,
    title="compliance between motor and load",
    equation="L = k e + c de/dt, e = y - q",
    source="Hooke; de Marchi 1998",
    parameters=(
        Parameter("stiffness", "k", "F/x", "force per deflection", positive=True),
        Parameter("damping", "c", "F s/x", "damping of the deflection", lower=0.0, default=0.0),
    ),
    link=link,
    rate=_rate,
    regime="quick changes of the force: the motor moves first, and both swing against each other at one frequency",
    looks_like={
        "backlash": "push the resting load gently: a spring's force grows from the start, through a gap there is none",
        "presliding": "measure the load's position too: a compliant transmission moves the motor, pre-sliding moves the load",
        "stiffness": "travel far: a spring to the frame pulls the harder the farther, one between bodies doesn't",
    },
    repeatable=True,
)
