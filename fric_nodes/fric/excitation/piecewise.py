"""Motions made of polynomial pieces, each going on where the one before it ended."""

from __future__ import annotations

import math

import numpy as np

from ..excitation_kind import Points
from ..record import Array

__all__ = ["PEAK_ACCELERATION", "PEAK_VELOCITY", "TURN", "Piecewise"]

PEAK_VELOCITY = 1.875
"""Largest velocity of a minimum-jerk move, times its duration over its way."""

PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)
"""Largest acceleration of a minimum-jerk move, times its duration squared over its way."""

TURN = 0.3125
"""How far a change from +v to -v within T goes on before it turns, over v T."""

_DEGREE = 6
_PADDING = (0.0,) * (_DEGREE + 1)


class Piecewise:
    """A motion of polynomial pieces, built piece by piece from rest at position 0.

    A piece of duration T is a polynomial in s = t/T from 0 to 1 of degree 6 at most.
    """

    def __init__(self) -> None:
        self._starts: list[float] = []
        self._spans: list[float] = []
        self._pieces: list[tuple[float, ...]] = []
        self._arrays: tuple[Array, Array, Array] | None = None
        self.duration = 0.0
        self.position = 0.0
        self.velocity = 0.0

    def _add(self, span: float, coefficients: list[float]) -> None:
        if span <= 0.0:
            return
        self._starts.append(self.duration)
        self._spans.append(span)
        self._pieces.append((*coefficients, *_PADDING[len(coefficients) :]))
        self._arrays = None
        self.duration += span

    def hold(self, span: float) -> None:
        """Stay at rest for ``span`` [s]."""
        self._add(span, [self.position])

    def cruise(self, span: float) -> None:
        """Go on at the present velocity for ``span`` [s]."""
        self._add(span, [self.position, self.velocity * span])
        self.position += self.velocity * span

    def change_velocity(self, velocity: float, span: float) -> None:
        """Change to ``velocity`` [x/s] within ``span`` [s], the acceleration starting and ending at 0.

        v(s) = v_0 + (v_1 - v_0) (3 s^2 - 2 s^3); the largest acceleration is 1.5 (v_1 - v_0) / T.
        """
        gain = (velocity - self.velocity) * span
        self._add(span, [self.position, self.velocity * span, 0.0, gain, -0.5 * gain])
        self.position += 0.5 * (self.velocity + velocity) * span
        self.velocity = velocity

    def move(self, position: float, span: float) -> None:
        """From rest to rest at ``position`` [x] within ``span`` [s], with the least jerk; at once when ``span`` is 0.

        q(s) = q_0 + (q_1 - q_0) (10 s^3 - 15 s^4 + 6 s^5) (Flash and Hogan 1985); the largest velocity is 1.875 (q_1 - q_0) /
        T, the largest acceleration 5.7735 (q_1 - q_0) / T^2.
        """
        way = position - self.position
        self._add(span, [self.position, 0.0, 0.0, 10.0 * way, -15.0 * way, 6.0 * way])
        self.position = position

    def at(self, time: Array) -> Points:
        """The motion at ``time`` [s], shape ``(n,)``."""
        if self._arrays is None:
            self._arrays = np.array(self._starts), np.array(self._spans), np.array(self._pieces)
        starts, spans, pieces = self._arrays
        number = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(starts) - 1)
        span = spans[number]
        s = np.clip((time - starts[number]) / span, 0.0, 1.0)
        c = pieces[number]
        position, velocity, acceleration = np.zeros_like(s), np.zeros_like(s), np.zeros_like(s)
        for k in range(_DEGREE, -1, -1):  # Horner's rule, for the polynomial and its derivatives
            position = position * s + c[:, k]
            if k >= 1:
                velocity = velocity * s + k * c[:, k]
            if k >= 2:
                acceleration = acceleration * s + k * (k - 1) * c[:, k]
        return Points(position, velocity / span, acceleration / (span * span))
