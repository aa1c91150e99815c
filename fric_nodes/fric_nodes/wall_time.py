"""Control in wall time: references and joint states that are checked, stalls that end without a jump, causes in the log."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from fric.control.controller import Law
from fric.control.reference import ReferencePoint
from fric.control.reference_guard import ReferenceGuard, ReferenceLimits
from fric.control.safe_control import SafeControl
from fric.control.safety import SafetyLayer
from fric.control.stall import StallGuard, StallLimits

from .convert import JointSample
from .loop import LoopNode, wall_clock
from .managed import ManagedNode
from .parameters import NodeParameter, Settings
from .safety_panel import SafetyPanel
from .safety_parameters import ENABLED, RESUME, limits_of, safety_parameters

__all__ = ["LIMITS", "REFERENCES", "STATES", "StampClock", "WallControl", "reference_guard"]

_FAR = 1e6  # physical scale: beyond any axis; stands for no limit of its own, and still refuses 1e300
REFERENCES = (
    NodeParameter(
        "reference_timeout", 0.1, "wall time: without a reference for so long the axis is brought to rest", "s", 1e-3, 1e6
    ),
    NodeParameter(
        "stop_acceleration", 5.0, "wall time: of that stop, and of the approach after it", "m/s^2 or rad/s^2", 1e-9, 1e9
    ),
    NodeParameter("reference_speed", 1e3, "wall time: largest speed of a reference", "m/s or rad/s", 1e-9, 1e9),
    NodeParameter("reference_min", -_FAR, "wall time: least position of a reference", "m or rad", -_FAR, _FAR),
    NodeParameter("reference_max", _FAR, "wall time: largest position of a reference", "m or rad", -_FAR, _FAR),
    NodeParameter("clock_tolerance", 0.01, "wall time: how far a stamp may lie in the future", "s", 0.0, 1e3),
)
STATES = (
    NodeParameter("state_timeout", 0.05, "wall time: a joint state of this age is dropped", "s", 1e-3, 1e3),
    NodeParameter("bridge_time", 0.05, "wall time: a gap between joint states of at most so long is bridged", "s", 1e-3, 1e3),
)
LIMITS = (
    *safety_parameters("force_limit", "command_timeout", "state_timeout", "clock_tolerance", "temperature_limit"),
    RESUME,
    ENABLED,
)


class StampClock:
    """The time of stamps [ns]: that of day at the start, counted on without its corrections; or the simulated one.

    Args:
        node: whose clock it is.
    """

    def __init__(self, node: LoopNode) -> None:
        self._node = node
        self._epoch, self._origin = wall_clock()
        self._simulated = bool(node.get_parameter("use_sim_time").value)

    def __call__(self) -> int:
        """The present."""
        if self._simulated:
            return int(self._node.get_clock().now().nanoseconds)
        return self._epoch + time.monotonic_ns() - self._origin


def reference_guard(settings: Settings) -> ReferenceGuard:
    """The guard that ``settings`` describe.

    Raises:
        InputError: they make no sense together.
    """
    value = settings.number
    return ReferenceGuard(
        ReferenceLimits(
            value("reference_timeout"), value("stop_acceleration"), value("reference_speed"), value("reference_min"),
            value("reference_max"), value("clock_tolerance"),
        )
    )  # fmt: skip


class WallControl:
    """A law that answers joint states as they come, behind a safety layer.

    Args:
        node: counts what is refused, says in the log when something begins and ends, and offers the layer's services.
        law: gives the force.
        send: publishes a force [F] of the time [ns], where there is one without a joint state.

    Raises:
        InputError: the parameters make no sense together.
    """

    def __init__(self, node: ManagedNode, law: Law, send: Callable[[int, float], None]) -> None:
        settings, period = node.settings, node.period
        self._node = node
        self._now = StampClock(node)
        self._send = send
        references = reference_guard(settings)
        timeout, tolerance = settings.number("state_timeout"), settings.number("clock_tolerance")
        guard = StallGuard(law, references, StallLimits(period, timeout, settings.number("bridge_time"), tolerance))
        given = {"command_timeout": max(timeout, 3.0 * period), "state_timeout": timeout, "clock_tolerance": tolerance}
        self.layer = SafetyLayer(limits_of(settings, period, **given, resume=settings.flag(RESUME.name)))
        self._control = SafeControl(guard, self.layer, 2.0 * period, settings.flag(ENABLED.name))
        self.panel = SafetyPanel(node, self.layer, self._now, self._control.enable, self._control.disable)
        references.counters = guard.counters = node.counters
        node.create_timer(2.0 * period, self._idle, clock=node.steady)

    def reference(self, reference: ReferencePoint) -> None:
        """Take in a reference."""
        self._control.reference(self._now(), *reference)

    def answer(self, state: JointSample, feedforward: float, referees: int) -> float | None:
        """The force [F] that answers ``state``, with so many publishers of references; None when there is none to send."""
        now = self._now()
        self._control.referees(now, referees)
        acting = state.effort if math.isfinite(state.effort) else 0.0
        force = self._control.answer(now, state.stamp, state.position, feedforward, acting)
        self.panel.log()
        return force

    def _idle(self) -> None:
        now = self._now()
        force = self._control.idle(now)
        if force is not None:
            self._send(now, force)
            self.panel.log()

    def start(self) -> None:
        """Go on where a stop ended: enable with the next joint states, if that is wanted from the start."""
        self._control.begin(self._node.settings.flag(ENABLED.name))

    def stop(self) -> None:
        """Stop the axis within its limits, and send no force then."""
        self._control.disable(self._now())

    @property
    def following(self) -> str:
        """What the setpoint does."""
        return self._control.guard.references.following.value
