"""Position control: takes ``reference``, ``joint_states`` and ``feedforward_force``, gives ``force_command``.

In wall time every joint state is answered at once, with the latest reference extrapolated to its stamp. In lock-step the answer
to a joint state waits for the reference, and the feedforward, of the same stamp.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any

from fric.control.feedbacks.pid import Pid, PidGains
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import Reference, StampedForce

from ..base import LOCK_STEP, PERIOD, LoopNode
from ..convert import JointSample, MessageError, from_seconds, joint_sample
from ..forces import STAMPED, ForcePublisher, ReferencePoint, force_in, force_type, reference_in
from ..lockstep import Stream
from ..parameters import NodeParameter
from ..qos import SAMPLES
from ..run import run

__all__ = ["PidNode", "main"]

_LONGEST = 1e12
PARAMETERS = (
    PERIOD,
    LOCK_STEP,
    NodeParameter("kp", 1e5, "proportional gain", "N/m or N m/rad", 0.0, _LONGEST, settable=True),
    NodeParameter("ki", 0.0, "integral gain", "N/(m s) or N m/(rad s)", 0.0, _LONGEST, settable=True),
    NodeParameter("kd", 0.0, "derivative gain", "N s/m or N m s/rad", 0.0, _LONGEST, settable=True),
    NodeParameter("filter_time", 0.001, "time constant of the derivative filter", "s", 0.0, 10.0, settable=True),
    NodeParameter("position_weight", 1.0, "weight of the reference in the proportional part", "", 0.0, 2.0, settable=True),
    NodeParameter("velocity_weight", 1.0, "weight of the reference in the derivative part", "", 0.0, 2.0, settable=True),
    NodeParameter("tracking_time", 0.0, "time constant of the anti-windup; 0: kp/ki", "s", 0.0, 1e3, settable=True),
    NodeParameter("force_limit", 1e6, "largest command", "N or N m", 0.0, _LONGEST, settable=True),
    NodeParameter("use_feedforward", True, "add the feedforward force; in lock-step false means not to wait for one"),
    NodeParameter("feedforward_timeout", 0.1, "wall time: leave out a feedforward that is older", "s", 1e-3, 1e6),
    NodeParameter(
        "reference_timeout", 0.1, "wall time: hold the last position when references stop for so long", "s", 1e-3, 1e6
    ),
    STAMPED,
)


class PidNode(LoopNode):
    """A PID controller; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter can't be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("pid", PARAMETERS, **options)
        settings = self.settings
        self._pid = Pid(self._gains(), settings.number("force_limit"))
        settings.when_changed(self._on_settings)
        self._adds = settings.flag("use_feedforward")
        self._answered = -1
        self._references: Stream[float] = Stream()
        self._forces: Stream[float] = Stream()
        self._pending: JointSample | None = None
        self._reference: ReferencePoint | None = None
        self._feedforward = (-math.inf, 0.0)
        self._commands = ForcePublisher(self, "force_command")
        self.create_subscription(JointState, "joint_states", self._on_state, SAMPLES)
        self.create_subscription(Reference, "reference", self._on_reference, SAMPLES)
        if self._adds:
            self.create_subscription(force_type(self), "feedforward_force", self._on_feedforward, SAMPLES)

    def _gains(self) -> PidGains:
        value = self.settings.number
        return PidGains(
            value("kp"), value("ki"), value("kd"), value("filter_time"), value("position_weight"), value("velocity_weight"),
            value("tracking_time"),
        )  # fmt: skip

    def _on_settings(self, _changed: set[str]) -> None:
        self._pid.set_gains(self._gains())
        self._pid.limit = self.settings.number("force_limit")

    def condition(self) -> Mapping[str, str]:
        """What the node adds to its report."""
        return {"saturated": str(self._pid.saturated)}

    def _on_reference(self, message: Reference) -> None:
        try:
            reference = reference_in(message)
        except MessageError as error:
            self.refuse("reference", error)
            return
        self._reference = reference
        if self.lock_step:
            self._references.put(reference.stamp, reference.position)
            self._answer()

    def _on_feedforward(self, message: StampedForce | Float64) -> None:
        try:
            stamp, force = force_in(message)
        except MessageError as error:
            self.refuse("feedforward", error)
            return
        self._feedforward = (time.monotonic(), force)
        if self.lock_step:
            self._forces.put(stamp, force)
            self._answer()

    def _on_state(self, message: JointState) -> None:
        try:
            state = joint_sample(message, self.joint)
        except MessageError as error:
            self.refuse("joint state", error)
            return
        if self.lock_step:
            self._on_step(state)
        else:
            self._follow(state)

    # Lock-step

    def _on_step(self, state: JointSample) -> None:
        if state.stamp == self._answered:
            self.counters["repeated states"] += 1
            self._commands.repeat()
            return
        if state.stamp < self._answered:
            self.counters["restarts"] += 1
            self._pid.reset()
        self._pending = state
        self._answer()

    def _answer(self) -> None:
        """Publish the command to the pending state, when all that it takes is there."""
        state = self._pending
        if state is None or not self.has_audience(self._commands.publisher):
            return
        reference = self._references.get(state.stamp)
        feedforward = self._forces.get(state.stamp) if self._adds else 0.0
        if reference is None or feedforward is None:
            return
        self._commands.publish(state.stamp, self._pid.step(reference, state.position, self.period, feedforward))
        self._answered, self._pending = state.stamp, None
        self._references.forget_before(state.stamp)
        self._forces.forget_before(state.stamp)
        self.deadlines.tick(time.monotonic())

    # Wall time

    def _setpoint(self, state: JointSample) -> float:
        """Position wanted at the stamp of ``state`` [x]."""
        if self._reference is None:
            self._reference = ReferencePoint(state.stamp, state.position, 0.0, 0.0)
        stamp, position, velocity, acceleration = self._reference
        ahead = (state.stamp - stamp) * 1e-9
        if abs(ahead) > self.settings.number("reference_timeout"):
            return position
        return position + ahead * (velocity + 0.5 * ahead * acceleration)

    def _follow(self, state: JointSample) -> None:
        if state.stamp <= self._answered and self._answered - state.stamp < from_seconds(1.0):
            self.refuse("joint state", "its stamp is not later than the last one's")
            return
        duration = self.period if self._answered < 0 else (state.stamp - self._answered) * 1e-9
        if not 0.0 < duration < 50.0 * self.period:
            # A pause, or another clock: what the controller remembers is not of this motion.
            self._pid.reset()
            duration = self.period
        given, force = self._feedforward
        now = time.monotonic()
        fresh = now - given <= self.settings.number("feedforward_timeout")
        self._commands.publish(
            state.stamp, self._pid.step(self._setpoint(state), state.position, duration, force if fresh else 0.0)
        )
        self._answered = state.stamp
        self.deadlines.tick(now)
        self.deadlines.latency((time.time_ns() - state.stamp) * 1e-9)


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    run(PidNode, args)


if __name__ == "__main__":
    main()
