"""A drive that speaks ``fric-serial/1``, on a pseudo-terminal: what a microcontroller would do, for tests and trials.

The emulator moves a simulated axis under the newest command that it has accepted, and answers. Its line may be made as bad as
wanted: :class:`BadLine` drops, flips, splits, merges, repeats and holds up what passes, in both directions.
"""

from __future__ import annotations

import contextlib
import math
import os
import threading
import tty
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..axis import SimulatedAxis
from .serial_frames import FAULT, LIMITED, READY, WATCHDOG, Command, Splitter, Status, newer, pack

__all__ = ["BadLine", "SerialEmulator"]

_AT_ONCE = 1 << 16


@dataclass
class BadLine:
    """Damage to a stream of bytes, piece by piece.

    Attributes:
        random: source of chance.
        drop: probability that a byte is lost.
        flip: probability that a byte has some of its bits flipped.
        split: probability that a piece is passed on in part, the rest with the next one.
        hold: probability that a piece is held up until the next one, so that both come merged.
        repeat: probability that a piece comes once more after the next one.
    """

    random: np.random.Generator
    drop: float = 0.0
    flip: float = 0.0
    split: float = 0.0
    hold: float = 0.0
    repeat: float = 0.0

    def __post_init__(self) -> None:
        self._kept = b""
        self._again = b""

    def passes(self, data: bytes) -> bytes:
        """What comes through of ``data``."""
        if not data:
            return b""
        chance = self.random.random(3)
        again = data if chance[2] < self.repeat else b""
        data = self._damaged(data)
        whole, self._kept = self._kept + data, b""
        whole, self._again = whole + self._again, again
        if chance[0] < self.hold:
            self._kept, whole = whole, b""
        elif chance[1] < self.split and len(whole) > 1:
            at = int(self.random.integers(1, len(whole)))
            whole, self._kept = whole[:at], whole[at:]
        return whole

    def _damaged(self, data: bytes) -> bytes:
        n = len(data)
        if self.flip > 0.0:
            hit = self.random.random(n) < self.flip
            if hit.any():
                values = np.frombuffer(data, np.uint8).copy()
                values[hit] ^= self.random.integers(1, 256, int(hit.sum()), dtype=np.uint8)
                data = values.tobytes()
        if self.drop > 0.0:
            lost = self.random.random(n) < self.drop
            if lost.any():
                data = np.frombuffer(data, np.uint8)[~lost].tobytes()
        return data


class SerialEmulator:
    """A drive with its axis on a pseudo-terminal.

    Args:
        axis: that it moves.
        port: where the device appears, a link that is made.
        now: clock [ns].
        watchdog: without a command for so long it gives no force [s].
        force_limit: its own limit [F].
        incoming: line from the host; None: a good one.
        outgoing: line to the host; None: a good one.

    Attributes:
        force: given now [F].
        accepted: commands accepted.
        faulty: it reports a fault.
        on_force: called with number and force of each command that is accepted.
    """

    def __init__(
        self,
        axis: SimulatedAxis,
        port: Path,
        now: Callable[[], int],
        *,
        watchdog: float = 0.05,
        force_limit: float = 1e3,
        incoming: BadLine | None = None,
        outgoing: BadLine | None = None,
    ) -> None:
        self.axis = axis
        self._port, self._now = port, now
        self._watchdog = round(1e9 * watchdog)
        self._limit = force_limit
        self.incoming, self.outgoing = incoming, outgoing
        self.force = 0.0
        self.accepted = 0
        self.faulty = False
        self.on_force: Callable[[int, float], None] = lambda sequence, force: None
        self._master = self._slave = -1
        self._moved = self._commanded = now()
        self._origin = now()
        self._echo = self._sequence = 0
        self._flags = WATCHDOG
        self._thread: threading.Thread | None = None
        self._ending = threading.Event()

    def plug(self) -> None:
        """Make the device appear."""
        self.unplug()
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._port.unlink(missing_ok=True)
        self._port.symlink_to(os.ttyname(self._slave))
        self._splitter = Splitter()

    @property
    def plugged(self) -> bool:
        """True while the device is there."""
        return self._master >= 0

    def unplug(self) -> None:
        """Make the device disappear."""
        for handle in (self._master, self._slave):
            if handle >= 0:
                os.close(handle)
        self._master = self._slave = -1
        self._port.unlink(missing_ok=True)

    def poll(self) -> None:
        """Do what is due now: move the axis, take in commands, answer."""
        self._move()
        if self._master < 0:
            return
        try:
            data = os.read(self._master, _AT_ONCE)
        except BlockingIOError:
            return
        if self.incoming is not None:
            data = self.incoming.passes(data)
        asked = False
        for frame in self._splitter.feed(data):
            if isinstance(frame, Command):
                asked = True
                self._take(frame)
        if asked:
            self._answer()

    def _move(self) -> None:
        """Move the axis to the present under the force, up to the watchdog's time."""
        now = self._now()
        end = self._commanded + self._watchdog
        if now > end and not self._flags & WATCHDOG:
            self.axis.advance(self.force, max(end - self._moved, 0) * 1e-9)
            self._moved = max(self._moved, end)
            self.force = 0.0
            self._flags = WATCHDOG
        self.axis.advance(self.force, (now - self._moved) * 1e-9)
        self._moved = now

    def _take(self, command: Command) -> None:
        if not (newer(command.sequence, self._echo) or self._flags & WATCHDOG):
            return
        self._echo = command.sequence
        self.accepted += 1
        # A drive takes what is no number for no force.
        limited = min(max(command.force, -self._limit), self._limit) if math.isfinite(command.force) else 0.0
        self._flags = READY | (LIMITED if limited != command.force else 0)
        self.force = limited
        self._commanded = self._now()
        self.on_force(command.sequence, command.force)

    def _answer(self) -> None:
        self._sequence = (self._sequence + 1) & 0xFFFFFFFF
        state = self.axis.measure()
        time_us = (self._now() - self._origin) // 1000
        status = Status(self._sequence, self._echo, time_us, *state, float("nan"), self._flags | (FAULT if self.faulty else 0))
        data = pack(status)
        if self.outgoing is not None:
            data = self.outgoing.passes(data)
        with contextlib.suppress(BlockingIOError):  # nobody reads: as with a full transmit buffer
            os.write(self._master, data)

    def serve(self, period: float = 2e-4) -> None:
        """Poll from a thread until :meth:`close`."""
        self._ending.clear()

        def work() -> None:
            while not self._ending.wait(period):
                self.poll()

        self._thread = threading.Thread(target=work, name="serial emulator")
        self._thread.start()

    def close(self) -> None:
        """End the thread, and unplug."""
        if self._thread is not None:
            self._ending.set()
            self._thread.join()
            self._thread = None
        self.unplug()
