"""Lag of second order of the actuator: a closed current or valve loop, two filters in a row, a command that rings.

Equation: T^2 d^2f/dt^2 + 2 zeta T df/dt + f = u. A damping ratio of 1 is two lags of T in a row, less of it overshoots. With
e = f - u and g = T de/dt, over a step of the length r T under a constant command,

    e(r) = e(0) (C + zeta S) + g(0) S,    g(r) = g(0) (C - zeta S) - e(0) S,

where C and S are exp(-zeta r) times cosh(r s) and sinh(r s)/s with s^2 = zeta^2 - 1, or cos and sin where that is negative.
The mean of e follows from the equation itself, (g(0) - g(r) + 2 zeta (e(0) - e(r)))/r; over short steps, where these
differences have no digits left, from its Taylor series. A run starts without force.
Source: second-order model of servo valves and current loops, standard in control engineering.
"""

from __future__ import annotations

import math
from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.first_order import mean_decay

__all__ = ["EFFECT"]

_SHORT = 0.3  # of the step times the fastest rate: the Taylor series is exact to the last digit
_TERMS = 13


@kernel
def _mean(e: float, g: float, r: float, damping: float) -> float:
    """Mean of e over a short step, from its derivatives at the begin: each follows from the two before."""
    before, at = e, g
    total, factor = e, 1.0
    for n in range(1, _TERMS):
        factor *= r / (n + 1.0)
        total += at * factor
        before, at = at, -2.0 * damping * at - before
    return total


@kernel
def command(u: float, h: float, y: Any, i: int, time: float, damping: float) -> float:
    r = h / time
    e, g = y[i] - u, y[i + 1] * time
    d = damping * damping - 1.0
    if d < 0.0:
        w = math.sqrt(-d)
        decay = math.exp(-damping * r)
        c, s = decay * math.cos(w * r), decay * math.sin(w * r) / w
    else:
        w = math.sqrt(d)
        slow = math.exp(-r / (damping + w))
        s = slow * r * mean_decay(2.0 * w * r)
        c = slow - w * s
    after, change = e * (c + damping * s) + g * s, g * (c - damping * s) - e * s
    y[i], y[i + 1] = u + after, change / time
    if r * (1.0 + 2.0 * damping) < _SHORT:
        return float(u + _mean(e, g, r, damping))
    return float(u + (g - change + 2.0 * damping * (e - after)) / r)


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
