"""The step of two bodies, motor and load, with a transmission between them: elastic, with play, or rigid.

Equations, with q the load's position (the body at the contact), y the motor's, e = y - q and L the transmission's force:

    m_m d^2y/dt^2 = u - L - c_m dy/dt - F_m sgn(dy/dt),
    m_l d^2q/dt^2 = L - F(q, dq/dt, t) - F_contact.

Elastic transmission. L is constant over the step, its mean. Either body is led under it exactly as it would be alone, the load
with all its terms and its exact sticking (:mod:`fric.engine.contact`), the motor in closed form. L is found such that it
is the mean force that the link gives for the deflections e_0 and e_1 that it leads to:

    L = link(e_0, e_1(L), h).

The more it pulls, the less the motor gets ahead, so e_1 falls with L, and L - link(...) rises with a slope of 1 at least:
there is one root, and it lies between any trial and that trial less its excess. As e_1 is nearly a straight line over L, the
link is solved along that line, and the line is drawn anew through what the bodies did: two trials where no friction lets go or
holds. As one force leads both bodies, no momentum is lost but to rounding, and as its work on both is L (e_1 - e_0), the energy
of an undamped link is kept as well as the root is found, whatever the step and whatever sticks or stops.

Rigid transmission: no term of the model gives a force. Within the play both bodies move for themselves. Where they meet they
go on with their common velocity (m_m dy/dt + m_l dq/dt)/(m_m + m_l), a fully plastic impact at the time within the step at
which they meet; from there on they are one body as long as they would get into each other otherwise. Without play they are
one body always.

With slip dynamics a step in which the load's velocity changes its sign is not split there, as it is for a body alone.
Source: Tao and Kokotovic 1994 as read by de Marchi 1998 (plastic impact, conserved momentum) for the rigid one; the
coupled step is derived here.
"""

from __future__ import annotations

import math
from typing import Any

from ..effect import Context
from .assembled import ELASTIC, RIGID, Inner, Surroundings, link, play
from .contact import CONTACT_FUNCTIONS, contact_step, opposing, slide, solve
from .kernel import kernel

__all__ = ["TRANSMISSION_FUNCTIONS", "driven_step"]


@kernel
def own(c: Context, p: Any) -> float:
    """The motor's viscous friction while both are one body; :func:`driven_step` has put it behind the model's values."""
    return float(p[-1] * c.velocity)


@kernel
def motor_step(m: float, dry: float, viscous: float, v: float, f: float, h: float) -> tuple[float, float]:
    """Mean velocity over ``h`` [s] and velocity at its end of the motor under the constant force ``f`` [F]."""
    way = 0.0
    left = h
    if v == 0.0:
        if abs(f) <= dry:
            return 0.0, 0.0
        side = 1.0 if f > 0.0 else -1.0
    else:
        side = 1.0 if v > 0.0 else -1.0
    half = 0.5 * left / m
    w = (v + half * (f - side * dry)) / (1.0 + half * viscous)
    v_1 = 2.0 * w - v
    if dry > 0.0 and v_1 * side < 0.0:
        # It comes to rest within the step, and what is left of it starts from rest.
        stop = m * abs(v) / (dry + 0.5 * viscous * abs(v) - side * f)
        stop = min(stop, h)
        way = 0.5 * v * stop
        left = h - stop
        w = 0.0
        if abs(f) > dry:
            half = 0.5 * left / m
            w = half * (f - math.copysign(dry, f)) / (1.0 + half * viscous)
        v_1 = 2.0 * w
    return (way + left * w) / h, v_1


@kernel
def load_step(p: Any, m: float, x: Any, x_next: Any, s: Inner, f: float, h: float, around: Surroundings) -> float:
    """The load under the constant force ``f`` [F]; as ``contact_step``, but it leaves ``s.z`` as it is, for another trial."""
    if RIGID:
        return slide(p, m, x, x_next, s, f, h, around)
    v = x[1]
    w, friction = solve(p, m, s, x[0], v, f, h, 1.0 if v >= 0.0 else -1.0, around)
    x_next[0] = x[0] + h * w
    x_next[1] = 2.0 * w - v
    return friction


