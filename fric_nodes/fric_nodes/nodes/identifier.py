"""Identifies friction while the axis moves: joint states in, estimates and models out."""

from __future__ import annotations

import math
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from fric.errors import InputError
from fric.identification.online import ESTIMATORS, State, make_estimator
from fric.identification.result import Options
from fric.identification.start import start_model
from fric.model import Model
from fric.model_file import read_model, write_model
from fric.record import Units
from fric.signals.sample_pairs import EffortPairing, Sample
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from fric_interfaces.msg import FrictionEstimate, FrictionModel
from fric_interfaces.srv import FreezeIdentification, ResetIdentification, SaveIdentification, StartIdentification

from ..bulk import BulkSubscription
from ..convert import MessageError, joint_sample, model_to_message
from ..estimates import estimate_to_message, well_determined
from ..orderly import OrderlyNode, run
from ..parameters import NodeParameter, Settings
from ..qos import DIAGNOSTICS, MODEL, SAMPLES

__all__ = ["PARAMETERS", "IdentifierNode", "main"]

PARAMETERS = (
    NodeParameter("joint", "", "name of the joint; empty: the only or first one of the joint states"),
    NodeParameter("model_file", "", "fric-model/1 file with the terms to estimate and the start values; empty: terms"),
    NodeParameter("terms", ["coulomb", "viscous", "bias"], "effects to estimate when no model file is given"),
    NodeParameter("position_unit", "m", "unit of positions when no model file is given", choices=("m", "rad")),
    NodeParameter("force_unit", "N", "unit of efforts when no model file is given"),
    NodeParameter(
        "estimator",
        "rls",
        "rls: recursive least squares in blocks; ekf, ukf: Kalman filter on the friction state, sample by sample, with slip "
        "dynamics and nonlinear parameters",
        choices=ESTIMATORS,
    ),
    NodeParameter("forgetting_time", 60.0, "how long informative motion counts", unit="s", lower=0.1, upper=1e9),
    NodeParameter("cutoff", 0.0, "low-pass filter on the position; 0: chosen from the rate", unit="Hz", lower=0.0),
    NodeParameter(
        "effort_hold", "preceding", "when an effort in a joint state acts", choices=("following", "preceding", "linear")
    ),
    NodeParameter("publish_period", 0.5, "time of the samples between two estimates", unit="s", lower=0.01, upper=3600.0),
    NodeParameter("model_period", 2.0, "time of the samples between two models", unit="s", lower=0.01, upper=3600.0),
    NodeParameter("publish_model", True, "publish models once the estimate is well determined", settable=True),
    NodeParameter("autostart", True, "begin at once, without a call of ~/start"),
)
_QUEUE = 5000  # samples that may wait while a block is being worked on
_ROUND = 0.01  # [s] between two rounds of taking samples
_BATCH = 1000  # samples worked on in one round, so that services get their turn
_QUIET = 0.5  # [s] without samples after which what is known is published


