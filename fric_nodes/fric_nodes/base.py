"""What every node of the loop has: declared parameters, counters, deadlines, and a report of them on ``/diagnostics``."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.task import Future

from .parameters import NodeParameter, Settings
from .scheduling import use_realtime_scheduling
from .timing import Deadlines, Reporter

__all__ = ["COMMON", "LOCK_STEP", "PERIOD", "LoopNode", "wait_until_sent", "wall_clock"]

PERIOD = NodeParameter("period", 0.002, "sample period of the loop", "s", 1e-5, 10.0)
LOCK_STEP = NodeParameter("lock_step", False, "count samples instead of time: the plant waits for the command to each sample")
COMMON = (
    NodeParameter("joint", "axis", "name of the joint in joint states and models"),
    NodeParameter(
        "realtime_priority", 0, "wall time: SCHED_FIFO priority to ask the system for; 0: normal scheduling", "", 0, 99
    ),
    NodeParameter("wait_for_subscribers", 1, "publish the first sample when so many listen; later ones always", "", 0, 100),
    NodeParameter("diagnostics_period", 1.0, "time between two reports on /diagnostics", "s", 0.01, 3600.0),
)


class LoopNode(Node):
    """A node with declared parameters that reports on itself.

    Args:
        name: of the node.
        declarations: its parameters besides the common ones.
        options: ``context``, ``namespace``, ``parameter_overrides`` and the like, as for ``rclpy.node.Node``.

    Attributes:
        settings: values of the parameters.
        counters: what was counted, by name.
        deadlines: periods of the node's main activity.
        finished: done when the node has nothing more to do, so that its process ends.

    Raises:
        NodeParameterError: a parameter has a value that can't be used.
    """

    def __init__(self, name: str, declarations: Sequence[NodeParameter], **options: Any) -> None:
        super().__init__(name, **options)
        self.settings = Settings(self, (*COMMON, *declarations))
        self.counters: Counter[str] = Counter()
        self.joint = self.settings.text("joint")
        self.lock_step = LOCK_STEP in declarations and self.settings.flag("lock_step")
        self.period = self.settings.number("period") if PERIOD in declarations else 0.0
        self.deadlines = Deadlines(0.0 if self.lock_step else self.period)
        self.finished: Future = Future()
        self._scheduling = "normal"
        self._heard = False
        self._reporter = Reporter(
            self, self.settings.number("diagnostics_period"), self.deadlines, self.counters, self._all_conditions
        )

    def settle(self) -> None:
        """Called once before the loop starts, by a process that the node has for itself."""
        priority = self.settings.integer("realtime_priority")
        if priority > 0 and not self.lock_step:
            self._scheduling = use_realtime_scheduling(priority)
            self.get_logger().info(f"scheduling: {self._scheduling}")

    def _all_conditions(self) -> Mapping[str, str]:
        return {"scheduling": self._scheduling, **self.condition()}

    def condition(self) -> Mapping[str, str]:
        """What the node adds to its report; overridden where there is something."""
        return {}

    def has_audience(self, publisher: Publisher) -> bool:
        """True once as many nodes as asked for listen to ``publisher``, and from then on."""
        if not self._heard:
            self._heard = bool(publisher.get_subscription_count() >= self.settings.integer("wait_for_subscribers"))
        return self._heard

    def refuse(self, what: str, why: object) -> None:
        """Count an input that can't be used, and say so at most once a second."""
        self.counters[f"refused {what}"] += 1
        self.get_logger().warning(f"refused {what}: {why}", throttle_duration_sec=1.0)

    def finish(self) -> None:
        """Let the process end with status 0."""
        if not self.finished.done():
            self.finished.set_result(None)

    def close(self) -> None:
        """Called before the node is destroyed; overridden where something is to be closed."""


def wall_clock() -> tuple[int, int]:
    """Time since 1970 and monotonic time of one instant [ns]: stamps count on from here, free of clock corrections."""
    return time.time_ns(), time.monotonic_ns()


def wait_until_sent(node: Node, publisher: Publisher, seconds: float) -> None:
    """Give matched subscribers up to ``seconds`` [s] to receive the last message."""
    if not publisher.wait_for_all_acked(Duration(seconds=seconds)):
        node.get_logger().warning(f"{publisher.topic_name}: not every subscriber has received the last message")