@kernel
def elastic_trial(
    p: Any, motor: Any, m_l: float, x: Any, x_next: Any, s: Inner, u: float, f: float, h: float, around: Surroundings
) -> tuple[float, float]:
    """How much the force ``f`` exceeds what the link gives for the motion that it leads to, and the contact's friction [F].

    ``motor`` is its mass, dry and viscous friction. All of ``x_next`` is written.
    """
    friction = load_step(p, m_l, x, x_next, s, f, h, around)
    w, v = motor_step(motor[0], motor[1], motor[2], x[3], u - f, h)
    x_next[2] = x[2] + h * w
    x_next[3] = v
    return f - link(x[2] - x[0], x_next[2] - x_next[0], h, p), friction


@kernel
def linked(p: Any, e: float, at: float, slope: float, near: float, enough: float, h: float) -> float:
    """The link's mean force [F] if it leads the deflection from ``e`` to ``at + slope force`` [x]; ``slope`` <= 0 [x/F].

    The search begins ``near`` it [F]; the result may be wrong by ``enough`` [F]. It lies between no force and that of the
    deflection which no force leads to, and between any trial and that trial less its excess.
    """
    free = link(e, at, h, p)
    low, high = min(free, 0.0), max(free, 0.0)
    a = min(max(near, low), high)
    excess_a = a - link(e, at + slope * a, h, p)
    if not abs(excess_a) > enough:
        return a
    b = min(max(a - excess_a, low), high)
    excess_b = b - link(e, at + slope * b, h, p)
    halve = False
    for _ in range(100):
        width = abs(b - a)
        if not abs(excess_b) > enough or width <= enough:
            break  # also at once where it is no number
        f = 0.5 * (a + b) if halve else b - excess_b * (b - a) / (excess_b - excess_a)
        excess = f - link(e, at + slope * f, h, p)
        if excess * excess_b < 0.0:
            a, excess_a = b, excess_b
        else:
            excess_a *= 0.5  # Illinois: the end that stays is made to move
        b, excess_b = f, excess
        # At the other end of the play the force is many times larger: a straight line from there hardly moves.
        halve = abs(b - a) > 0.5 * width and not halve
    return b


@kernel
def elastic_step(
    p: Any, motor: Any, m_l: float, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings
) -> float:
    """The step with an elastic transmission; mean friction force of the contact [F].

    However stiff the link and however bent, the deflection that the bodies end with is nearly a straight line over the force:
    both of them are led once or twice, and between that the link alone is solved along the line.
    """
    e = x[2] - x[0]
    at = e + h * (x[3] - x[1])
    slope = steepest = -0.5 * h * h * (1.0 / motor[0] + 1.0 / m_l)
    enough = 1e-9 * abs(link(e, at, h, p))
    f = linked(p, e, at, slope, link(e, e, h, p), 0.01 * enough, h)
    low, high = -math.inf, math.inf
    before = end_before = friction = 0.0
    for trial in range(60):
        excess, friction = elastic_trial(p, motor, m_l, x, x_next, s, u, f, h, around)
        if not abs(excess) > enough:
            break  # also at once where it is no number
        if excess > 0.0:
            low, high = max(low, f - excess), min(high, f)
        else:
            low, high = max(low, f), min(high, f - excess)
        end = x_next[2] - x_next[0]
        if trial > 0 and f != before:
            # Friction may hold a body, but doesn't make it lighter.
            slope = min(max((end - end_before) / (f - before), steepest), 0.0)
        before, end_before = f, end
        f = linked(p, e, end - slope * f, slope, f, 0.01 * enough, h)
        if not low <= f <= high or trial > 8:
            f = 0.5 * (low + high)  # friction that lets go or holds bends the line
        if abs(f - before) <= 1e-10 * abs(f):
            break  # what is left of the excess is a rounding of the positions, times the stiffness
    return friction


