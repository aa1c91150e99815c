"""A rigid axis whose mass is given in two parts."""

from __future__ import annotations

from typing import Any

from fric.effect import Context
from fric.engine.assembled import Inner, Surroundings
from fric.engine.contact import CONTACT_FUNCTIONS, contact_step
from fric.engine.kernel import kernel
from fric.parameter import Parameter
from fric.plant import Plant


@kernel
def own(c: Context, p: Any) -> float:
    return -0.0


@kernel
def step(p: Any, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    return contact_step(p, p[0] + p[1], x, x_next, s, u, h, around)


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    return float((p[0] + p[1]) * a)


PLANT = Plant(
    id="loaded_table",
    title="table with a load on it",
    equation="(m_1 + m_2) dv/dt = u - F(q, v, t) - F_contact",
    source="this test",
    parameters=(
        Parameter("table", "m_1", "F s^2/x", "mass of the table", positive=True, linear=True),
        Parameter("load", "m_2", "F s^2/x", "mass on it", lower=0.0, default=0.0, linear=True),
    ),
    states=("position", "velocity"),
    functions=(own, *CONTACT_FUNCTIONS, step, drive),
    inertia=lambda table, load: table + load,
)
