"""The motion that is wanted of the axis: gives ``reference``, or ``force_command`` for an open-loop excitation.

Planned motions are sent ahead of the plant in lock-step, and by a timer in wall time. As soon as one of the excitations answers
the motion (a feedback), the node gives one force for each joint state instead, in both clocks.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from fric.excitation.sequence import SampledPlan
from sensor_msgs.msg import JointState

from fric_interfaces.msg import Reference

from ..convert import from_seconds, nanoseconds, set_stamp
from ..excitation_parameters import PLAN, planned
from ..forces import STAMPED, ForcePublisher
from ..loop import LOCK_STEP, PERIOD, LoopNode, wall_clock
from ..parameters import NodeParameter
from ..qos import SAMPLES
from ..run import run

__all__ = ["ExcitationNode", "main"]

PARAMETERS = (
    PERIOD,
    LOCK_STEP,
    *PLAN,
    STAMPED,
    NodeParameter(
        "look_ahead", 16, "lock-step: samples sent ahead of the plant; makes no difference to the numbers", "", 0, 64
    ),
)


class ExcitationNode(LoopNode):
    """A planned motion, published sample by sample; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter can't be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("excitation", PARAMETERS, **options)
        settings = self.settings
        self._plan = planned(settings)
        self._forces = ForcePublisher(self, "force_command") if settings.text("output") == "force" else None
        if self._forces is None:
            self._reference = Reference()
            self._reference.header.frame_id = self.joint
            self._references = self.create_publisher(Reference, "reference", SAMPLES)
        self._publisher = self._references if self._forces is None else self._forces.publisher
        self.get_logger().info(f"{', '.join(settings.texts('kinds'))}: {self._plan.duration:.1f} s")
        self._seen = -1
        if self._plan.has_feedback:
            self._first = 0 if self.lock_step else -1
            self.take_in(JointState, "joint_states", self._on_motion)
        elif self.lock_step:
            self._period_ns = from_seconds(self.period)
            self._ahead = settings.integer("look_ahead")
            self._next = 0
            self._samples = SampledPlan(self._plan, self.period)
            self.create_subscription(JointState, "joint_states", self._on_state, SAMPLES)
        else:
            self._epoch, self._origin = wall_clock()
            self._start: int | None = None
            self.create_timer(self.period, self._tick)

    def condition(self) -> Mapping[str, str]:
        """What the node adds to its report."""
        return {"planned duration [s]": f"{self._plan.duration:.3f}"}

    def _publish(self, stamp: int, position: float, velocity: float, acceleration: float) -> None:
        if self._forces is not None:
            self._forces.publish(stamp, position)
            return
        message = self._reference
        set_stamp(message.header.stamp, stamp)
        message.position, message.velocity, message.acceleration = position, velocity, acceleration
        self._references.publish(message)

    # Feedback

    def _on_motion(self, message: JointState) -> None:
        """Answer a joint state; in lock-step time is its stamp, in wall time it begins with the first one."""
        state = self.state_of_joint(message)
        if state is None or self._forces is None or not self.has_audience(self._publisher):
            return
        if self.lock_step and state.stamp == self._seen:
            self.counters["repeated states"] += 1
            self._forces.repeat()
            return
        if not self.lock_step and state.stamp <= self._seen:
            self.refuse_late_state()
            return
        if self._first < 0:
            self._first = state.stamp
        self._seen = state.stamp
        self._forces.publish(state.stamp, self._plan.force((state.stamp - self._first) * 1e-9, state.position))
        self.deadlines.tick(time.monotonic())

    # Lock-step

    def _on_state(self, state: JointState) -> None:
        if not self.has_audience(self._publisher):
            return  # the plant will ask again
        sample = nanoseconds(state.header.stamp) // self._period_ns
        if sample <= self._seen:
            # The plant repeats itself, or has started again: someone has missed what was sent from here on.
            self.counters["repeated states"] += 1
            self._next = sample
        elif self._next < sample:
            self._next = sample
        self._seen = sample
        # Sent in bursts, which wakes the receivers less often.
        if self._next <= sample + self._ahead // 2:
            while self._next <= sample + self._ahead:
                self._publish(self._next * self._period_ns, *self._samples.at(self._next))
                self._next += 1
            self.deadlines.tick(time.monotonic())

    # Wall time

    def _tick(self) -> None:
        now = time.monotonic_ns()
        if self._start is None:
            # The motion starts when somebody is there to follow it, and not before.
            if not self.has_audience(self._publisher):
                return
            self._start = now
        position, velocity, acceleration = self._plan.at(np.array([(now - self._start) * 1e-9]))
        self._publish(self._epoch + now - self._origin, float(position[0]), float(velocity[0]), float(acceleration[0]))
        self.deadlines.tick(now * 1e-9)


main = partial(run, ExcitationNode)
"""Serve the node until a signal comes."""

if __name__ == "__main__":
    main()
