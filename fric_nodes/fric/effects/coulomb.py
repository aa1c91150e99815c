"""Coulomb friction: a constant level, against the direction of motion.

Equation: F = F_C sgn(v); at rest anything up to F_C, exactly as much as it takes to stay.
Source: C. A. Coulomb, 1785; Szell, Eq. 6.
"""

from __future__ import annotations

from ..effect import Context, Effect, Place
from ..engine.kernel import kernel
from ..parameter import Parameter

__all__ = ["EFFECT"]


@kernel
def level(c: Context, base: float, force: float) -> float:
    return base + force


EFFECT = Effect(
    id="coulomb",
    place=Place.SLIP_LEVEL,
    title="Coulomb friction",
    equation="F = F_C sgn(v)",
    source="Coulomb 1785; Szell, Eq. 6",
    parameters=(Parameter("force", "F_C", "F", "friction level while sliding", lower=0.0, linear=True),),
    level=level,
    regime="every reversal: a step of twice the level as the sign of the velocity changes",
    looks_like={"bias": "drive in both directions: Coulomb friction changes sign with the velocity, a bias does not"},
)
