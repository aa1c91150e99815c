"""Rigid axis: one body, one contact.

Equation: m dv/dt = u - F(q, v, t) - F_contact, stepped by :mod:`fric.engine.contact`. With backlash or compliance among
the terms the axis becomes two bodies, see :mod:`fric.plants.rigid_driven`.
"""

from __future__ import annotations

from typing import Any

from ..effect import Context
from ..engine.assembled import Inner, Surroundings
from ..engine.contact import CONTACT_FUNCTIONS, contact_step
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..plant import Plant
from .rigid_driven import BEHIND, DRIVEN

__all__ = ["PLANT"]


@kernel
def own(c: Context, p: Any) -> float:
    return -0.0  # what the compiler leaves out of a sum


@kernel
def step(p: Any, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    return contact_step(p, p[0], x, x_next, s, u, h, around)


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    return float(p[0] * a)


def _inertia(mass: float) -> float:
    return mass


PLANT = Plant(
    id="rigid",
    title="rigid axis",
    equation="m dv/dt = u - F(q, v, t) - F_contact",
    source="Newton; implicit midpoint rule with exact stops, derived in fric.engine.contact",
    parameters=(
        Parameter("mass", "m", "F s^2/x", "moving mass, or moment of inertia of a rotary axis", positive=True, linear=True),
    ),
    states=("position", "velocity"),
    functions=(own, *CONTACT_FUNCTIONS, step, drive),
    inertia=_inertia,
    driven=DRIVEN,
    behind=BEHIND,
)
