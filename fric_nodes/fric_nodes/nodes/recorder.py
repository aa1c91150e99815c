"""Records topics of the running graph into a rosbag2 bag, whatever their types, without decoding them."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from fric.bagio.errors import WriteError
from fric.bagio.message_order import ReceiveOrder, StampOrder, TopicIntake
from fric.bagio.padding import PaddingEraser
from fric.bagio.types import type_fields
from fric.bagio.write import BagWriter
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile
from rclpy.topic_endpoint_info import TopicEndpointInfo

from ..bulk import BulkSubscription, message_class, offered_qos
from ..orderly import OrderlyNode, run
from ..parameters import NodeParameter, NodeParameterError, Settings
from ..qos import DIAGNOSTICS

__all__ = ["DEFAULT_TOPICS", "PARAMETERS", "RecorderNode", "main"]

DEFAULT_TOPICS = (
    "joint_states",
    "force_command",
    "reference",
    "feedforward_force",
    "normal_load",
    "temperature",
    "friction/model",
    "friction/estimate",
    "/diagnostics",  # one for the whole graph, whatever the namespace
)
PARAMETERS = (
    NodeParameter("bag", "", "folder of the bag to write; must not exist"),
    NodeParameter("storage", "mcap", "storage format of the bag", choices=("mcap", "sqlite3")),
    NodeParameter("compression", "none", "compression of chunks (mcap) or messages (sqlite3)", choices=("none", "zstd")),
    NodeParameter("topics", list(DEFAULT_TOPICS), "names of the topics, relative ones in the node's namespace"),
    NodeParameter("all_topics", False, "record every topic that is not hidden"),
    NodeParameter("log_time", "receive", "log times: of reception, or the messages' stamps", choices=("receive", "stamp")),
    NodeParameter("joint", "axis", "name of the joint, for those who read the bag"),
    NodeParameter("position_unit", "m", "unit of positions, for those who read the bag"),
    NodeParameter("force_unit", "N", "unit of efforts, for those who read the bag"),
    NodeParameter("effort_hold", "preceding", "when an effort acts", choices=("following", "preceding", "linear", "unknown")),
    NodeParameter("queue_depth", 5000, "messages that may wait on each topic between two rounds", lower=1, upper=1_000_000),
    NodeParameter("drain_period", 0.02, "time between two rounds of taking messages", unit="s", lower=0.001, upper=1.0),
)
_DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
_BATCH = 20_000  # messages taken from one topic in one round, so that a flood on one cannot starve the others


class RecorderNode(OrderlyNode):
    """Writes what is published on its topics into a bag, from its construction to :meth:`close`.

    Raises:
        WriteError: the bag exists already or cannot be written.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__("recorder", **node_options)
        settings = Settings(self, PARAMETERS)
        if not settings.text("bag"):
            raise NodeParameterError("parameter 'bag' of the recorder", "is missing", "name the folder to record into")
        bag = Path(settings.text("bag"))
        self._all_topics = settings.flag("all_topics")
        self._by_stamp = settings.text("log_time") == "stamp"
        self._depth = settings.integer("queue_depth")
        self._wanted = {self.resolve_topic_name(name) for name in settings.texts("topics") or DEFAULT_TOPICS}
        storage: Any = settings.text("storage")
        compression: Any = settings.text("compression")
        stored = ("joint", "position_unit", "force_unit", "effort_hold", "log_time")
        metadata = {f"fric.{name}": settings.text(name) for name in stored}
        self._writer = BagWriter(bag, storage=storage, compression=compression, metadata=metadata)
        self._topics: list[TopicIntake] = []
        self._order = StampOrder(self._topics, self._warn_restart) if self._by_stamp else ReceiveOrder(self._topics)
        self._bulk: list[BulkSubscription] = []
        self._erasers: list[PaddingEraser] = []
        self._refused: set[str] = set()
        self._written_before = 0
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
        steady = Clock(clock_type=ClockType.STEADY_TIME)  # the node's own clock may be simulated, and stand still
        for period, work in ((settings.number("drain_period"), self.drain), (0.05, self.discover), (1.0, self.report)):
            self.create_timer(period, work, clock=steady)
        self.get_logger().info(f"recording into {bag}")

    def discover(self) -> None:
        """Subscribe to every wanted topic whose type has become known, and follow a change of its quality of service."""
        known = {subscription.topic: at for at, subscription in enumerate(self._bulk)}
        for topic, _ in self.get_topic_names_and_types():
            if topic in self._refused or not (topic in self._wanted or (self._all_topics and "/_" not in topic)):
                continue
            # The graph's own list of types also holds those that are only subscribed to.
            publishers = self.get_publishers_info_by_topic(topic)
            at = known.get(topic)
            if at is None:
                if publishers:
                    self._subscribe(topic, publishers)
                continue
            present = self._bulk[at]
            qos = offered_qos([p for p in publishers if p.topic_type == present.msgtype], self._depth)
            if not _receives_as_well(present.qos, qos):
                # A publisher with less to offer has joined, from which the present subscription would receive nothing.
                self._take(at)
                self._bulk[at] = BulkSubscription(self, present.msgtype, topic, qos)
                present.destroy()

    def _subscribe(self, topic: str, publishers: Sequence[TopicEndpointInfo]) -> None:
        msgtype = publishers[0].topic_type
        if any(publisher.topic_type != msgtype for publisher in publishers):
            self.get_logger().warning(f"{topic}: published with several types; only {msgtype} is recorded")
        try:
            first = next(iter(message_class(msgtype).get_fields_and_field_types().values()), "")
            self._writer.topic(topic, msgtype)
            qos = offered_qos([p for p in publishers if p.topic_type == msgtype], self._depth)
            self._bulk.append(BulkSubscription(self, msgtype, topic, qos))
        except (ImportError, WriteError) as error:
            self._refused.add(topic)
            self.get_logger().warning(f"{topic}: not recorded, its type {msgtype} is not installed ({error})")
            return
        self._erasers.append(PaddingEraser(msgtype, type_fields(msgtype)))
        stamped = first == "std_msgs/Header"
        self._topics.append(TopicIntake(topic, stamped, follows_clock=stamped and msgtype != _DIAGNOSTICS))
        self.get_logger().info(f"recording {topic} [{msgtype}]")

    def _take(self, at: int) -> None:
        """Move what topic number ``at`` has received from the middleware's queue into the order."""
        subscription, intake, add = self._bulk[at], self._topics[at], self._order.add
        one_publisher = subscription.publishers() <= 1
        erase = self._erasers[at]
        for payload, received, sequence in subscription.take(_BATCH):
            intake.count(sequence, one_publisher)
            # Without this, neither would retransmissions be recognised nor two runs of one lock-step give the same bag.
            add(at, erase(payload), received)

    def drain(self) -> None:
        """Take what the middleware has received on all topics, and write what is complete."""
        before = time.time_ns()  # the clock on which the middleware stamps reception
        for at in range(len(self._topics)):
            self._take(at)
        self._write(before)

    def _write(self, before: int | None) -> None:
        write, topics = self._writer.write, self._topics
        for log_time, at, payload in self._order.release(before):
            topic = topics[at]
            write(topic.name, log_time, payload)
            topic.written += 1

    @property
    def written(self) -> Counter[str]:
        """Messages written so far, by topic."""
        return Counter({topic.name: topic.written for topic in self._topics})

    def _warn_restart(self, topic: str) -> None:
        self.get_logger().warning(f"{topic}: stamps start again from an earlier time; the bag goes on, in a part of its own")

    def report(self) -> None:
        """Publish counts, rate and losses on /diagnostics."""
        lost = sum(topic.lost for topic in self._topics)
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if lost else DiagnosticStatus.OK,
            name=f"{self.get_fully_qualified_name()}: recording",
            message=f"{lost} messages lost" if lost else "no message lost",
            hardware_id="",
        )
        written = sum(self.written.values())
        values: dict[str, object] = {
            "written": written,
            "rate [1/s]": written - self._written_before,
            "lost": lost,
        }
        for topic in self._topics:
            values[topic.name] = f"{topic.received} received, {topic.repeated} repeated, {topic.lost} lost"
        status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        self._written_before = written
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def close(self) -> None:
        """Take what is still in the queues, write it all and close the bag."""
        self.drain()
        self._write(None)
        self._writer.close()
        lost = sum(topic.lost for topic in self._topics)
        self.get_logger().info(f"recorded {sum(self.written.values())} messages, {lost} lost")


def _receives_as_well(present: QoSProfile, offered: QoSProfile) -> bool:
    """True when a subscription with ``present`` receives from publishers with which ``offered`` is the best that can be had."""
    return bool(present.reliability >= offered.reliability and present.durability >= offered.durability)


def main(args: list[str] | None = None) -> None:
    """Record until SIGINT or SIGTERM, then close the bag; exit status 2 when the bag cannot be written."""
    run("recorder", RecorderNode, args)


if __name__ == "__main__":
    main()
