"""One pass over a file of records in the order they were written, without use of its index.

A recorder that was killed leaves a file without an index, which readers refuse; the messages are there all the same. A scan
takes what is whole and says what is not. What a record looks like is a matter of the format (:mod:`.recover_mcap`,
:mod:`.recover_ros1`).
"""

from __future__ import annotations

import mmap
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import NamedTuple

from rosbags.interfaces import MessageDefinition

from .errors import BagError
from .topics import Raw, Topic

__all__ = ["Channel", "Scan"]


class Channel(NamedTuple):
    """What a file says of the messages with one number.

    Attributes:
        topic: its name.
        msgtype: its type, by its ROS 2 name.
        definition: of the type.
        encoding: ``cdr`` or ``ros1``.
    """

    topic: str
    msgtype: str
    definition: MessageDefinition
    encoding: str


class Scan(ABC):
    """Messages of a file.

    Attributes:
        path: of the file.
        topics: what the complete records hold.
        damage: what is incomplete or unreadable, in plain words; filled by the first pass over the file.
    """

    def __init__(self, path: Path) -> None:
        """Pass once over the file.

        Raises:
            BagError: empty, or not a file of this format that can be read.
        """
        self.path = path
        self.damage: list[str] = []
        self._channels: dict[int, Channel] = {}
        self._odd = 0  # records that do not hold what they should
        if path.stat().st_size == 0:
            raise BagError(path, "is empty (0 bytes)", "record again")
        with path.open("rb") as file:
            self._content = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        try:
            self._start = self._first_record()
            counts = Counter(number for number, _, _ in self._messages(self.damage))
        except BaseException:
            self.close()
            raise
        if self._odd:
            self.damage.append(f"{self._odd} records not readable and left out")
        lost = sum(count for number, count in counts.items() if number not in self._channels)
        if lost:
            self.damage.append(f"{lost} messages lost: the description of their topic is not readable")
        self.topics = self._merged(counts)

    def _merged(self, counts: Counter[int]) -> tuple[Topic, ...]:
        """The topics, those of several numbers once."""
        merged: dict[tuple[str, str], Topic] = {}
        for number, channel in self._channels.items():
            key = (channel.topic, channel.msgtype)
            before = merged[key].n_messages if key in merged else 0
            merged[key] = Topic(*key, before + counts[number], channel.definition, channel.encoding)
        return tuple(merged.values())

    def close(self) -> None:
        """Let go of the file."""
        self._content.close()

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Raw]:
        """Messages in the order they were written; of all topics when ``topics`` is None."""
        wanted = {number: channel for number, channel in self._channels.items() if topics is None or channel.topic in topics}
        for number, log_time, data in self._messages([]):
            channel = wanted.get(number)
            if channel is not None:
                yield Raw(channel.topic, channel.msgtype, log_time, data)

    @abstractmethod
    def _first_record(self) -> int:
        """Where the first record begins.

        Raises:
            BagError: the file is of another format.
        """

    @abstractmethod
    def _messages(self, damage: list[str]) -> Iterator[tuple[int, int, bytes]]:
        """Number of the channel, time of reception [ns] and content of each message; what isn't whole goes to ``damage``."""
