"""Rivals in other forms: by a law that goes further, another shape, or stops that give in place of hard ones."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.candidates import candidates, scales_of
from fric.diagnosis.fitting import State, refit
from fric.diagnosis.other_forms import extended, is_stop, shaped, that_give, with_play
from fric.diagnosis.rival import Rival, rival_of
from fric.diagnosis.screen import Screening, screen
from fric.diagnosis.track import Track
from fric.model import Model, Term, build_model, term
from fric.record import Record
from fric.simulation import simulate

from .small_axis import NOMINAL, STEP, followed, with_terms


def rival(track: Track, state: State, found: Screening, fitted: Model, effect_id: str) -> Rival:
    """The fitted model as a rival that was offered by the trial of its effect."""
    offer = next(each for each in (*found.tried, *found.laws) if each.column.term.effect.id == effect_id)
    return rival_of(track, state, (offer,), refit(track, fitted).fit, found)


def screened(track: Track) -> tuple[State, Screening]:
    state = refit(track, NOMINAL)
    return state, screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False)


def parted(stop: Term, bandwidth: float = 140.0) -> Track:
    """Two bodies of 1 kg with ``stop`` between them, recorded at the motor."""
    axis = build_model("rigid", {"mass": 2.0, "load_share": 0.5}, [*NOMINAL.terms, stop])
    time = STEP * np.arange(3000)
    effort = 18.0 * np.sin(5.0 * time) + 9.0 * np.sin(17.0 * time)
    position = simulate(axis, effort, STEP, n_substeps=8).position
    position = position + 1e-7 * np.random.default_rng(1).standard_normal(time.size)
    return Track.of([Record(time, position, effort, effort_hold="following")], bandwidth, NOMINAL)


def test_a_shape_that_suits_better_is_taken() -> None:
    """A surplus that falls as the plain exponential of the speed, offered as one that falls with its square."""
    track = followed(term("stribeck", "exponential", force=6.0, velocity=0.15, exponent=1.0), bandwidth=140.0)
    state, found = screened(track)
    offered = rival(track, state, found, with_terms(term("stribeck", force=6.0, velocity=0.15)), "stribeck")
    better = shaped(track, state, offered, found, scales_of(track))
    assert better.fit.model.value("stribeck.exponent") == 1.0
    assert better.left < 0.1 * offered.left
    assert better.fair == pytest.approx(better.left * offered.fair / offered.left)
    assert better.dear == pytest.approx(offered.dear, abs=0.02 * state.excess)  # a shape costs nothing


def test_a_shape_that_suits_is_kept() -> None:
    track = followed(term("stribeck", force=6.0, velocity=0.15), bandwidth=140.0)
    state, found = screened(track)
    offered = rival(track, state, found, with_terms(term("stribeck", force=6.0, velocity=0.15)), "stribeck")
    assert shaped(track, state, offered, found, scales_of(track)) is offered


@pytest.fixture(scope="module")
def hardening() -> tuple[Track, State, Screening]:
    """A shaft that is twice as stiff where a force of 10 N winds it up."""
    shaft = term("compliance", "hardening", stiffness=2e3, hardening=8e7, damping=10.0)
    track = parted(shaft)
    return track, *screened(track)


def test_a_spring_that_hardens_is_taken_where_it_leaves_much_less(hardening: tuple[Track, State, Screening]) -> None:
    track, state, found = hardening
    linear = NOMINAL.with_terms((*NOMINAL.terms, term("compliance", stiffness=3e3, damping=10.0)))
    offered = rival(track, state, found, linear, "compliance")
    further = extended(track, state, offered, found, scales_of(track))
    law = next(held for held in further.fit.model.terms if held.effect.id == "compliance")
    assert law.effect.law == "hardening"
    assert further.left < 0.3 * offered.left
    # One parameter more has its price.
    assert further.dear > offered.dear


def test_a_linear_spring_stays_linear() -> None:
    spring = term("compliance", stiffness=3e3, damping=10.0)
    track = parted(spring)
    state, found = screened(track)
    offered = rival(track, state, found, NOMINAL.with_terms((*NOMINAL.terms, spring)), "compliance")
    assert extended(track, state, offered, found, scales_of(track)) is offered


def test_stops_that_give_are_tried_in_place_of_hard_ones() -> None:
    """A gap of a millimetre whose stops give a third of it under the usual force."""
    soft = term("impact_backlash", gap=1e-3, stiffness=3e4, damping=40.0)
    track = parted(soft)
    state, found = screened(track)
    hard = rival(track, state, found, NOMINAL.with_terms((*NOMINAL.terms, term("backlash", gap=1e-3))), "backlash")
    (giving,) = that_give(track, state, hard, found, scales_of(track))
    assert giving.effect.id == "impact_backlash"
    assert giving.left < 0.5 * hard.left
    assert giving.fit.model.value("impact_backlash.gap") == pytest.approx(1e-3, rel=0.1)
    assert giving.fit.model.value("impact_backlash.stiffness") == pytest.approx(3e4, rel=0.5)
    assert "backlash" not in giving.fit.model.prefixes
    # What has no hard stops has none that could give.
    spring = rival(track, state, found, NOMINAL.with_terms((*NOMINAL.terms, term("compliance", stiffness=3e4))), "compliance")
    assert that_give(track, state, spring, found, scales_of(track)) == []


def test_stops_with_play_stay_and_what_has_none_is_not_asked() -> None:
    track = parted(term("backlash", gap=1e-3))
    state, found = screened(track)
    gap = rival(track, state, found, NOMINAL.with_terms((*NOMINAL.terms, term("backlash", gap=1e-3))), "backlash")
    bias = rival(track, state, found, with_terms(term("bias", force=0.1)), "bias")
    assert with_play(track, state, [gap, bias], found, scales_of(track)) == [gap, bias]


@pytest.mark.parametrize(
    ("held", "stop"),
    [
        (term("impact_backlash", gap=1e-3, stiffness=3e4, damping=40.0), True),
        (term("backlash", gap=1e-3), False),  # a play without a spring
        (term("compliance", stiffness=3e4), False),  # a spring without a play
        (term("coulomb", force=4.0), False),
    ],
    ids=lambda each: str(each) if isinstance(each, bool) else each.effect.id,
)
def test_a_stop_has_a_play_and_a_spring(held: Term, stop: bool) -> None:
    assert is_stop(held.effect) is stop
