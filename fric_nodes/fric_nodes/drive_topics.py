"""Topics of a drive behind ros2_control, as the drive protocol in the library wants them."""

from __future__ import annotations

import math

from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from .base import FricNode
from .convert import nanoseconds
from .qos import LATEST, SAMPLES

__all__ = ["DriveTopics"]


class DriveTopics:
    """Joint states of ros2_control in, efforts out.

    Args:
        node: whose topics they are.
        states: topic of the joint states of ros2_control.
    """

    def __init__(self, node: FricNode, states: str) -> None:
        self._node = node
        self._newest: JointState | None = None
        self._publishers: dict[str, Publisher] = {}
        node.create_subscription(JointState, states, self._on_state, node.qos_of("drive_states", LATEST))

    def _on_state(self, message: JointState) -> None:
        self._newest = message

    def send(self, topic: str, values: list[float]) -> None:
        """Publish one value for each joint."""
        if topic not in self._publishers:
            self._publishers[topic] = self._node.create_publisher(Float64MultiArray, topic, SAMPLES)
        self._publishers[topic].publish(Float64MultiArray(data=values))

    def newest(self) -> tuple[int, dict[str, tuple[float, float, float]]] | None:
        """Stamp [ns] of the newest joint state, and position, velocity and effort of its joints; None: none yet."""
        message = self._newest
        if message is None:
            return None
        columns = (message.position, message.velocity, message.effort)
        joints = {
            name: tuple(column[k] if k < len(column) else math.nan for column in columns)
            for k, name in enumerate(message.name)
            if k < len(message.position)
        }
        return nanoseconds(message.header.stamp), joints  # type: ignore[return-value]
