"""What a held-back recording alone is corrected by: its own faults, and not what the axis has in every recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from fric.diagnosis.intake import without_faults
from fric.instrument import inspect
from fric.model import Model, build_model, term
from fric.record import Record
from fric.simulation import simulate

NOMINAL = build_model("rigid", {"mass": 3.0}, [term("coulomb", force=6.0), term("viscous", coefficient=10.0)])


def pushed(model: Model, seconds: float, size: float, name: str) -> Record:
    """A slide pushed to and fro by two tones of ``size`` times 20 N and 12 N."""
    random = np.random.default_rng(5)
    time = 2e-3 * np.arange(round(seconds / 2e-3))
    force = size * (20.0 * np.sin(2.0 * np.pi * 0.6 * time) + 12.0 * np.sin(2.0 * np.pi * 1.7 * time + 1.0))
    position = simulate(model, force, 2e-3).position
    return replace(Record(time, position, force + 0.02 * random.standard_normal(time.size)), source=name)


def test_a_unit_of_the_held_back_recording_alone_is_taken_out() -> None:
    learnt, held = pushed(NOMINAL, 12.0, 1.0, "learnt"), pushed(NOMINAL, 9.0, 0.9, "held")
    wrong = replace(held, effort=1000.0 * held.effort)
    _, (found,), notes = without_faults([learnt], [wrong], NOMINAL, inspect([learnt], NOMINAL))
    np.testing.assert_allclose(found.effort, held.effort, rtol=1e-9)
    assert any("in held alone" in note for note in notes)


def test_friction_that_follows_the_force_is_no_unit_of_the_held_back_recording() -> None:
    """Where the axis learnt from is unlike its model, one recording's estimate of a factor is the axis', too."""
    geared = NOMINAL.with_terms([*NOMINAL.terms, term("gear_friction", coefficient=0.7)])
    learnt, held = pushed(geared, 12.0, 4.0, "learnt"), pushed(geared, 9.0, 1.0, "held")
    checks = inspect([learnt], NOMINAL)
    _, (found,), notes = without_faults([learnt], [held], NOMINAL, checks)
    np.testing.assert_array_equal(found.effort, held.effort)
    assert not any("in held alone" in note for note in notes)
