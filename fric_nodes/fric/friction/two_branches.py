"""A mass on friction that is given as tables: one branch while it speeds up, one while it slows down, for each direction.

Equation: m dv/dt = u - F, with F between the nodes of a table linear in v. Below the first node F keeps that node's value, so
that there is a level to stick at; beyond the last it stays in proportion to v, as a constant damping would.

The step is that of :mod:`fric.engine.contact` (implicit midpoint, exact stops, exact sticking, and where neither branch
can hold the velocity stays what it is), for a law that is no term of a model.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..engine.kernel import kernel, loop
from ..record import Array
from ..simulation import Motion, intervals

__all__ = ["Tables", "simulate_mass"]


class Tables(NamedTuple):
    """Friction against the direction of motion over |v|, four tables one behind the other.

    They are, in this order: forward speeding up, forward slowing down, backward speeding up, backward slowing down.

    Attributes:
        speed: nodes [x/s], increasing within a table, greater than 0, ``(n_nodes,)``.
        force: at the nodes, positive against the motion [F], ``(n_nodes,)``.
        first: where each table begins, and where the last ends, ``(5,)``.
    """

    speed: Any
    force: Any
    first: Any


@kernel
def friction_at(tables: Tables, speed: float, side: float, slowing: int) -> float:
    """Friction against the motion [F] at ``speed`` = |v|, on the way up (``slowing`` 0) or down (1)."""
    table = slowing if side > 0.0 else 2 + slowing
    low, high = tables.first[table], tables.first[table + 1] - 1
    if speed <= tables.speed[low]:
        return float(tables.force[low])
    if speed >= tables.speed[high]:
        return float(tables.force[high] * speed / tables.speed[high])
    while high - low > 1:
        middle = (low + high) // 2
        if tables.speed[middle] <= speed:
            low = middle
        else:
            high = middle
    share = (speed - tables.speed[low]) / (tables.speed[high] - tables.speed[low])
    return float(tables.force[low] + share * (tables.force[high] - tables.force[low]))


@kernel
def mean_velocity(tables: Tables, mass: float, v: float, u: float, h: float, side: float) -> tuple[float, float]:
    """Mean velocity over ``h`` and friction force [F], for sliding towards ``side`` throughout."""
    slowing = 0
    if side * u <= friction_at(tables, abs(v), side, 0):
        if side * u >= friction_at(tables, abs(v), side, 1):
            return v, u
        slowing = 1
    half = 0.5 * h / mass
    w = v
    friction = 0.0
    for _ in range(50):
        friction = side * friction_at(tables, max(side * w, 0.0), side, slowing)
        previous = w
        w = v + half * (u - friction)
        if abs(w - previous) <= 1e-12 * (abs(w) + abs(v)):
            break
    return w, friction


@kernel
def moved(tables: Tables, mass: float, q: float, v: float, u: float, h: float) -> tuple[float, float, float]:
    """Position and velocity after a step of ``h`` under the constant force ``u``, and the impulse of friction [F s]."""
    left = h
    impulse = 0.0
    for _ in range(8):
        side = 1.0 if v > 0.0 else -1.0
        if v == 0.0:
            side = 1.0 if u > 0.0 else -1.0
            if abs(u) <= friction_at(tables, 0.0, side, 0):
                return q, 0.0, impulse + left * u
        w, friction = mean_velocity(tables, mass, v, u, left, side)
        v_1 = 2.0 * w - v
        if side * v_1 >= 0.0:
            return q + left * w, v_1, impulse + left * friction
        if v == 0.0:
            return q, 0.0, impulse + left * u
        friction = side * friction_at(tables, 0.5 * abs(v), side, 1)
        braking = side * (friction - u)
        stop = min(mass * abs(v) / braking, left) if braking > 0.0 else left
        q += 0.5 * v * stop
        impulse += friction * stop
        v = 0.0
        left -= stop
        if left <= 0.0:
            break
    return q, v, impulse


@loop
def lead(
    tables: Tables, mass: float, u: Any, h: float, n_sub: int, q: float, v: float, states: Any, friction: Any
) -> None:  # fmt: skip
    """Fill ``states`` ``(n, 2)`` and mean ``friction`` ``(n,)`` over the intervals of ``u`` ``(n,)``."""
    h_sub = h / n_sub
    for k in range(u.shape[0]):
        total = 0.0
        for _ in range(n_sub):
            q, v, impulse = moved(tables, mass, q, v, u[k], h_sub)
            total += impulse
        states[k, 0] = q
        states[k, 1] = v
        friction[k] = total / h


def simulate_mass(
    tables: Tables,
    mass: float,
    effort: Array,
    sample_time: float,
    *,
    position: float = 0.0,
    velocity: float = 0.0,
    hold: str = "following",
    n_substeps: int = 1,
) -> Motion:
    """Free run of ``mass`` [F s^2/x] under the forces ``effort`` [F], ``(n_samples,)``.

    Arguments as of :func:`fric.simulation.simulate`.
    """
    given = np.ascontiguousarray(intervals(effort, hold))
    states = np.empty((given.shape[0], 2))
    friction = np.empty(given.shape[0])
    lead(tables, mass, given, sample_time, n_substeps, position, velocity, states, friction)
    states = np.vstack([[position, velocity], states])
    return Motion(
        position=states[:, 0].copy(),
        velocity=states[:, 1].copy(),
        friction=np.concatenate([[0.0], friction]),
        applied=np.concatenate([[0.0], given]),
        states=states,
    )
