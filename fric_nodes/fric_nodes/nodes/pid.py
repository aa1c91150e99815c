"""Position control: takes ``reference``, ``joint_states`` and ``feedforward_force``, gives ``force_command``.

In wall time every joint state is answered at once, with the latest reference led on to its stamp. What is late, not finite or
no motion of the axis is refused; a reference that is lost ends in a controlled stop, a pause of the process without a jump; no
force leaves but by the safety layer (:mod:`fric.control.safe_control`). In lock-step the answer to a joint state waits for the
reference, and the feedforward, of the same stamp.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from fric.control.feedbacks.pid import Pid
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import Reference, StampedForce

from ..convert import JointSample
from ..forces import ForcePublisher, force_in, force_type, reference_in
from ..managed import ManagedNode
from ..pid_in_lock_step import StepControl
from ..pid_parameters import CONTROLLER_FILE, PARAMETERS, gains_of, law_of
from ..run import run
from ..wall_time import WallControl

__all__ = ["PidNode", "main"]


class PidNode(ManagedNode):
    """A PID controller, or the one of a file; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter can't be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("pid", PARAMETERS, **options)

    def configure(self) -> None:
        """Make the law, and the topics."""
        settings = self.settings
        self._law = law_of(settings, self.period)
        self._adds = settings.flag("use_feedforward")
        self._feedforward = (-math.inf, 0.0)
        self._commands = ForcePublisher(self, "force_command")
        self._wall: WallControl | None = None
        if self.lock_step:
            self._step = StepControl(self, self._law, self._commands, self._adds)
        else:
            self._wall = WallControl(self, self._law, self._commands.publish)
        settings.test_together(lambda values: gains_of(values, self.period))
        settings.when_changed(self._on_settings)
        self.take_in(JointState, "joint_states", self._on_state)
        self._references = self.take_in(Reference, "reference", self._on_reference)
        if self._adds:
            self.take_in(force_type(self), "feedforward_force", self._on_feedforward)

    def activate(self) -> None:
        """Answer joint states from now on."""
        if self._wall is not None:
            self._wall.start()

    def deactivate(self) -> None:
        """Bring the force to zero."""
        if self._wall is not None:
            self._wall.stop()

    def summary(self) -> str:
        """What the node works with."""
        limits = f"force limit {self._law.limit:g}" if self._wall is None else self._wall.layer.limits
        law = self.settings.text(CONTROLLER_FILE.name) or (self._law.gains if isinstance(self._law, Pid) else self._law)
        return f"{super().summary()}; {law}; {limits}"

    def _on_settings(self, _changed: set[str]) -> None:
        if isinstance(self._law, Pid):  # a file's gains are the file's
            self._law.set_gains(gains_of(self.settings.values(), self.period))
            self._law.limit = self.settings.number("force_limit")
        if self._wall is not None:
            self._wall.layer.allow(self.settings.number("force_limit"))

    def state_of(self) -> Mapping[str, object]:
        """What the node adds to its report."""
        saturated = {"saturated": str(self._law.saturated)}
        return (
            saturated
            if self._wall is None
            else {**saturated, "reference": self._wall.following, **self._wall.panel.condition()}
        )

    def judgement(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """Level and text of the report."""
        return super().judgement(troubles) if self._wall is None else self._wall.panel.verdict(troubles)

    def _on_reference(self, message: Reference) -> None:
        reference = self.usable("reference", reference_in, message)
        if reference is None:
            return
        if self._wall is not None:
            self._wall.reference(reference)
        else:
            self._step.reference(reference)

    def _on_feedforward(self, message: StampedForce | Float64) -> None:
        given = self.usable("feedforward", force_in, message)
        if given is None:
            return
        self._feedforward = (time.monotonic(), given[1])
        if self.lock_step:
            self._step.feedforward(*given)

    def _on_state(self, message: JointState) -> None:
        state = self.state_of_joint(message)
        if state is None:
            return
        if self._wall is not None:
            self._follow(self._wall, state)
        else:
            self._step.state(state)

    def _follow(self, wall: WallControl, state: JointSample) -> None:
        given, force = self._feedforward
        now = time.monotonic()
        fresh = now - given <= self.settings.number("feedforward_timeout")
        if not fresh and force != 0.0:
            self._feedforward = (given, 0.0)
            self.counters["feedforward lost"] += 1
        answer = wall.answer(state, force if fresh else 0.0, self._references.get_publisher_count())
        if answer is None:
            return
        self._commands.publish(state.stamp, answer)
        self.deadlines.tick(now)
        self.deadlines.latency((time.time_ns() - state.stamp) * 1e-9)


main = partial(run, PidNode)
"""Serve the node until a signal comes."""

if __name__ == "__main__":
    main()
