"""Delay of the command: the force is what was commanded a fixed time ago (a bus, a computation).

Equation: f(t) = u(t - T). The mean force over the step is handed on, so that a step longer than the delay, or one that
isn't a part of it, gets the right share of either command. The line (:mod:`fric.steps.delay_line`) is exact for commands
that are held for T/64 at least. A run starts without force.
Source: transport delay.
"""

from __future__ import annotations

from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps import delay_line
from ..steps.delay_line import begin, mean_before, put

__all__ = ["EFFECT"]


@kernel
def command(u: float, h: float, y: Any, i: int, time: float) -> float:
    if y[i + 1] == 0.0:
        begin(y, i, 0.0, time)
    f = mean_before(y, i, u, h, time)
    put(y, i, u, h, time, True)
    return f


EFFECT = Effect(
    id="delay",
    place=Place.COMMAND_PATH,
    title="delay of the command",
    equation="f(t) = u(t - T)",
    source="transport delay",
    parameters=(Parameter("time", "T", "s", "time between command and force", positive=True),),
    command=command,
    n_memory=delay_line.N_STATES,
    absent={"time": 1e-12},
    regime="every change of the command: the motion answers late by the same time",
    looks_like={
        "actuator_lag": "command a step against a stop: a lag begins at once and bends, a delay waits and jumps",
        "frictional_lag": "command a quick change far above the Stribeck velocity: there friction has nothing to follow",
    },
)
