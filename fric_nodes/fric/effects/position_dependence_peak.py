"""Local position dependence with tails: a tight spot whose surplus fades slowly, as where a rail is bent around it.

Equation: g -> g (1 + A (1 + d^2 / (2 m))^(-m)) with d = (q - q_0) / w. With the exponent m = 1 it is a Lorentz curve, and the
larger m is the nearer it is to the bell of the law ``local``, whose width w is at its top.
Source: Pearson 1916, his curve of type VII, the usual one for peaks between the two.
"""

from __future__ import annotations

import math

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, amplitude: float, position: float, width: float, exponent: float) -> float:
    distance = (c.position - position) / width
    return base * (1.0 + amplitude * math.exp(-exponent * math.log1p(0.5 * distance * distance / exponent)))


EFFECT = Effect(
    id="position_dependence",
    law="peak",
    form_of="local",
    place=Place.SLIP_LEVEL,
    order=30,
    title="local change of friction with tails",
    equation="g = g_0 (1 + A (1 + (q - q_0)^2 / (2 m w^2))^(-m))",
    source="Pearson 1916, type VII",
    parameters=(
        Parameter("amplitude", "A", "1", "relative change at its centre", lower=-1.0, default=0.0),
        Parameter("position", "q_0", "x", "where its centre is"),
        Parameter("width", "w", "x", "standard width of the bell that has the same top", positive=True),
        Parameter("exponent", "m", "1", "how fast its tails fade", lower=0.5, upper=20.0, default=1.0),
    ),
    level=level,
    absent={"amplitude": 0.0},
    regime="one place of the travel, in both directions, at every passage",
    looks_like={
        "ripple": "compare the two directions at the place: friction changes its sign, a ripple doesn't",
        "load_dependence": "drive over the place under a constant load: what stays belongs to the place",
    },
    repeatable=True,
)
