"""Several excitations after one another, with rests before, between and after."""

from __future__ import annotations

from collections.abc import Sequence as Listed

import numpy as np

from ..excitation_kind import Feedback, Points, Trajectory
from ..record import Array

__all__ = ["Sequence"]


class Sequence:
    """``parts`` one after the other; at rest at position 0 before, between and after them.

    Args:
        parts: planned motions, and feedbacks.
        delay: rest before the first [s].
        pause: rest after each [s].
        repeat: True to go through all again and again.

    Attributes:
        duration: from the start to the end of the first time through [s].
        has_feedback: True when some part answers the motion, so that not everything is known in advance.
    """

    def __init__(
        self, parts: Listed[Trajectory | Feedback], delay: float = 0.0, pause: float = 0.0, repeat: bool = False
    ) -> None:
        self._planned = [None if hasattr(part, "force") else part for part in parts]
        self._answering = [part if hasattr(part, "force") else None for part in parts]
        self._delay = delay
        self._repeat = repeat
        lengths = np.array([part.duration + pause for part in parts])
        self._starts = np.concatenate([[0.0], np.cumsum(lengths)])
        self.duration = delay + float(self._starts[-1])
        self.has_feedback = any(self._answering)

    def _local(self, time: Array) -> Array:
        local = time - self._delay
        if self._repeat and self._starts[-1] > 0.0:
            local = np.where(local >= 0.0, np.mod(local, self._starts[-1]), local)
        return local

    def at(self, time: Array) -> Points:
        """The motion at ``time`` [s], shape ``(n,)``; at rest at position 0 outside the planned parts."""
        points = Points(np.zeros_like(time), np.zeros_like(time), np.zeros_like(time))
        local = self._local(time)
        for start, part in zip(self._starts, self._planned, strict=False):
            if part is None:
                continue
            inside = (local >= start) & (local <= start + part.duration)
            if np.any(inside):
                for whole, piece in zip(points, part.at(local[inside] - start), strict=True):
                    whole[inside] = piece
        return points

    def force(self, time: float, position: float) -> float:
        """The force [F] from ``time`` [s] on, with the sensor at ``position`` [x]; called once per sample, in order."""
        instant = np.array([time])
        local = float(self._local(instant)[0])
        for start, part in zip(self._starts, self._answering, strict=False):
            if part is not None and start <= local < start + part.duration:
                return part.force(local - float(start), position)
        return float(self.at(instant).position[0])
