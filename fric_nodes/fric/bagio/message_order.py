"""Order, repetition and loss of the messages that a recorder takes from several topics; no ROS in here.

Messages are taken topic by topic and in bulk, so they arrive here in the order of topics, not of time. Two orders are offered:

- :class:`ReceiveOrder`: log time is the time of reception. Everything received before the draining began is complete and can be
  written in order; what came in meanwhile waits for the next round.
- :class:`StampOrder`: log time is the time stamp in the message. In lock-step this is what makes two runs give the same bag: it
  doesn't depend on when a message happened to arrive. A message is written when every topic that is still talking has reached
  its stamp. A message without a stamp of the same clock (no header, or diagnostics, which are stamped with wall time) takes
  the newest stamp seen. When the stamps start again, because the plant was restarted, the log time goes on after the last one.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

__all__ = ["Message", "ReceiveOrder", "StampOrder", "TopicIntake", "header_stamp"]

_STAMP = {0: struct.Struct(">iI"), 1: struct.Struct("<iI")}
_REMEMBERED = 64  # payloads kept per topic to recognise a retransmission; lock-step runs ahead by far less
# A topic that says nothing for so long doesn't hold up others [ns]. What a busy machine has lost comes again within about 3 s,
# which is how often Fast DDS asks for it.
_SILENT_AFTER = 7_000_000_000
_HELD_AT_FIRST = _SILENT_AFTER  # from the first message on [ns], for topics that have not said anything yet
_RESTART = 1_000_000  # [ns] between the last log time and the first one after a restart of the stamps

Message = tuple[int, int, bytes]
"""Log time [ns], index of the topic, serialized message."""


def header_stamp(payload: bytes) -> int:
    """Time stamp [ns] of a serialized message whose first field is a ``std_msgs/Header``; 0 for a negative one."""
    seconds, nanoseconds = _STAMP[payload[1] & 1].unpack_from(payload, 4)
    return int(max(seconds * 1_000_000_000 + nanoseconds, 0))


@dataclass
class TopicIntake:
    """One topic on its way into the bag.

    Attributes:
        name: name of the topic.
        stamped: the message begins with a header, so a repetition can be recognised.
        follows_clock: its stamps are of the clock of the samples (False for diagnostics).
        received: messages taken from the middleware.
        written: messages handed on to the bag.
        repeated: retransmissions, which are not written.
        lost: messages that the publisher sent and that never came, by the gaps in its sequence numbers.
    """

    name: str
    stamped: bool
    follows_clock: bool
    received: int = 0
    written: int = 0
    repeated: int = 0
    lost: int = 0
    last_sequence: int = 0
    last_stamp: int = -1
    last_received: int = 0
    restarts: int = 0
    recent: deque[bytes] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))

    def count(self, sequence: int | None, one_publisher: bool) -> None:
        """Note the publisher's sequence number of a message just taken; None when the middleware has none.

        The numbers of several publishers mix and the info says not whose it is, so losses are counted for a single one only.
        """
        self.received += 1
        if sequence is None:
            return
        if one_publisher and 0 < self.last_sequence < sequence - 1:
            self.lost += sequence - 1 - self.last_sequence
        self.last_sequence = sequence

    def is_repetition(self, payload: bytes, stamp: int) -> bool:
        """True when this message, stamp and all, was taken before; otherwise it is remembered."""
        if stamp <= self.last_stamp and payload in self.recent:
            self.repeated += 1
            return True
        self.recent.append(payload)
        return False


class ReceiveOrder:
    """Messages by time of reception."""

    def __init__(self, topics: list[TopicIntake]) -> None:
        self._topics = topics
        self._waiting: list[Message] = []

    def add(self, index: int, payload: bytes, received: int) -> None:
        """Take in a message of topic ``index`` that was received at ``received`` [ns]."""
        topic = self._topics[index]
        if topic.stamped:
            stamp = header_stamp(payload)
            # Stamps that nobody fills are all 0, and then two equal messages are two messages.
            if stamp > 0:
                if topic.is_repetition(payload, stamp):
                    return
                topic.last_stamp = stamp
        self._waiting.append((received, index, payload))

    def release(self, before: int | None) -> list[Message]:
        """Messages that are complete up to the time ``before`` [ns], in order; all of them when None."""
        waiting = self._waiting
        waiting.sort(key=lambda message: message[:2])
        if before is None or not waiting or waiting[-1][0] < before:
            self._waiting = []
            return waiting
        cut = next(at for at, message in enumerate(waiting) if message[0] >= before)
        self._waiting = waiting[cut:]
        return waiting[:cut]


class StampOrder:
    """Messages by their own time stamps, the same for every run of the same lock-step.

    Args:
        topics: the topics; more may be appended later. At equal stamps they are written in the order of their names.
        on_restart: called with the topic's name when its stamps start again from an earlier time.
    """

    def __init__(self, topics: list[TopicIntake], on_restart: Callable[[str], None] = lambda name: None) -> None:
        self._topics = topics
        self._on_restart = on_restart
        # Restart counts how often the clock of the samples began anew. At equal stamps the name decides, not the index, since
        # the order in which topics were discovered differs from run to run.
        self._waiting: list[tuple[int, int, str, int, int, bytes]] = []
        """Restart, stamp, name of the topic, arrival, index of the topic, payload."""
        self._arrival = 0
        self._newest = (0, 0)
        self._base = {0: 0}
        self._last_log_time = 0
        self._begun: int | None = None  # when the first message with a clock was received

    def add(self, index: int, payload: bytes, received: int) -> None:
        """Take in a message of topic ``index`` that was received at ``received`` [ns]."""
        topic = self._topics[index]
        key = self._newest
        if topic.stamped and topic.follows_clock:
            stamp = header_stamp(payload)
            if topic.is_repetition(payload, stamp):
                return
            if topic.last_stamp < 0:
                topic.restarts = self._newest[0]
            elif stamp < topic.last_stamp:
                topic.restarts += 1
                self._on_restart(topic.name)
            topic.last_stamp, topic.last_received = stamp, received
            if self._begun is None:
                self._begun = received
            key = (topic.restarts, stamp)
            self._newest = max(self._newest, key)
        elif topic.stamped and topic.is_repetition(payload, -1):
            return
        self._arrival += 1
        self._waiting.append((*key, topic.name, self._arrival, index, payload))

    def release(self, before: int | None) -> list[Message]:
        """Messages up to the stamp that every talking topic has reached, in order; all of them when ``before`` is None.

        Args:
            before: now [ns], on the clock of the times of reception.
        """
        self._waiting.sort()
        cut = len(self._waiting) if before is None else self._settled(before)
        ready, self._waiting = self._waiting[:cut], self._waiting[cut:]
        return [(self._log_time(restart, stamp), index, payload) for restart, stamp, _, _, index, payload in ready]

    def _settled(self, now: int) -> int:
        talking = [t for t in self._topics if t.follows_clock and t.last_stamp >= 0 and now - t.last_received < _SILENT_AFTER]
        if not talking:
            # Nobody talks: either the loop stands still, and little waits here, or no topic has a clock at all.
            clockless = not any(t.follows_clock and t.last_stamp >= 0 for t in self._topics)
            return len(self._waiting) if clockless else 0
        if (
            self._begun is not None
            and now - self._begun < _HELD_AT_FIRST
            and any(t.follows_clock and t.last_stamp < 0 for t in self._topics)
        ):
            return 0  # the first message of another topic may be on its way
        reached = min((t.restarts, t.last_stamp) for t in talking)
        return next((at for at, message in enumerate(self._waiting) if message[:2] > reached), len(self._waiting))

    def _log_time(self, restart: int, stamp: int) -> int:
        if restart not in self._base:
            self._base[restart] = self._last_log_time + _RESTART - stamp
        log_time = max(self._base[restart] + stamp, 0)
        self._last_log_time = max(self._last_log_time, log_time)
        return log_time
