"""Coulomb friction in proportion to the normal load, beside other friction that doesn't depend on it.

Equation: F = F_N (N/N_0) sgn(v), with F_N = mu N_0 the friction at the nominal normal load N_0. It adds to the slip level,
where the other law of this effect scales the whole of it: a lubricated bearing has a part that follows the load (the Coulomb
part) and one that doesn't (the transition from stiction).
Source: Amontons, Coulomb; Al-Zughaibi 2018, Eqs. 20 and 34, with |F_nb| sgn(v), see
:mod:`fric.friction.lubricated_bearing`.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, force: float) -> float:
    return base + force * c.load


EFFECT = Effect(
    id="load_dependence",
    law="proportional",
    place=Place.SLIP_LEVEL,
    title="Coulomb friction in proportion to the normal load",
    equation="F = F_N (N/N_0) sgn(v), F_N = mu N_0",
    source="Amontons; Al-Zughaibi 2018, Eqs. 20, 34",
    parameters=(Parameter("force", "F_N", "F", "friction level at the nominal normal load, mu N_0", lower=0.0, linear=True),),
    level=level,
    regime="while the normal load changes: the friction level follows it in proportion",
    looks_like={
        "coulomb": "slide at one speed under several normal loads: only this part of the level follows the load",
        "position_dependence": "repeat the same path under another load: a dependence on position keeps its place",
    },
)
