"""The quarter car's equations typed a second time, for an integration by another method, and the paper's road.

Written from the paper with its own symbols and numbers; nothing here is shared with :mod:`fric.plants.quarter_car`.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from ..record import Array

__all__ = ["HEIGHT", "MIDPOINT", "STAGES", "integrate", "normal_force", "road"]

MIDPOINT = 0.085
"""Of the cylinder's stroke [m]: the body's second steady stage."""

HEIGHT = 0.05
"""Of the step [m]."""

STAGES = ((1.0, 7.0, 0.085), (7.0, 11.0, 0.135), (11.0, 16.0, 0.035))
"""Start and end [s] of each move and where it leads [m], as in Fig. 5."""

_RAMP = 2.5
_CYLINDER = {"A1": 1.96e-3, "A2": 0.94e-3, "V1": 80e-6, "V2": 167e-6, "B": 500.0, "Ps": 200e5, "R": 2.45e11, "K": 0.99e-4}
_MASSES = {"b": 240.0, "w": 40.0, "r": 5.0, "T": 285.0}


def road(time: Array) -> Array:
    """Road displacement wanted, X_rd [m], at ``time`` [s], shape ``(n,)``: to the midpoint in a ramp, then +50 and -50 mm."""
    ramp = MIDPOINT * np.clip((time - STAGES[0][0]) / _RAMP, 0.0, 1.0)
    return np.where(time < STAGES[1][0], ramp, np.where(time < STAGES[2][0], MIDPOINT + HEIGHT, MIDPOINT - HEIGHT))


def normal_force(deflection: Array | float, rate: Array | float, theta: float) -> Array:
    """|F_nb| [N] by Eqs. 11 and 12, for a suspension compressed by ``deflection`` [m] that closes at ``rate`` [m/s]."""
    sine = deflection * np.sin(theta) / (0.342 - deflection * np.sin(theta))
    return np.asarray(np.abs(2.89e4 * deflection + 260.0 * rate) / np.tan(theta - np.arcsin(sine)))


def _sqrt(pressure: float) -> float:
    return float(np.sign(pressure) * np.sqrt(np.abs(pressure)))


def _flows(spool: float, p1: float, p2: float) -> tuple[float, float]:
    k, ps = _CYLINDER["K"], _CYLINDER["Ps"]
    if spool >= 0:
        return k * spool * _sqrt(ps - p1), k * spool * _sqrt(p2)
    return k * spool * _sqrt(p1), k * spool * _sqrt(ps - p2)


def integrate(
    start: Array,
    times: Array,
    wanted: Callable[[Array], Array],
    breaks: tuple[float, ...] = (),
    friction: Callable[[float, float, float], float] | None = None,
) -> Array:
    """States at ``times`` [s] from ``start`` by Radau's method at a tolerance of 1e-9, shape ``(n_times, 11)``.

    Args:
        start: body, wheel and road with their velocities, spool, both pressures, integral of the error, filtered road.
        times: the first is that of the start.
        wanted: X_rd [m] over time.
        breaks: times at which it jumps or bends [s].
        friction: of the body's bearings [N], from its velocity, the suspension's deflection and its rate; None: none.
    """
    m, c = _MASSES, _CYLINDER
    beta, tau, kp, ki, tf = 1.43e9, 0.003, 0.3, 1.2, 0.15

    def slope(t: float, y: Array, offset: float) -> list[float]:
        xb, vb, xw, vw, xr, vr, spool, p1, p2, integral, filtered = y
        fs = 2.89e4 * (xw - xb) + 260.0 * (vw - vb)
        ft = 9.2e5 * (xr - xw) + 3886.0 * (vr - vw)
        held = friction(vb, xw - xb, vw - vb) if friction is not None else 0.0
        q1, q2 = _flows(spool, p1, p2)
        leak = (p1 - p2) / c["R"]
        error = filtered - xr
        # A bend or jump at the end of a stretch belongs to the next one.
        x_rd = float(wanted(np.array([t + offset]))[0])
        return [
            *(vb, (fs - held) / m["b"], vw, (ft - fs) / m["w"]),
            *(vr, (p1 * c["A1"] - p2 * c["A2"] - c["B"] * vr - ft - m["T"] * 9.81) / m["r"]),
            (kp * error + ki * integral - spool) / tau,
            beta / (c["V1"] + c["A1"] * xr) * (q1 - c["A1"] * vr - leak),
            beta / (c["V2"] - c["A2"] * xr) * (c["A2"] * vr + leak - q2),
            *(error, (x_rd - filtered) / tf),
        ]

    scale = np.array([0.1, 0.5, 0.1, 0.5, 0.1, 0.5, 1e-3, 1e7, 1e7, 1e-3, 0.1])
    edges = [float(times[0]), *(b for b in breaks if times[0] < b < times[-1]), float(times[-1])]
    states = np.empty((times.shape[0], 11))
    states[0] = start
    y = start
    for first, last in pairwise(edges):
        inside = (times > first) & (times <= last)
        answer = solve_ivp(
            slope, (first, last), y, "Radau", times[inside], rtol=1e-9, atol=1e-9 * scale, args=(-1e-12 * (last < times[-1]),)
        )
        states[inside] = answer.y.T
        y = answer.y[:, -1]
    return states
