"""Two bare rclpy nodes that answer each other: ``python -m fric_nodes.ping_pong ping|pong events|default MESSAGES``.

``ping`` publishes joint states, and ``pong`` answers each with a force. They use the message types and the quality of service
of the loop in lock-step, and do nothing else: no parameters, no bookkeeping, no model. ``ping`` ends after so many answers and
prints how many it had per second; ``pong`` ends on SIGINT.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import rclpy
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState

from fric_interfaces.msg import StampedForce

from .qos import SAMPLES

__all__ = ["EXECUTORS", "main"]

EXECUTORS: dict[str, Callable[[], Executor]] = {"events": EventsExecutor, "default": SingleThreadedExecutor}
"""By the word on the command line; the default one is that of ``rclpy.spin``."""

_AGAIN = 0.2  # [s] physical scale: a lost message, or one before both ends were matched, is sent again after that

_LOOK = 0.1  # [s] physical scale: at most so long until an end is noticed


class _Ping(Node):
    """Asks, and counts answers."""

    def __init__(self, messages: int) -> None:
        super().__init__("ping")
        self._messages, self._count, self._begun = messages, 0, 0.0
        self._state = JointState(name=["axis"], position=[0.0], velocity=[0.0], effort=[0.0])
        self._seen = -1
        self.done = False
        self._publisher = self.create_publisher(JointState, "ping", SAMPLES)
        self.create_subscription(StampedForce, "pong", self._on_answer, SAMPLES)
        self.create_timer(_AGAIN, self._again)

    def _on_answer(self, message: StampedForce) -> None:
        if message.header.stamp.nanosec != self._count:
            return  # to a question that was repeated
        if self._count == 0:
            self._begun = time.monotonic()
        self._count += 1
        if self._count > self._messages:
            sys.stdout.write(f"{self._messages / (time.monotonic() - self._begun):.1f} answers/s\n")
            self.done = True
            return
        self._ask()

    def _ask(self) -> None:
        self._state.header.stamp.nanosec = self._count
        self._state.position[0] = float(self._count)
        self._publisher.publish(self._state)

    def _again(self) -> None:
        if self._seen == self._count:
            self._ask()
        self._seen = self._count


class _Pong(Node):
    """Answers."""

    def __init__(self) -> None:
        super().__init__("pong")
        self.done = False
        self._force = StampedForce()
        self._publisher = self.create_publisher(StampedForce, "pong", SAMPLES)
        self.create_subscription(JointState, "ping", self._on_question, SAMPLES)

    def _on_question(self, message: JointState) -> None:
        self._force.header.stamp = message.header.stamp
        self._force.force = -message.position[0]
        self._publisher.publish(self._force)


def main(arguments: list[str]) -> None:
    """Run one of the two nodes."""
    role, executor_name, messages = arguments
    rclpy.init()
    try:
        node = _Ping(int(messages)) if role == "ping" else _Pong()
        executor = EXECUTORS[executor_name]()
        executor.add_node(node)
        while not node.done:
            executor.spin_once(timeout_sec=_LOOK)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main(sys.argv[1:])
