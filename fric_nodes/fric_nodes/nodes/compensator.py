"""Feedforward of inertia and friction along the reference: takes ``reference`` and models, gives ``feedforward_force``."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Mapping
from typing import Any

from rclpy.task import Future
from std_msgs.msg import Float64

from fric_interfaces.msg import FrictionModel, Reference, StampedForce
from fric_interfaces.srv import LoadModel

from ..control.feedforward import Feedforward, prepare
from ..errors import InputError
from ..model import Model
from ..model_file import read_model
from .base import LOCK_STEP, PERIOD, LoopNode
from .convert import model_from_message, nanoseconds, set_stamp
from .lockstep import Answers
from .main import run
from .parameters import NodeParameter
from .qos import MODEL, SAMPLES

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
    NodeParameter("stamped", False, "wall time: publish StampedForce instead of Float64; lock-step always does"),
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
        self._ready: deque[tuple[Model, Future]] = deque()
        self.create_timer(0.05, self._take_over)
        settings.when_changed(self._on_settings)
        stamped = self.lock_step or settings.flag("stamped")
        self._message = StampedForce() if stamped else Float64()
        if stamped:
            self._message.header.frame_id = self.joint
        self._publisher = self.create_publisher(type(self._message), "feedforward_force", SAMPLES)
        self._answers: Answers[tuple[float, float, float], float] = Answers()
        self.create_subscription(Reference, "reference", self._on_step if self.lock_step else self._on_reference, SAMPLES)
        self.create_subscription(FrictionModel, "friction/model", self._on_model, MODEL)
        self.create_service(LoadModel, "~/load_model", self._on_load)

    def _preview(self) -> float:
        given = self.settings.number("preview")
        # The middle of the interval in which the command acts. In wall time the reference is half a period old on average when
        # a joint state meets it, and the messages take a while.
        return given if given >= 0.0 else (0.5 if self.lock_step else 1.2) * self.period

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

    def _prepare(self, model: Model) -> Future:
        """Compile ``model`` on a thread of its own, while the loop goes on, then take it over; done when it is in use."""
        done = Future(executor=self.executor)

        def work() -> None:
            try:
                prepare(model)
                self._ready.append((model, done))
            except Exception as error:
                done.set_exception(error)

        threading.Thread(target=work, daemon=True).start()
        return done

    def _take_over(self) -> None:
        """Change to the models that are ready."""
        while self._ready:
            model, done = self._ready.popleft()
            self._feedforward.set_model(model)
            self.counters["models"] += 1
            done.set_result(None)

    def _on_model(self, message: FrictionModel) -> None:
        if not self.settings.flag("follow_topic"):
            return
        try:
            self._prepare(self._checked(model_from_message(message)))
        except InputError as error:
            self.refuse("model", error)

    async def _on_load(self, request: LoadModel.Request, response: LoadModel.Response) -> LoadModel.Response:
        try:
            model = read_model(request.path) if request.path else model_from_message(request.model)
            await self._prepare(self._checked(model))
            response.success, response.message = True, f"{model.plant.id} with {', '.join(model.prefixes) or 'no terms'}"
        except InputError as error:
            response.success, response.message = False, str(error)
        return response

    # References

    def _force(self, reference: Reference) -> float | None:
        """The force for ``reference``, or None when it can't be used."""
        p, v, a = reference.position, reference.velocity, reference.acceleration
        if not (math.isfinite(p) and math.isfinite(v) and math.isfinite(a)):
            self.refuse("reference", f"position {p}, velocity {v}, acceleration {a}")
            return None
        return self._feedforward.step(nanoseconds(reference.header.stamp) * 1e-9, p, v, a)

    def _publish(self, stamp: int, force: float) -> None:
        message = self._message
        if isinstance(message, Float64):
            message.data = force
        else:
            set_stamp(message.header.stamp, stamp)
            message.force = force
        self._publisher.publish(message)

    def _on_step(self, reference: Reference) -> None:
        stamp = nanoseconds(reference.header.stamp)
        question = (reference.position, reference.velocity, reference.acceleration)
        force = self._answers.find(stamp, question)
        if force is None:
            if self._answers.goes_back(stamp):
                self.counters["restarts"] += 1
                self._answers.clear()
                self._feedforward.reset()
            force = self._force(reference)
            if force is None:
                return
            self._answers.keep(stamp, question, force)
            self.deadlines.tick(time.monotonic())
        self._publish(stamp, force)

    def _on_reference(self, reference: Reference) -> None:
        force = self._force(reference)
        if force is not None:
            self._publish(nanoseconds(reference.header.stamp), force)
            self.deadlines.tick(time.monotonic())
            self.deadlines.latency((time.time_ns() - nanoseconds(reference.header.stamp)) * 1e-9)


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    run(CompensatorNode, args)


if __name__ == "__main__":
    main()
