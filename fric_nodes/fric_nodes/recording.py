"""Topics of the running graph on their way into a bag, whatever their types, without decoding them."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence

from fric.bagio.errors import WriteError
from fric.bagio.message_order import ReceiveOrder, StampOrder, TopicIntake
from fric.bagio.padding import PaddingEraser
from fric.bagio.types import type_fields
from fric.bagio.write import BagWriter
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosbags.interfaces import Qos

from .bulk import BulkSubscription, message_class, offered_qos, stored_qos

__all__ = ["Recording"]

_DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
_BATCH = 20_000  # messages taken from one topic in one round, so that a flood on one cannot starve the others


class Recording:
    """Subscribes to topics and writes what they bring.

    Args:
        node: subscribes.
        writer: of the bag.
        wanted: full names of topics; None takes every topic that is not hidden.
        depth: messages that may wait on each topic between two rounds.
        by_stamp: log times are the messages' stamps; False: the times of reception.

    Attributes:
        topics: those found so far.
    """

    def __init__(self, node: Node, writer: BagWriter, wanted: Collection[str] | None, depth: int, by_stamp: bool) -> None:
        self._node = node
        self._writer = writer
        self._wanted = wanted
        self._depth = depth
        self.topics: list[TopicIntake] = []
        self._order = StampOrder(self.topics, self._warn_restart) if by_stamp else ReceiveOrder(self.topics)
        self._bulk: list[BulkSubscription] = []
        self._erasers: list[PaddingEraser] = []
        self._refused: set[str] = set()
        self._known: set[tuple[int, ...]] = set()  # publishers whose offer is in the bag

    @property
    def lost(self) -> int:
        """Messages that were sent and never came."""
        return sum(topic.lost for topic in self.topics)

    @property
    def written(self) -> int:
        """Messages written so far."""
        return sum(topic.written for topic in self.topics)

    def _wants(self, topic: str) -> bool:
        if topic in self._refused:
            return False
        return "/_" not in topic if self._wanted is None else topic in self._wanted

    def discover(self) -> None:
        """Subscribe to every wanted topic whose type has become known, and follow a change of its quality of service."""
        known = {subscription.topic: at for at, subscription in enumerate(self._bulk)}
        for topic, _ in self._node.get_topic_names_and_types():
            if not self._wants(topic):
                continue
            # The graph's own list of types also holds those that are only subscribed to.
            publishers = self._node.get_publishers_info_by_topic(topic)
            at = known.get(topic)
            if at is None:
                if publishers:
                    self._subscribe(topic, publishers)
                continue
            present = self._bulk[at]
            publishers = [publisher for publisher in publishers if publisher.topic_type == present.msgtype]
            self._writer.offer(topic, self._new_offers(publishers))
            qos = offered_qos(publishers, self._depth)
            if not _receives_as_well(present.qos, qos):
                # A publisher with less to offer has joined, from which the present subscription would receive nothing.
                self._take(at)
                self._bulk[at] = BulkSubscription(self._node, present.msgtype, topic, qos)
                present.destroy()

    def _new_offers(self, publishers: Sequence[TopicEndpointInfo]) -> list[Qos]:
        """What those of ``publishers`` offer that were not there before."""
        new = [publisher for publisher in publishers if tuple(publisher.endpoint_gid) not in self._known]
        self._known |= {tuple(publisher.endpoint_gid) for publisher in new}
        return list(dict.fromkeys(stored_qos(publisher.qos_profile) for publisher in new))

    def _subscribe(self, topic: str, publishers: Sequence[TopicEndpointInfo]) -> None:
        msgtype = publishers[0].topic_type
        if any(publisher.topic_type != msgtype for publisher in publishers):
            self._node.get_logger().warning(f"{topic}: published with several types; only {msgtype} is recorded")
        try:
            first = next(iter(message_class(msgtype).get_fields_and_field_types().values()), "")
            publishers = [publisher for publisher in publishers if publisher.topic_type == msgtype]
            self._writer.topic(topic, msgtype, offered=self._new_offers(publishers))
            qos = offered_qos(publishers, self._depth)
            self._bulk.append(BulkSubscription(self._node, msgtype, topic, qos))
        except (ImportError, WriteError) as error:
            self._refused.add(topic)
            self._node.get_logger().warning(f"{topic}: not recorded, its type {msgtype} is not installed ({error})")
            return
        self._erasers.append(PaddingEraser(msgtype, type_fields(msgtype)))
        stamped = first == "std_msgs/Header"
        self.topics.append(TopicIntake(topic, stamped, follows_clock=stamped and msgtype != _DIAGNOSTICS))
        self._node.get_logger().info(f"recording {topic} [{msgtype}]")

    def _take(self, at: int) -> None:
        """Move what topic number ``at`` has received from the middleware's queue into the order."""
        subscription, intake, add = self._bulk[at], self.topics[at], self._order.add
        one_publisher = subscription.publishers() <= 1
        erase = self._erasers[at]
        for payload, received, sequence in subscription.take(_BATCH):
            intake.count(sequence, one_publisher)
            # Without this, neither would retransmissions be recognised nor two runs of one lock-step give the same bag.
            add(at, erase(payload), received)

    def drain(self) -> None:
        """Take what the middleware has received on all topics, and write what is complete."""
        before = time.time_ns()  # the clock on which the middleware stamps reception
        for at in range(len(self.topics)):
            self._take(at)
        self._write(before)

    def _write(self, before: int | None) -> None:
        write, topics = self._writer.write, self.topics
        for log_time, at, payload in self._order.release(before):
            topic = topics[at]
            write(topic.name, log_time, payload)
            topic.written += 1

    def _warn_restart(self, topic: str) -> None:
        self._node.get_logger().warning(
            f"{topic}: stamps start again from an earlier time; the bag goes on, in a part of its own"
        )

    def close(self) -> None:
        """Take what is still in the queues, write it all and close the bag."""
        self.drain()
        self._write(None)
        self._writer.close()


def _receives_as_well(present: QoSProfile, offered: QoSProfile) -> bool:
    """True when a subscription with ``present`` receives from publishers with which ``offered`` is the best that can be had."""
    return bool(present.reliability >= offered.reliability and present.durability >= offered.durability)
