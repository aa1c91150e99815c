"""A simulated axis under a drive that has the safety layer in front, along a clock.

The layer's readings are the axis's own, so that no message can deceive it. A command acts from the moment of its arrival, as
far as the layer allows; between commands the layer is stepped with every sample. The drive's watchdog stays behind it, for
when the process itself is held up.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from ..axis import SimulatedAxis
from ..axis_in_time import TimedDrive
from .safety import SafetyLayer, State
from .safety.starting import Starting

__all__ = ["GuardedAxis"]

_NS = 1e9
_SEED = 1_000_000  # numerical: [ns] between the readings of the resting axis before the start


class GuardedAxis(Starting):
    """Drive, safety layer and axis.

    Args:
        axis: what moves; it rests.
        layer: decides on the force; its command timeout is that of a command.
        now: time at the start [ns].
        enabled: enable with the first command.

    Attributes:
        witness: called with time [ns], force [F], true position [x] and the layer's state whenever the drive has been told a
            force, for who judges what reaches the axis.
    """

    def __init__(self, axis: SimulatedAxis, layer: SafetyLayer, now: int, enabled: bool) -> None:
        super().__init__(layer, enabled)
        limits = layer.limits
        # A force that has to come down by its rate takes its time; the watchdog, which cuts, leaves it that.
        down = limits.force / limits.force_rate if math.isfinite(limits.force_rate) else 0.0
        self._drive = TimedDrive(axis, now, round(_NS * (limits.command_timeout + down)))
        self._axis = axis
        self.witness: Callable[[int, float, float, State], None] | None = None
        for before in (2, 1):
            layer.reading(now - before * _SEED, now - before * _SEED, axis.position)
        layer.step(now)

    @property
    def force(self) -> float:
        """Given by the drive now [F]."""
        return self._drive.force

    def command(self, now: int, stamp: int, force: float) -> bool:
        """A command for ``force`` [F], made at ``stamp`` [ns], has come; True when the watchdog ended the one before."""
        ended = self._advance(now)
        taken = self.layer.command(now, stamp, force)
        if taken:
            self._start(now, keep=True)
        self._give(now, taken, between=True)
        return ended

    def sample(self, now: int, publishers: int) -> bool:
        """A sample begins, and so many senders are known; True when the watchdog ended the force."""
        ended = self._advance(now)
        self.layer.reading(now, now, self._axis.position)
        self.layer.publishers(publishers)
        if self.layer.commanded:
            self._start(now, keep=True)
        self._give(now, False, between=False)
        return ended

    def _advance(self, now: int) -> bool:
        ended = self._drive.advance_to(now)
        if ended:
            self.layer.cut(now)
        return ended

    def _give(self, now: int, fed: bool, between: bool) -> None:
        force = self.layer.step(now, between=between)
        if fed or force != self._drive.force:
            self._drive.command(now, force)
        if self.witness is not None:
            self.witness(now, self._drive.force, self._axis.position, self.layer.state)
