"""Forces and references on topics: one place that knows both message types of a force and what makes a message unusable.

In wall time a force is a ``std_msgs/Float64``; in lock-step, or where a node is told so, it is a
``fric_interfaces/StampedForce`` that says to which sample it belongs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from fric.control.reference import ReferencePoint
from fric.control.safety.senders import SenderWatch
from std_msgs.msg import Float64

from fric_interfaces.msg import Reference, StampedForce

from .convert import MessageError, nanoseconds, set_stamp
from .loop import LoopNode
from .parameters import NodeParameter
from .qos import SAMPLES

__all__ = ["STAMPED", "ForcePublisher", "SenderCheck", "force_in", "force_type", "reference_in"]

STAMPED = NodeParameter("stamped", False, "wall time: use StampedForce instead of Float64 for forces; lock-step always does")


def reference_in(message: Reference) -> ReferencePoint:
    """The numbers of a reference.

    Raises:
        MessageError: one of them is not finite.
    """
    position, velocity, acceleration = message.position, message.velocity, message.acceleration
    if not (math.isfinite(position) and math.isfinite(velocity) and math.isfinite(acceleration)):
        raise MessageError(f"position {position}, velocity {velocity}, acceleration {acceleration}")
    return ReferencePoint(nanoseconds(message.header.stamp), position, velocity, acceleration)


def force_in(message: StampedForce | Float64) -> tuple[int, float]:
    """Stamp [ns] (-1 without one) and force [F] of a message.

    Raises:
        MessageError: the force is not finite.
    """
    stamp, force = (-1, message.data) if isinstance(message, Float64) else (nanoseconds(message.header.stamp), message.force)
    if not math.isfinite(force):
        raise MessageError(f"force is {force}")
    return stamp, force


def force_type(node: LoopNode) -> Any:
    """The message type of the forces that ``node`` takes and gives."""
    return StampedForce if node.lock_step or node.settings.flag(STAMPED.name) else Float64


class SenderCheck:
    """Takes ``force_command``, and says when more than one publisher is at work there.

    Args:
        node: counts and says what is refused.
        on_command: takes the messages.
    """

    def __init__(self, node: LoopNode, on_command: Callable[[Any], None]) -> None:
        self._node = node
        self._subscription = node.create_subscription(force_type(node), "force_command", on_command, node.input_qos)
        self._watch = SenderWatch()

    def alone(self) -> bool:
        """A command has come; True when it may be used."""
        self._watch.command()
        if self._watch.many:
            self._node.refuse("command: second source", "more than one publisher commands; the drive gives no force")
        return not self._watch.many

    def sample(self) -> None:
        """A sample is over."""
        self._watch.sample(self._subscription.get_publisher_count())


class ForcePublisher:
    """Publishes forces of ``node`` on ``topic``, in the type that it is told to use.

    Attributes:
        publisher: the publisher itself.
    """

    def __init__(self, node: LoopNode, topic: str) -> None:
        self._message = force_type(node)()
        if isinstance(self._message, StampedForce):
            self._message.header.frame_id = node.joint
        self.publisher = node.create_publisher(type(self._message), topic, SAMPLES)

    def publish(self, stamp: int, force: float) -> None:
        """Publish ``force`` [F] for the sample ``stamp`` [ns]."""
        message = self._message
        if isinstance(message, Float64):
            message.data = force
        else:
            set_stamp(message.header.stamp, stamp)
            message.force = force
        self.publisher.publish(message)

    def repeat(self) -> None:
        """Publish the last one again."""
        self.publisher.publish(self._message)
