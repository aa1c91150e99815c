"""When each message of a recording is to be published; no ROS in here.

Deadlines are absolute: message k is due at ``begin + (t_k - t_0) / rate`` on the monotonic clock, so a late message delays
none of those after it, and errors of sleeping don't add up. The time t of a message is the time of its reception or its own
time stamp; a message without a stamp, or one whose time goes back, is due together with the message before it.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from rosbags.interfaces import Qos
from rosbags.rosbag2 import Reader, ReaderError

from .message_order import header_stamp
from .topics import Raw

__all__ = ["Due", "Pace", "recorded_qos", "schedule"]


class Due(NamedTuple):
    """A message and the time in the recording [ns] at which it is due; ``message`` is None for a tick of the clock."""

    time_ns: int
    message: Raw | None


def schedule(
    messages: Iterable[Raw],
    *,
    stamped: Collection[str] = (),
    start: float = 0.0,
    end: float | None = None,
    tick: float | None = None,
) -> Iterator[Due]:
    """Put times to messages.

    Args:
        messages: in the order in which they are to be published.
        stamped: message types whose own time stamp counts; a message of another type then goes with the one before it. Empty:
            the time of reception counts for all.
        start: leave out what comes before this time since the first message [s].
        end: leave out what comes after this time since the first message [s]; None for nothing.
        tick: distance of the ticks of the clock [s]; None for no ticks.

    Yields:
        Messages and ticks, times never decreasing.
    """
    times = _stamp_times(messages, stamped) if stamped else _log_times(messages)
    first: int | None = None
    next_tick: int | None = None
    step = 0 if tick is None else max(round(tick * 1e9), 1)
    for now, message in times:
        first = now if first is None else first
        since = (now - first) * 1e-9
        if since < start:
            continue
        if end is not None and since > end:
            return
        if step:
            next_tick = now if next_tick is None else next_tick
            while next_tick <= now:
                yield Due(next_tick, None)
                next_tick += step
        yield Due(now, message)


def _log_times(messages: Iterable[Raw]) -> Iterator[tuple[int, Raw]]:
    now = 0
    for message in messages:
        now = max(now, message.log_time_ns)
        yield now, message


def _stamp_times(messages: Iterable[Raw], stamped: Collection[str]) -> Iterator[tuple[int, Raw]]:
    now: int | None = None
    early: list[Raw] = []  # messages without a stamp before the first one that has one
    for message in messages:
        if message.msgtype in stamped:
            stamp = header_stamp(message.data)
            now = stamp if now is None else max(now, stamp)
        if now is None:
            early.append(message)
            continue
        for waiting in early:
            yield now, waiting
        early.clear()
        yield now, message
    for waiting in early:
        yield 0, waiting


class Pace:
    """Waits for the deadlines of one pass through a recording.

    Args:
        rate: speed relative to the recording, greater than 0.
        stop: ends every wait when set.
    """

    def __init__(self, rate: float, stop: threading.Event) -> None:
        self._rate = rate
        self._stop = stop
        self._begin: tuple[int, float] | None = None
        self.worst_delay = 0.0
        """Largest time by which a message was late so far [s]."""

    def wait(self, time_ns: int) -> bool:
        """Wait until what is due at ``time_ns`` in the recording is due now; False when told to stop."""
        if self._begin is None:
            self._begin = (time_ns, time.monotonic())
        origin, begin = self._begin
        remaining = begin + (time_ns - origin) * 1e-9 / self._rate - time.monotonic()
        if remaining > 0:
            return not self._stop.wait(remaining)
        self.worst_delay = max(self.worst_delay, -remaining)
        return not self._stop.is_set()


def recorded_qos(path: str | Path) -> dict[str, Qos]:
    """Quality of service that the publishers of each topic offered when the bag was recorded, as far as the bag says.

    Where publishers differed the least demanding one is given, with which every subscriber of that time could connect.
    """
    found: dict[str, Qos] = {}
    try:
        with Reader(path) as reader:
            for connection in reader.connections:
                offered = getattr(connection.ext, "offered_qos_profiles", ())
                if offered:
                    found[connection.topic] = max(offered, key=lambda qos: (qos.reliability.value, qos.durability.value))
    except (ReaderError, OSError, AssertionError, ValueError):
        return {}  # a damaged bag, or a file without its folder, is played all the same
    return found
