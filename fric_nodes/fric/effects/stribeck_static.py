"""Static friction: a surplus that has to be overcome to break away, and is gone as soon as the contact moves.

Equation: F <= F_S at rest (v = 0), F = F_C sgn(v) in motion: the limit of the Stribeck effect as its velocity goes to
zero. Together with a pre-sliding law, whose contact hardly ever has a velocity of exactly zero, the surplus has no
effect; there a Stribeck effect with a small velocity takes its place.
Source: Coulomb 1785; Szell, section 3 and Fig. 2c (an influence of the external force at rest, which makes friction
discontinuous); Armstrong-Helouvry, Dupont, Canudas de Wit 1994.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, force: float) -> float:
    return base + force if c.velocity == 0.0 else base


EFFECT = Effect(
    id="stribeck",
    law="static",
    place=Place.SLIP_LEVEL,
    title="static friction",
    equation="F <= F_S where v = 0, F = F_C sgn(v) elsewhere",
    source="Coulomb 1785; Szell, section 3 and Fig. 2c; Armstrong-Helouvry, Dupont, Canudas de Wit 1994",
    parameters=(
        Parameter("force", "F_S - F_C", "F", "surplus of static friction over Coulomb friction", lower=0.0, linear=True),
    ),
    level=level,
    regime="break-away: the force it takes to start moving, against the force right after",
    looks_like={
        "coulomb": "ladder of constant velocities: Stribeck friction falls on it, a Coulomb level stays",
        "dwell_time": "repeat break-away after rests of graded length: plain static friction doesn't depend on the rest",
        "presliding": "look at the position before break-away: a stuck contact doesn't move, a pre-sliding one does",
    },
)
