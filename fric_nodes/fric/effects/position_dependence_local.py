"""Local position dependence: a tight or worn spot, as a bell over the place.

Equation: g -> g (1 + A exp(-(q - q_0)^2 / (2 w^2))): the slip level of all other terms, times the bell.
Source: a Gaussian bump, the common description of a local change with an amplitude, a place and a width.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]

_FAR = 80.0  # exp(-80) = 2e-35


@kernel
def level(c: Context, base: float, amplitude: float, position: float, width: float) -> float:
    distance = (c.position - position) / width
    fall = 0.5 * distance * distance
    # An exponential that underflows takes ten times as long as any other.
    if fall > _FAR:
        return base
    return base * (1.0 + amplitude * math.exp(-fall))


EFFECT = Effect(
    id="position_dependence",
    law="local",
    place=Place.SLIP_LEVEL,
    order=30,
    title="local change of friction",
    equation="g = g_0 (1 + A exp(-(q - q_0)^2 / (2 w^2)))",
    source="Gaussian bump in the slip level",
    parameters=(
        Parameter("amplitude", "A", "1", "relative change at its centre", lower=-1.0, default=0.0),
        Parameter("position", "q_0", "x", "where its centre is"),
        Parameter("width", "w", "x", "standard width of the bell", positive=True),
    ),
    level=level,
    absent={"amplitude": 0.0},
    regime="one place of the travel, in both directions, at every passage",
    looks_like={
        "ripple": "compare the two directions at the place: friction changes its sign, a ripple doesn't",
        "load_dependence": "drive over the place under a constant load: what stays belongs to the place",
    },
    repeatable=True,
)
