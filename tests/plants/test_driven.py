"""The rigid axis behind a transmission: a model grows by a term, and the plant by a body."""

from __future__ import annotations

import numpy as np
import pytest
from fric.model import Model, Term, build_model, term
from fric.plants import PLANTS
from fric.plants.rigid_driven import DRIVEN
from fric.simulation import Simulator, predict_force, simulate

SPRING = term("compliance", stiffness=2e4, damping=5.0)
FRICTION = (term("coulomb", force=2.0), term("stribeck", force=1.0, velocity=0.02))


def axis(*terms: Term, share: float = 0.5) -> Model:
    driven = any(each.effect.link is not None or each.effect.play is not None for each in terms)
    return build_model("rigid", {"mass": 4.0, "load_share": share} if driven else {"mass": 4.0}, terms)


def bed(*terms: Term, share: float) -> Model:
    masses = {"motor_mass": 4.0 * (1.0 - share), "load_mass": 4.0 * share, "motor_coulomb": 0.0, "motor_viscous": 0.0}
    return build_model("two_mass", masses, terms)


def test_the_rigid_axis_has_it() -> None:
    assert PLANTS["rigid"].driven is DRIVEN
    assert PLANTS["rigid"].parameters == DRIVEN.parameters[:1]
    assert [plant for plant in PLANTS.values() if plant is DRIVEN] == []


@pytest.mark.parametrize(
    "transmission",
    [SPRING, term("backlash", gap=1e-3)],
    ids=lambda each: each.effect.id,
)
@pytest.mark.parametrize("share", [0.5, 0.2])
def test_it_is_a_two_mass_system(transmission: Term, share: float) -> None:
    model = axis(transmission, *FRICTION, share=share)
    assert model.plant is DRIVEN
    u = 8.0 * np.sin(0.02 * np.arange(1500))
    found, friction = Simulator(model).run(u, 1e-3, 4)
    expected, opposed = Simulator(bed(transmission, *FRICTION, share=share)).run(u, 1e-3, 4)
    assert np.max(np.abs(found[:, 0] - found[:, 2])) > 1e-5
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(friction, opposed, rtol=1e-12, atol=1e-15)


def test_without_a_transmission_it_stays_one_body() -> None:
    model = axis(*FRICTION)
    assert model.plant is PLANTS["rigid"]
    motion = simulate(model, np.full(100, 6.0), 1e-3)
    assert motion.states.shape == (100, 2)


def test_the_sensor_sees_the_motor() -> None:
    motion = simulate(axis(SPRING, *FRICTION), np.full(300, 6.0), 1e-3, position=-0.3)
    np.testing.assert_array_equal(motion.position, motion.states[:, 2])
    assert motion.states[0].tolist() == [-0.3, 0.0, -0.3, 0.0]


def test_a_very_stiff_transmission_is_a_rigid_axis() -> None:
    stiff = axis(term("compliance", stiffness=1e8, damping=2e3), *FRICTION)
    u = 8.0 * np.sin(0.02 * np.arange(800))
    one, two = simulate(stiff, u, 1e-3), simulate(axis(*FRICTION), u, 1e-3)
    assert np.max(np.abs(one.position - two.position)) < 1e-3 * np.ptp(two.position)


def test_the_force_that_a_motion_needs_is_that_of_the_whole_mass() -> None:
    one = np.ones(1)
    assert predict_force(axis(SPRING), 0 * one, one, 0.5 * one, 2.0 * one, 1e-3)[0] == 8.0
