"""A drive behind ros2_control: joint states in, efforts out to a controller of the stock kind; the mapping only, no topics.

Two ways out:

- ``effort``: ``Float64MultiArray`` with one effort per joint, in the order of the controller's parameter ``joints``, to an
  effort controller of ``forward_command_controller`` or ``effort_controllers``. Joints other than ours get zero, or what they
  were told to keep.
- ``trajectory``: ``JointTrajectoryPoint`` with position, velocity and, as feedforward, the effort, to the stock trajectory
  controller: the user keeps his controller and gets friction compensation.

Between joint and actuator stands the gear ratio n (turns of the actuator per turn of the joint): position and velocity of the
joint are those of the actuator divided by n, the effort is multiplied by n, and by the sign of n where a side is mirrored.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from .drive import Drive, DriveError, DriveKind, DriveOption, JointReading, Link, Options

__all__ = ["DRIVE", "JointMap", "Point", "Ros2ControlDrive"]


class Point(NamedTuple):
    """Values of a ``JointTrajectoryPoint`` for all joints, in the controller's order."""

    positions: list[float]
    velocities: list[float]
    effort: list[float]


@dataclass(frozen=True)
class JointMap:
    """Which of the controller's joints is ours, and the gear between.

    Attributes:
        joints: of the controller, in its order.
        joint: ours.
        ratio: gear ratio, turns of the actuator per turn of the joint; 1 where the topics are the joint's already.

    Raises:
        DriveError: our joint isn't among the controller's, a name comes twice, or the ratio can't be used.
    """

    joints: tuple[str, ...]
    joint: str
    ratio: float = 1.0

    def __post_init__(self) -> None:
        where = "drive 'ros2_control'"
        if self.joint not in self.joints:
            raise DriveError(where, f"no joint '{self.joint}' among {', '.join(self.joints)}", "give the controller's joints")
        if len(set(self.joints)) != len(self.joints):
            raise DriveError(where, "a joint comes twice", "give each of the controller's joints once, in its order")
        if not (math.isfinite(self.ratio) and self.ratio != 0.0):
            raise DriveError(where, f"the gear ratio is {self.ratio}", "give a finite number other than 0")

    def reading(
        self, stamp: int, names: Sequence[str], positions: Sequence[float], velocities: Sequence[float],
        efforts: Sequence[float],
    ) -> JointReading:  # fmt: skip
        """Our part of a joint state, whatever its order; velocities and efforts may be empty.

        Raises:
            DriveError: our joint isn't in it, or has no position.
        """
        try:
            at = list(names).index(self.joint)
        except ValueError:
            said = ", ".join(names) or "none"
            raise DriveError("joint states", f"no joint '{self.joint}' among {said}", "give the name as it is there") from None
        if at >= len(positions):
            raise DriveError("joint states", f"joint '{self.joint}' has no position", "let the broadcaster publish it")
        velocity = velocities[at] / self.ratio if at < len(velocities) else math.nan
        effort = efforts[at] * self.ratio if at < len(efforts) else math.nan
        return JointReading(stamp, positions[at] / self.ratio, velocity, effort)

    def dynamic_reading(
        self, stamp: int, names: Sequence[str], interfaces: Sequence[tuple[Sequence[str], Sequence[float]]]
    ) -> JointReading:
        """The same from a ``DynamicJointState``: names and values of the interfaces of each joint.

        Raises:
            DriveError: as for :meth:`reading`.
        """
        held = [dict(zip(kinds, values, strict=False)) for kinds, values in interfaces]
        at = list(names).index(self.joint) if self.joint in names else len(held)
        ours = held[at] if at < len(held) else {}
        position = [ours["position"]] if "position" in ours else []
        velocity, effort = ours.get("velocity", math.nan), ours.get("effort", math.nan)
        known = [self.joint] if self.joint in names else list(names)
        return self.reading(stamp, known, position, [velocity], [effort])

    def efforts(self, force: float, others: Sequence[float] = ()) -> list[float]:
        """Efforts of all joints for our ``force`` [F]; ``others`` are what the other joints get, in order; empty: zero."""
        values = list(others) or [0.0] * len(self.joints)
        values[self.joints.index(self.joint)] = force / self.ratio
        return values

    def point(self, position: float, velocity: float, force: float, others: Sequence[float] = ()) -> Point:
        """A trajectory point with our ``position``, ``velocity`` and, as feedforward, ``force`` [F].

        Args:
            position: wanted [x].
            velocity: wanted [x/s].
            force: feedforward [F].
            others: positions that the other joints are to keep; empty: zero.
        """
        at, n = self.joints.index(self.joint), len(self.joints)
        positions, velocities = list(others) or [0.0] * n, [0.0] * n
        positions[at], velocities[at] = position * self.ratio, velocity * self.ratio
        return Point(positions, velocities, self.efforts(force))


