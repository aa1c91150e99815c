"""Oscillating motions that fade in and out, so that they start and end at rest."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..excitation_kind import Points
from ..record import Array

__all__ = ["Windowed"]


class Windowed:
    """``wave`` times a window that rises and falls with zero velocity and zero acceleration at its ends.

    Args:
        wave: gives the motion at times of shape ``(n,)`` from the start [s].
        duration: from the start to the end [s].
        ramp: time in which the window rises, and falls [s]; at most half the duration.
    """

    def __init__(self, wave: Callable[[Array], Points], duration: float, ramp: float) -> None:
        self._wave = wave
        self.duration = duration
        self._ramp = min(ramp, 0.5 * duration)

    def at(self, time: Array) -> Points:
        """The motion at ``time`` [s], shape ``(n,)``."""
        q, v, a = self._wave(time)
        ramp = self._ramp
        if ramp <= 0.0:
            return Points(q, v, a)
        from_end = self.duration - time
        s = np.clip(np.minimum(time, from_end) / ramp, 0.0, 1.0)
        sign = np.where(time <= from_end, 1.0, -1.0)
        w = s**3 * (10.0 + s * (-15.0 + 6.0 * s))
        dw = sign * 30.0 * s**2 * (1.0 - s) ** 2 / ramp
        ddw = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / ramp**2
        return Points(w * q, w * v + dw * q, w * a + 2.0 * dw * v + ddw * q)
