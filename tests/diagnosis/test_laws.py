"""The law of an effect that was found: one that leaves much less comes in its place, and no other."""

from __future__ import annotations

import pytest
from fric.diagnosis.fitting import State, refit
from fric.diagnosis.laws import with_best_laws
from fric.diagnosis.settle import Step
from fric.diagnosis.track import Track
from fric.model import Term, term

from .small_axis import NOMINAL, followed, with_terms

BENT = term("stribeck", "exponential", force=6.0, velocity=0.15, exponent=1.0)
"""A surplus that falls as the plain exponential of the speed."""
ROUND = term("stribeck", "exponential", force=6.0, velocity=0.15, exponent=2.0)


def begun(lack: Term, grown: Term) -> tuple[Track, State, State]:
    track = followed(lack, bandwidth=140.0)
    return track, refit(track, NOMINAL), refit(track, with_terms(grown))


def step(begin: State, state: State, name: str) -> Step:
    return Step(name, begin.left, state.left, state.floor, begin.excess, (), ())


def test_an_effect_takes_the_law_that_leaves_much_less() -> None:
    track, begin, state = begun(BENT, ROUND)
    said: list[str] = []
    better, (now,) = with_best_laws(track, state, [step(begin, state, "stribeck")], said.append)
    assert better.fit.model.value("stribeck.exponent") == 1.0
    assert better.left < 0.1 * state.left
    assert now.term == "stribeck"
    # What the step left goes down by what the law takes off.
    assert now.after == pytest.approx(better.left)
    assert now.before == begin.left
    assert len(said) == 1


def test_an_effect_keeps_its_law_where_the_others_leave_as_much() -> None:
    track, begin, state = begun(ROUND, ROUND)
    before = [step(begin, state, "stribeck")]
    after, steps = with_best_laws(track, state, before, lambda _: None)
    assert after is state
    assert steps == before


def test_without_steps_no_law_is_tried() -> None:
    """A law of the nominal model isn't in question."""
    track, _, state = begun(BENT, ROUND)
    assert with_best_laws(track, state, [], lambda _: None) == (state, [])


def test_a_limit_with_a_round_knee_is_found_by_its_own_law() -> None:
    """A drive that gives way softly towards 20 N; by a sharp corner it would leave something at every large force."""
    soft = term("saturation", "soft", limit=20.0, softness=0.5)
    track, begin, state = begun(soft, term("saturation", "hard", limit=20.0))
    better, (now,) = with_best_laws(track, state, [step(begin, state, "saturation")], lambda _: None)
    law = next(held for held in better.fit.model.terms if held.effect.id == "saturation")
    assert law.effect.law == "soft"
    assert law.by_name["softness"] == pytest.approx(0.5, abs=0.05)
    assert law.by_name["limit"] == pytest.approx(20.0, rel=0.02)
    assert now.after < 0.1 * state.left
