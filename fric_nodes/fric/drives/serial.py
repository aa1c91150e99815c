"""A drive on a serial line or USB, by the protocol ``fric-serial/1`` of :mod:`fric.drives.serial_frames`.

One command goes out and the newest status comes in per exchange; nothing waits. The stamp of a reading comes from the drive's
own clock: the offset between both clocks is the least that was found between the time of measurement and the time of
reception, and is let rise slowly, because clocks drift. A status that was held up on its way has therefore an old stamp and not
the present one, and a safety layer refuses it where it is too old.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from typing import Any

from .drive import Drive, DriveError, DriveKind, DriveOption, JointReading, Link, Options
from .serial_frames import FAULT, WATCHDOG, Command, Splitter, Status, newer, pack

__all__ = ["DRIVE", "SerialDrive"]

_NS = 1_000_000_000
_DRIFT = 1e-4  # physical scale: clocks of microcontrollers differ by less [1]
_AT_ONCE = 4096  # numerical: bytes read at once
_WRITE = 0.002  # physical scale: [s] that a full line may hold up the loop; zero would let pyserial wait without end


class SerialDrive:
    """A serial drive.

    Args:
        port: device, such as ``/dev/ttyACM0``.
        baud: bits per second.
        timeout: without an intact status for so long the drive is lost [s].
        now: clock of stamps [ns].

    Attributes:
        damaged: pieces received that were no frame.
        overtaken: intact frames dropped because a newer one had come.
    """

    def __init__(self, port: str, baud: int, timeout: float, now: Callable[[], int]) -> None:
        self._port, self._baud = port, baud
        self._timeout = round(_NS * timeout)
        self._now = now
        self._line: Any = None
        self.damaged = self.overtaken = 0
        self._sequence = 0

    def open(self) -> None:
        """Open the line.

        Raises:
            DriveError: it can't be opened, or pyserial isn't installed.
        """
        try:
            import serial
        except ImportError:
            raise DriveError("drive 'serial'", "pyserial isn't installed", "install it: pip install pyserial") from None
        self.close()
        try:
            self._line = serial.Serial(self._port, self._baud, timeout=0, write_timeout=_WRITE, exclusive=True)
            self._line.reset_input_buffer()
        except (OSError, ValueError) as error:
            self.close()
            raise DriveError(self._port, f"can't be opened ({error})", "plug the drive in, or give its port") from None
        self._splitter = Splitter()
        self._before: Status | None = None
        self._offset = math.inf
        self._offset_since = self._heard = self._now()

    def exchange(self, force: float) -> JointReading | None:
        """Send ``force`` [F], and give the newest reading that hasn't been given yet; None when there is none.

        Raises:
            DriveError: the line is lost, the drive is silent or reports a fault, or ``force`` isn't finite.
        """
        if self._line is None:
            raise DriveError(self._port, "isn't open", "open it first")
        if not math.isfinite(force):
            raise DriveError(self._port, f"the force is {force}", "send a finite force only")
        self._sequence = (self._sequence + 1) & 0xFFFFFFFF
        data = self._pass(pack(Command(self._sequence, force)))
        newest: Status | None = None
        for frame in self._splitter.feed(data):
            if isinstance(frame, Status):
                newest = self._newest(frame, newest)
        self.damaged = self._splitter.damaged
        now = self._now()
        if newest is None:
            if now - self._heard > self._timeout:
                silent = f"no intact status for {(now - self._heard) / _NS:.3g} s"
                raise DriveError(self._port, silent, "look at the drive's supply, cable and baud rate")
            return None
        self._heard = now
        if newest.flags & FAULT:
            raise DriveError(self._port, "the drive reports a fault", "take its cause away and reset the fault")
        return JointReading(self._stamp(newest.time, now), newest.position, newest.velocity, newest.effort, newest.temperature)

    def _pass(self, out: bytes) -> bytes:
        """Write ``out`` and read what is there."""
        import serial

        line = self._line
        try:
            data = line.read(_AT_ONCE)
            # A line that is full means that the drive doesn't listen: its silence will tell.
            with contextlib.suppress(serial.SerialTimeoutException):
                line.write(out)
        except (OSError, TypeError) as error:  # pyserial gives a TypeError when the device goes while it reads
            raise DriveError(self._port, f"is lost ({error})", "plug the drive in again") from None
        return bytes(data)

    def _newest(self, status: Status, best: Status | None) -> Status | None:
        """The newer one of ``status`` and ``best``, which may be none; a status from before is dropped."""
        before = self._before
        if before is not None and not (newer(status.sequence, before.sequence) and status.time > before.time):
            self.overtaken += 1
            return best
        if best is not None:
            self.overtaken += 1
        self._before = status
        return status

    def _stamp(self, time: int, now: int) -> int:
        """The drive's ``time`` [us] in our clock [ns]."""
        offset = now - 1000 * time
        drifted = self._offset + _DRIFT * (now - self._offset_since)
        if offset < drifted or abs(offset - drifted) > _NS:  # a second off: the drive has started anew
            self._offset, self._offset_since = offset, now
        else:
            self._offset, self._offset_since = drifted, now
        return 1000 * time + round(self._offset)

    @property
    def watched(self) -> bool:
        """True while the drive's own watchdog has taken the force away."""
        return self._before is not None and bool(self._before.flags & WATCHDOG)

    def close(self) -> None:
        """Send a zero force, if that is possible, and close the line."""
        line, self._line = self._line, None
        if line is None:
            return
        self._sequence = (self._sequence + 1) & 0xFFFFFFFF
        with contextlib.suppress(OSError, TypeError):  # where the line is gone, the drive's watchdog takes the force away
            line.write(pack(Command(self._sequence, 0.0)))
        with contextlib.suppress(OSError):
            line.close()


def _make(options: Options, now: Callable[[], int], link: Link | None) -> Drive:
    if not options["port"]:
        raise DriveError("drive 'serial'", "no port", "give 'port', such as /dev/ttyACM0")
    return SerialDrive(str(options["port"]), int(options["baud"]), float(options["timeout"]), now)


DRIVE = DriveKind(
    "serial",
    "serial line or USB, protocol fric-serial/1",
    (
        DriveOption("port", "", "device of the drive, such as /dev/ttyACM0"),
        DriveOption("baud", 921_600, "bits per second; without meaning on USB", "", 1200, 12_000_000),
        DriveOption("timeout", 0.05, "without an intact status for so long the drive is lost", "s", 1e-3, 10.0),
    ),
    _make,
)
