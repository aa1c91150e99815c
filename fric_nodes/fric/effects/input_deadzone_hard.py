"""Dead zone of the input: an actuator that doesn't answer small commands (overlap of a valve, a drive's threshold).

Equation: f = u - w sgn(u) where |u| > w, else 0.
Source: Szell, section 4.1 (overlap of the valve's sections); Tao and Kokotovic 1996, chapter 2.
"""

from __future__ import annotations

from typing import Any

from ..effect import Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def command(u: float, h: float, y: Any, i: int, width: float) -> float:
    return max(u - width, 0.0) + min(u + width, 0.0)


@kernel
def uncommand(f: float, width: float) -> float:
    return f + width if f > 0.0 else (f - width if f < 0.0 else 0.0)


EFFECT = Effect(
    id="input_deadzone",
    law="hard",
    usual=True,
    place=Place.COMMAND_PATH,
    title="dead zone of the input",
    equation="f = u - w sgn(u) where |u| > w, else 0",
    source="Szell, section 4.1; Tao and Kokotovic 1996, chapter 2",
    parameters=(Parameter("width", "w", "F", "half width: what a command loses to either side", lower=0.0),),
    command=command,
    uncommand=uncommand,
    absent={"width": 0.0},
    passes_for={"width": "coulomb.force"},
    regime="commands around zero: nothing happens, and larger ones lose a constant part",
    looks_like={
        "coulomb": "let it coast: friction stops a body that moves, a dead zone lets it roll",
        "stribeck": "push with a small command while it moves: a dead zone swallows it at every speed",
    },
)
