"""Position control: takes ``reference``, ``joint_states`` and ``feedforward_force``, gives ``force_command``.

In wall time every joint state is answered at once, with the latest reference led on to its stamp. What is late, not finite or
no motion of the axis is refused; a reference that is lost ends in a controlled stop, a pause of the process without a jump
(:mod:`fric.control.stall`). In lock-step the answer to a joint state waits for the reference, and the feedforward, of the same
stamp.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from functools import partial
from typing import Any

from fric.control.controller import Setpoint
from fric.control.feedbacks.pid import Pid
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import Reference, StampedForce

from ..convert import JointSample
from ..forces import STAMPED, ForcePublisher, force_in, force_type, reference_in
from ..lockstep import Matching
from ..loop import LOCK_STEP, PERIOD, LoopNode
from ..parameters import NodeParameter
from ..pid_parameters import CONTROLLER_FILE, GAINS, gains_of, law_of
from ..run import run
from ..wall_time import REFERENCES, STATES, WallControl

__all__ = ["PidNode", "main"]

_REFERENCE, _FEEDFORWARD = 0, 1  # what a state in lock-step waits for
PARAMETERS = (
    PERIOD,
    LOCK_STEP,
    *GAINS,
    CONTROLLER_FILE,
    NodeParameter("use_feedforward", True, "add the feedforward force; in lock-step false means not to wait for one"),
    NodeParameter("feedforward_timeout", 0.1, "wall time: leave out a feedforward that is older", "s", 1e-3, 1e6),
    *REFERENCES,
    *STATES,
    STAMPED,
)


class PidNode(LoopNode):
    """A PID controller, or the one of a file; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter can't be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("pid", PARAMETERS, **options)
        settings = self.settings
        self._law = law_of(settings, self.period)
        settings.when_changed(self._on_settings)
        self._adds = settings.flag("use_feedforward")
        self._answered = -1
        self._matching: Matching[JointSample] = Matching(2 if self._adds else 1)
        self._wall = WallControl(self, self._law)
        self._feedforward = (-math.inf, 0.0)
        self._commands = ForcePublisher(self, "force_command")
        self.create_subscription(JointState, "joint_states", self._on_state, self.input_qos)
        self.create_subscription(Reference, "reference", self._on_reference, self.input_qos)
        if self._adds:
            self.create_subscription(force_type(self), "feedforward_force", self._on_feedforward, self.input_qos)

    def _on_settings(self, _changed: set[str]) -> None:
        if isinstance(self._law, Pid):  # a file's gains are the file's
            self._law.set_gains(gains_of(self.settings))
            self._law.limit = self.settings.number("force_limit")

    def condition(self) -> Mapping[str, str]:
        """What the node adds to its report."""
        return {"saturated": str(self._law.saturated), "reference": self._wall.following}

    def _on_reference(self, message: Reference) -> None:
        reference = self.usable("reference", reference_in, message)
        if reference is None:
            return
        if not self.lock_step:
            self._wall.reference(reference)
            return
        self._matching.put(_REFERENCE, reference.stamp, Setpoint(*reference[1:]))
        self._answer()

    def _on_feedforward(self, message: StampedForce | Float64) -> None:
        given = self.usable("feedforward", force_in, message)
        if given is None:
            return
        self._feedforward = (time.monotonic(), given[1])
        if self.lock_step:
            self._matching.put(_FEEDFORWARD, *given)
            self._answer()

    def _on_state(self, message: JointState) -> None:
        state = self.state_of_joint(message)
        if state is not None:
            (self._on_step if self.lock_step else self._follow)(state)

    # Lock-step

    def _on_step(self, state: JointSample) -> None:
        if state.stamp == self._answered:
            self.counters["repeated states"] += 1
            self._commands.repeat()
            return
        if state.stamp < self._answered:
            self.counters["restarts"] += 1
            self._law.reset()
        self._matching.ask(state.stamp, state)
        self._answer()

    def _answer(self) -> None:
        """Publish the command to the state that waits, when all that it takes is there."""
        complete = self._matching.complete() if self.has_audience(self._commands.publisher) else None
        if complete is None:
            return
        state, (wanted, *feedforward) = complete
        self._commands.publish(state.stamp, self._law.answer(wanted, state.position, self.period, sum(feedforward)))
        self._answered = state.stamp
        self.deadlines.tick(time.monotonic())

    # Wall time

    def _follow(self, state: JointSample) -> None:
        given, force = self._feedforward
        now = time.monotonic()
        fresh = now - given <= self.settings.number("feedforward_timeout")
        answer = self._wall.answer(state, force if fresh else 0.0)
        if answer is None:
            return
        self._commands.publish(state.stamp, answer)
        self.deadlines.tick(now)
        self.deadlines.latency((time.time_ns() - state.stamp) * 1e-9)


main = partial(run, PidNode)
"""Serve the node until a signal comes."""

if __name__ == "__main__":
    main()
