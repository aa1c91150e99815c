"""Rigid axis: one body, one contact.

Equation: m dv/dt = u - F(q, v, t) - F_contact.

Derivation of the step. Over a step of length h under constant u the velocity goes from v_0 to v_1; with the mean velocity
w = (v_0 + v_1)/2 (implicit midpoint rule)

    m (v_1 - v_0) / h = u - F(q_0 + w h/2, w) - F_contact(w),     q_1 = q_0 + h w.

The work of every mean force over the step is that force times h w, and m (v_1 - v_0)/h times h w is exactly the change of
m v^2/2, so the energy balance closes to rounding in every step. The equation is scalar in w and is solved by the secant method,
from the velocity before the step and from the velocity that the force there leads to. The line through the last two trials also
gives the friction force and the states that belong to its root, so that the balance closes although the law itself isn't
evaluated once more; trials end when the root moves by less than 1/200 of the velocity's change, where what the line neglects is
far below the error of the midpoint rule.

With slip dynamics a step in which the velocity changes its sign is split where it does, since |v| has a kink there.

Sticking is exact. Without slip dynamics the contact force is set-valued at v = 0: a body at rest stays where it is, to the last
bit, while |u - F(q, 0)| does not exceed the slip level. A sliding body whose v_1 would change sign comes to rest within the
step, at h_1 = m v_0 / (F(w) + F_contact(w) - u) with w = v_0/2, since v_1 = 0 makes the midpoint equation explicit in h_1; what
is left of the step starts from rest. No tanh, no velocity threshold, no step that has to go to zero.
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
def opposing(
    p: Any, z: Any, z_next: Any,
    q: float, w: float, h: float, s: float, t: float, load: float, temperature: float,
) -> tuple[float, float]:  # fmt: skip
    """Force of the terms and mean friction force of the contact [F] over ``h`` at the mean velocity ``w``."""
    direction = s
    if not RIGID and w != 0.0:
        direction = 1.0 if w > 0.0 else -1.0
    c = Context(q + 0.5 * w * h, w, direction, t, load, temperature)
    friction = s * level(c, p) if RIGID else slip(z, z_next, w, h, level(c, p), p)
    return force(c, p), friction


@kernel
def solve(
    p: Any, z: Any, z_next: Any,
    q: float, v: float, u: float, h: float, s: float, t: float, load: float, temperature: float,
) -> tuple[float, float]:  # fmt: skip
    """Mean velocity over the step and mean friction force, for sliding in direction ``s`` throughout.

    The second half of ``z_next`` keeps the states of the trial before.
    """
    n = z.shape[0]
    half = h * (0.5 / p[0])
    w_a = v
    force_a, friction_a = opposing(p, z, z_next, q, w_a, h, s, t, load, temperature)
    w_b = v + half * (u - force_a - friction_a)
    change = abs(w_b - v)
    for _ in range(50):
        if not RIGID:
            for j in range(n):
                z_next[n + j] = z_next[j]
        force_b, friction_b = opposing(p, z, z_next, q, w_b, h, s, t, load, temperature)
        excess = w_b - v - half * (u - force_b - friction_b)
        rise = w_b - w_a + half * (force_b - force_a + friction_b - friction_a)
        share = -excess / rise if rise != 0.0 else 0.0
        move = share * (w_b - w_a)
        if abs(move) <= 5e-3 * change:
            if not RIGID:
                for j in range(n):
                    z_next[j] += share * (z_next[j] - z_next[n + j])
            return w_b + move, friction_b + share * (friction_b - friction_a)
        w_a, force_a, friction_a = w_b, force_b, friction_b
        w_b += move
    return w_a, friction_a


@kernel
def glide(
    p: Any, x: Any, x_next: Any, z: Any, z_next: Any,
    u: float, h: float, t: float, load: float, temperature: float,
) -> float:  # fmt: skip
    """The step with slip dynamics; split, once, where the velocity changes its sign. Uses ``z`` up."""
    q, v = x[0], x[1]
    left = h
    part = h
    impulse = 0.0
    for attempt in range(3):
        s = 1.0 if v >= 0.0 else -1.0
        w, friction = solve(p, z, z_next, q, v, u, part, s, t, load, temperature)
        v_1 = 2.0 * w - v
        if attempt == 0 and v * v_1 < 0.0:
            part = h * v / (v - v_1)
            continue
        q += part * w
        v = v_1
        impulse += part * friction
        left -= part
        if left <= 0.0:
            break
        for j in range(z.shape[0]):
            z[j] = z_next[j]
        part = left
    x_next[0] = q
    x_next[1] = v
    return impulse / h


@kernel
def slide(
    p: Any, x: Any, x_next: Any, z: Any, z_next: Any,
    u: float, h: float, t: float, load: float, temperature: float,
) -> float:  # fmt: skip
    """The step of a contact that sticks exactly."""
    q, v = x[0], x[1]
    left = h
    impulse = 0.0
    for _ in range(8):  # stops and starts within one step; more only when the step is far too long
        s = 1.0 if v > 0.0 else -1.0
        push = 0.0
        if v == 0.0:
            push = u - force(Context(q, 0.0, 1.0, t, load, temperature), p)
            s = 1.0 if push > 0.0 else -1.0
            if abs(push) <= level(Context(q, 0.0, s, t, load, temperature), p):
                if left == h:
                    x_next[0] = q
                    x_next[1] = 0.0
                    return push
                impulse += push * left
                break
        w, friction = solve(p, z, z_next, q, v, u, left, s, t, load, temperature)
        v_1 = 2.0 * w - v
        if v_1 * s >= 0.0:
            q += left * w
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
        braking = s * (force(c, p) + friction - u)
        # Not longer than what is left: so it would be only where the step is too long for the law.
        stop = p[0] * abs(v) / braking if braking * left > p[0] * abs(v) else left
        q += w * stop
        impulse += friction * stop
        v = 0.0
        left -= stop
        if left <= 0.0:
            break
    x_next[0] = q
    x_next[1] = v
    return impulse / h


@kernel
def step(
    p: Any, x: Any, x_next: Any, z: Any, z_next: Any,
    u: float, h: float, t: float, load: float, temperature: float,
) -> float:  # fmt: skip
    if RIGID:
        return slide(p, x, x_next, z, z_next, u, h, t, load, temperature)
    return glide(p, x, x_next, z, z_next, u, h, t, load, temperature)


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    """Force that moves the body against nothing but its inertia [F]."""
    return float(p[0] * a)


def _inertia(mass: float) -> float:
    return mass


PLANT = Plant(
    id="rigid",
    title="rigid axis",
    equation="m dv/dt = u - F(q, v, t) - F_contact",
    source="Newton; implicit midpoint rule with exact stops, derived in the module",
    parameters=(
        Parameter("mass", "m", "F s^2/x", "moving mass, or moment of inertia of a rotary axis", positive=True, linear=True),
    ),
    states=("position", "velocity"),
    functions=(opposing, solve, glide, slide, step, drive),
    inertia=_inertia,
)
