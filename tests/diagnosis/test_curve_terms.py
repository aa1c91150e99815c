"""Terms of a friction curve, against curves written out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.curve_terms import (
    base_of,
    force_of_term,
    gain_of,
    kept,
    refitted,
    static_force,
    terms_beyond,
    weight_of,
    with_effect,
)
from fric.identification.static_maps.curve import Candidate, Choice, Curve, Points, choose
from fric.model import build_model, term
from fric.record import Array

SPEEDS: Array = np.concatenate([np.geomspace(0.005, 0.3, 12), -np.geomspace(0.005, 0.3, 12)])


def curve(candidate: Candidate, *values: float) -> Curve:
    n = len(values)
    return Curve(candidate, np.array(values), np.eye(n), 0.0, 0.0, 0.0, 10)


def points(force: Array, seed: int = 0, error: float = 0.02) -> Points:
    noise = error * np.random.default_rng(seed).standard_normal(SPEEDS.shape)
    return Points(SPEEDS, force + noise, np.full(SPEEDS.shape, error))


def plain(v: Array) -> Array:
    return np.asarray(4.0 * np.sign(v) + 8.0 * v + 0.7)


def test_each_term_of_a_curve_with_a_stribeck_effect_has_its_own_force() -> None:
    whole = curve(Candidate(viscous=True, stribeck="exponential", quadratic=True), 0.7, 4.0, 8.0, 20.0, 1.5, 0.03)
    v = np.array([-0.2, -0.01, 0.0, 0.01, 0.2])
    assert force_of_term("viscous", whole, v) == pytest.approx(8.0 * v)
    assert force_of_term("quadratic_drag", whole, v) == pytest.approx(20.0 * v * np.abs(v))
    assert force_of_term("coulomb", whole, v) == pytest.approx([-4.0, -4.0, 0.0, 4.0, 4.0])
    fallen = 1.5 * np.exp(-1.0 / 9.0)
    assert force_of_term("stribeck", whole, v)[1:4] == pytest.approx([-fallen, 0.0, fallen])


@pytest.mark.parametrize("law", ["", "exponential", "hess_soom"])
def test_the_terms_add_up_to_the_curve(law: str) -> None:
    candidate = Candidate(viscous=True, stribeck=law, quadratic=True, asymmetry=True)
    whole = curve(candidate, *[0.7, 4.0, 8.0, 20.0, 3.0, 1.5, 0.03][: len(candidate.names)])
    names = ("bias", "coulomb", "viscous", "quadratic_drag", "asymmetry", "stribeck")
    parts = [force_of_term(name, whole, SPEEDS) for name in names]
    assert np.sum(parts, axis=0) == pytest.approx(whole.force(SPEEDS))


def test_the_static_force_of_a_model_is_that_of_its_terms() -> None:
    terms = [term("coulomb", force=4.0), term("stribeck", force=2.0, velocity=0.1), term("bias", force=-0.5)]
    model = build_model("rigid", {"mass": 3.0}, [*terms, term("viscous", coefficient=10.0)])
    assert base_of(model) == Candidate(viscous=True, stribeck="exponential")
    at = np.array([0.1, -0.1])
    assert static_force(model, at) == pytest.approx([4.0 + 2.0 / np.e + 1.0 - 0.5, -4.0 - 2.0 / np.e - 1.0 - 0.5])


def test_terms_beyond_the_nominal_ones_and_without_each() -> None:
    base, rich = Candidate(viscous=True), Candidate(viscous=True, stribeck="hess_soom", asymmetry=True)
    assert terms_beyond(rich, base) == ["stribeck", "asymmetry"]
    assert terms_beyond(base, rich) == []
    assert with_effect(base, "stribeck", rich) == Candidate(viscous=True, stribeck="hess_soom")
    assert with_effect(rich, "stribeck", Candidate()) == Candidate(viscous=True, asymmetry=True)


def test_a_coefficient_that_would_be_negative_is_zero_and_the_others_are_fitted() -> None:
    drooping = points(plain(SPEEDS) - 16.0 * SPEEDS)
    assert refitted(Candidate(viscous=True), drooping, 0.0).candidate == Candidate()
    # What is left may be told by the other terms: a drag that would be negative doesn't take viscous friction with it.
    bent = points(plain(SPEEDS) - 20.0 * SPEEDS * np.abs(SPEEDS))
    found = refitted(Candidate(viscous=True, quadratic=True), bent, 0.0)
    assert found.candidate == Candidate(viscous=True)
    assert found.values[2] > 0.0
    # A surplus that would be negative likewise.
    rising = points(plain(SPEEDS) - np.sign(SPEEDS) * np.exp(-((SPEEDS / 0.02) ** 2)))
    assert refitted(Candidate(viscous=True, stribeck="exponential"), rising, 0.0).candidate == Candidate(viscous=True)


def test_the_gain_of_a_term_is_what_its_force_weighs_beyond_the_others() -> None:
    """In units of the error: the part of the drag that bias, Coulomb and viscous friction can't take over."""
    drag = 30.0 * SPEEDS * np.abs(SPEEDS)
    learnt = points(plain(SPEEDS) + drag)
    best = refitted(Candidate(viscous=True, quadratic=True), learnt, 0.0)
    others = np.column_stack([np.ones_like(SPEEDS), np.sign(SPEEDS), SPEEDS])
    beyond = drag - others @ np.linalg.lstsq(others, drag, rcond=None)[0]
    assert gain_of("quadratic_drag", best, learnt) == pytest.approx(float(beyond @ beyond) / 0.02**2, rel=0.15)


def test_a_term_that_only_the_means_learnt_from_show_goes() -> None:
    base = Candidate(viscous=True)
    learnt, apart = points(plain(SPEEDS) + 3.0 * np.abs(SPEEDS)), points(plain(SPEEDS), seed=1)
    choice = choose(learnt, at_least=base)
    assert choice.best.candidate.asymmetry
    best, gone = kept(choice, base, learnt, apart)
    assert not best.candidate.asymmetry
    assert best.candidate.viscous
    assert "asymmetry" in [name for name, _ in gone]
    # Where the others show it too, it stays.
    both = points(plain(SPEEDS) + 3.0 * np.abs(SPEEDS), seed=1)
    best, gone = kept(choice, base, learnt, both)
    assert best.candidate.asymmetry
    assert "asymmetry" not in [name for name, _ in gone]


def test_weights_of_two_curves_follow_from_the_difference_of_their_criteria() -> None:
    """Twice the logarithm of three apart, the better one carries three quarters (Burnham and Anderson 2002, Eq. 2.9)."""
    one = Curve(Candidate(viscous=True), np.zeros(3), np.eye(3), 0.0, 0.0, 0.0, 10)
    other = Curve(Candidate(), np.zeros(2), np.eye(2), 0.0, 2.0 * np.log(3.0), 0.0, 10)
    nan = float("nan")
    choice = Choice(one, None, (one, other), nan, nan, np.ones(3))
    assert weight_of(choice, "viscous") == pytest.approx(0.75)
    assert weight_of(choice, "asymmetry") == 0.0
