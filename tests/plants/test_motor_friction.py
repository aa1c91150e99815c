"""Friction of the motor itself, on a rigid axis behind a transmission."""

from __future__ import annotations

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.result import Options
from fric.model import Model, ModelError, Term, build_model, term
from fric.model_file import model_from_text, model_to_text
from fric.record import Record
from fric.simulation import simulate

GAP, SPRING = term("backlash", gap=2e-3), term("compliance", stiffness=8e3, damping=5.0)
OWN = {"motor_coulomb": 2.0, "motor_viscous": 7.0}


def axis(*terms: Term, **own: float) -> Model:
    return build_model("rigid", {"mass": 4.0, "load_share": 0.3, **own}, [term("coulomb", force=3.0), *terms])


@pytest.mark.parametrize("transmission", [GAP, SPRING], ids=["gap", "spring"])
def test_the_axis_moves_as_the_test_bed_with_the_same_bodies(transmission: Term) -> None:
    u = 20.0 * np.sin(0.03 * np.arange(1500))
    bodies = {"motor_mass": 4.0 * 0.7, "load_mass": 4.0 * 0.3, **OWN}
    bed = build_model("two_mass", bodies, [term("coulomb", force=3.0), transmission])
    here, there = (simulate(model, u, 1e-3, n_substeps=4) for model in (axis(transmission, **OWN), bed))
    np.testing.assert_allclose(here.states, there.states, rtol=0.0, atol=1e-12)
    without = simulate(axis(transmission), u, 1e-3, n_substeps=4)
    assert np.max(np.abs(without.position - here.position)) > 1e-3


def test_at_rest_the_motor_holds_what_its_own_friction_can() -> None:
    for push, moves in ((1.9, False), (2.1, True)):
        motor = simulate(axis(GAP, **OWN), np.full(20, push), 1e-3).position
        assert bool(np.any(motor != 0.0)) is moves


def test_files_hold_it_and_a_model_without_transmission_has_none() -> None:
    model = axis(GAP, **OWN)
    back = model_from_text(model_to_text(model), "memory")
    assert {name: back.value(name) for name in OWN} == OWN
    rigid = model.with_terms([held for held in model.terms if held.effect.id != "backlash"])
    assert not set(OWN) & set(rigid.names)
    text = model_to_text(model).replace("motor_coulomb: 2.0", "motor_coulomb: -2.0")
    with pytest.raises(ModelError, match="motor_coulomb"):
        model_from_text(text, "memory")


def test_a_fit_holds_it_and_says_that_sliding_does_not_tell_it_from_the_loads() -> None:
    h, n = 1e-3, 4000
    t = h * np.arange(n)
    u = 14.0 * np.sin(2.0 * np.pi * 0.9 * t) + 9.0 * np.sin(2.0 * np.pi * 2.3 * t + 1.0)
    moved = simulate(axis(SPRING, **OWN), u, h, n_substeps=4)
    noise = np.random.default_rng(3).normal(0.0, 1e-6, n)
    record = Record(t, moved.position + noise, u, effort_hold="following")
    method = METHODS["prediction-error"]
    plain = method.fit(axis(SPRING, **OWN), [record], Options(held=tuple(OWN)))
    assert not set(OWN) & set(plain.fitted)
    assert plain.model.value("coulomb.force") == pytest.approx(3.0, rel=0.05)
    asked = method.fit(axis(SPRING, **OWN), [record], Options(freed=tuple(OWN)))
    assert any("motor_coulomb can't be told from coulomb.force" in each for each in asked.warnings)
