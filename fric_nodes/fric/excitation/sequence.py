"""Several excitations after one another, with rests before, between and after."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence as Listed

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Feedback, Points, Trajectory
from ..record import Array

__all__ = ["SampledPlan", "Sequence", "sequence_of"]

_BLOCK = 512  # samples planned together; always the same ones, so that every sample has the same bits in every run


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


class SampledPlan:
    """A plan, sample by sample.

    Args:
        plan: without feedback.
        period: time between samples [s].
    """

    def __init__(self, plan: Sequence, period: float) -> None:
        self._plan = plan
        self._period = period
        self._block: tuple[int, list[list[float]]] = (-1, [])

    def at(self, sample: int) -> list[float]:
        """Position [x], velocity [x/s] and acceleration [x/s^2] at sample number ``sample``."""
        number, at = divmod(sample, _BLOCK)
        if self._block[0] != number:
            times = np.arange(number * _BLOCK, (number + 1) * _BLOCK, dtype=np.float64) * self._period
            self._block = (number, np.stack(self._plan.at(times), axis=1).tolist())
        return self._block[1][at]


def sequence_of(
    kinds: Listed[Excitation],
    output: str,
    number: Callable[[str, str], float],
    text: Callable[[str, str], str],
    random: np.random.Generator,
    rests: tuple[float, float, bool],
) -> Sequence:
    """Excitations of the catalogue after one another.

    Args:
        kinds: in their order.
        output: what is published: ``"reference"`` or ``"force"``.
        number: value of a parameter, from the excitation's id and the parameter's name.
        text: value of a parameter that is a text, likewise.
        random: for what is random in them.
        rests: delay [s], pause [s] and repetition, as for :class:`Sequence`.

    Raises:
        ExcitationError: an excitation has no such output, or a value that it can't use.
    """
    parts = []
    for kind in kinds:
        if output not in kind.outputs:
            problem = f"{kind.id} can't be published as a {output}"
            raise ExcitationError("parameter 'output'", problem, f"set it to {' or '.join(kind.outputs)}")
        numbers = {p.name: number(kind.id, p.name) for p in kind.parameters}
        parts.append(kind.part(numbers, {t.name: text(kind.id, t.name) for t in kind.texts}, random))
    return Sequence(parts, *rests)
