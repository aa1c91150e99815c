"""Hardening stiffness: a spring to the frame that gets stiffer with its deflection; add ``stiffness`` for its linear part.

Equation: F = k_3 (q - q_0)^3. Over a step at constant velocity, which takes the deflection from e - d to e + d, the mean
of the cube is e^3 + e d^2 exactly, so that the spring gives back all the energy it took.
Source: Duffing 1918.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def force(c: Context, stiffness: float, position: float) -> float:
    deflection = c.position - position
    reach = 0.5 * c.velocity * c.step
    return stiffness * deflection * (deflection * deflection + reach * reach)


EFFECT = Effect(
    id="nonlinear_stiffness",
    place=Place.FORCE,
    title="hardening spring to the frame",
    equation="F = k_3 (q - q_0)^3",
    source="Duffing 1918",
    parameters=(
        Parameter("stiffness", "k_3", "F/x^3", "force per displacement cubed", lower=0.0, linear=True),
        Parameter("position", "q_0", "x", "where the spring is relaxed", default=0.0),
    ),
    force=force,
    regime="the ends of the stroke, at rest too: the force grows with the cube of the distance from the middle",
    looks_like={
        "stiffness": "free oscillations of graded amplitude: only a hardening spring makes their frequency rise with it"
    },
)
