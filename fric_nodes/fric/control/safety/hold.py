"""Keeping the position after a stop.

Equation: F = -k (x - x_s) - (m / T_b) v + I, dI/dt = -k (x - x_s) / (8 T_b), |I| <= L, with k = m / (2 T_b)^2, so that an
axis of inertia m comes to rest without overshoot. The integral carries the load L and no more: under friction alone it stays at
zero, and can't hunt.
"""

from __future__ import annotations

import math

from .limits import Limits

__all__ = ["Hold"]


class Hold:
    """The hold of one axis.

    Args:
        limits: of the axis.
    """

    def __init__(self, limits: Limits) -> None:
        self._damping = limits.inertia_min / limits.brake_time
        self._stiffness = 0.25 * limits.inertia_min / limits.brake_time**2
        self._rate = 0.125 * self._stiffness / limits.brake_time
        self._load = limits.load
        self.release()

    def release(self) -> None:
        """Hold nothing."""
        self._position: float | None = None
        self._integral = 0.0

    def take(self, position: float, force: float) -> None:
        """Hold ``position`` [x] from now on, beginning with ``force`` [F]."""
        self._position = position
        self._integral = min(max(force, -self._load), self._load)

    def force(self, position: float, velocity: float, passed: float) -> float:
        """Force [F] at ``position`` [x] and ``velocity`` [x/s], ``passed`` [s] after the last."""
        if self._position is None or not math.isfinite(position):
            return 0.0
        error = self._position - position
        self._integral = min(max(self._integral + self._rate * error * passed, -self._load), self._load)
        return self._stiffness * error - self._damping * velocity + self._integral
