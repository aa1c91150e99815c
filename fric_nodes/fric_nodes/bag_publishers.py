"""Publishers for the topics of a bag, with the quality of service with which they were recorded."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from pathlib import Path

from fric.bagio.errors import BagError
from fric.bagio.playback import recorded_qos
from fric.bagio.read import bag_info
from fric.bagio.topics import Raw
from fric.errors import InputError
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import Qos

from .base import wait_until_sent
from .bulk import message_class

__all__ = ["BagPublishers", "NoSubscribersError"]

_FRICTION_MODEL = "fric_interfaces/msg/FrictionModel"
_DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
_DEPTH = 1000  # messages kept for a slow reliable subscriber
_SETTLE_LIMIT = 15.0  # [s]; Fast DDS asks for what was lost every 3 s: a few rounds for a subscriber on a busy machine
_MATCHING = 0.2  # [s] the subscribers' side learns of the match somewhat later, and would miss the first messages


class NoSubscribersError(InputError):
    """Nobody subscribed to what is to be played."""


class BagPublishers:
    """A publisher for every topic of a bag whose type is installed.

    Args:
        node: publishes.
        bag: a rosbag2 folder, or a file.
        topics: names of those wanted; empty: all.

    Attributes:
        total: messages of these topics in the bag.
        stamped: message types that begin with a stamp of the machine's clock.

    Raises:
        BagError: not a bag, damaged beyond use, of ROS 1, or without a topic that was asked for.
    """

    def __init__(self, node: Node, bag: Path, topics: Sequence[str]) -> None:
        self._node = node
        self._bag = bag
        self._of: dict[str, Publisher] = {}
        self.total = 0
        self.stamped: set[str] = set()
        known = {topic.name: topic for topic in bag_info(bag).topics}
        if any(topic.encoding == "ros1" for topic in known.values()):
            remedy = f"convert it first: rosbags-convert --src {bag} --dst {bag.with_suffix('')}_ros2"
            raise BagError(bag, "is a ROS 1 bag, whose messages no ROS 2 node takes", remedy)
        for name in topics:
            if name not in known:
                raise BagError(bag, f"no topic {name} in the bag; it holds: {', '.join(known)}", "choose among these")
        offered = recorded_qos(bag)
        for name in topics or known:
            topic = known[name]
            try:
                kind = message_class(topic.msgtype)
            except ImportError as error:
                node.get_logger().warning(f"{name}: not played, its type {topic.msgtype} is not installed ({error})")
                continue
            first = next(iter(kind.get_fields_and_field_types().values()), "")
            if first == "std_msgs/Header" and topic.msgtype != _DIAGNOSTICS:
                self.stamped.add(topic.msgtype)
            self._of[name] = node.create_publisher(kind, name, _playing_qos(offered.get(name), topic.msgtype))
            self.total += topic.n_messages

    @property
    def names(self) -> list[str]:
        """The topics."""
        return list(self._of)

    def wait_for(self, wanted: int, patience: float, stop: threading.Event) -> None:
        """Wait up to ``patience`` [s] for ``wanted`` subscriptions, over all topics, or until ``stop`` is set.

        Raises:
            NoSubscribersError: there are fewer.
        """

        def count() -> int:
            return sum(publisher.get_subscription_count() for publisher in self._of.values())

        deadline = time.monotonic() + patience
        while count() < wanted and not stop.wait(0.02):
            if time.monotonic() > deadline:
                found = f"{count()} of {wanted} subscriptions within {patience:g} s"
                raise NoSubscribersError(self._bag, found, "start the subscribers first, or raise wait_timeout")
        if wanted:
            stop.wait(_MATCHING)

    def publish(self, message: Raw) -> None:
        """Publish the bytes of ``message`` on its topic."""
        self._of[message.topic].publish(message.data)

    def settle(self) -> None:
        """Wait until every reliable subscriber has acknowledged what was published, so that leaving loses nothing."""
        deadline = time.monotonic() + _SETTLE_LIMIT
        for publisher in self._of.values():
            wait_until_sent(self._node, publisher, max(deadline - time.monotonic(), 0.0))


def _playing_qos(recorded: Qos | None, msgtype: str) -> QoSProfile:
    """Quality of service as recorded; where the bag does not say, reliable, and latched for a friction model."""
    if recorded is None:
        latched, reliable = msgtype == _FRICTION_MODEL, True
    else:
        latched, reliable = recorded.durability.name == "TRANSIENT_LOCAL", recorded.reliability.name != "BEST_EFFORT"
    return QoSProfile(
        depth=1 if latched and recorded is None else _DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
