"""The one base class of all nodes: declared parameters, counters, refusals, and reports on ``/diagnostics``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from .convert import MessageError
from .parameters import NodeParameter, Settings
from .qos import as_text, chosen_qos, qos_parameter, qos_parameters
from .qos_watch import QosWatch
from .timing import Deadlines, Reporter

__all__ = ["Described", "FricNode", "wait_until_sent"]

Message = TypeVar("Message")
Value = TypeVar("Value")
_OF_RCLPY = ("/parameter_events ", "/rosout ")


class Described(Exception):
    """Comes in place of a node that was only to say which parameters it has.

    Attributes:
        declarations: its parameters.
    """

    def __init__(self, declarations: Sequence[NodeParameter]) -> None:
        super().__init__()
        self.declarations = declarations


class FricNode(Node):
    """A node with declared parameters that :func:`fric_nodes.run.run` serves.

    Args:
        name: of the node.
        declarations: its parameters.
        describe: raise :class:`Described` instead of making a node.
        options: ``context``, ``namespace``, ``parameter_overrides`` and the like, as for ``rclpy.node.Node``.

    Attributes:
        settings: values of the parameters.
        counters: what was counted, by name.
        deadlines: periods of the node's main activity; without a nominal period unless the node gives one.

    Raises:
        NodeParameterError: a parameter has a value that can't be used, or is not known.
        Described: in place of a node, when asked for.
    """

    def __init__(self, name: str, declarations: Sequence[NodeParameter], *, describe: bool = False, **options: Any) -> None:
        declarations = (*declarations, *qos_parameters(name))
        if describe:
            raise Described(declarations)
        super().__init__(name, **options)
        self.settings = Settings(self, declarations)
        self.counters: Counter[str] = Counter()
        self._qos_watch = QosWatch(self, self.counters)
        self.deadlines = Deadlines(0.0)
        # Timers count on this clock: the node's own may be simulated, and stand still.
        self.steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._finished = False

    # What a node may override

    @staticmethod
    def make_executor() -> Executor:
        """The executor that serves the node in a process of its own."""
        return SingleThreadedExecutor()

    def begin(self) -> None:
        """Called once before the node is served, in a process that it has for itself."""

    def condition(self) -> Mapping[str, object]:
        """What the node adds to its report."""
        return {}

    def summary(self) -> str:
        """What the node works with, for the line in the log at its start."""
        return ""

    def verdict(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """Level and text of the report; ``troubles`` are the refusals and missed deadlines since the last one."""
        return DiagnosticStatus.WARN if troubles else DiagnosticStatus.OK, ", ".join(troubles) or "running"

    @property
    def done(self) -> bool:
        """True when the node has nothing more to do, so that its process ends."""
        return self._finished

    def close(self) -> None:
        """Finish what has been begun; called before the node is destroyed, while the graph still works.

        Raises:
            InputError: the work failed.
        """

    # What a node may use

    def finish(self) -> None:
        """Let the process end with status 0."""
        self._finished = True

    def report_every(self, period: float) -> Reporter:
        """Report on ``/diagnostics`` every ``period`` [s] from now on."""
        self._reporter = Reporter(self, period, self.deadlines, self.counters, self._whole_verdict, self.condition)
        return self._reporter

    def _whole_verdict(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """The node's own verdict; an error with its cause where a topic carries nothing."""
        level, text = self.verdict(troubles)
        faults = self._qos_watch.faults()
        return (DiagnosticStatus.ERROR, "; ".join([*faults, text])) if faults else (level, text)

    def introduce(self) -> None:
        """One line in the log: what the node works with, and its topics with their quality of service."""
        ends: list[tuple[str, Sequence[Publisher | Subscription]]]
        ends = [("in", list(self.subscriptions)), ("out", list(self.publishers))]
        topics = [f"{end.topic_name} {way} ({as_text(end.qos_profile)})" for way, each in ends for end in each]
        told = [topic for topic in topics if not topic.startswith(_OF_RCLPY)]
        self.get_logger().info("; ".join(part for part in (self.summary(), f"topics: {', '.join(told)}") if part))

    def report(self) -> None:
        """Report now, besides."""
        self._reporter.publish()

    def qos_of(self, topic: str, profile: QoSProfile) -> QoSProfile:
        """What the parameter ``qos.TOPIC`` asks for; ``profile`` where there is none, or it leaves the choice to the node.

        Args:
            topic: as the node names it.
            profile: the node's own choice.
        """
        name = qos_parameter(topic)
        return chosen_qos(self.settings.text(name), profile) if self.has_parameter(name) else profile

    def create_publisher(self, msg_type: Any, topic: str, qos_profile: Any, **options: Any) -> Publisher:
        """As in rclpy; with the quality of service that a parameter asks for, and what doesn't go together is reported."""
        # rclpy makes publishers of its own before there are parameters
        if isinstance(qos_profile, QoSProfile) and hasattr(self, "_qos_watch"):
            qos_profile = self.qos_of(topic, qos_profile)
            options.setdefault("event_callbacks", self._qos_watch.events_of_publisher(topic, qos_profile))
        return super().create_publisher(msg_type, topic, qos_profile, **options)

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[[Any], None], qos_profile: Any, **options: Any
    ) -> Subscription:
        """As in rclpy; with the quality of service that a parameter asks for, and what doesn't go together is reported."""
        if isinstance(qos_profile, QoSProfile) and hasattr(self, "_qos_watch"):
            qos_profile = self.qos_of(topic, qos_profile)
            if "event_callbacks" in options:
                self._qos_watch.look_always(topic, qos_profile)
            else:
                options["event_callbacks"] = self._qos_watch.events_of_subscription(topic, qos_profile)
        return super().create_subscription(msg_type, topic, callback, qos_profile, **options)

    def refuse(self, what: str, why: object) -> None:
        """Count an input that can't be used, and say so at most once a second."""
        self.counters[f"refused {what}"] += 1
        self.get_logger().warning(f"refused {what}: {why}", throttle_duration_sec=1.0)

    def usable(self, what: str, read: Callable[[Message], Value], message: Message) -> Value | None:
        """What ``read`` makes of ``message``; None, and a refusal of ``what``, when it can't be used."""
        try:
            return read(message)
        except MessageError as error:
            self.refuse(what, error)
            return None


def wait_until_sent(node: Node, publisher: Publisher, seconds: float) -> None:
    """Give matched subscribers up to ``seconds`` [s] to receive the last message."""
    if not publisher.wait_for_all_acked(Duration(seconds=seconds)):
        node.get_logger().warning(f"{publisher.topic_name}: not every subscriber has received the last message")
