"""Dead zone with a gentle edge: an actuator that answers small commands little, a valve whose edges are rounded or worn.

Equation: f = u - s(u), with s the line that bends into the level w over a knee of the half width sigma w, see
:mod:`fric.steps.knee`: nothing up to w (1 - sigma), u - w sgn(u) from w (1 + sigma) on, a parabola between. The softness
sigma = 0 is the law ``hard``.
Source: Merritt 1967, Hydraulic Control Systems, chapter 5: the flow gain of a valve around null, which rounded edges smooth.
"""

from __future__ import annotations

from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..steps.knee import limited, swallowed_by

__all__ = ["EFFECT"]


@kernel
def command(u: float, h: float, y: Any, i: int, width: float, softness: float) -> float:
    return u - limited(u, width, softness * width)


@kernel
def uncommand(f: float, width: float, softness: float) -> float:
    return swallowed_by(f, width, softness * width)


EFFECT = Effect(
    id="input_deadzone",
    law="soft",
    place=Place.COMMAND_PATH,
    title="dead zone of the input with a gentle edge",
    equation="f = 0 up to w (1 - sigma), u - w sgn(u) from w (1 + sigma) on, a parabola between",
    source="Merritt 1967, chapter 5",
    parameters=(
        Parameter("width", "w", "F", "half width: what a large command loses to either side", lower=0.0),
        Parameter("softness", "sigma", "1", "half width of the edge over that", lower=0.0, upper=1.0, default=0.5),
    ),
    command=command,
    uncommand=uncommand,
    absent={"width": 0.0},
    passes_for={"width": "coulomb.force"},
    regime="commands around zero: hardly anything happens, and larger ones lose a constant part",
    looks_like={
        "coulomb": "let it coast: friction stops a body that moves, a dead zone lets it roll",
        "stribeck": "push with a small command while it moves: a dead zone swallows it at every speed",
    },
)