@kernel
def as_one(p: Any, m: float, dry: float, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    """The step of both as one body of mass ``m`` with the motor's Coulomb friction ``dry`` [F] beside the contact's."""
    if dry == 0.0:
        return contact_step(p, m, x, x_next, s, u, h, around)
    q, v = x[0], x[1]
    left = span = h
    stops = False
    impulse = 0.0
    for _ in range(5):
        side = 1.0 if v > 0.0 else -1.0
        if v == 0.0:
            opposed, friction = opposing(p, s, q, 0.0, u, left, 1.0, 0.0, around)
            push = u - opposed
            if not RIGID:
                push -= friction
            side = 1.0 if push > 0.0 else -1.0
            held = dry
            if RIGID:
                _, friction = opposing(p, s, q, 0.0, u, left, side, side, around)
                held += side * friction
                friction = push - min(max(push, -dry), dry)
            if abs(push) <= held:
                impulse += left * friction
                break
        w, friction = solve(p, m, s, q, v, u - side * dry, span, side, around)
        v_1 = 2.0 * w - v
        if stops:
            # It has come to rest, and what is left of the step starts from there.
            v_1 = 0.0
        elif v_1 * side < 0.0:
            if v == 0.0:
                # Pushed off and turned back within the step: friction holds.
                impulse += left * friction
                break
            span = left * v / (v - v_1)
            stops = True
            continue
        q += span * w
        v = v_1
        impulse += span * friction
        left -= span
        if left <= 0.0:
            break
        span = left
        stops = False
        for j in range(s.z.shape[0]):
            s.z[j] = s.z_next[j]
    x_next[0] = q
    x_next[1] = v
    return impulse / h


@kernel
def until_contact(way: float, start: float, end: float, h: float) -> float:
    """When, within ``h`` [s], a body that closes in at ``start`` and then ``end`` [x/s] has covered ``way`` > 0 [x]."""
    bend = (end - start) / h
    root = math.sqrt(max(start * start + 2.0 * bend * way, 0.0))
    if start + root <= 0.0:
        return h
    return min(2.0 * way / (start + root), h)


@kernel
def rigid_step(
    p: Any, motor: Any, m_l: float, half: float, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings
) -> float:
    """The step with rigid stops ``half`` [x] to either side; mean friction force of the contact [F]."""
    m_m, dry, viscous = motor
    left = span = h
    impulse = 0.0
    meet = 0.0  # the side at which they meet at the end of the span, if they do
    for _ in range(12 if half > 0.0 else 0):
        friction = load_step(p, m_l, x, x_next, s, 0.0, span, around)
        w, v = motor_step(m_m, dry, viscous, x[3], u, span)
        x_next[2] = x[2] + span * w
        x_next[3] = v
        if meet == 0.0:
            e = x_next[2] - x_next[0]
            if abs(e) <= half:
                return (impulse + span * friction) / h
            meet = 1.0 if e > 0.0 else -1.0
            way = half - meet * (x[2] - x[0])
            if way > 1e-12 * (half + abs(x[0])):
                span = until_contact(way, meet * (x[3] - x[1]), meet * (v - x_next[1]), span)
                continue
            if x[3] == x[1]:
                break  # they press on each other
        else:
            x[0], x[1], x[3] = x_next[0], x_next[1], v
            for j in range(s.z.shape[0]):
                s.z[j] = s.z_next[j]
            impulse += span * friction
            left -= span
        x[1] = x[3] = (m_m * x[3] + m_l * x[1]) / (m_m + m_l)
        x[2] = x[0] + meet * half
        if left <= 0.0:
            break
        span = left
        meet = 0.0  # do they press on, or part at once?
    if left > 0.0:
        e = x[2] - x[0]
        impulse += left * as_one((*p[:-1], viscous), m_m + m_l, dry, x, x_next, s, u, left, around)
        x_next[2] = x_next[0] + e
        x_next[3] = x_next[1]
    else:
        x_next[0], x_next[1], x_next[2], x_next[3] = x[0], x[1], x[2], x[3]
        for j in range(s.z.shape[0]):
            s.z_next[j] = s.z[j]
    return impulse / h


@kernel
def driven_step(
    p: Any, m_m: float, m_l: float, dry: float, viscous: float, x: Any, x_next: Any, s: Inner, u: float, h: float,
    around: Surroundings,
) -> float:  # fmt: skip
    """Lead load ``x[0], x[1]`` and motor ``x[2], x[3]`` (position, velocity) over ``h`` [s] under the motor's force ``u`` [F].

    ``dry`` [F] and ``viscous`` [F s/x] are the motor's own friction. Returns the mean friction force of the contact [F].
    """
    alone = (*p, 0.0)
    motor = (m_m, dry, viscous)
    if ELASTIC:
        return elastic_step(alone, motor, m_l, x, x_next, s, u, h, around)
    return rigid_step(alone, motor, m_l, 0.5 * play(alone), x, x_next, s, u, h, around)


TRANSMISSION_FUNCTIONS = (
    own,
    *CONTACT_FUNCTIONS,
    *(motor_step, load_step, elastic_trial, linked, elastic_step, as_one, until_contact, rigid_step, driven_step),
)
"""What a driven plant lists among its functions, before its ``step``; its ``own`` is among them."""
