"""Load dependence by a power: contacts whose area doesn't grow in proportion to the load.

Equation: g -> g (N/N_0)^n: the slip level of all other terms, times the power of their normal load; n = 1 is Coulomb's law
F = mu N, n = 0 no dependence. A load that pulls is none.
Source: Hertz 1881, by which the area of a smooth round contact grows with the power 2/3 of the load; Bowden and Tabor 1950.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, exponent: float) -> float:
    return float(base * max(c.load, 0.0) ** exponent)


EFFECT = Effect(
    id="load_dependence",
    law="power",
    place=Place.SLIP_LEVEL,
    order=30,
    title="friction by a power of the load",
    equation="g = g_0 (N/N_0)^n",
    source="Hertz 1881; Bowden and Tabor 1950",
    parameters=(Parameter("exponent", "n", "1", "power of the load", lower=0.0, upper=3.0, default=1.0),),
    level=level,
    absent={"exponent": 0.0},
    regime="wherever the normal load changes, in both directions of motion",
    looks_like={
        "bias": "change the load and drive in both directions: friction by load changes its sign with the velocity",
        "position_dependence": "repeat the stroke under another load: a dependence on place alone stays as it was",
    },
)
