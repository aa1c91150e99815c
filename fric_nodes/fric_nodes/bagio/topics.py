"""What every reader of recordings in this room speaks of: a topic of a bag, and a message as it was recorded."""

from __future__ import annotations

from typing import NamedTuple

from rosbags.interfaces import MessageDefinition

__all__ = ["Raw", "Topic"]


class Topic(NamedTuple):
    """A topic in a bag: name, message type, number of messages, definition of the type as stored in the bag."""

    name: str
    msgtype: str
    n_messages: int
    definition: MessageDefinition


class Raw(NamedTuple):
    """A message as recorded: topic, message type, time of reception [ns], CDR bytes."""

    topic: str
    msgtype: str
    log_time_ns: int
    data: bytes
