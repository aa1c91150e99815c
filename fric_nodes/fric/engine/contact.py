"""The step of one body with a frictional contact, which every plant shares: sliding, sticking and pre-sliding.

Equation: m dv/dt = u - F(q, v, t) - F_contact, with F the plant's own force and that of the terms.

Derivation of the step. Over a step of length h under constant u the velocity goes from v_0 to v_1; with the mean velocity
w = (v_0 + v_1)/2 (implicit midpoint rule)

    m (v_1 - v_0) / h = u - F(q_0 + w h/2, w) - F_contact(w),     q_1 = q_0 + h w.

The work of every mean force over the step is that force times h w, and m (v_1 - v_0)/h times h w is exactly the change of
m v^2/2, so the energy balance closes to rounding in every step. The equation is scalar in w and is solved by the secant method,
from the velocity before the step and from the velocity that the force there leads to. The line through the last two trials also
gives the friction force and the states that belong to its root, so that the balance closes although the law itself isn't
evaluated once more; trials end when the root moves by less than 1/200 of the velocity's change, where what the line neglects is
far below the error of the midpoint rule. Where friction falls with speed so steeply that there are several roots, or the law
jumps, the lines may lead anywhere; after a dozen trials the root is closed in on by halves instead.

With slip dynamics a step in which the velocity changes its sign is split where it does, since |v| has a kink there.

Sticking is exact. Without slip dynamics the contact force is set-valued at v = 0: a body at rest stays where it is, to the last
bit, while |u - F(q, 0)| does not exceed the slip level. A sliding body whose v_1 would change sign comes to rest within the
step, at h_1 = m v_0 / (F(w) + F_contact(w) - u) with w = v_0/2, since v_1 = 0 makes the midpoint equation explicit in h_1; what
is left of the step starts from rest. No tanh, no velocity threshold, no step that has to go to zero.

Friction that depends on the sign of the acceleration is set-valued a second time: between the force that would speed the body
up and the one that would slow it down, its velocity stays exactly what it is.
Source: set-valued Coulomb friction as in Acary and Brogliato 2008, chapter 1; the closed form for h_1 is derived here.
"""

from __future__ import annotations

import math
from typing import Any

from ..effect import Context
from .assembled import ACCELERATION, RIGID, Inner, Surroundings, bends, force, level, own, slip
from .kernel import kernel

__all__ = ["CONTACT_FUNCTIONS", "contact_step", "glide", "opposing", "slide", "solve"]


@kernel
def opposing(
    p: Any, s: Inner, q: float, w: float, u: float, h: float, side: float, bend: float, around: Surroundings
) -> tuple[float, float]:
    """Force of plant and terms, and the contact's mean friction [F], over ``h`` at the mean velocity ``w`` under ``u``."""
    direction = side
    if not RIGID and w != 0.0:
        direction = 1.0 if w > 0.0 else -1.0
    c = Context(q + 0.5 * w * h, w, direction, around.time + 0.5 * h, around.load, around.temperature, bend, h, s.memory, u)
    friction = side * level(c, p) if RIGID else slip(s.z, s.z_next, w, h, level(c, p), s.constants, p)
    return own(c, p) + force(c, p), friction