class IdentifierNode(OrderlyNode):
    """Subscribes to joint states (and, where they carry no effort, to the force command) and estimates friction from them.

    Raises:
        ModelError: the model file or the terms cannot be used.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__("identifier", **node_options)
        settings = self._settings = Settings(self, PARAMETERS)
        self._joint = settings.text("joint")
        self._forgetting_time = settings.number("forgetting_time")
        file = settings.text("model_file")
        self._structure = read_model(file) if file else self._of_terms(settings.texts("terms"))
        self.counters: Counter[str] = Counter()
        self.newest = self._published_at = self._model_at = -1
        self._origin = 0
        self._unpublished = False
        self._unstamped = False
        self._quiet_rounds = 0
        self._begin(self._structure, running=settings.flag("autostart"))
        self._estimates = self.create_publisher(FrictionEstimate, "friction/estimate", 10)
        self._models = self.create_publisher(FrictionModel, "friction/model", MODEL)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
        deep = QoSProfile(depth=_QUEUE, reliability=SAMPLES.reliability)
        self._states = BulkSubscription(self, "sensor_msgs/msg/JointState", "joint_states", deep, raw=False)
        self._commands: BulkSubscription | None = None
        self.create_service(StartIdentification, "~/start", self._start)
        self.create_service(FreezeIdentification, "~/freeze", self._freeze)
        self.create_service(ResetIdentification, "~/reset", self._reset)
        self.create_service(SaveIdentification, "~/save", self._save)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_ROUND, self.work, clock=steady)
        self.create_timer(1.0, self._report, clock=steady)

    def _of_terms(self, terms: list[str]) -> Model:
        settings = self._settings
        return start_model(terms, self._joint or "axis", Units(settings.text("position_unit"), settings.text("force_unit")))

    def _begin(self, structure: Model, running: bool) -> None:
        settings = self._settings
        options = Options(cutoff=settings.number("cutoff") or None)
        hold = settings.text("effort_hold")
        self._identifier = make_estimator(settings.text("estimator"), structure, self._forgetting_time, options, hold)
        self._identifier.state = State.RUNNING if running else State.IDLE
        self._pairing = EffortPairing(hold, at_stamp=self._identifier.averages_force)

    def work(self) -> None:
        """Take what has come and learn from it."""
        before = time.time_ns()  # the clock on which the middleware stamps reception
        taken = 0
        if self._commands is not None:
            for message, received, _ in self._commands.take(_BATCH):
                stamp = message.header.stamp if hasattr(message, "header") else None
                force = message.force if stamp is not None else message.data
                if not math.isfinite(force):
                    self.counters["refused: command not finite"] += 1
                    continue
                self._pairing.command(force, received, None if stamp is None else stamp.sec * 1_000_000_000 + stamp.nanosec)
        for message, received, _ in self._states.take(_BATCH):
            taken += 1
            self._take(message, received)
        for sample in self._pairing.ready(before):
            self._learn(sample)
        self._listen_to_commands()
        self._quiet_rounds = 0 if taken else self._quiet_rounds + 1
        if self._quiet_rounds * _ROUND > _QUIET and self._unpublished:
            self.publish()

    def _take(self, message: JointState, received: int) -> None:
        try:
            if not self._joint and message.name:
                self._joint = message.name[0]
            sample = joint_sample(message, self._joint)
        except MessageError as error:
            self.counters["refused: joint state"] += 1
            self.get_logger().warning(f"joint state refused: {error}", throttle_duration_sec=5.0)
            return
        if sample.stamp and self._unstamped:
            # In lock-step the first stamp is 0, which looks like none; time by the wall doesn't go with what follows.
            self._pairing.clear()
        self._unstamped = not sample.stamp
        self._pairing.state(Sample(sample.stamp or received, received, sample.position, sample.effort))

    def _learn(self, sample: Sample) -> None:
        if self.newest < 0:
            self._origin = sample.time  # seconds since 1970 would leave too few digits for the steps
        if sample.time < self.newest:
            self._published_at = self._model_at = -1  # the machine, or the recording, was started again
        self.newest = sample.time
        self._identifier.hold = self._pairing.hold
        self._unpublished |= self._identifier.update((sample.time - self._origin) * 1e-9, sample.position, sample.effort)
        period = self._settings.number("publish_period")
        if self._published_at < 0:
            self._published_at = self._model_at = sample.time
        elif sample.time - self._published_at >= round(period * 1e9):
            self.publish()

    def _listen_to_commands(self) -> None:
        """Subscribe to the command, in the type in which it is published, when the joint states turn out to have no effort."""
        if self._commands is not None or not self._pairing.lacks_effort:
            return
        topic = self.resolve_topic_name("force_command")
        for publisher in self.get_publishers_info_by_topic(topic):
            deep = QoSProfile(depth=_QUEUE, reliability=publisher.qos_profile.reliability)
            self._commands = BulkSubscription(self, publisher.topic_type, topic, deep, raw=False)
            self.get_logger().info(f"joint states carry no effort; it is taken from {topic}")
            return

    def publish(self) -> None:
        """Publish the estimate, and the model when it is due and well determined."""
        self._published_at, self._unpublished = self.newest, False
        estimate = self._identifier.estimate()
        self._estimates.publish(estimate_to_message(estimate, self._structure, self._name_of_joint(), max(self.newest, 0)))
        due = self.newest - self._model_at >= round(self._settings.number("model_period") * 1e9)
        if (
            due
            and self._settings.flag("publish_model")
            and estimate.samples_used
            and well_determined(estimate, self._structure)
        ):
            self._model_at = self.newest
            message = model_to_message(self._model(), max(self.newest, 0))
            message.covariance_parameters = list(estimate.names)
            message.covariance = estimate.covariance.ravel().tolist()
            self._models.publish(message)

    def _name_of_joint(self) -> str:
        return self._joint or self._structure.joint

    def _model(self) -> Model:
        samples = str(self._identifier.samples_used)
        provenance = {"method": f"online, {self._identifier.title}", "samples": samples}
        return replace(self._identifier.model(), joint=self._name_of_joint(), provenance=provenance)

    def _start(self, request: Any, response: Any) -> Any:
        try:
            if request.forgetting_time < 0 or not math.isfinite(request.forgetting_time):
                raise InputError("forgetting_time", f"is {request.forgetting_time}", "give a positive time, or 0 to keep it")
            self._structure = self._of_terms(list(request.terms)) if request.terms else self._structure
            self._forgetting_time = request.forgetting_time or self._forgetting_time
            self._begin(self._structure, running=True)
        except InputError as error:
            return _answer(response, False, str(error))
        return _answer(response, True, f"estimating {', '.join(self._identifier.estimate().names)}")

    def _freeze(self, request: Any, response: Any) -> Any:
        if self._identifier.state is State.IDLE:
            return _answer(response, False, "not started; call ~/start first")
        self._identifier.freeze(request.freeze)
        self.publish()
        return _answer(response, True, "frozen" if request.freeze else "running")

    def _reset(self, request: Any, response: Any) -> Any:
        self._begin(self._structure, running=self._identifier.state is not State.IDLE)
        self.publish()
        return _answer(response, True, "reset")

    def _save(self, request: Any, response: Any) -> Any:
        path = Path(request.path or "friction_model.yaml").resolve()
        try:
            if not self._identifier.samples_used:
                raise InputError(path, "nothing has been identified yet", "move the axis first")
            if not request.path and path.exists():
                raise InputError(path, "exists already", "name a file")
            write_model(self._model(), path)
        except (InputError, OSError) as error:
            return _answer(response, False, str(error))
        response.path = str(path)
        return _answer(response, True, f"written: {path}")

    def _report(self) -> None:
        estimate = self._identifier.estimate()
        values = {"state": estimate.state.name.lower(), "samples used": estimate.samples_used, "status": estimate.status}
        values |= {"samples rejected": estimate.samples_rejected, **self.counters}
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if self.counters else DiagnosticStatus.OK,
            name=self.get_fully_qualified_name().lstrip("/"),
            message=estimate.status,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def close(self) -> None:
        """Learn from what has come, and publish the last estimate."""
        self.work()
        self.publish()


def _answer(response: Any, success: bool, message: str) -> Any:
    response.success, response.message = success, message
    return response


def main(args: list[str] | None = None) -> None:
    """Identify until SIGINT or SIGTERM; exit status 2 when the terms or the model file cannot be used."""
    run("identifier", IdentifierNode, args)


if __name__ == "__main__":
    main()