class Ros2ControlDrive:
    """A drive behind ros2_control, over topics that the bridge provides.

    Args:
        joints: which of the controller's joints is ours.
        topic: of the efforts.
        link: to the topics.
        timeout: without a joint state for so long the drive is lost [s].
        now: clock of stamps [ns].
    """

    def __init__(self, joints: JointMap, topic: str, link: Link, timeout: float, now: Callable[[], int]) -> None:
        self._joints, self._topic, self._link, self._now = joints, topic, link, now
        self._timeout = round(1e9 * timeout)
        self._opened = False

    def open(self) -> None:
        """Begin to listen."""
        self._last: int | None = None
        self._heard = self._now()
        self._opened = True

    def exchange(self, force: float) -> JointReading | None:
        """Publish ``force`` [F], and give the newest reading that hasn't been given yet; None when there is none.

        Raises:
            DriveError: no joint state comes, ours isn't in it, or ``force`` isn't finite.
        """
        if not self._opened:
            raise DriveError("drive 'ros2_control'", "isn't open", "open it first")
        if not math.isfinite(force):
            raise DriveError("drive 'ros2_control'", f"the force is {force}", "send a finite force only")
        self._link.send(self._topic, self._joints.efforts(force))
        newest, now = self._link.newest(), self._now()
        if newest is None or newest[0] == self._last:
            if now - self._heard > self._timeout:
                silent = f"no joint state for {1e-9 * (now - self._heard):.3g} s"
                raise DriveError("drive 'ros2_control'", silent, "start the controller manager and joint_state_broadcaster")
            return None
        self._last, self._heard = newest[0], now
        names = list(newest[1])
        columns = [[newest[1][name][k] for name in names] for k in range(3)]
        return self._joints.reading(newest[0], names, *columns)

    def close(self) -> None:
        """Publish a zero force once more."""
        if self._opened:
            self._opened = False
            self._link.send(self._topic, self._joints.efforts(0.0))


def _make(options: Options, now: Callable[[], int], link: Link | None) -> Drive:
    if link is None:
        raise DriveError("drive 'ros2_control'", "has no topics here", "use it in the node hardware_bridge")
    joint = str(options["joint"])
    listed = tuple(name.strip() for name in str(options["joints"]).split(",") if name.strip()) or (joint,)
    joints = JointMap(listed, joint, float(options["ratio"]))
    return Ros2ControlDrive(joints, str(options["topic"]), link, float(options["timeout"]), now)


DRIVE = DriveKind(
    "ros2_control",
    "effort controller of ros2_control, over topics",
    (
        DriveOption("joint", "axis", "name of the joint in the joint states of ros2_control"),
        DriveOption("joints", "", "joints of the effort controller in its order, separated by commas; empty: the joint alone"),
        DriveOption(
            "ratio", 1.0, "turns of the actuator per turn of the joint; 1 where the topics are the joint's", "", -1e6, 1e6
        ),
        DriveOption("topic", "effort_controller/commands", "topic of the efforts"),
        DriveOption("timeout", 0.05, "without a joint state for so long the drive is lost", "s", 1e-3, 10.0),
    ),
    _make,
)
