"""Several excitations after one another, with rests before, between and after."""

from __future__ import annotations

from collections.abc import Sequence as Listed

import numpy as np

from ..excitation_kind import Points, Trajectory
from ..record import Array

__all__ = ["Sequence"]


class Sequence:
    """``parts`` one after the other; at rest at position 0 before, between and after them.

    Args:
        parts: planned motions.
        delay: rest before the first [s].
        pause: rest after each [s].
        repeat: True to go through all again and again.

    Attributes:
        duration: from the start to the end of the first time through [s].
    """

    def __init__(self, parts: Listed[Trajectory], delay: float = 0.0, pause: float = 0.0, repeat: bool = False) -> None:
        self._parts = list(parts)
        self._delay = delay
        self._repeat = repeat
        lengths = np.array([part.duration + pause for part in self._parts])
        self._starts = np.concatenate([[0.0], np.cumsum(lengths)])
        self.duration = delay + float(self._starts[-1])

    def at(self, time: Array) -> Points:
        """The motion at ``time`` [s], shape ``(n,)``; at rest at position 0 outside."""
        points = Points(np.zeros_like(time), np.zeros_like(time), np.zeros_like(time))
        local = time - self._delay
        if self._repeat and self._starts[-1] > 0.0:
            local = np.where(local >= 0.0, np.mod(local, self._starts[-1]), local)
        for start, part in zip(self._starts, self._parts, strict=False):
            inside = (local >= start) & (local <= start + part.duration)
            if np.any(inside):
                for whole, piece in zip(points, part.at(local[inside] - start), strict=True):
                    whole[inside] = piece
        return points