@kernel
def solve(
    p: Any, m: float, s: Inner, q: float, v: float, u: float, h: float, side: float, around: Surroundings
) -> tuple[float, float]:
    """Mean velocity over the step and mean friction force, for sliding towards ``side`` throughout.

    The second half of ``z_next`` keeps the states of the trial before. All trials go through one call of :func:`opposing`,
    since all terms are compiled once for each call that there is.
    """
    n = s.z.shape[0]
    half = h * (0.5 / m)
    which = ACCELERATION and bends(p)  # is it still open which way the velocity bends?
    bend = 1.0 if which else 0.0
    first = True
    force_up = 0.0
    w_a = w_b = v
    force_a = friction_a = change = 0.0
    # A root lies between two trials of which the one lacks velocity and the other has too much; none are known yet.
    low = high = v
    below = above = False
    reach = 0.0
    for trial in range(120):
        if not RIGID and not first:
            for j in range(n):
                s.z_next[n + j] = s.z_next[j]
        force_b, friction_b = opposing(p, s, q, w_b, u, h, side, bend, around)
        if first:
            rest = u - force_b - friction_b
            if which and bend > 0.0 and not rest > 0.0:
                bend = -1.0
                force_up = force_b
                continue
            if which and bend < 0.0 and not rest < 0.0:
                return v, u - force_up
            first = False
            w_b = v + half * rest
            change = abs(w_b - v)
            reach = w_b - v
            below, above = rest > 0.0, rest < 0.0
            force_a, friction_a = force_b, friction_b
            continue
        excess = w_b - v - half * (u - force_b - friction_b)
        if excess < 0.0:
            low, below = w_b, True
        elif excess > 0.0:
            high, above = w_b, True
        rise = w_b - w_a + half * (force_b - force_a + friction_b - friction_a)
        share = -excess / rise if rise != 0.0 else 0.0
        move = share * (w_b - w_a)
        if trial < 12 and abs(move) <= 5e-3 * change:
            if not RIGID:
                for j in range(n):
                    s.z_next[j] += share * (s.z_next[j] - s.z_next[n + j])
            return w_b + move, friction_b + share * (friction_b - friction_a)
        w_a, force_a, friction_a = w_b, force_b, friction_b
        if trial < 12:
            w_b += move
        elif below and above:
            if excess == 0.0 or abs(high - low) <= 5e-3 * change:
                break
            w_b = 0.5 * (low + high)
        else:
            reach *= 2.0
            w_b = v + reach
    # Whatever the law is doing there, what accelerates the body is what is left of the force.
    return w_a, u - force_a - (w_a - v) / half


@kernel
def glide(p: Any, m: float, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    """The step with slip dynamics; split, once, where the velocity changes its sign. Uses ``s.z`` up."""
    q, v = x[0], x[1]
    left = h
    part = h
    impulse = 0.0
    for attempt in range(3):
        side = 1.0 if v >= 0.0 else -1.0
        w, friction = solve(p, m, s, q, v, u, part, side, around)
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
        for j in range(s.z.shape[0]):
            s.z[j] = s.z_next[j]
        part = left
    x_next[0] = q
    x_next[1] = v
    return impulse / h


@kernel
def slide(p: Any, m: float, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    """The step of a contact that sticks exactly."""
    q, v = x[0], x[1]
    left = h
    impulse = 0.0
    for _ in range(8):  # stops and starts within one step; more only when the step is far too long
        side = math.copysign(1.0, v)
        push = 0.0
        if v == 0.0:
            c = Context(q, 0.0, 1.0, around.time, around.load, around.temperature, 0.0, left, s.memory, u)
            push = u - own(c, p) - force(c, p)
            side = 1.0 if push > 0.0 else -1.0
            c = Context(q, 0.0, side, around.time, around.load, around.temperature, side, left, s.memory, u)
            if abs(push) <= level(c, p):
                if left == h:
                    x_next[0] = q
                    x_next[1] = 0.0
                    return push
                impulse += push * left
                break
        w, friction = solve(p, m, s, q, v, u, left, side, around)
        v_1 = 2.0 * w - v
        if v_1 * side >= 0.0:
            q += left * w
            v = v_1
            impulse += friction * left
            break
        if v == 0.0:
            # Pushed off and turned back within the step: friction at its limit holds the body.
            impulse += push * left
            break
        w = 0.5 * v
        stop = left
        friction = 0.0
        # The middle of the stop depends on how long it takes, which the trial before tells well enough.
        for _ in range(3):
            c = Context(q + 0.5 * w * stop, w, side, around.time, around.load, around.temperature, -side, stop, s.memory, u)
            friction = side * level(c, p)
            braking = side * (own(c, p) + force(c, p) + friction - u)
            # Not longer than what is left: so it would be only where the step is too long for the law.
            stop = m * abs(v) / braking if braking * left > m * abs(v) else left
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
def contact_step(p: Any, m: float, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    """Lead a body of mass ``m`` from position ``x[0]`` and velocity ``x[1]`` to ``x_next`` under the constant force ``u`` [F].

    Returns the mean friction force of the contact over the step [F].
    """
    if RIGID:
        return slide(p, m, x, x_next, s, u, h, around)
    return glide(p, m, x, x_next, s, u, h, around)


CONTACT_FUNCTIONS = (opposing, solve, glide, slide, contact_step)
"""What a plant lists among its functions, after its ``own`` and before its ``step``."""
