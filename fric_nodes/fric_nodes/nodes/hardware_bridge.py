"""A real drive in the place of ``plant``: takes ``force_command``, gives ``joint_states``, with the safety layer in front.

The parameter ``driver`` chooses the drive's protocol from :mod:`fric.drives`; its options are the parameters under its name.
The bridge enables only on request (``~/enable``), or once by ``autostart``; a fault stops the axis and stays until
``~/reset_fault``. ``/diagnostics`` names every cause, and the log says when each begins.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from fric.control.safety import SafetyLayer
from fric.drives import DRIVES
from fric.drives.drive import checked_options
from fric.drives.supervised import SupervisedDrive
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import Reference, StampedForce

from ..convert import MessageError, from_seconds, set_stamp
from ..drive_topics import DriveTopics
from ..forces import STAMPED, force_in, force_type
from ..loop import PERIOD, LoopNode, wall_clock
from ..parameters import NodeParameter
from ..qos import SAMPLES
from ..run import run
from ..safety_parameters import SAFETY, limits_of
from ..triggers import add_triggers

__all__ = ["HardwareBridgeNode", "main"]

PARAMETERS = (
    PERIOD,
    NodeParameter("driver", "serial", "protocol of the drive", choices=tuple(DRIVES)),
    NodeParameter("autostart", False, "enable once, as soon as there are readings to rely on"),
    NodeParameter("drive_states", "drive/joint_states", "ros2_control: topic of its joint states"),
    *SAFETY,
    STAMPED,
    *(
        NodeParameter(f"{kind.id}.{o.name}", o.default, o.doc, o.unit, o.lower, o.upper, o.choices)
        for kind in DRIVES.values()
        for o in kind.options
    ),
)


class HardwareBridgeNode(LoopNode):
    """A bridge to one drive; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter can't be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("hardware_bridge", PARAMETERS, **options)
        settings = self.settings
        kind = DRIVES[settings.text("driver")]
        given = {option.name: self.get_parameter(f"{kind.id}.{option.name}").value for option in kind.options}
        link = DriveTopics(self, settings.text("drive_states")) if kind.id == "ros2_control" else None
        self._layer = SafetyLayer(limits_of(settings, self.period))
        self._layer.counters = self.counters
        drive = kind.make(checked_options(kind, given), self._now, link)
        self._drive = SupervisedDrive(drive, self._layer, settings.flag("autostart"))
        self._epoch, self._origin = wall_clock()
        self._state = JointState(name=[self.joint], position=[0.0])
        self._state.header.frame_id = self.joint
        self._publisher = self.create_publisher(JointState, "joint_states", SAMPLES)
        self._commands = self.create_subscription(force_type(self), "force_command", self._on_command, self.input_qos)
        self._wanted = (0, math.nan)
        if math.isfinite(self._layer.limits.following_error):
            self.create_subscription(Reference, "reference", self._on_reference, self.input_qos)
        requests = {"enable": self._layer.enable, "disable": self._layer.disable, "reset_fault": self._layer.reset}
        add_triggers(self, {name: self._at_once(act) for name, act in requests.items()})
        self.create_timer(self.period, self._tick, clock=self.steady)
        self.get_logger().info(f"{kind.title}; joint {self.joint}, {self.period:g} s; limits: {self._layer.limits}")

    def _now(self) -> int:
        """The time of stamps [ns]: that of day at the start, and counted on without its corrections."""
        return self._epoch + time.monotonic_ns() - self._origin

    def condition(self) -> Mapping[str, object]:
        """What the node adds to its report."""
        state = self._layer.condition()
        return {"driver": self.settings.text("driver"), "drive": self._drive.trouble or "open", **state}

    def verdict(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """Level and text of the report: faults first, then what hinders or was refused."""
        layer = self._layer
        said = [f"{name} ({detail})" for name, detail in layer.faults.items()]
        said += [f"drive: {self._drive.trouble}"] if self._drive.trouble else []
        level = DiagnosticStatus.ERROR if said else DiagnosticStatus.WARN if troubles else DiagnosticStatus.OK
        return level, "; ".join([layer.state.value, *said, *troubles])

    def _at_once(self, act: Callable[[int], None]) -> Callable[[], str]:
        """``act`` at the present time; then the state of the layer."""

        def acted() -> str:
            act(self._now())
            return self._layer.state.value

        return acted

    def _on_reference(self, message: Reference) -> None:
        self._wanted = (self._now(), message.position)

    def _on_command(self, message: StampedForce | Float64) -> None:
        now, layer = self._now(), self._layer
        layer.publishers(self._commands.get_publisher_count())
        try:
            stamp, force = force_in(message)
        except MessageError:
            stamp, force = -1, math.nan  # the layer refuses it, and knows what it was
        layer.command(now, now if stamp < 0 else stamp, force)

    def _tick(self) -> None:
        now = self._now()
        since, wanted = self._wanted
        fresh = now - since <= from_seconds(self._layer.limits.command_timeout)
        reading = self._drive.tick(now, wanted if fresh else math.nan)
        for event in self._layer.events():
            if event.text.startswith("fault"):
                self.get_logger().error(event.text)
            else:
                self.get_logger().info(event.text)
        if reading is not None:
            state = self._state
            set_stamp(state.header.stamp, reading.stamp)
            state.position = [reading.position]
            state.velocity = [] if math.isnan(reading.velocity) else [reading.velocity]
            state.effort = [self._layer.force if math.isnan(reading.effort) else reading.effort]
            self._publisher.publish(state)
        self.deadlines.tick(time.monotonic())

    def close(self) -> None:
        """Take the force away, and let go of the drive."""
        self._drive.close()


main = partial(run, HardwareBridgeNode)
"""Serve the node until a signal comes."""

if __name__ == "__main__":
    main()
