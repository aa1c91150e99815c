"""A real drive in the place of ``plant``: takes ``force_command``, gives ``joint_states``, with the safety layer in front.

The parameter ``driver`` chooses the drive's protocol from :mod:`fric.drives`; its options are the parameters under its name.
The bridge enables only on request (``~/enable``), or once by the parameter ``enable_at_start``; a fault stops the axis and
stays until ``~/reset_fault``. ``/diagnostics`` names every cause, and the log says when each begins.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from fric.control.safety import SafetyLayer
from fric.drives import DRIVES
from fric.drives.drive import checked_options
from fric.drives.supervised import SupervisedDrive
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import Reference, StampedForce

from ..convert import from_seconds, set_stamp
from ..drive_topics import DriveTopics
from ..forces import STAMPED, force_or_nan, force_type
from ..loop import PERIOD, wall_clock
from ..managed import ManagedNode
from ..parameters import NodeParameter
from ..qos import SAMPLES
from ..run import run
from ..safety_panel import SafetyPanel
from ..safety_parameters import SAFETY, limits_of

__all__ = ["HardwareBridgeNode", "main"]

PARAMETERS = (
    PERIOD,
    NodeParameter("driver", "serial", "protocol of the drive", choices=tuple(DRIVES)),
    NodeParameter("enable_at_start", False, "enable once, as soon as there are readings to rely on"),
    NodeParameter("drive_states", "drive/joint_states", "ros2_control: topic of its joint states"),
    *SAFETY,
    STAMPED,
    *(
        NodeParameter(f"{kind.id}.{o.name}", o.default, o.doc, o.unit, o.lower, o.upper, o.choices)
        for kind in DRIVES.values()
        for o in kind.options
    ),
)


class HardwareBridgeNode(ManagedNode):
    """A bridge to one drive; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter can't be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("hardware_bridge", PARAMETERS, **options)

    def configure(self) -> None:
        """Make the drive, which is opened with the first tick, and the topics."""
        settings = self.settings
        kind = DRIVES[settings.text("driver")]
        given = {option.name: self.get_parameter(f"{kind.id}.{option.name}").value for option in kind.options}
        link = DriveTopics(self, settings.text("drive_states")) if kind.id == "ros2_control" else None
        self._layer = SafetyLayer(limits_of(settings, self.period))
        drive = kind.make(checked_options(kind, given), self._now, link)
        self._drive = SupervisedDrive(drive, self._layer)
        self._panel = SafetyPanel(self, self._layer, self._now, self._drive.enable, self._drive.disable)
        self._epoch, self._origin = wall_clock()
        self._state = JointState(name=[self.joint], position=[0.0])
        self._state.header.frame_id = self.joint
        self._publisher = self.create_publisher(JointState, "joint_states", SAMPLES)
        self._commands = self.take_in(force_type(self), "force_command", self._on_command)
        self._wanted = (0, math.nan)
        if math.isfinite(self._layer.limits.following_error):
            self.take_in(Reference, "reference", self._on_reference)
        self.create_timer(self.period, self._tick, clock=self.steady)

    def activate(self) -> None:
        """Publish joint states; enable with the first of them, if that is wanted."""
        self._drive.begin(self.settings.flag("enable_at_start"))

    def deactivate(self) -> None:
        """Stop the axis; the drive stays open, its joint states are not published any more."""
        self._drive.disable(self._now())

    def release(self) -> None:
        """Take the force away, and let go of the drive."""
        self._drive.close()

    def summary(self) -> str:
        """What the node works with."""
        return f"{super().summary()}; {DRIVES[self.settings.text('driver')].title}; {self._layer.limits}"

    def _now(self) -> int:
        """The time of stamps [ns]: that of day at the start, and counted on without its corrections."""
        return self._epoch + time.monotonic_ns() - self._origin

    def state_of(self) -> Mapping[str, object]:
        """What the node adds to its report."""
        state = self._panel.condition()
        return {"driver": self.settings.text("driver"), "drive": self._drive.trouble or "open", **state}

    def judgement(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """Level and text of the report: faults first, then what hinders or was refused."""
        return self._panel.verdict(troubles, *([f"drive: {self._drive.trouble}"] if self._drive.trouble else []))

    def _on_reference(self, message: Reference) -> None:
        self._wanted = (self._now(), message.position)

    def _on_command(self, message: StampedForce | Float64) -> None:
        now, layer = self._now(), self._layer
        layer.publishers(self._commands.get_publisher_count())
        stamp, force = force_or_nan(message)
        layer.command(now, now if stamp < 0 else stamp, force)

    def _tick(self) -> None:
        now = self._now()
        since, wanted = self._wanted
        fresh = now - since <= from_seconds(self._layer.limits.command_timeout)
        reading = self._drive.tick(now, wanted if fresh else math.nan)
        self._panel.log()
        if reading is not None and self.active:
            state = self._state
            set_stamp(state.header.stamp, reading.stamp)
            state.position = [reading.position]
            state.velocity = [] if math.isnan(reading.velocity) else [reading.velocity]
            state.effort = [self._layer.force if math.isnan(reading.effort) else reading.effort]
            self._publisher.publish(state)
        self.deadlines.tick(time.monotonic())


main = partial(run, HardwareBridgeNode)
"""Serve the node until a signal comes."""

if __name__ == "__main__":
    main()
