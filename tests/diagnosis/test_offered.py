"""Which candidates are fitted in full, from screenings whose gains are set by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis.candidates import candidates, scales_of
from fric.diagnosis.fitting import Beginning, State, refit
from fric.diagnosis.offered import offered
from fric.diagnosis.screen import Screening, Tried, screen
from fric.diagnosis.track import Track
from fric.model import term

from .small_axis import NOMINAL, followed

Offers = Mapping[tuple[Tried, ...], Beginning]


@pytest.fixture(scope="module")
def dragged() -> tuple[Track, State, Screening]:
    track = followed(term("quadratic_drag", coefficient=15.0))
    state = refit(track, NOMINAL)
    return track, state, screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance)


def with_gains(found: Screening, state: State, gains: Mapping[str, float]) -> Screening:
    """Only these effects, as if each took its share of what is missing off."""
    tried = [
        replace(each, gain=share * state.excess, left=state.left - share * state.excess)
        for name, share in gains.items()
        for each in found.tried
        if each.column.term.effect.key == name
    ]
    return replace(found, tried=tuple(tried), laws=(), pairs=())


def effects(offers: Offers) -> set[tuple[str, ...]]:
    return {tuple(each.column.term.effect.id for each in offer) for offer in offers}


def test_the_best_at_first_order_is_fitted_and_its_fit_begins_near_the_truth(dragged: tuple[Track, State, Screening]) -> None:
    track, state, found = dragged
    offers = offered(track, state, found, scales_of(track), far=True)
    best = next(offer for offer in offers if offer[0].column.term.effect.id == "quadratic_drag")
    begun = offers[best]
    assert begun.model.value("quadratic_drag.coefficient") == pytest.approx(15.0, rel=0.2)
    assert begun.lacks == pytest.approx(float(np.sum(track.residual(begun.model) ** 2)))
    assert begun.lacks < 0.1 * float(state.fit.residual @ state.fit.residual)


def test_others_are_fitted_that_take_off_half_of_what_the_best_does(dragged: tuple[Track, State, Screening]) -> None:
    """Beside the two best, those that come near; the begin of a fit of the others leaves more than nothing does here."""
    track, state, found = dragged
    gains = {"ripple": 0.9, "stiffness": 0.6, "nonlinear_stiffness": 0.5, "time_drift/linear": 0.4}
    # An axis that lacks nothing of these: where a fit would begin, each only does harm.
    worse = replace(state, fit=replace(state.fit, solution=replace(state.fit.solution, residual=0.0 * state.fit.residual)))
    offers = offered(track, worse, with_gains(found, state, gains), scales_of(track), far=True)
    assert effects(offers) == {("ripple",), ("stiffness",), ("nonlinear_stiffness",)}


def test_where_the_best_takes_off_little_only_the_two_best_are_fitted(dragged: tuple[Track, State, Screening]) -> None:
    track, state, found = dragged
    worse = replace(state, fit=replace(state.fit, solution=replace(state.fit.solution, residual=0.0 * state.fit.residual)))
    gains = {"ripple": 0.1, "stiffness": 0.09, "nonlinear_stiffness": 0.08}
    offers = offered(track, worse, with_gains(found, state, gains), scales_of(track), far=True)
    assert effects(offers) == {("ripple",), ("stiffness",)}


def test_what_parts_bodies_needs_to_promise_half_as_much(dragged: tuple[Track, State, Screening]) -> None:
    """Its fit begins with much that is missing, whatever the machine does."""
    track, state, found = dragged
    worse = replace(state, fit=replace(state.fit, solution=replace(state.fit.solution, residual=0.0 * state.fit.residual)))
    parting = next(e for each in found.tried if (e := each.column.term.effect).link is not None or e.play is not None)
    gains = {"ripple": 0.9, "stiffness": 0.6, parting.key: 0.3, "nonlinear_stiffness": 0.3}
    offers = offered(track, worse, with_gains(found, state, gains), scales_of(track), far=True)
    assert effects(offers) == {("ripple",), ("stiffness",), (parting.id,)}


def test_who_lacks_least_where_its_fit_begins_is_fitted_though_first_order_says_little(
    dragged: tuple[Track, State, Screening],
) -> None:
    track, state, found = dragged
    gains = {"ripple": 0.5, "stiffness": 0.4, "nonlinear_stiffness": 0.05, "quadratic_drag/quadratic": 0.01}
    offers = offered(track, state, with_gains(found, state, gains), scales_of(track), far=True)
    assert ("quadratic_drag",) in effects(offers)


def test_where_hardly_anything_is_to_be_beaten_fewer_are_fitted(dragged: tuple[Track, State, Screening]) -> None:
    track, state, found = dragged
    far, near = (offered(track, state, found, scales_of(track), far=each) for each in (True, False))
    assert set(near) < set(far)
    # The first four take half off of what the best does; what else comes lacks little where its fit begins.
    more = [[offer for offer in offers if len(offer) == 1 and offer[0] not in found.tried[:4]] for offers in (near, far)]
    assert 0 < len(more[0]) <= 2
    assert len(more[1]) == 4
    laws = [offer[0].column.term.effect.id for offer in more[0]]
    assert len(laws) == len(set(laws))  # of each effect one law


def test_a_pair_is_fitted_where_it_leaves_half_of_what_the_best_leaves(dragged: tuple[Track, State, Screening]) -> None:
    track, state, found = dragged
    alone = with_gains(found, state, {"ripple": 0.5, "stiffness": 0.4})
    one, other = alone.tried
    for share, is_offered in ((0.2, True), (0.3, False)):  # of what is missing; the better one alone leaves 0.5
        pairs = ((one, other, state.floor + share * state.excess),)
        offers = offered(track, state, replace(alone, pairs=pairs), scales_of(track), far=True)
        assert (("ripple", "stiffness") in effects(offers)) is is_offered
        if is_offered:
            added = {"ripple", "stiffness"}
            assert {held.effect.id for held in offers[one, other].model.terms} == {"coulomb", "viscous"} | added


def test_what_the_model_cannot_hold_is_left_out(dragged: tuple[Track, State, Screening]) -> None:
    """A second contact with bristles of its own can't be."""
    track, _, found = dragged
    state = refit(track, NOMINAL.with_terms((*NOMINAL.terms, term("presliding", "dahl", stiffness=1e6))), 1)
    names = {"presliding/lugre": 0.9, "stiffness": 0.5}
    n_moved = len(state.fit.names)
    held = with_gains(found, state, names)
    held = replace(held, tried=tuple(replace(each, moved=np.zeros(n_moved)) for each in held.tried))
    assert effects(offered(track, state, held, scales_of(track), far=True)) == {("stiffness",)}


def test_nothing_screened_is_nothing_offered(dragged: tuple[Track, State, Screening]) -> None:
    track, state, found = dragged
    assert offered(track, state, replace(found, tried=(), laws=(), pairs=()), scales_of(track), far=True) == {}
