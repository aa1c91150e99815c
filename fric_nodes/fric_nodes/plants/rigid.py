"""Rigid axis: one body, one contact.

Equation: m dv/dt = u - F(q, v, t) - F_contact.

Derivation of the step. Over a step of length h under constant u the velocity goes from v_0 to v_1; with the mean velocity
w = (v_0 + v_1)/2 (implicit midpoint rule)

    m (v_1 - v_0) / h = u - F(q_0 + w h/2, w) - F_contact(w),     q_1 = q_0 + h w.

The work of every mean force over the step is that force times h w, and m (v_1 - v_0)/h times h w is exactly the change of
m v^2/2, so the energy balance closes to rounding in every step. The equation is scalar in v_1 and is solved by a safeguarded
secant iteration.

Sticking is exact. Without slip dynamics the contact force is set-valued at v = 0: a body at rest stays where it is, to the last
bit, while |u - F(q, 0)| does not exceed the slip level. A sliding body whose v_1 would change sign comes to rest within the step, at
h_1 = m v_0 / (F(w) + F_contact(w) - u) with w = v_0/2, since v_1 = 0 makes the midpoint equation explicit in h_1; what is left of
the step starts from rest. No tanh, no velocity threshold, no step that has to go to zero.
Source: set-valued Coulomb friction as in Acary and Brogliato 2008, chapter 1; the closed form for h_1 is derived here.
"""

from __future__ import annotations

from typing import Any

from ..assembled import RIGID, force, level, slip
from ..effect import Context
from ..kernel import kernel
from ..parameter import Parameter
from ..plant import Plant

__all__ = ["PLANT"]

@kernel
def residual(
    p: Any, z: Any, z_next: Any,
    q: float, v_0: float, v_1: float, u: float, h: float, s: float, t: float, load: float, temperature: float,
) -> tuple[float, float]:  # fmt: skip
    """Residual of the midpoint equation [F] and the contact's mean friction force [F] for a trial ``v_1``."""
    w = 0.5 * (v_0 + v_1)
    direction = s
    if not RIGID and w != 0.0:
        direction = 1.0 if w > 0.0 else -1.0
    c = Context(q + 0.5 * w * h, w, direction, t, load, temperature)
    friction = s * level(c, p) if RIGID else slip(z, z_next, w, h, level(c, p), p)
    return p[0] * (v_1 - v_0) / h - u + force(c, p) + friction, friction


@kernel
def solve(
    p: Any, z: Any, z_next: Any,
    q: float, v_0: float, u: float, h: float, s: float, t: float, load: float, temperature: float,
) -> tuple[float, float]:  # fmt: skip
    """Velocity after the step and mean friction force, for sliding in direction ``s`` throughout."""
    a = v_0
    r_a, friction = residual(p, z, z_next, q, v_0, a, u, h, s, t, load, temperature)
    b = a - r_a * h / p[0]
    scale = abs(u) + p[0] * (abs(v_0) + abs(b)) / h
    for _ in range(60):
        r_b, friction = residual(p, z, z_next, q, v_0, b, u, h, s, t, load, temperature)
        if abs(r_b) <= 1e-13 * scale or r_b == r_a:
            break
        step = -r_b * (b - a) / (r_b - r_a)
        a, r_a = b, r_b
        if a + step == a:
            break
        b = a + step
    return b, friction


@kernel
def step(
    p: Any, x: Any, x_next: Any, z: Any, z_next: Any,
    u: float, h: float, t: float, load: float, temperature: float,
) -> float:  # fmt: skip
    q, v = x[0], x[1]
    if not RIGID:
        s = 1.0 if v >= 0.0 else -1.0
        v_1, friction = solve(p, z, z_next, q, v, u, h, s, t, load, temperature)
        x_next[0] = q + 0.5 * h * (v + v_1)
        x_next[1] = v_1
        return friction
    left = h
    impulse = 0.0
    push = 0.0
    for _ in range(8):  # stops and starts within one step; more only when the step is far too long
        if v == 0.0:
            rest = Context(q, 0.0, 1.0, t, load, temperature)
            push = u - force(rest, p)
            s = 1.0 if push > 0.0 else -1.0
            if abs(push) <= level(Context(q, 0.0, s, t, load, temperature), p):
                impulse += push * left
                break
        else:
            s = 1.0 if v > 0.0 else -1.0
        v_1, friction = solve(p, z, z_next, q, v, u, left, s, t, load, temperature)
        if v_1 * s >= 0.0:
            q += 0.5 * left * (v + v_1)
            v = v_1
            impulse += friction * left
            break
        if v == 0.0:
            # Pushed off and turned back within the step: friction at its limit holds the body.
            impulse += push * left
            break
        w = 0.5 * v
        c = Context(q, w, s, t, load, temperature)
        friction = s * level(c, p)
        stop = p[0] * v / (force(c, p) + friction - u)
        stop = min(max(stop, 0.0), left)
        q += 0.5 * stop * v
        impulse += friction * stop
        v = 0.0
        left -= stop
        if left <= 0.0:
            break
    x_next[0] = q
    x_next[1] = v
    return impulse / h


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    """Force that moves the body against nothing but its inertia [F]."""
    return p[0] * a


def _inertia(mass: float) -> float:
    return mass


PLANT = Plant(
    id="rigid",
    title="rigid axis",
    equation="m dv/dt = u - F(q, v, t) - F_contact",
    source="Newton; implicit midpoint rule with exact stops, derived in the module",
    parameters=(Parameter("mass", "m", "F s^2/x", "moving mass, or moment of inertia of a rotary axis", positive=True, linear=True),),
    states=("position", "velocity"),
    functions=(residual, solve, step, drive),
    inertia=_inertia,
)
