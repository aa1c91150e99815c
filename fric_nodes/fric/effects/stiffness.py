"""Stiffness: a spring between the moving body and the frame (a cable chain, a flexure, a bellows).

Equation: F = k (q - q_0).
Source: Hooke's law.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def force(c: Context, stiffness: float, position: float) -> float:
    return stiffness * (c.position - position)


def _rate(mass: float, stiffness: float, position: float) -> float:
    """Natural frequency of the body on the spring [1/s]."""
    return math.sqrt(stiffness / mass)


EFFECT = Effect(
    id="stiffness",
    place=Place.FORCE,
    title="spring to the frame",
    equation="F = k (q - q_0)",
    source="Hooke's law",
    parameters=(
        Parameter("stiffness", "k", "F/x", "force per displacement", lower=0.0, linear=True),
        Parameter("position", "q_0", "x", "where the spring is relaxed", default=0.0),
    ),
    force=force,
    rate=_rate,
    regime="everywhere, at rest too: the force depends on where the body is, not on how it moves",
    looks_like={
        "bias": "go through the same motion at two places of the stroke: a bias is the same at both",
        "position_dependence": "compare the two directions: a spring acts alike in both, friction changes its sign",
    },
)
