"""Which laws a diagnosis tries by themselves, against what the files of the effects say of them."""

from __future__ import annotations

from fric.diagnosis.worth_trying import worth_trying
from fric.effects import EFFECTS


def laws(effect_id: str) -> list[str]:
    return sorted(each.law for each in worth_trying() if each.id == effect_id)


def test_every_effect_of_the_vocabulary_is_tried() -> None:
    assert {each.id for each in worth_trying()} == {each.id for each in EFFECTS.values()}


def test_no_law_is_tried_twice_and_none_that_another_stands_for() -> None:
    keys = [each.key for each in worth_trying()]
    assert len(keys) == len(set(keys))
    assert not any(each.near for each in worth_trying())
    assert all(each.shows_alone for each in worth_trying() if each.form_of)


def test_of_an_effect_with_a_usual_law_only_that_one_is_tried() -> None:
    assert laws("presliding") == ["lugre"]
    assert laws("saturation") == ["hard"]


def test_a_form_that_shows_where_its_law_does_not_is_tried_beside_it() -> None:
    """Friction that differs by direction at low speed alone shows where the directions differ nowhere else."""
    assert laws("stribeck") == ["directional", "exponential"]
    assert laws("asymmetry") == ["linear", "low_speed"]


def test_without_a_usual_law_all_are_tried_that_do_not_come_near_another() -> None:
    """A contact that ages by a power or a root of the time comes near the logarithm."""
    assert laws("dwell_time") == ["exponential", "hyperbolic", "logarithmic"]
    assert laws("time_drift") == ["exponential", "linear"]


def test_a_law_that_can_be_absent_stands_beside_a_usual_one_that_cannot() -> None:
    """A spring in series has no stiffness at which there is none; a mass that hangs on the body can weigh nothing."""
    assert laws("compliance") == ["appendage", "linear"]
