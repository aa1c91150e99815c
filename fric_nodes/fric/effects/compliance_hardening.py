"""Hardening compliance: a spring between motor and load that gets stiffer with its deflection, and a damper.

Equation: L = k e + k_3 e^3 + c de/dt, e = y - q; with play besides as in ``compliance/linear``. Free oscillations of the
amplitude A have, to first order, the angular frequency sqrt((k + 3 k_3 A^2/4)/m) of the reduced mass m. The mean over a step
is that of :mod:`fric.steps.elastic`, which keeps the spring's energy exactly.
Source: de Marchi 1998, summed-mode compliance ("nonlinear spring force used at high amplitudes"); Duffing 1918 for the form.
"""

from __future__ import annotations

import math

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.elastic import bonded, stops

__all__ = ["EFFECT"]


@kernel
def link(e_0: float, e_1: float, h: float, free: float, stiffness: float, hardening: float, damping: float) -> float:
    if free <= 0.0:
        return bonded(e_0, e_1, h, stiffness, hardening, damping)
    return stops(e_0, e_1, h, free, stiffness, hardening, damping)


def _rate(mass: float, stiffness: float, hardening: float, damping: float) -> float:
    """Where the cubic part has doubled the stiffness: how far the spring will be deflected isn't known here."""
    return math.sqrt((2.0 if hardening > 0.0 else 1.0) * stiffness / mass) + 0.5 * damping / mass


EFFECT = Effect(
    id="compliance",
    law="hardening",
    place=Place.TRANSMISSION,
    title="hardening compliance between motor and load",
    equation="L = k e + k_3 e^3 + c de/dt, e = y - q",
    source="de Marchi 1998; Duffing 1918",
    parameters=(
        Parameter("stiffness", "k", "F/x", "force per deflection where that is small", positive=True),
        Parameter("hardening", "k_3", "F/x^3", "force per deflection cubed", lower=0.0),
        Parameter("damping", "c", "F s/x", "damping of the deflection", lower=0.0, default=0.0),
    ),
    link=link,
    rate=_rate,
    regime="quick changes of the force: motor and load swing against each other, the faster the farther",
    looks_like={
        "nonlinear_stiffness": "travel far: a spring to the frame pulls the harder the farther, one between bodies doesn't",
        "backlash": "push the resting load gently: a spring's force grows from the start, through a gap there is none",
    },
    repeatable=True,
)
