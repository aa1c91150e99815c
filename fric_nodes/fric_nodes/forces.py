"""Forces and references on topics: one place that knows both message types of a force and what makes a message unusable.

In wall time a force is a ``std_msgs/Float64``; in lock-step, or where a node is told so, it is a
``fric_interfaces/StampedForce`` that says to which sample it belongs.
"""

from __future__ import annotations

import math
from typing import Any

from fric.control.reference import ReferencePoint
from std_msgs.msg import Float64

from fric_interfaces.msg import Reference, StampedForce

from .convert import MessageError, nanoseconds, set_stamp
from .loop import LoopNode
from .parameters import NodeParameter
from .qos import SAMPLES

__all__ = ["STAMPED", "ForcePublisher", "force_in", "force_or_nan", "force_type", "reference_in"]

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


def force_or_nan(message: StampedForce | Float64) -> tuple[int, float]:
    """As :func:`force_in`, for a safety layer, which refuses what is not finite and knows what it was."""
    try:
        return force_in(message)
    except MessageError:
        return -1, math.nan


def force_type(node: LoopNode) -> Any:
    """The message type of the forces that ``node`` takes and gives."""
    return StampedForce if node.lock_step or node.settings.flag(STAMPED.name) else Float64


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
