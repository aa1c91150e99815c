"""Load dependence: friction that grows with the normal load.

Equation: g -> g (1 + c (N/N_0 - 1)): the slip level of all other terms, times its share; c = 1 is Coulomb's law F = mu N,
c = 0 none. The load N/N_0 relative to nominal comes from the plant or from the recording (``normal_load``).
Source: Coulomb 1785; Szell, Eq. 7; Al-Zughaibi 2018, Coulomb friction by the normal force.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, coefficient: float) -> float:
    return base * (1.0 + coefficient * (c.load - 1.0))


EFFECT = Effect(
    id="load_dependence",
    law="scaling",
    place=Place.SLIP_LEVEL,
    order=30,
    title="load-dependent friction",
    equation="g = g_0 (1 + c (N/N_0 - 1))",
    source="Coulomb 1785; Szell, Eq. 7",
    parameters=(
        Parameter("coefficient", "c", "1", "relative change of the level per relative change of the load", default=1.0),
    ),
    level=level,
    absent={"coefficient": 0.0},
    regime="wherever the normal load changes, in both directions of motion",
    looks_like={
        "bias": "change the load and drive in both directions: friction by load changes its sign with the velocity",
        "position_dependence": "repeat the stroke under another load: a dependence on place alone stays as it was",
    },
    usual=True,
)
