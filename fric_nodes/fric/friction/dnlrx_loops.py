"""The compiled loops of :mod:`fric.friction.dnlrx`: deformations, force from motion, motion from force.

All lead their states in place and write into arrays that are handed in. A history is a row of past values, the latest first.
"""

from __future__ import annotations

import math
from typing import Any

from ..engine.kernel import kernel

__all__ = ["deform", "predict", "simulate"]


@kernel
def deform(x: Any, x_before: float, thresholds: Any, delta: Any, out: Any) -> None:
    """Deformations along ``x``, ``(n, M)``, by Eq. 11; ``delta``, ``(M,)``, is led on from those at ``x_before``."""
    last = x_before
    for k in range(x.shape[0]):
        dx = x[k] - last
        last = x[k]
        for i in range(thresholds.shape[0]):
            delta[i] = min(max(delta[i] + dx, -thresholds[i]), thresholds[i])
            out[k, i] = delta[i]


@kernel
def past(g: Any, theta: Any, offset: float, x_past: Any, delta_past: Any) -> float:
    """What the samples before this one contribute to its force; the histories hold the latest sample in row 0."""
    total = offset
    for j in range(1, g.shape[0]):
        total += g[j] * x_past[j - 1]
    for j in range(1, theta.shape[0]):
        for i in range(theta.shape[1]):
            total += theta[j, i] * delta_past[j - 1, i]
    return total


@kernel
def shift(x: float, delta: Any, x_past: Any, delta_past: Any) -> None:
    """Put a new sample in front of the histories."""
    for j in range(x_past.shape[0] - 1, 0, -1):
        x_past[j] = x_past[j - 1]
    x_past[0] = x
    for j in range(delta_past.shape[0] - 1, 0, -1):
        for i in range(delta_past.shape[1]):
            delta_past[j, i] = delta_past[j - 1, i]
    for i in range(delta_past.shape[1]):
        delta_past[0, i] = delta[i]


@kernel
def predict(
    thresholds: Any, g: Any, theta: Any, offset: float, x: Any, x_past: Any, delta_past: Any, delta: Any, u_out: Any
) -> None:
    """Eq. 14 along ``x``, ``(n,)``."""
    for k in range(x.shape[0]):
        u = past(g, theta, offset, x_past, delta_past) + g[0] * x[k]
        dx = x[k] - x_past[0]
        for i in range(thresholds.shape[0]):
            delta[i] = min(max(delta_past[0, i] + dx, -thresholds[i]), thresholds[i])
            u += theta[0, i] * delta[i]
        u_out[k] = u
        shift(x[k], delta, x_past, delta_past)


@kernel
def increment(residual: float, thresholds: Any, g_0: float, theta: Any, delta: Any) -> float:
    """The move that raises the force by ``residual``, piece by piece between the points where springs slide."""
    side = 1.0 if residual > 0.0 else -1.0
    wanted = abs(residual)
    reached = 0.0
    for _ in range(thresholds.shape[0] + 1):
        slope = g_0
        corner = math.inf
        for i in range(thresholds.shape[0]):
            room = thresholds[i] - side * delta[i]
            if room > reached:
                slope += theta[0, i]
                corner = min(corner, room)
        if wanted <= slope * (corner - reached):
            return side * (reached + wanted / slope)
        wanted -= slope * (corner - reached)
        reached = corner
    return side * reached


@kernel
def simulate(
    thresholds: Any, g: Any, theta: Any, offset: float, u: Any, x_past: Any, delta_past: Any, delta: Any, x_out: Any
) -> None:
    """Eq. 14 solved for x(k) along ``u``, ``(n,)``."""
    for k in range(u.shape[0]):
        residual = u[k] - past(g, theta, offset, x_past, delta_past) - g[0] * x_past[0]
        for i in range(thresholds.shape[0]):
            delta[i] = delta_past[0, i]
            residual -= theta[0, i] * delta[i]
        x = x_past[0] + increment(residual, thresholds, g[0], theta, delta)
        dx = x - x_past[0]
        for i in range(thresholds.shape[0]):
            delta[i] = min(max(delta[i] + dx, -thresholds[i]), thresholds[i])
        x_out[k] = x
        shift(x, delta, x_past, delta_past)
