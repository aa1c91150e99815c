"""A guideway whose contact has pre-sliding with memory, diagnosed from a Coulomb model."""

from __future__ import annotations

import numpy as np

from ..diagnosis.prove.structure import nominal_model
from .concealed_reference import AXIS, Case, Limits, axis_recordings, evidence, found_in
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_DISPLACEMENT = 1e-4  # [m]
_ELEMENTS = ((0.2, 0.55), (0.3, 0.25), (0.3, 0.14), (0.2, 0.06))  # shares of the level and of the stiffness


def _case() -> Case:
    truth = AXIS.physics.using({"presliding": 2.0, "displacement": _DISPLACEMENT, "elements": _ELEMENTS})
    train, validation = axis_recordings(AXIS, truth, 0.05, 11)
    _, nominal = nominal_model(AXIS.physics, AXIS.parts, {}, np.random.default_rng(1))
    return Case(train, validation, nominal)


def _run() -> Evidence:
    case = _case()
    notes = ["Concealed: four elements that stick or slip, 0.1 mm of pre-sliding; no candidate was used to make the recording."]
    return evidence(case, found_in(case), ("presliding",), ("guideway friction",), Limits(), notes)


VERIFICATION = Verification(
    id="concealed_presliding",
    title="Concealed: pre-sliding with memory behind a Coulomb model of a guideway",
    source="Al-Bender, Lampaert, Swevers 2005 (elements with slip dynamics), integrated by the examiner's loop",
    run=_run,
)
