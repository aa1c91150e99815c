"""What an axis measures, on topics: ``joint_states``, and each further signal of its plant on a topic of its own."""

from __future__ import annotations

import time

from fric.axis import SimulatedAxis
from fric.errors import InputError
from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState

from .axis_parameters import model_at, model_in
from .base import wait_until_sent
from .convert import set_stamp
from .forces import ForcePublisher
from .loop import LoopNode
from .qos import SAMPLES

__all__ = ["AxisOutput", "ModelSwitch"]


class AxisOutput:
    """Publishes what ``axis`` measures.

    Args:
        node: whose publishers these are; its parameter ``publish_velocity`` says whether the velocity is filled in.
        axis: measured at :meth:`measure`.

    Attributes:
        publisher: of the joint states.
        stamp: of the last measurement [ns].
    """

    def __init__(self, node: LoopNode, axis: SimulatedAxis) -> None:
        self._node = node
        self._axis = axis
        self._velocity = node.settings.flag("publish_velocity")
        self._state = JointState(name=[node.joint], position=[0.0])
        self._state.header.frame_id = node.joint
        self.publisher: Publisher = node.create_publisher(JointState, "joint_states", SAMPLES)
        self._signals = [ForcePublisher(node, name) for name in axis.signal_names]
        self._values: list[float] = []
        self.stamp = 0

    def measure(self, stamp: int) -> None:
        """Measure now; the measurement's stamp is ``stamp`` [ns]."""
        state, measured = self._state, self._axis.measure()
        self._values = self._axis.signals()
        self.stamp = stamp
        set_stamp(state.header.stamp, stamp)
        state.position = [measured.position]
        state.velocity = [measured.velocity] if self._velocity else []
        state.effort = [measured.effort]

    def publish(self) -> None:
        """Publish the last measurement: the plant's signals, and then the state, which calls forth the next command."""
        for publisher, value in zip(self._signals, self._values, strict=True):
            publisher.publish(self.stamp, value)
        self.publisher.publish(self._state)

    def wait_until_sent(self, seconds: float) -> None:
        """Give subscribers up to ``seconds`` [s] in all to receive the last messages."""
        deadline = time.monotonic() + seconds
        for publisher in (self.publisher, *(signal.publisher for signal in self._signals)):
            wait_until_sent(self._node, publisher, max(deadline - time.monotonic(), 0.0))


class ModelSwitch:
    """Gives ``axis`` another model when the parameter ``model_file`` of ``node`` is set.

    Args:
        node: whose parameter it is.
        axis: goes on with the other model's values.
        output: tells the time of the change.

    Attributes:
        since: stamp of the last state before the present model [ns].
    """

    def __init__(self, node: LoopNode, axis: SimulatedAxis, output: AxisOutput) -> None:
        self._node = node
        self._axis = axis
        self._output = output
        self.since = 0
        node.settings.test_before("model_file", lambda path: axis.accepts(model_at(path)))
        node.settings.when_changed(self._on_settings)

    def _on_settings(self, changed: set[str]) -> None:
        node = self._node
        if "model_file" not in changed:
            return
        try:
            self._axis.become(model_in(node.settings))
        except InputError as error:
            node.refuse("model", error)
            return
        node.counters["models"] += 1
        self.since = self._output.stamp
        node.get_logger().info(f"moves by the new model from {1e-9 * self.since:.6f} s on")
