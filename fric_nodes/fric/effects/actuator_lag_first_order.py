"""Lag of the actuator: the force follows the command with one time constant (a current loop, a filter on the command).

Equation: T df/dt = u - f. Over a step under a constant command it is solved exactly, and the mean force over the step is
handed on. A run starts without force.
Source: first-order model of a current loop.
"""

from __future__ import annotations

import math
from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.first_order import mean_decay

__all__ = ["EFFECT"]


@kernel
def command(u: float, h: float, y: Any, i: int, time: float) -> float:
    r = h / time
    before = y[i] - u
    y[i] = u + before * math.exp(-r)
    return float(u + before * mean_decay(r))


EFFECT = Effect(
    id="actuator_lag",
    law="first_order",
    usual=True,
    place=Place.COMMAND_PATH,
    title="lag of the actuator",
    equation="T df/dt = u - f",
    source="first-order model of a current loop",
    parameters=(Parameter("time", "T", "s", "time constant of the force", positive=True),),
    command=command,
    n_memory=1,
    absent={"time": 1e-12},
    regime="quick changes of the command, at every speed: the motion answers late and rounded",
    looks_like={
        "delay": "command a step against a stop: a lag begins at once and bends, a delay waits and jumps",
        "frictional_lag": "command a quick change far above the Stribeck velocity: there friction has nothing to follow",
    },
)
