"""What a next recording must keep within, and how its instruments see it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError
from ...record import Record
from ...signals.resolution import noise_of

_SHORTEST = 2.0  # [s] of a recording worth designing

__all__ = ["DesignError", "Limits", "Rig", "limits_of", "rig_of"]


class DesignError(InputError):
    """An experiment that can't be designed as asked."""


@dataclass(frozen=True)
class Limits:
    """Limits of the next recording.

    Attributes:
        position: lowest and highest, from where it starts [x].
        speed: largest [x/s].
        force: lowest and highest command [F].
        duration: longest [s].
    """

    position: tuple[float, float]
    speed: float
    force: tuple[float, float]
    duration: float = 20.0

    def __post_init__(self) -> None:
        for name, (low, high) in (("position", self.position), ("force", self.force)):
            if not (math.isfinite(low) and math.isfinite(high) and low < 0.0 < high):
                problem = f"{name} is {low:g} to {high:g}"
                raise DesignError("--limit", problem, f"give {name}=LO,HI with LO below 0, where it starts, and HI above")
        for name, value in (("speed", self.speed), ("duration", self.duration)):
            if not (math.isfinite(value) and value > 0.0):
                raise DesignError(f"--limit {name}", f"is {value:g}", "give a number greater than 0")
        if self.duration < _SHORTEST:
            raise DesignError("--duration", f"is {self.duration:g} s", f"allow at least {_SHORTEST:g} s")

    @classmethod
    def parsed(cls, given: Sequence[str], duration: float) -> Limits:
        """The limits that texts such as ``position=-0.1,0.1``, ``speed=0.3`` and ``force=-50,50`` give.

        Raises:
            DesignError: one is missing, twice there, or no number.
        """
        found: dict[str, tuple[float, float]] = {}
        for text in given:
            name, _, numbers = text.partition("=")
            if name not in ("position", "speed", "force") or name in found:
                raise DesignError("--limit", f"is '{text}'", "give position=LO,HI, speed=V and force=LO,HI, each once")
            try:
                values = [float(number) for number in numbers.split(",")]
            except ValueError:
                values = []
            if len(values) not in (1, 2):
                raise DesignError("--limit", f"is '{text}'", f"give one or two numbers, such as {name}=-0.1,0.1")
            # One number bounds both sides.
            found[name] = (values[0], values[1]) if len(values) == 2 else (-abs(values[0]), abs(values[0]))
        for name in ("position", "speed", "force"):
            if name not in found:
                raise DesignError("--limit", f"{name} is not limited", "give position=LO,HI, speed=V and force=LO,HI")
        low, high = found["speed"]
        return cls(found["position"], min(-low, high), found["force"], duration)

    @property
    def way(self) -> float:
        """How far a motion may go to either side [x]."""
        return min(-self.position[0], self.position[1])

    @property
    def push(self) -> float:
        """How hard it may be pushed to either side [F]."""
        return min(-self.force[0], self.force[1])

    def narrowed(self, share: float) -> Limits:
        """The same with position, speed and force reduced to a ``share``."""
        low, high = self.position
        weak, strong = self.force
        return replace(
            self, position=(share * low, share * high), speed=share * self.speed, force=(share * weak, share * strong)
        )


@dataclass(frozen=True)
class Rig:
    """How the next recording is made.

    Attributes:
        period: of controller and recording [s].
        resolution: of the position signal [x].
        position_noise: standard deviation of white noise on it [x].
        force_noise: standard deviation of white noise on the force signal, which never acted [F].
    """

    period: float
    resolution: float = 0.0
    position_noise: float = 0.0
    force_noise: float = 0.0


def rig_of(records: Sequence[Record]) -> Rig:
    """The instruments behind recordings, as far as these show them: the noise of quantisation is noise like any other."""
    return Rig(
        period=float(max(record.sample_time for record in records)),
        position_noise=float(max(noise_of(record.position[record.mask]) for record in records)),
        force_noise=float(max(noise_of(record.effort[record.mask]) for record in records)),
    )


def limits_of(records: Sequence[Record], speed: float, most: float = 6.0) -> Limits:
    """What recordings themselves kept within, their travel taken about its middle: a next one like them may do the same.

    Args:
        records: at least one.
        speed: the largest that they hold [x/s].
        most: longest duration [s].
    """
    half = 0.5 * max(float(np.ptp(record.position[record.mask])) for record in records)
    push = 1.2 * max(float(np.max(np.abs(record.effort[record.mask]))) for record in records)
    duration = min(max(float(np.ptp(record.time)) for record in records), most)
    return Limits((-half, half), speed, (-push, push), max(duration, _SHORTEST))
