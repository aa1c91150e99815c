"""Run-in: friction that changes with running time and settles (grease that spreads, surfaces that wear in).

Equation: g -> g (1 + a (1 - exp(-t/tau))): the slip level of all other terms, times its share at the time t of the run.
Source: exponential settling, the common description of a run-in.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, change: float, time: float) -> float:
    return base * (1.0 - change * math.expm1(-c.time / time))


EFFECT = Effect(
    id="time_drift",
    law="exponential",
    place=Place.SLIP_LEVEL,
    order=30,
    title="run-in of friction",
    equation="g = g_0 (1 + a (1 - exp(-t/tau)))",
    source="exponential settling over the run",
    parameters=(
        Parameter("change", "a", "1", "relative change in the long run", lower=-1.0, default=0.0),
        Parameter("time", "tau", "s", "time constant of the change", positive=True),
    ),
    level=level,
    absent={"change": 0.0},
    regime="the first part of a recording against its later ones, at the same motion",
    looks_like={
        "temperature": "stop for long, let it cool, run again: a run-in doesn't start anew",
        "position_dependence": "repeat the same stroke: a drift goes on, what belongs to the place comes back",
    },
)
