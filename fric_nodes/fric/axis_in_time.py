"""A simulated axis that moves by the time that really passes, under a drive with a watchdog.

A command acts from the moment of its arrival; without a command for the watchdog's time the drive gives no force.
"""

from __future__ import annotations

from .axis import SimulatedAxis

__all__ = ["TimedDrive"]


class TimedDrive:
    """Moves ``axis`` along a clock.

    Args:
        axis: what moves.
        now: time at the start [ns].
        watchdog: longest time that a command acts [ns].
    """

    def __init__(self, axis: SimulatedAxis, now: int, watchdog: int) -> None:
        self._axis = axis
        self._now = self._commanded = now
        self._watchdog = watchdog
        self._force = 0.0
        self._fed = False

    @property
    def force(self) -> float:
        """Force given now [F]."""
        return self._force

    def advance_to(self, now: int) -> bool:
        """Move the axis to ``now`` [ns] under the force that the drive has been giving; True when the watchdog ended it."""
        end_of_force = self._commanded + self._watchdog
        ended = self._fed and now > end_of_force
        if ended:
            self._axis.advance(self._force, (end_of_force - self._now) * 1e-9)
            self._now = max(self._now, end_of_force)
            self._force = 0.0
            self._fed = False
        self._axis.advance(self._force, (now - self._now) * 1e-9)
        self._now = now
        return ended

    def command(self, now: int, force: float) -> bool:
        """``force`` [F] acts from ``now`` [ns] on; True when the watchdog ended the one before."""
        ended = self.advance_to(now)
        self._commanded, self._force, self._fed = now, force, True
        return ended
