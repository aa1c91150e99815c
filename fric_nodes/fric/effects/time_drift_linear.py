"""Linear drift: friction that changes steadily over a run (wear, loss of lubricant), too slowly to show an end.

Equation: g -> g (1 + r t): the slip level of all other terms, times its share at the time t of the run. The level is kept
from going below zero where the assembled model sums it up.
Source: first-order expansion of any slow change.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, rate: float) -> float:
    return base * (1.0 + rate * c.time)


EFFECT = Effect(
    id="time_drift",
    law="linear",
    place=Place.SLIP_LEVEL,
    order=30,
    title="slow drift of friction",
    equation="g = g_0 (1 + r t)",
    source="first-order expansion of a slow change",
    parameters=(Parameter("rate", "r", "1/s", "relative change per second", default=0.0),),
    level=level,
    absent={"rate": 0.0},
    regime="one part of a recording against another, at the same motion",
    looks_like={
        "temperature": "stop for long and run again: with temperature friction comes back, with wear it doesn't",
        "load_dependence": "repeat the motion under constant load: a drift goes on",
    },
)
