"""Friction levels below zero along a motion: as much as can be said by hand, and what a diagnosis makes of it."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.levels import negative_friction
from fric.diagnosis.price import implausible, strange
from fric.model import Term, build_model, term

from .small_axis import MASS, NOMINAL, followed, with_terms

TRACK = followed()


def only(*terms: Term) -> float:
    return negative_friction(TRACK, build_model("rigid", {"mass": MASS}, terms))


@pytest.mark.parametrize("dry", [4.0, 2.0, 1.0])
def test_what_is_below_zero_counts_by_its_energy(dry: float) -> None:
    """Levels of F + D forward and F - D backward; the axis moves both ways for about as long."""
    share = only(term("coulomb", force=dry), term("asymmetry", force=3.0, coefficient=0.0))
    below = min(dry - 3.0, 0.0) ** 2
    assert share == pytest.approx(below / ((dry + 3.0) ** 2 + (dry - 3.0) ** 2), rel=0.2)


def test_one_direction_without_any_other_friction_is_half_of_it() -> None:
    assert only(term("asymmetry", force=3.0, coefficient=0.0)) == pytest.approx(0.5, abs=0.05)
    assert only(term("asymmetry", force=-3.0, coefficient=0.0)) == pytest.approx(0.5, abs=0.05)


def test_other_forces_are_no_levels() -> None:
    """A bias pushes, a viscous friction of one direction alone has no level, and a model without levels has none below zero."""
    assert only() == 0.0
    assert only(term("bias", force=-9.0), term("viscous", coefficient=5.0), term("coulomb", force=1.0)) == 0.0
    assert only(term("asymmetry", force=0.0, coefficient=8.0)) == 0.0


def test_bristles_and_a_transmission_change_nothing_of_it() -> None:
    lacking = term("coulomb", force=1.0), term("asymmetry", force=3.0, coefficient=0.0)
    plain = only(*lacking)
    assert only(*lacking, term("presliding", "lugre", stiffness=1e5, damping=100.0)) == pytest.approx(plain, rel=1e-9)
    behind = build_model(
        "rigid", {"mass": MASS, "load_share": 0.5}, [*lacking, term("compliance", stiffness=1e5, damping=10.0)]
    )
    assert negative_friction(TRACK, behind) == pytest.approx(plain, rel=0.1)
    dead = term("input_deadzone", "hard", width=1.0)
    assert only(*lacking, dead) == pytest.approx(plain, rel=1e-9)


def test_it_is_added_to_what_speaks_against_a_model() -> None:
    usual = with_terms(term("asymmetry", force=1.0, coefficient=0.0))
    assert implausible(TRACK, usual) == strange(TRACK.masses, usual) == 0.0
    odd = build_model("rigid", {"mass": 2.0 * MASS}, [term("asymmetry", force=3.0, coefficient=0.0)])
    assert implausible(TRACK, odd) == pytest.approx(0.1 + 0.5, abs=0.05)


def test_a_level_that_has_no_number_speaks_for_nothing() -> None:
    broken = NOMINAL.with_value("coulomb.force", np.inf)
    assert np.isfinite(negative_friction(TRACK, broken))
