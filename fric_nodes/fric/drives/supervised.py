"""A drive with the safety layer in front of it, opened again when its connection was lost."""

from __future__ import annotations

import math

from ..control.safety import SafetyLayer, State
from ..control.safety.starting import Starting
from .drive import Drive, DriveError, JointReading

__all__ = ["SupervisedDrive"]

_RETRY = 200_000_000  # physical scale: [ns] between two tries to open; a device is back within a second then


class SupervisedDrive(Starting):
    """What a bridge does in each period. No force reaches the drive but by the layer.

    A drive that is lost while it may move is a latched fault of the layer. It is opened again by itself, and gives no force
    until the fault is reset and the layer enabled, by whoever is responsible.

    Args:
        drive: not opened yet.
        layer: safety layer of the axis.
        autostart: enable once, as soon as there are readings to rely on.

    Attributes:
        trouble: why the drive isn't open; empty when it is.
    """

    def __init__(self, drive: Drive, layer: SafetyLayer, autostart: bool = False) -> None:
        super().__init__(layer, autostart)
        self._drive = drive
        self._is_open = False
        self._next_try: int | None = None
        self.trouble = "not opened yet"

    def tick(self, now: int, reference: float = math.nan) -> JointReading | None:
        """Send the force of this period, at ``now`` [ns], and give the newest reading, if there is one.

        Args:
            now: present time [ns].
            reference: position wanted now [x], for the following error; NaN: none.
        """
        force = self.layer.step(now, reference)
        if not (self._is_open or self._opens(now)):
            return None
        try:
            reading = self._drive.exchange(force)
        except DriveError as error:
            self._lose(now, error)
            return None
        if reading is not None:
            self.layer.reading(now, reading.stamp, reading.position, reading.temperature)
            self._start(now)
        return reading

    def _opens(self, now: int) -> bool:
        if self._next_try is not None and 0 <= self._next_try - now <= _RETRY:
            return False
        try:
            self._drive.open()
        except DriveError as error:
            self.trouble = str(error)
            self._next_try = now + _RETRY
            return False
        self._is_open, self.trouble = True, ""
        self.layer.counters["drive opened"] += 1
        return True

    def _lose(self, now: int, error: DriveError) -> None:
        if self.layer.state in {State.ENABLED, State.STOPPING}:
            self.layer.fail("drive", error.problem, now)
        self.trouble = str(error)
        self._is_open = False
        self._next_try = now + _RETRY
        self._drive.close()

    def close(self) -> None:
        """Let go of the drive, which takes the force away."""
        self._is_open = False
        self.trouble = "closed"
        self._drive.close()
