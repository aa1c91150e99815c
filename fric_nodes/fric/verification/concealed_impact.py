"""Backlash whose sides rebound, diagnosed from a model with plain backlash."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..diagnosis.prove.structure import nominal_model
from ..model import build_model, term
from .concealed_reference import AXIS, Case, Limits, axis_recordings, evidence, found_in
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_SHARE, _GAP = 0.5, 4e-4  # of the mass behind the play; [m]
_FREQUENCY, _DAMPING = 32.0, 0.08  # of both masses on a stop [Hz]; ratio
_SETTING = replace(AXIS, sample_time=1e-3, train_time=11.0, validation_time=9.0)


def _case() -> Case:
    reduced = AXIS.physics.mass * _SHARE * (1.0 - _SHARE)
    rate = 2.0 * math.pi * _FREQUENCY
    stops = {"stop_stiffness": reduced * rate**2, "stop_damping": 2.0 * _DAMPING * reduced * rate}
    truth = _SETTING.physics.using({"load_share": _SHARE, "gap": _GAP, **stops})
    train, validation = axis_recordings(_SETTING, truth, 0.05, 17)
    _, known = nominal_model(_SETTING.physics, _SETTING.parts, {}, np.random.default_rng(3))
    mass = {"mass": known.plant_values[0], "load_share": 0.8 * _SHARE}
    return Case(train, validation, build_model("rigid", mass, [*known.terms, term("backlash", gap=1.2 * _GAP)]))


def _run() -> Evidence:
    case = _case()
    notes = [
        f"Concealed: stops on which both masses would swing at {_FREQUENCY:.0f} Hz, damping ratio {_DAMPING:g}, at the ends of"
        f" a play of {1e3 * _GAP:g} mm. The nominal model has the play with plastic stops."
    ]
    return evidence(case, found_in(case), ("impact_backlash",), ("transmission",), Limits(), notes)


VERIFICATION = Verification(
    id="concealed_impact",
    title="Concealed: backlash with impact behind a model with plain backlash",
    source="de Marchi 1998 (backlash with impact effects), integrated by the examiner's loop",
    run=_run,
)
