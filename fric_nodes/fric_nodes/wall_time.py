"""Control in wall time: references and joint states that are checked, stalls that end without a jump, causes in the log."""

from __future__ import annotations

import math
import time
from collections import Counter

from fric.control.controller import Law
from fric.control.reference import ReferencePoint
from fric.control.reference_guard import ReferenceGuard, ReferenceLimits
from fric.control.stall import StallGuard, StallLimits

from .convert import JointSample
from .loop import LoopNode, wall_clock
from .parameters import NodeParameter, Settings

__all__ = ["REFERENCES", "STATES", "StampClock", "WallControl", "reference_guard"]

_FAR = 1e6  # physical scale: beyond any axis; stands for no limit of its own, and still refuses 1e300
_OVER = 1.0  # physical scale: [s] without another one, after which something is over
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
    """A law that answers joint states as they come.

    Args:
        node: counts what is refused, and says in the log when something begins and ends.
        law: gives the force.

    Raises:
        InputError: the parameters make no sense together.
    """

    def __init__(self, node: LoopNode, law: Law) -> None:
        settings = node.settings
        self._node = node
        self._now = StampClock(node)
        self._references = reference_guard(settings)
        limits = StallLimits(
            node.period, settings.number("state_timeout"), settings.number("bridge_time"), settings.number("clock_tolerance")
        )
        self._guard = StallGuard(law, self._references, limits)
        self._references.counters = self._guard.counters = node.counters
        self._before: Counter[str] = Counter()
        self._total = 0
        self._lasting: dict[str, float] = {}  # what goes on, and when it was last counted [s]

    def reference(self, reference: ReferencePoint) -> None:
        """Take in a reference."""
        self._references.take(self._now(), *reference)

    def answer(self, state: JointSample, feedforward: float) -> float | None:
        """The force [F] that answers ``state``; None when it is dropped, or the first one after a gap."""
        acting = state.effort if math.isfinite(state.effort) else 0.0
        force = self._guard.answer(self._now(), state.stamp, state.position, feedforward, acting)
        self._log()
        return force

    @property
    def following(self) -> str:
        """What the setpoint does."""
        return self._references.following.value

    def _log(self) -> None:
        """Say once when something begins to be refused or lost, and once when it is over."""
        counters, now = self._node.counters, time.monotonic()
        total = sum(counters.values())
        if total != self._total:
            for name, count in counters.items():
                if count > self._before[name]:
                    if name not in self._lasting:
                        self._node.get_logger().warning(name)
                    self._lasting[name] = now
            self._total, self._before = total, Counter(counters)
        elif self._lasting:
            for name in [name for name, last in self._lasting.items() if now - last > _OVER]:
                del self._lasting[name]
                self._node.get_logger().info(f"over: {name}")
