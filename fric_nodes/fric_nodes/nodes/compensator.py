"""Feedforward of inertia and friction along the reference: takes ``reference`` and models, gives ``feedforward_force``.

With ``controller_file`` the feedforward of that file, of any kind, takes the place of a model's. Either is scaled, limited in
force and slew, and its friction published as ``feedforward_friction`` where somebody listens.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import partial
from typing import Any

from fric.control.reference import ReferencePoint
from fric.errors import InputError

from fric_interfaces.msg import Reference

from ..compensation import COMPENSATION, Compensation
from ..forces import STAMPED, ForcePublisher, reference_in
from ..lockstep import Answers
from ..loop import LOCK_STEP, PERIOD
from ..managed import ManagedNode
from ..model_intake import ModelIntake
from ..run import run
from ..wall_time import REFERENCES, StampClock, reference_guard

__all__ = ["CompensatorNode", "main"]

PARAMETERS = (PERIOD, LOCK_STEP, *COMPENSATION, *REFERENCES, STAMPED)


class CompensatorNode(ManagedNode):
    """Feedforward for one axis; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter or the model file can't be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("compensator", PARAMETERS, **options)

    def configure(self) -> None:
        """Read the model, and make the topics."""
        settings = self.settings
        # The middle of the interval in which the command acts. In wall time the reference is half a period old on average when
        # a joint state meets it, and the messages take a while.
        preview = (0.5 if self.lock_step else 1.3) * self.period
        self._compensation = Compensation(settings, self.joint, self.period, preview)
        self._force = self._compensation.force
        self._intake = ModelIntake(self, self._compensation.checked, self._compensation.use)
        settings.when_changed(lambda _changed: self._compensation.update())
        self._forces = ForcePublisher(self, "feedforward_force")
        self._friction = ForcePublisher(self, "feedforward_friction")
        self._stamps, self._watch = StampClock(self), reference_guard(settings)
        self._watch.counters = self.counters
        self._answers: Answers[ReferencePoint, float] = Answers()
        self.take_in(Reference, "reference", self._on_reference)

    def activate(self) -> None:
        """Begin at rest."""
        self._force.reset()
        self._answers.clear()

    def summary(self) -> str:
        """What the node works with."""
        limits = "" if self.lock_step else f"; {self._watch.limits}"
        told = ", ".join(f"{name} {value}" for name, value in self._compensation.condition().items())
        return f"{super().summary()}; {told}{limits}"

    def state_of(self) -> Mapping[str, str]:
        """What the node adds to its report."""
        return self._compensation.condition()

    def _on_reference(self, message: Reference) -> None:
        reference = self.usable("reference", reference_in, message)
        if reference is None or not self.active:
            return
        if self.lock_step:
            self._on_step(reference)
            return
        why = self._watch.take(self._stamps(), *reference)
        if why:
            self.get_logger().warning(f"refused reference: {why}", throttle_duration_sec=1.0)
            return
        stamp, *motion = reference
        try:
            force = self._force.step(stamp * 1e-9, *motion)
        except InputError as error:
            self.refuse("feedforward", error)
            self._force.reset()
            return
        self._publish(stamp, force)
        self.deadlines.tick(time.monotonic())
        self.deadlines.latency((time.time_ns() - stamp) * 1e-9)

    def _on_step(self, reference: ReferencePoint) -> None:
        if not self.has_audience(self._forces.publisher):
            return  # it will be sent again
        stamp = reference.stamp
        force = self._answers.find(stamp, reference)
        if force is None:
            if self._answers.goes_back(stamp):
                self.counters["restarts"] += 1
                self._answers.clear()
                self._force.reset()
            force = self._force.step(stamp * 1e-9, *reference[1:])
            self._answers.keep(stamp, reference, force)
            self.deadlines.tick(time.monotonic())
        self._publish(stamp, force)

    def _publish(self, stamp: int, force: float) -> None:
        said = self._compensation.beyond()
        if said:
            self.get_logger().warning(said)
        self._forces.publish(stamp, force)
        if self._friction.publisher.get_subscription_count() > 0:
            self._friction.publish(stamp, self._force.friction)


main = partial(run, CompensatorNode)
"""Serve the node until a signal comes."""

if __name__ == "__main__":
    main()
