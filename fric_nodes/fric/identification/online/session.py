"""One online identification from its start to the model that it leaves: begun, frozen, begun anew, saved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...errors import InputError
from ...model import Model
from ...model_file import write_model
from ...record import Units
from ..start import start_model
from . import make_estimator
from .estimate import Estimate, State
from .kind import OnlineOptions

__all__ = ["Session", "well_determined"]

_FORCE_SHARE = 0.05  # physical scale: an error this small against the largest force is of no use to a compensation


class Session:
    """An estimator with what it was begun with.

    Args:
        kind: of the estimator, one of :data:`ESTIMATORS`.
        structure: terms to estimate, with their start values.
        options: settings of the estimator.
        hold: how an effort relates to the intervals beside its sample.
        running: learn from the first sample on; False waits for :meth:`start`.

    Attributes:
        structure: of the present estimate.
        estimator: in use.
    """

    def __init__(self, kind: str, structure: Model, options: OnlineOptions, hold: str, running: bool) -> None:
        self._kind = kind
        self._hold = hold
        self._begin(structure, options, running)

    def _begin(self, structure: Model, options: OnlineOptions, running: bool) -> None:
        self.estimator = make_estimator(self._kind, structure, options, self._hold)
        self.estimator.state = State.RUNNING if running else State.IDLE
        self.structure, self._options = structure, options

    def start(self, terms: Sequence[str], units: Units, forgetting_time: float) -> str:
        """Begin anew with ``terms`` (empty: the present ones) and ``forgetting_time`` [s] (0: the present one); says with what.

        Raises:
            InputError: the terms or the time can't be used; the estimate goes on as it was.
        """
        if forgetting_time < 0 or not math.isfinite(forgetting_time):
            raise InputError("forgetting_time", f"is {forgetting_time}", "give a positive time, or 0 to keep it")
        structure = start_model(list(terms), self.structure.joint, units) if terms else self.structure
        options = replace(self._options, forgetting_time=forgetting_time or self._options.forgetting_time)
        self._begin(structure, options, True)
        return f"estimating {', '.join(self.estimator.estimate().names)}"

    def freeze(self, frozen: bool) -> str:
        """Hold the estimate as it is, or go on; says which.

        Raises:
            InputError: nothing was started.
        """
        if self.estimator.state is State.IDLE:
            raise InputError("identifier", "not started", "call ~/start first")
        self.estimator.freeze(frozen)
        return "frozen" if frozen else "running"

    def reset(self) -> str:
        """Forget everything and go on in the same state."""
        self._begin(self.structure, self._options, self.estimator.state is not State.IDLE)
        return "reset"

    def model(self, joint: str) -> Model:
        """The structure with the values estimated so far, of ``joint``, and where they come from."""
        found = self.estimator
        provenance = {"method": f"online, {found.title}", "samples": str(found.samples_used)}
        return replace(found.model(), joint=joint, provenance=provenance)

    def save(self, given: str, joint: str) -> Path:
        """Write the model to the path ``given``; empty: to ``friction_model.yaml``, which must not exist.

        Raises:
            InputError: nothing is known yet, or the file exists.
            OSError: the file can't be written.
        """
        path = Path(given or "friction_model.yaml").resolve()
        if not self.estimator.samples_used:
            raise InputError(path, "nothing has been identified yet", "move the axis first")
        if not given and path.exists():
            raise InputError(path, "exists already", "name a file")
        write_model(self.model(joint), path)
        return path


def well_determined(estimate: Estimate, structure: Model) -> bool:
    """True when every parameter is known well enough to compensate with.

    A force that is truly zero never becomes certain in relation to itself, so forces are also measured against the largest one.
    """
    dimension = {p.name: p.declaration.dimension for p in structure.parameters()}
    forces = [abs(value) for name, value in zip(estimate.names, estimate.values, strict=True) if dimension[name] == "F"]
    limit = _FORCE_SHARE * max(forces, default=0.0)
    known = zip(estimate.names, estimate.standard_errors, estimate.excited, strict=True)
    return bool(estimate.samples_used) and all(
        bool(excited) or (dimension[name] == "F" and bool(error < limit)) for name, error, excited in known
    )
