"""Frictional lag of second order: friction that begins gently to follow its steady value, as a film that drains under a mass.

Equation: T^2 d^2g/dt^2 + tau dg/dt + g = g_0, T = tau/(2 zeta), with g_0 the slip level that the other terms give and g the one
that acts. At low frequency it is the lag tau of the law ``first_order``; a damping ratio of 1 is two lags of tau/2 in a row.
Source: squeezing a film out between two faces is an equation of second order where the normal motion has a mass: Hess and Soom
1990; Al-Bender, Lampaert, Swevers 2004, section 10, whose asperity model rises over normal oscillations after a velocity step.

Over a step in which g_0 is taken at its middle the equation is solved exactly. A run starts with g = g_0.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.second_order import decayed

__all__ = ["EFFECT"]

# The memory: whether the run has begun (0 or 1), the level, and its rate.


@kernel
def level(c: Context, base: float, i: int, time: float, damping: float) -> float:
    if c.memory[i] == 0.0:
        return base
    natural = 0.5 * time / damping
    mean, _, _ = decayed(c.memory[i + 1] - base, c.memory[i + 2] * natural, c.step / natural, damping)
    return float(base + mean)


@kernel
def remember(c: Context, base: float, i: int, time: float, damping: float) -> None:
    if c.memory[i] == 0.0:
        c.memory[i] = 1.0
        c.memory[i + 1] = base
        c.memory[i + 2] = 0.0
    else:
        natural = 0.5 * time / damping
        _, after, change = decayed(c.memory[i + 1] - base, c.memory[i + 2] * natural, c.step / natural, damping)
        c.memory[i + 1] = base + after
        c.memory[i + 2] = change / natural


def _rate(mass: float, time: float, damping: float) -> float:
    """What changes within a fraction of the lag is followed exactly; the step only has to resolve the motion."""
    return 0.25 / time


EFFECT = Effect(
    id="frictional_lag",
    law="second_order",
    place=Place.SLIP_LEVEL,
    order=10,
    title="frictional lag of second order",
    equation="T^2 d^2g/dt^2 + tau dg/dt + g = g_0, T = tau/(2 zeta)",
    source="Hess and Soom 1990; Al-Bender, Lampaert, Swevers 2004, section 10",
    parameters=(
        Parameter("time", "tau", "s", "time by which friction stays behind what changes slowly", positive=True),
        Parameter("damping", "zeta", "1", "damping ratio; below 1 friction overshoots", lower=0.3, upper=10.0, default=1.0),
    ),
    level=level,
    remember=remember,
    n_memory=3,
    rate=_rate,
    absent={"time": 1e-12},
    regime="low speed crossed quickly: more force while speeding up than while slowing down",
    looks_like={
        "accel_hysteresis": "cross low speed at graded accelerations: a lag's loop widens with them, the other doesn't change",
        "dwell_time": "repeat break-away after rests of graded length: a lag doesn't make it rise beyond a few time constants",
        "actuator_lag": "look at speeds far above the Stribeck velocity: a lag of the actuator shows there too",
    },
)
