"""The plant in wall time: a simulated axis under a drive with the safety layer, commanded and measured by the clock."""

from __future__ import annotations

import time

from fric.axis import SimulatedAxis
from fric.control.guarded_axis import GuardedAxis
from fric.control.safety import SafetyLayer
from rclpy.subscription import Subscription

from .loop import wall_clock
from .managed import ManagedNode
from .safety_panel import SafetyPanel
from .safety_parameters import ENABLED, RESUME, limits_of, safety_parameters

__all__ = ["LIMITS", "PlantInTime"]

_LATE = 10.0  # numerical: [periods] without a sample, after which the drive's own readings are stale
LIMITS = (
    *safety_parameters(
        "force_limit", "following_error", "temperature_limit", "position_noise", "latency", "command_timeout", "state_timeout",
        "clock_tolerance", brake_time=0.03,
    ),
    RESUME,
    ENABLED,
)  # fmt: skip


class PlantInTime:
    """The axis of a node in wall time.

    Args:
        node: whose axis it is; ``watchdog_time`` is how long a command acts.
        axis: moves with the clock.
        commands: where forces come from.

    Attributes:
        layer: the safety layer in front of the drive.
        drive: the axis behind it.

    Raises:
        InputError: the limits make no sense together.
    """

    def __init__(self, node: ManagedNode, axis: SimulatedAxis, commands: Subscription) -> None:
        settings, period = node.settings, node.period
        self._node = node
        self._commands = commands
        self._epoch, self._origin = wall_clock()
        watchdog = settings.number("watchdog_time")
        self.layer = SafetyLayer(
            limits_of(
                settings, period, command_timeout=watchdog, state_timeout=max(0.02, _LATE * period), latency=period,
                resume=settings.flag(RESUME.name),
            )
        )  # fmt: skip
        self.drive = GuardedAxis(axis, self.layer, self.now(), settings.flag(ENABLED.name))
        self.panel = SafetyPanel(node, self.layer, self.now, self.drive.enable, self.drive.disable)

    def now(self) -> int:
        """The time of stamps [ns]: that of day at the start, and counted on without its corrections."""
        return self._epoch + time.monotonic_ns() - self._origin

    def command(self, stamp: int, force: float) -> None:
        """A command for ``force`` [F] has come, made at ``stamp`` [ns]; -1: nobody knows when."""
        now = self.now()
        self._count(self.drive.command(now, now if stamp < 0 else stamp, force))

    def sample(self) -> int:
        """A sample begins; its stamp [ns]."""
        now = self.now()
        self._count(self.drive.sample(now, self._commands.get_publisher_count()))
        self.panel.log()
        return now

    def start(self) -> None:
        """Be enabled with the first command, if that is wanted from the start."""
        self.drive.begin(self._node.settings.flag(ENABLED.name))

    def stop(self) -> None:
        """Stop the axis within its limits, and give no force then."""
        self.drive.disable(self.now())

    def _count(self, ended: bool) -> None:
        if ended:
            self._node.counters["watchdog"] += 1
