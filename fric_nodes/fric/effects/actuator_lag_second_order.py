"""Lag of second order of the actuator: a closed current or valve loop, two filters in a row, a command that rings.

Equation: T^2 d^2f/dt^2 + 2 zeta T df/dt + f = u. A damping ratio of 1 is two lags of T in a row, less of it overshoots. Over a
step under a constant command it is solved exactly (:mod:`fric.steps.second_order`), and the mean force over the step is
handed on. A run starts without force.
Source: second-order model of servo valves and current loops, standard in control engineering.
"""

from __future__ import annotations

from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.second_order import decayed

__all__ = ["EFFECT"]


@kernel
def command(u: float, h: float, y: Any, i: int, time: float, damping: float) -> float:
    mean, after, change = decayed(y[i] - u, y[i + 1] * time, h / time, damping)
    y[i], y[i + 1] = u + after, change / time
    return float(u + mean)


EFFECT = Effect(
    id="actuator_lag",
    law="second_order",
    place=Place.COMMAND_PATH,
    title="lag of second order of the actuator",
    equation="T^2 d^2f/dt^2 + 2 zeta T df/dt + f = u",
    source="second-order model of servo valves and current loops",
    parameters=(
        Parameter("time", "T", "s", "inverse of the natural angular frequency", positive=True),
        Parameter("damping", "zeta", "1", "damping ratio; below 1 the force overshoots", lower=0.1, upper=10.0, default=1.0),
    ),
    command=command,
    n_memory=2,
    absent={"time": 1e-12},
    regime="quick changes of the command, at every speed: the motion answers late, with a gentle beginning",
    looks_like={
        "delay": "command a step against a stop: a lag of second order begins gently, a delay waits and jumps",
        "compliance": "hold the load fast and command a step: a lag is there all the same, a shaft's mode goes with the load",
    },
)
