"""How an experiment moves the axis: by forces of its own, or through the node ``pid``, whose gains it sets.

Through a controller: its parameters are set by its parameter service, its reference and feedforward come from here. A setting
takes a while; meanwhile nothing else is asked of the axis, so that in lock-step it doesn't move on. The force is cut by the
controller's limit, which takes effect whatever it remembers.
"""

from __future__ import annotations

import math
import time
from typing import Protocol

from fric.experiment import answering
from fric.experiment.motion import Drive, ExperimentError, Law, Sample
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.task import Future

from fric_interfaces.msg import Reference

from .convert import set_stamp
from .forces import ForcePublisher
from .loop import LoopNode
from .qos import SAMPLES

__all__ = ["ControllerDrive", "ForceDrive", "Output"]

# A request or its answer may be lost where the controller is begun anew, or where two nodes have only just met: the parts of a
# service are matched one by one (https://github.com/ros2/rmw_fastrtps/pull/418). A setting may be asked for twice: one client's
# requests keep their order.
_ASK_AGAIN = 1.0  # [s]


class Output(answering.Output, Protocol):
    """Where the drives of an experiment go, on topics."""

    @property
    def publisher(self) -> Publisher:
        """The one whose audience has to be there."""

    def repeat(self) -> None:
        """Give the last answer again."""

    def stop(self, stamp: int) -> Future | None:
        """Leave the drive without force; the future is done when it is, None: at once."""


class ForceDrive:
    """Gives ``force_command``.

    Args:
        node: the experiment.
        limit: largest force [F].
        filter_time: of the velocity [s].
    """

    def __init__(self, node: LoopNode, limit: float, filter_time: float) -> None:
        self._forces = ForcePublisher(node, "force_command")
        self._law = Law(limit, filter_time)
        self.publisher: Publisher = self._forces.publisher

    @property
    def saturated(self) -> int:
        """Samples at which the limit took something away."""
        return self._law.saturated

    def give(self, stamp: int, drive: Drive, sample: Sample) -> float | None:
        """See :class:`Output`."""
        force = self._law.force(drive, sample)
        force = force if math.isfinite(force) else 0.0
        self._forces.publish(stamp, force)
        return force

    def zero(self, stamp: int, sample: Sample) -> None:
        """See :class:`Output`."""
        self.give(stamp, Drive(), sample)

    def repeat(self) -> None:
        """See :class:`Output`."""
        self._forces.repeat()

    def stop(self, stamp: int) -> Future | None:
        """See :class:`Output`."""
        self._forces.publish(stamp, 0.0)
        return None


class ControllerDrive:
    """Gives ``reference`` and ``feedforward_force``, and sets the gains of the node ``controller``.

    Args:
        node: the experiment.
        controller: name of the controller's node.
        limit: largest force [F].
        filter_time: of the velocity [s].
    """

    def __init__(self, node: LoopNode, controller: str, limit: float, filter_time: float) -> None:
        self._node = node
        self._controller = controller
        self._limit = limit
        self._reference = Reference()
        self._reference.header.frame_id = node.joint
        self.publisher: Publisher = node.create_publisher(Reference, "reference", SAMPLES)
        self._forces = ForcePublisher(node, "feedforward_force")
        self._client = node.create_client(SetParameters, f"{controller}/set_parameters")
        self._fixed = {"ki": 0.0, "filter_time": filter_time, "position_weight": 1.0, "velocity_weight": 0.0}
        self._present: dict[str, float] = {}
        self._asked: tuple[dict[str, float], Future] | None = None
        self._asked_at = 0.0  # [s], monotonic
        self._position = 0.0

    def _set(self, wanted: dict[str, float]) -> bool:
        """True when the controller's parameters are ``wanted``; else they are being set.

        Raises:
            ExperimentError: it refuses them.
        """
        if self._asked is not None:
            values, future = self._asked
            if not future.done():
                if time.monotonic() - self._asked_at > _ASK_AGAIN and self._client.service_is_ready():
                    self._client.remove_pending_request(future)
                    self._asked = (values, self._ask(values))
                return False
            self._asked = None
            for name, result in zip(values, future.result().results, strict=True):
                if not result.successful:
                    raise ExperimentError(
                        f"node {self._controller}", f"refuses {name} = {values[name]:g}: {result.reason}",
                        "narrow the limits of the gains, or leave the parameter 'controller' empty",
                    )  # fmt: skip
                self._present[name] = values[name]
        changed = {name: value for name, value in wanted.items() if self._present.get(name) != value}
        if not changed:
            return True
        if self._client.service_is_ready():
            self._asked = (changed, self._ask(changed))
        return False

    def _ask(self, values: dict[str, float]) -> Future:
        request = SetParameters.Request()
        request.parameters = [Parameter(name, value=float(value)).to_parameter_msg() for name, value in values.items()]
        self._asked_at = time.monotonic()
        return self._client.call_async(request)

    def give(self, stamp: int, drive: Drive, sample: Sample) -> float | None:
        """See :class:`Output`."""
        acting = drive.proportional > 0.0 or drive.derivative != 0.0 or drive.force != 0.0
        wanted = dict(self._fixed)
        if acting:
            # The last gains stay while there is no force: a change of gains is made where it leaves nothing behind.
            wanted |= {"kp": drive.proportional, "kd": drive.derivative}
        wanted["force_limit"] = self._limit if acting else 0.0
        if not self._set(wanted):
            return None
        self._publish(stamp, drive.reference if acting else sample.position, drive.force)
        return math.nan

    def _publish(self, stamp: int, position: float, force: float) -> None:
        message = self._reference
        set_stamp(message.header.stamp, stamp)
        self._position = message.position = position
        self.publisher.publish(message)
        self._forces.publish(stamp, force)

    def zero(self, stamp: int, sample: Sample) -> None:
        """See :class:`Output`."""
        self._publish(stamp, self._position, 0.0)

    def repeat(self) -> None:
        """See :class:`Output`."""
        self.publisher.publish(self._reference)
        self._forces.repeat()

    def stop(self, stamp: int) -> Future | None:
        """See :class:`Output`."""
        self._publish(stamp, self._position, 0.0)
        return self._ask({"force_limit": 0.0}) if self._client.service_is_ready() else None
