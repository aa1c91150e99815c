"""What an experiment asks of the axis, sample by sample, and when it is cut off.

A phase of an experiment is a generator: it yields the drive that it wants and is sent the next sample. So the phases read from
top to bottom as the axis goes through them, and the same text serves lock-step, wall time, and a test without any middleware.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from ..errors import InputError

__all__ = ["REST", "Cut", "Drive", "ExperimentError", "Law", "Limits", "Motion", "Quiet", "Sample", "SwingWatch"]

T = TypeVar("T")


class ExperimentError(InputError):
    """An experiment that can't be made as asked."""


class Sample(NamedTuple):
    """What is known of the axis at ``time`` [s]: position [x], effort [F] (NaN: not measured)."""

    time: float
    position: float
    effort: float


class Drive(NamedTuple):
    """u = P (reference - q) - D v + force.

    Attributes:
        reference: [x].
        proportional: P [F/x].
        derivative: D [F s/x].
        force: added to the feedback [F].
    """

    reference: float = 0.0
    proportional: float = 0.0
    derivative: float = 0.0
    force: float = 0.0


REST = Drive()
"""No force."""

Motion = Generator[Drive, Sample, T]
"""A phase: yields drives, is sent samples, returns what came of it."""


class Cut(Exception):
    """The axis left its limits: the force has to be zero at once."""


@dataclass(frozen=True)
class Limits:
    """What an experiment must keep within.

    Attributes:
        force: largest command [F].
        travel: largest distance from where the experiment began [x].
        growth: largest swing, relative to the one that was released, before the axis counts as unstable.
    """

    force: float
    travel: float
    growth: float = 1.15

    def watch(self, sample: Sample, origin: float) -> None:
        """Look at a sample while a force may act.

        Raises:
            Cut: it is out of the travel allowed.
        """
        if not abs(sample.position - origin) <= self.travel:
            raise Cut(f"the axis is {abs(sample.position - origin):.4g} from its origin, the travel is {self.travel:.4g}")


class SwingWatch:
    """Notices a free oscillation that grows.

    Args:
        size: of the swing that was released [x].
        growth: largest factor by which a swing may exceed the release, or the last swing to the same side.
        centre: about which it swings [x].
    """

    def __init__(self, size: float, growth: float, centre: float) -> None:
        self._size = size
        self._growth = growth
        self._centre = centre
        self._side = 0
        self._far = 0.0
        self._before: dict[int, float] = {}

    def see(self, position: float) -> None:
        """Take in the next position [x].

        Raises:
            Cut: it swings farther than it was released from, or farther from swing to swing.
        """
        off = position - self._centre
        if abs(off) > self._growth * self._size:
            raise Cut(f"unstable: it swings to {abs(off):.4g}, and was released from {self._size:.4g}")
        # A side counts when it was reached by more than friction and noise make.
        side = 0 if abs(off) < 0.05 * self._size else 1 if off > 0.0 else -1
        if side in (0, self._side):
            self._far = max(self._far, abs(off))
            return
        if self._side and self._far > self._growth * self._before.get(self._side, self._size):
            raise Cut(f"unstable: its swing grows from {self._before[self._side]:.4g} to {self._far:.4g}")
        if self._side:
            self._before[self._side] = self._far
        self._side, self._far = side, abs(off)


class Quiet:
    """Tells when a position has stayed within ``tolerance`` [x] for ``duration`` [s]."""

    def __init__(self, duration: float, tolerance: float) -> None:
        self._duration = duration
        self._tolerance = tolerance
        self._since = 0.0
        self._low = self._high = float("nan")

    def see(self, sample: Sample) -> bool:
        """Take in a sample; True when it is quiet."""
        position = sample.position
        low, high = min(self._low, position), max(self._high, position)
        if not high - low <= self._tolerance:
            self._since, self._low, self._high = sample.time, position, position
            return False
        self._low, self._high = low, high
        return sample.time - self._since >= self._duration


class Law:
    """The force of a drive from positions as they are measured.

    v is the filtered difference quotient v_k = (T_f v_(k-1) + q_k - q_(k-1))/(T_f + h).

    Args:
        limit: largest force [F].
        filter_time: T_f [s].
    """

    def __init__(self, limit: float, filter_time: float) -> None:
        self._limit = limit
        self._filter_time = filter_time
        self._last: Sample | None = None
        self._velocity = 0.0
        self.saturated = 0
        """Samples at which the limit took something away."""

    def force(self, drive: Drive, sample: Sample) -> float:
        """Force [F] from ``sample`` on."""
        last = self._last
        if last is not None and sample.time > last.time:
            filter_time = self._filter_time
            change = sample.position - last.position
            self._velocity = (filter_time * self._velocity + change) / (filter_time + sample.time - last.time)
        self._last = sample
        wanted = drive.proportional * (drive.reference - sample.position) - drive.derivative * self._velocity + drive.force
        given = min(max(wanted, -self._limit), self._limit)
        self.saturated += given != wanted
        return given
