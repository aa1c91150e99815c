"""Saturation: an actuator that gives no more than its limit.

Equation: f = max(-L, min(L, u)).
Source: every amplifier's current limit.
"""

from __future__ import annotations

from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def command(u: float, h: float, y: Any, i: int, limit: float) -> float:
    return max(-limit, min(limit, u))


@kernel
def uncommand(f: float, limit: float) -> float:
    # A force beyond the limit can't be had; the limit comes closest.
    return max(-limit, min(limit, f))


EFFECT = Effect(
    id="saturation",
    law="hard",
    usual=True,
    place=Place.COMMAND_PATH,
    title="saturation of the actuator",
    equation="f = max(-L, min(L, u))",
    source="current or pressure limit of an actuator",
    parameters=(Parameter("limit", "L", "F", "largest force of the actuator", positive=True),),
    command=command,
    uncommand=uncommand,
    absent={"limit": 1e300},
    regime="the largest commands: the motion falls short of them",
    looks_like={
        "actuator_lag": "hold the large command: a lag gets there in time, a saturated actuator never does",
        "quadratic_drag": "command the same force at rest against a stop: drag needs speed, saturation doesn't",
    },
)
