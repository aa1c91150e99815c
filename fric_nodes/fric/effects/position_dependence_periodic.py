"""Periodic position dependence: friction that repeats along the travel (an eccentric screw, balls in their track).

Equation: g -> g (1 + A cos(2 pi q / L) + B sin(2 pi q / L)): the slip level of all other terms, times the wave. The level
is kept from going below zero where the assembled model sums it up.
Source: Fourier series of the friction level over the travel; one term per harmonic.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, cosine: float, sine: float, period: float) -> float:
    phase = 2.0 * math.pi / period * c.position
    return base * (1.0 + cosine * math.cos(phase) + sine * math.sin(phase))


EFFECT = Effect(
    id="position_dependence",
    law="periodic",
    place=Place.SLIP_LEVEL,
    order=30,
    title="periodic change of friction",
    equation="g = g_0 (1 + A cos(2 pi q / L) + B sin(2 pi q / L))",
    source="Fourier series of the friction level, one harmonic per term",
    parameters=(
        Parameter("cosine", "A", "1", "relative amplitude of the cosine over position", lower=-1.0, upper=1.0, default=0.0),
        Parameter("sine", "B", "1", "relative amplitude of the sine over position", lower=-1.0, upper=1.0, default=0.0),
        Parameter("period", "L", "x", "distance after which friction repeats", positive=True),
    ),
    level=level,
    absent={"cosine": 0.0, "sine": 0.0},
    regime="the whole travel, in both directions: friction repeats with the place",
    looks_like={
        "ripple": "compare the two directions at one place: friction changes its sign, a ripple doesn't",
        "time_drift": "change the speed: what belongs to the place keeps its period in position, not in time",
    },
    repeatable=True,
)
