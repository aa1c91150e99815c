"""Saturation with a knee: an actuator that gives less and less of what it is told before it gives no more.

Equation: f = s(u), which is u up to L (1 - sigma), L from L (1 + sigma) on, and a parabola between, see
:mod:`fric.steps.knee`. The softness sigma = 0 is the law ``hard``.
Source: magnetic saturation of a motor's iron, the knee of a servo valve's flow, a limiter with headroom: the usual way to
join two straight lines without a corner.
"""

from __future__ import annotations

from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.knee import limited, limited_by

__all__ = ["EFFECT"]


@kernel
def command(u: float, h: float, y: Any, i: int, limit: float, softness: float) -> float:
    return limited(u, limit, softness * limit)


@kernel
def uncommand(f: float, limit: float, softness: float) -> float:
    return limited_by(f, limit, softness * limit)


EFFECT = Effect(
    id="saturation",
    law="soft",
    place=Place.COMMAND_PATH,
    title="saturation of the actuator with a knee",
    equation="f = u up to L (1 - sigma), L from L (1 + sigma) on, a parabola between",
    source="magnetic saturation; the knee of a valve's flow",
    parameters=(
        Parameter("limit", "L", "F", "largest force of the actuator", positive=True),
        Parameter("softness", "sigma", "1", "half width of the knee over the limit", lower=0.0, upper=1.0, default=0.3),
    ),
    command=command,
    uncommand=uncommand,
    absent={"limit": 1e300},
    regime="large commands: the motion falls the shorter of them the larger they are",
    looks_like={
        "actuator_lag": "hold the large command: a lag gets there in time, a saturated actuator never does",
        "quadratic_drag": "command the same force at rest against a stop: drag needs speed, saturation doesn't",
    },
)
