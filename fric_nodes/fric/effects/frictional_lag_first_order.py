"""Frictional lag: friction follows its steady value with one time constant, as a lubricant film takes time to build up.

Equation: tau dg/dt = g_0 - g, with g_0 the slip level that the other terms give and g the one that acts. While the speed
rises through the falling part of the Stribeck curve, g lies above the curve, while it falls, below: the loop of friction
over velocity grows with the frequency as long as omega tau < 1. In steady sliding g is g_0.
Source: Hess and Soom 1990, whose memory is a pure delay (law ``delay``); Al-Bender, Lampaert, Swevers 2004, section 10, who
find that the lag of their asperity model after a velocity step is nearly one of first order.

Over a step in which g_0 is taken at its middle the equation is solved exactly, so that it is accurate to the second order
in the step and has no limit on it. A run starts with g = g_0.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.first_order import mean_decay

__all__ = ["EFFECT"]

# The memory: whether the run has begun (0 or 1), and the level.


@kernel
def level(c: Context, base: float, i: int, time: float) -> float:
    if c.memory[i] == 0.0:
        return base
    return float(base + (c.memory[i + 1] - base) * mean_decay(c.step / time))


@kernel
def remember(c: Context, base: float, i: int, time: float) -> None:
    if c.memory[i] == 0.0:
        c.memory[i] = 1.0
        c.memory[i + 1] = base
    else:
        c.memory[i + 1] = base + (c.memory[i + 1] - base) * math.exp(-c.step / time)


def _rate(mass: float, time: float) -> float:
    """What changes within a fraction of the time constant is followed exactly; the step only has to resolve the motion."""
    return 0.25 / time


EFFECT = Effect(
    id="frictional_lag",
    law="first_order",
    place=Place.SLIP_LEVEL,
    order=10,
    title="frictional lag",
    equation="tau dg/dt = g_0 - g",
    source="Hess and Soom 1990; Al-Bender, Lampaert, Swevers 2004, section 10",
    parameters=(Parameter("time", "tau", "s", "time constant with which friction follows its steady value", positive=True),),
    level=level,
    remember=remember,
    n_memory=2,
    rate=_rate,
    absent={"time": 1e-12},
    regime="low speed crossed quickly: more force while speeding up than while slowing down",
    looks_like={
        "accel_hysteresis": "cross low speed at graded accelerations: a lag's loop widens with them, the other doesn't change",
        "dwell_time": "repeat break-away after rests of graded length: a lag doesn't make it rise beyond a few time constants",
        "actuator_lag": "look at speeds far above the Stribeck velocity: a lag of the actuator shows there too",
    },
    usual=True,
)
