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

from .convert import MessageError
from .parameters import NodeParameter, Settings
from .timing import Deadlines, Reporter

__all__ = ["FricNode", "wait_until_sent"]

Message = TypeVar("Message")
Value = TypeVar("Value")


class FricNode(Node):
    """A node with declared parameters that :func:`fric_nodes.run.run` serves.

    Args:
        name: of the node.
        declarations: its parameters.
        options: ``context``, ``namespace``, ``parameter_overrides`` and the like, as for ``rclpy.node.Node``.

    Attributes:
        settings: values of the parameters.
        counters: what was counted, by name.
        deadlines: periods of the node's main activity; without a nominal period unless the node gives one.

    Raises:
        NodeParameterError: a parameter has a value that can't be used.
    """

    def __init__(self, name: str, declarations: Sequence[NodeParameter], **options: Any) -> None:
        super().__init__(name, **options)
        self.settings = Settings(self, declarations)
        self.counters: Counter[str] = Counter()
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
        self._reporter = Reporter(self, period, self.deadlines, self.counters, self.verdict, self.condition)
        return self._reporter

    def report(self) -> None:
        """Report now, besides."""
        self._reporter.publish()

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
