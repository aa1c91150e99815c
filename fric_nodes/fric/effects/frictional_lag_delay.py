"""Frictional memory: friction is that of the steady curve a fixed time ago.

Equation: g(t) = g_0(t - tau_L), with g_0 the slip level that the other terms give and g the one that acts. While the
speed rises through the falling part of the Stribeck curve, g lies above the curve, while it falls, below: the loop of
friction over velocity grows with the frequency as sin(omega tau_L). In steady sliding g is g_0.
Source: Hess and Soom 1990; quoted by Al-Bender, Lampaert, Swevers 2004, section 11.

The past is kept in a line of a fixed number of cells (:mod:`fric.steps.delay_line`) and read between them linearly. A run
starts as if the contact had always been as it is in its first step.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps import delay_line
from ..steps.delay_line import put, value_before

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, i: int, time: float) -> float:
    if c.memory[i + 1] == 0.0:
        return base
    return value_before(c.memory, i, base, c.step, time)


@kernel
def remember(c: Context, base: float, i: int, time: float) -> None:
    put(c.memory, i, base, c.step, time, False)


def _rate(mass: float, time: float) -> float:
    """The step only has to resolve the motion during the delay."""
    return 0.25 / time


EFFECT = Effect(
    id="frictional_lag",
    law="delay",
    place=Place.SLIP_LEVEL,
    order=10,
    title="frictional memory",
    equation="g(t) = g_0(t - tau_L)",
    source="Hess and Soom 1990; Al-Bender, Lampaert, Swevers 2004, section 11",
    parameters=(Parameter("time", "tau_L", "s", "time by which friction stays behind its steady value", positive=True),),
    level=level,
    remember=remember,
    n_memory=delay_line.N_STATES,
    rate=_rate,
    absent={"time": 1e-12},
    regime="low speed crossed quickly: more force while speeding up than while slowing down",
    looks_like={
        "accel_hysteresis": "cross low speed at graded accelerations: a lag's loop widens with them, the other doesn't change",
        "dwell_time": "repeat break-away after rests of graded length: a memory doesn't make it rise beyond its own length",
        "delay": "look at speeds far above the Stribeck velocity: a delay of the command shows there too",
    },
)
