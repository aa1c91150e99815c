"""An axis whose transmission has a resonance, diagnosed from a model of one body."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..diagnosis.prove.structure import nominal_model
from .concealed_reference import AXIS, Case, Limits, axis_recordings, evidence, found_in
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_SHARE = 0.45  # of the mass behind the spring
_FREQUENCY, _DAMPING = 22.0, 0.04  # of both masses against each other [Hz]; ratio
_SETTING = replace(AXIS, sample_time=1e-3, train_time=14.0, validation_time=10.0)


def _case() -> Case:
    reduced = AXIS.physics.mass * _SHARE * (1.0 - _SHARE)
    rate = 2.0 * math.pi * _FREQUENCY
    shaft = {"shaft": reduced * rate**2, "shaft_damping": 2.0 * _DAMPING * reduced * rate}
    train, validation = axis_recordings(_SETTING, _SETTING.physics.using({"load_share": _SHARE, **shaft}), 0.05, 23)
    _, nominal = nominal_model(_SETTING.physics, _SETTING.parts, {}, np.random.default_rng(4))
    return Case(train, validation, nominal)


def _run() -> Evidence:
    case = _case()
    notes = [
        f"Concealed: a spring between motor and load on which they swing at {_FREQUENCY:.0f} Hz, damping ratio {_DAMPING:g}."
        " The nominal model is one body; the encoder is the motor's."
    ]
    return evidence(case, found_in(case), ("compliance",), ("transmission",), Limits(), notes)


VERIFICATION = Verification(
    id="concealed_compliance",
    title="Concealed: a resonance in the transmission behind a model of one body",
    source="Al-Bender, Symens 2005, and the two-mass model of a drive; integrated by the examiner's loop",
    run=_run,
)
