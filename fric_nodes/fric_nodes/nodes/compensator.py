"""Feedforward of inertia and friction along the reference: takes ``reference`` and models, gives ``feedforward_force``."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from functools import partial
from typing import Any

from fric.control.feedforward import Feedforward
from fric.control.reference import ReferencePoint
from fric.errors import InputError
from fric.model import Model
from fric.model_file import read_model

from fric_interfaces.msg import Reference

from ..forces import STAMPED, ForcePublisher, reference_in
from ..lockstep import Answers
from ..loop import LOCK_STEP, PERIOD, LoopNode
from ..model_intake import ModelIntake
from ..parameters import NodeParameter
from ..run import run
from ..wall_time import REFERENCES, StampClock, reference_guard

__all__ = ["CompensatorNode", "main"]

PARAMETERS = (
    PERIOD,
    LOCK_STEP,
    NodeParameter("model_file", "", "fric-model/1 file to start with; empty: no force until a model comes"),
    NodeParameter("enabled", True, "give the force; false gives zero", settable=True),
    NodeParameter("follow_topic", True, "take over models from friction/model", settable=True),
    NodeParameter("terms", [""], "effects of the model to compensate; empty: all"),
    NodeParameter("include_inertia", True, "feed the inertia force forward too", settable=True),
    NodeParameter("preview", -1.0, "how much later than its stamp the force acts; negative: by the clock", "s", -1.0, 10.0,
                  settable=True),
    NodeParameter("transition_time", 0.2, "time to change from a model to another, and to switch on and off", "s", 0.0, 100.0),
    NodeParameter("rest_fade_time", 0.1, "time in which a static friction force is let down at rest", "s", 0.0, 100.0),
    *REFERENCES,
    STAMPED,
)  # fmt: skip


class CompensatorNode(LoopNode):
    """Feedforward for one axis; options as for ``rclpy.node.Node``.

    Raises:
        InputError: a parameter or the model file can't be used.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("compensator", PARAMETERS, **options)
        settings = self.settings
        self._feedforward = Feedforward(
            self.period,
            preview=self._preview(),
            transition_time=settings.number("transition_time"),
            rest_fade_time=settings.number("rest_fade_time"),
            terms=settings.texts("terms"),
            include_inertia=settings.flag("include_inertia"),
            enabled=settings.flag("enabled"),
        )
        if settings.text("model_file"):
            self._feedforward.set_model(self._checked(read_model(settings.text("model_file"))), at_once=True)
        self._intake = ModelIntake(self, self._checked, self._feedforward.set_model)
        settings.when_changed(self._on_settings)
        self._forces = ForcePublisher(self, "feedforward_force")
        self._stamps, self._watch = StampClock(self), reference_guard(settings)
        self._watch.counters = self.counters
        self._answers: Answers[ReferencePoint, float] = Answers()
        self.create_subscription(Reference, "reference", self._on_reference, self.input_qos)

    def _preview(self) -> float:
        given = self.settings.number("preview")
        # The middle of the interval in which the command acts. In wall time the reference is half a period old on average when
        # a joint state meets it, and the messages take a while.
        return given if given >= 0.0 else (0.5 if self.lock_step else 1.3) * self.period

    def _on_settings(self, _changed: set[str]) -> None:
        self._feedforward.enabled = self.settings.flag("enabled")
        self._feedforward.include_inertia = self.settings.flag("include_inertia")
        self._feedforward.preview = self._preview()

    def condition(self) -> Mapping[str, str]:
        """What the node adds to its report."""
        model = self._feedforward.model
        effects = "none" if model is None else ", ".join(model.prefixes)
        return {"model": effects, "enabled": str(self._feedforward.enabled)}

    # Models

    def _checked(self, model: Model) -> Model:
        if model.joint != self.joint:
            raise InputError("model", f"is of joint '{model.joint}'", f"give one of joint '{self.joint}'")
        return self._feedforward.selected(model)

    # References

    def _on_reference(self, message: Reference) -> None:
        reference = self.usable("reference", reference_in, message)
        if reference is None:
            return
        if self.lock_step:
            self._on_step(reference)
            return
        why = self._watch.take(self._stamps(), *reference)
        if why:
            self.get_logger().warning(f"refused reference: {why}", throttle_duration_sec=1.0)
            return
        stamp, *motion = reference
        force = self._feedforward.step(stamp * 1e-9, *motion)
        if not math.isfinite(force):
            self.counters["feedforward not finite: reset"] += 1
            self._feedforward.reset()
            return
        self._forces.publish(stamp, force)
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
                self._feedforward.reset()
            force = self._feedforward.step(stamp * 1e-9, *reference[1:])
            self._answers.keep(stamp, reference, force)
            self.deadlines.tick(time.monotonic())
        self._forces.publish(stamp, force)


main = partial(run, CompensatorNode)
"""Serve the node until a signal comes."""

if __name__ == "__main__":
    main()
