"""Records topics of the running graph into a rosbag2 bag, whatever their types, without decoding them."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions

from ..bagio.errors import WriteError
from ..bagio.write import BagWriter
from ..errors import InputError
from .bulk import BulkSubscription, message_class, offered_qos
from .message_order import ReceiveOrder, StampOrder, TopicIntake

__all__ = ["DEFAULT_TOPICS", "RecorderNode", "main"]

DEFAULT_TOPICS = (
    "joint_states",
    "force_command",
    "reference",
    "feedforward_force",
    "friction/model",
    "friction/estimate",
    "diagnostics",
)
_DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
_BATCH = 20_000  # messages taken from one topic in one round, so that a flood on one cannot starve the others


class RecorderNode(Node):
    """Writes what is published on its topics into a bag, from its construction to :meth:`close`.

    Raises:
        WriteError: the bag exists already or cannot be written.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__("recorder", **node_options)
        declare = self.declare_parameter
        bag = Path(declare("bag", "").value)
        storage = declare("storage", "mcap").value
        compression = declare("compression", "none").value
        names = declare("topics", list(DEFAULT_TOPICS)).value or DEFAULT_TOPICS
        self._all_topics = declare("all_topics", False).value
        self._by_stamp = declare("log_time", "receive").value == "stamp"
        self._depth = declare("queue_depth", 5000).value
        drain_period = declare("drain_period", 0.02).value
        metadata = {
            "fric.joint": declare("joint", "axis").value,
            "fric.position_unit": declare("position_unit", "m").value,
            "fric.force_unit": declare("force_unit", "N").value,
            "fric.effort_hold": declare("effort_hold", "preceding").value,
            "fric.log_time": "stamp" if self._by_stamp else "receive",
        }
        self._wanted = {self.resolve_topic_name(name) for name in names}
        self._writer = BagWriter(bag, storage=storage, compression=compression, metadata=metadata)
        self._topics: list[TopicIntake] = []
        self._order = StampOrder(self._topics, self._warn_restart) if self._by_stamp else ReceiveOrder(self._topics)
        self._bulk: list[BulkSubscription] = []
        self._refused: set[str] = set()
        self._written = self._written_before = 0
        self._diagnostics = self.create_publisher(DiagnosticArray, "diagnostics", 10)
        self.create_timer(drain_period, self._drain)
        self.create_timer(0.05, self._discover)
        self.create_timer(1.0, self._report)
        self.get_logger().info(f"recording into {bag}")

    def _discover(self) -> None:
        """Subscribe to every wanted topic whose type has become known, and follow a change of its quality of service."""
        known = {subscription.topic: at for at, subscription in enumerate(self._bulk)}
        for topic, types in self.get_topic_names_and_types():
            wanted = topic in self._wanted or (self._all_topics and "/_" not in topic)
            if not wanted or topic in self._refused or not self.count_publishers(topic):
                continue
            qos = offered_qos(self, topic, self._depth)
            at = known.get(topic)
            if at is None:
                self._subscribe(topic, types, qos)
            elif not _receives_as_well(self._bulk[at].qos, qos):
                # A publisher with less to offer has joined, from which the present subscription would receive nothing.
                self._take(at)
                old = self._bulk[at]
                self._bulk[at] = BulkSubscription(self, old.msgtype, topic, qos)
                old.destroy()

    def _subscribe(self, topic: str, types: Sequence[str], qos: QoSProfile) -> None:
        try:
            if len(types) > 1:
                self.get_logger().warning(f"{topic}: published as {', '.join(types)}; only {types[0]} is recorded")
            first = next(iter(message_class(types[0]).get_fields_and_field_types().values()), "")
            self._writer.topic(topic, types[0])
            self._bulk.append(BulkSubscription(self, types[0], topic, qos))
        except (ImportError, WriteError) as error:
            self._refused.add(topic)
            self.get_logger().warning(f"{topic}: not recorded, its type {types[0]} is not installed ({error})")
            return
        stamped = first == "std_msgs/Header"
        self._topics.append(TopicIntake(topic, stamped, follows_clock=stamped and types[0] != _DIAGNOSTICS))
        self.get_logger().info(f"recording {topic} [{types[0]}]")

    def _take(self, at: int) -> None:
        """Move what topic number ``at`` has received from the middleware's queue into the order."""
        subscription, intake, add = self._bulk[at], self._topics[at], self._order.add
        one_publisher = subscription.publishers() <= 1
        for payload, received, sequence in subscription.take(_BATCH):
            intake.count(sequence, one_publisher)
            add(at, payload, received)

    def _drain(self) -> None:
        before = time.time_ns()  # the clock on which the middleware stamps reception
        for at in range(len(self._topics)):
            self._take(at)
        self._write(before)

    def _write(self, before: int | None) -> None:
        write, topics = self._writer.write, self._topics
        ready = self._order.release(before)
        for log_time, at, payload in ready:
            write(topics[at].name, log_time, payload)
        self._written += len(ready)

    def _warn_restart(self, topic: str) -> None:
        self.get_logger().warning(f"{topic}: stamps start again from an earlier time; the bag goes on, in a part of its own")

    def _report(self) -> None:
        lost = sum(topic.lost for topic in self._topics)
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if lost else DiagnosticStatus.OK,
            name=f"{self.get_fully_qualified_name()}: recording",
            message=f"{lost} messages lost" if lost else "no message lost",
            hardware_id="",
        )
        values: dict[str, object] = {
            "written": self._written,
            "rate [1/s]": self._written - self._written_before,
            "lost": lost,
        }
        for topic in self._topics:
            values[topic.name] = f"{topic.received} received, {topic.repeated} repeated, {topic.lost} lost"
        status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        self._written_before = self._written
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def close(self) -> None:
        """Take what is still in the queues, write it all and close the bag."""
        self._drain()
        self._write(None)
        self._writer.close()
        lost = sum(topic.lost for topic in self._topics)
        self.get_logger().info(f"recorded {self._written} messages, {lost} lost")


def _receives_as_well(present: QoSProfile, offered: QoSProfile) -> bool:
    """True when a subscription with ``present`` receives from publishers with which ``offered`` is the best that can be had."""
    return present.reliability >= offered.reliability and present.durability >= offered.durability


def main(args: list[str] | None = None) -> None:
    """Record until SIGINT or SIGTERM, then close the bag; exit status 2 when the bag cannot be written."""
    # rclpy's own handlers would shut the context down, and with it the queues that are still to be written, and could
    # interrupt a write half-way. So a signal only sets a flag here, which is looked at between two rounds of the executor.
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = RecorderNode()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not stop.is_set():
            executor.spin_once(timeout_sec=0.1)
        node.close()
        node.destroy_node()
    except InputError as error:
        print(f"recorder: {error}", file=sys.stderr)
        sys.exit(2)
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
