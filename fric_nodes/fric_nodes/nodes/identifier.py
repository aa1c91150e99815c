"""Identifies friction while the axis moves: joint states in, estimates and models out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from fric.identification.online import ESTIMATORS
from fric.identification.online.session import Session, well_determined
from fric.identification.start import start_model
from fric.model_file import read_model
from fric.record import Units
from fric.signals.sample_pairs import EffortPairing, Sample

from fric_interfaces.msg import FrictionEstimate, FrictionModel

from ..convert import estimate_to_message, model_to_message
from ..identifier_services import offer_services
from ..parameters import NodeParameter
from ..qos import MODEL
from ..run import run
from ..sample_node import SampleNode
from ..setting_parameters import estimator_options, estimator_parameters

__all__ = ["PARAMETERS", "IdentifierNode", "main"]

PARAMETERS = (
    NodeParameter("model_file", "", "fric-model/1 file with the terms to estimate and the start values; empty: terms"),
    NodeParameter("terms", ["coulomb", "viscous", "bias"], "effects to estimate when no model file is given"),
    NodeParameter("position_unit", "m", "unit of positions when no model file is given", choices=("m", "rad")),
    NodeParameter("force_unit", "N", "unit of efforts when no model file is given"),
    NodeParameter(
        "estimator",
        "rls",
        "; ".join(f"{kind.id}: {kind.title}" for kind in ESTIMATORS.values()),
        choices=tuple(ESTIMATORS),
    ),
    *estimator_parameters(ESTIMATORS),
    NodeParameter("publish_period", 0.5, "time of the samples between two estimates", unit="s", lower=0.01, upper=3600.0),
    NodeParameter("model_period", 2.0, "time of the samples between two models", unit="s", lower=0.01, upper=3600.0),
    NodeParameter("publish_model", True, "publish models once the estimate is well determined", settable=True),
    NodeParameter("autostart", True, "begin at once, without a call of ~/start"),
)
_QUIET = 0.5  # [s] without samples after which what is known is published
_ROUND = 0.01  # [s] between two rounds


class IdentifierNode(SampleNode):
    """Subscribes to joint states (and, where they carry no effort, to the force command) and estimates friction from them.

    Raises:
        InputError: the model file, the terms or a setting of the estimator cannot be used.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__("identifier", PARAMETERS, **node_options)
        settings = self.settings
        file = settings.text("model_file")
        units = Units(settings.text("position_unit"), settings.text("force_unit"))
        structure = read_model(file) if file else start_model(settings.texts("terms"), self.joint or "axis", units)
        hold = settings.text("effort_hold")
        estimator = settings.text("estimator")
        options = estimator_options(settings, ESTIMATORS, estimator)
        self._session = Session(estimator, structure, options, hold, settings.flag("autostart"))
        self.pairing = EffortPairing(hold, at_stamp=self._session.estimator.averages_force)
        self._published_at = self._model_at = -1
        self._unpublished = False
        self._quiet_rounds = 0
        self._estimates = self.create_publisher(FrictionEstimate, "friction/estimate", 10)
        self._models = self.create_publisher(FrictionModel, "friction/model", MODEL)
        offer_services(self, self._session, units, self._name_of_joint, self.publish)

    def learn(self, time: float, sample: Sample) -> None:
        """Learn from ``sample``, and publish when it is time."""
        if sample.time < self.newest:
            self._published_at = self._model_at = -1  # the machine, or the recording, was started again
        self.newest = sample.time
        estimator = self._session.estimator
        estimator.hold = self.pairing.hold
        self._unpublished |= estimator.update(time, sample.position, sample.effort)
        if self._published_at < 0:
            self._published_at = self._model_at = sample.time
        elif sample.time - self._published_at >= round(self.settings.number("publish_period") * 1e9):
            self.publish()

    def after_round(self, taken: int) -> None:
        """Publish what is known when no samples come any more."""
        self._quiet_rounds = 0 if taken else self._quiet_rounds + 1
        if self._quiet_rounds * _ROUND > _QUIET and self._unpublished:
            self.publish()

    def publish(self) -> None:
        """Publish the estimate, and the model when it is due and well determined."""
        self._published_at, self._unpublished = self.newest, False
        session, settings, joint, stamp = self._session, self.settings, self._name_of_joint(), max(self.newest, 0)
        estimate = session.estimator.estimate()
        self._estimates.publish(estimate_to_message(estimate, session.structure, joint, stamp))
        due = self.newest - self._model_at >= round(settings.number("model_period") * 1e9)
        if due and settings.flag("publish_model") and well_determined(estimate, session.structure):
            self._model_at = self.newest
            message = model_to_message(session.model(joint), stamp)
            message.covariance_parameters = list(estimate.names)
            message.covariance = estimate.covariance.ravel().tolist()
            self._models.publish(message)

    def _name_of_joint(self) -> str:
        return self.joint or self._session.structure.joint

    def condition(self) -> Mapping[str, object]:
        """What the node adds to its report."""
        estimate = self._session.estimator.estimate()
        return {
            "state": estimate.state.name.lower(),
            "samples used": estimate.samples_used,
            "samples rejected": estimate.samples_rejected,
            "status": estimate.status,
        }

    def verdict(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """A warning once something was refused."""
        level = DiagnosticStatus.WARN if self.counters else DiagnosticStatus.OK
        return level, self._session.estimator.estimate().status

    def close(self) -> None:
        """Learn from what has come, and publish the last estimate."""
        super().close()
        self.publish()


main = partial(run, IdentifierNode)
"""Identify until SIGINT or SIGTERM; exit status 2 when the terms or the model file cannot be used."""


if __name__ == "__main__":
    main()
