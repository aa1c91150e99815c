"""A grown model reconsidered: a term less, another law, other values; on axes whose structure is known."""

from __future__ import annotations

import pytest
from fric.diagnosis.fitting import State, refit
from fric.diagnosis.moves import Search, alike, reconsidered
from fric.diagnosis.track import Track
from fric.effects import by_name
from fric.model import Term, build_model, term

from .small_axis import MASS, NOMINAL, followed, with_terms

DRAG = term("quadratic_drag", coefficient=15.0)
BENT = term("stribeck", "exponential", force=6.0, velocity=0.15, exponent=1.0)
"""A surplus that falls as the plain exponential of the speed."""
HYSTERESIS = term("accel_hysteresis", force=3.0, velocity=0.1)
ROUND = term("stribeck", "exponential", force=6.0, velocity=0.15, exponent=2.0)


def begun(*lacks: Term, grown: tuple[Term, ...]) -> tuple[Track, State, State]:
    track = followed(*lacks, bandwidth=140.0)
    return track, refit(track, NOMINAL), refit(track, with_terms(*grown))


def moves(track: Track, begin: State, state: State) -> tuple[State, list[str]]:
    said: list[str] = []
    return reconsidered(track, begin, state, said.append), said


def test_a_term_that_does_nothing_goes_and_the_truth_stays() -> None:
    track, begin, state = begun(DRAG, grown=(DRAG, term("stiffness", stiffness=0.5, position=0.0)))
    found, said = moves(track, begin, state)
    assert found.fit.model.prefixes == (*NOMINAL.prefixes, "quadratic_drag")
    assert found.fit.model.value("quadratic_drag.coefficient") == pytest.approx(15.0, rel=0.02)
    assert len(said) == 1
    assert said[0].startswith("without")


def test_a_move_that_lost_by_more_than_others_have_won_since_is_not_made_again() -> None:
    track, begin, state = begun(DRAG, grown=(DRAG,))
    search = Search(track, begin, state, frozenset(NOMINAL.prefixes), lambda _: None)
    assert search.is_worth(("without", "quadratic_drag"))
    search.judged(("without", "quadratic_drag"), begin)
    by = search.score(state, False) - search.score(begin, False)
    assert by > 100.0
    for won, again in ((0.0, False), (0.9 * by, False), (1.1 * by, True)):
        search.won = won
        assert search.is_worth(("without", "quadratic_drag")) is again


@pytest.mark.parametrize("difference", [0.0, 3.0])
def test_a_form_gives_way_to_its_law_where_it_has_nothing_more(difference: float) -> None:
    """A Stribeck effect that is the same both ways, by the law for one that differs; and one that does differ."""
    form = term("stribeck", "directional", force=6.0, difference=difference, velocity=0.15)
    track, begin, state = begun(form, grown=(term("stribeck", "directional", force=6.0, difference=0.1, velocity=0.15),))
    found, _ = moves(track, begin, state)
    (held,) = (held for held in found.fit.model.terms if held.effect.id == "stribeck")
    assert held.effect.law == ("directional" if difference else "exponential")
    assert held.by_name["force"] == pytest.approx(6.0, rel=0.05)


def test_the_right_structure_is_not_moved() -> None:
    track, begin, state = begun(DRAG, grown=(DRAG,))
    found, said = moves(track, begin, state)
    assert found is state
    assert said == []


def test_terms_of_the_nominal_model_stay_though_they_do_nothing() -> None:
    """An axis without viscous friction: its model says that there is some, and finds it at nothing."""
    bare = NOMINAL.with_terms([term("coulomb", force=4.0), term("viscous", coefficient=20.0), term("bias", force=0.0)])
    track = followed(DRAG, bandwidth=140.0)
    begin = refit(track, bare)
    state = refit(track, bare.with_terms((*bare.terms, DRAG)))
    assert moves(track, begin, state)[0].fit.model.prefixes == state.fit.model.prefixes


def test_a_law_that_is_the_wrong_one_gives_way_and_takes_what_mended_it_along() -> None:
    """A surplus that falls as exp(-v) by the law exp(-v^2), and a drag that only mended its form."""
    track, begin, state = begun(BENT, grown=(ROUND, term("asymmetry", force=0.1, coefficient=0.1)))
    found, _ = moves(track, begin, state)
    assert set(found.fit.model.prefixes) == {*NOMINAL.prefixes, "stribeck"}
    assert found.fit.model.value("stribeck.exponent") == 1.0
    assert found.fit.model.value("stribeck.force") == pytest.approx(6.0, rel=0.1)
    assert found.fit.model.value("stribeck.velocity") == pytest.approx(0.15, rel=0.1)


def test_threads_make_no_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    track, begin, state = begun(BENT, grown=(ROUND, term("asymmetry", force=0.1, coefficient=0.1)))
    came_to = []
    for threads in ("1", "3"):
        monkeypatch.setenv("FRIC_THREADS", threads)
        found, said = moves(track, begin, state)
        came_to.append((said, found.fit.model.prefixes, found.fit.model.values.tolist(), found.left))
    assert came_to[0] == came_to[1]
    assert len(came_to[0][0]) > 0


@pytest.mark.parametrize("truth", [ROUND, HYSTERESIS], ids=["another name", "its own"])
def test_an_effect_gives_way_to_the_one_that_it_looks_like(truth: Term) -> None:
    track, begin, state = begun(truth, DRAG, grown=(HYSTERESIS, DRAG))
    found = reconsidered(track, begin, state, lambda _: None, names_only=True)
    names = {"stribeck" if truth is ROUND else "accel_hysteresis", "quadratic_drag"}
    assert set(found.fit.model.prefixes) - set(NOMINAL.prefixes) == names


@pytest.mark.parametrize("holds_both_ways", [("compliance", "impact_backlash"), ("impact_backlash", "compliance")])
def test_looking_alike_holds_both_ways(holds_both_ways: tuple[str, str]) -> None:
    one, other = (by_name(each) for each in holds_both_ways)
    assert alike(one, other)
    assert not alike(by_name("viscous"), by_name("ripple"))


def test_the_simpler_name_wins_where_hardly_anything_is_left() -> None:
    """Dry friction told as a Stribeck curve that falls far beyond the speeds of the recording."""
    bare = build_model("rigid", {"mass": MASS}, [term("viscous", coefficient=20.0)])
    track = followed(bandwidth=140.0)
    wrong = bare.with_terms((*bare.terms, term("stribeck", force=4.0, velocity=2.0)))
    begin, state = refit(track, bare), refit(track, wrong)
    assert state.excess < 1e-3 * begin.excess
    found = reconsidered(track, begin, state, lambda _: None, names_only=True)
    assert set(found.fit.model.prefixes) == {"viscous", "coulomb"}
    assert found.fit.model.value("coulomb.force") == pytest.approx(4.0, rel=0.01)


def test_a_fit_that_ended_in_the_wrong_valley_is_begun_from_elsewhere() -> None:
    """Friction around one place: a bump four times too wide, held where it is."""
    bump = term("position_dependence", "local", amplitude=1.0, position=0.08, width=0.01)
    track, begin, _ = begun(bump, grown=())
    wide = with_terms(term("position_dependence", "local", amplitude=0.3, position=0.08, width=0.04))
    stuck = refit(track, wide, max_iterations=0)
    found, _ = moves(track, begin, stuck)
    assert found.fit.model.value("position_dependence.width") == pytest.approx(0.01, rel=0.1)
    assert found.left < 0.05 * stuck.left


def test_bristles_that_do_nothing_go_although_a_model_with_them_is_led_otherwise() -> None:
    """Its position is set, so that it seems to lack less than the same model without them."""
    rigid = term("presliding", "lugre", stiffness=1e9, damping=1e5)
    track, begin, state = begun(DRAG, grown=(DRAG, rigid))
    found, _ = moves(track, begin, state)
    assert found.fit.model.prefixes == (*NOMINAL.prefixes, "quadratic_drag")


def test_bristles_that_are_there_stay() -> None:
    bristles = term("presliding", "lugre", stiffness=2e4, damping=100.0)
    track, begin, state = begun(bristles, DRAG, grown=(DRAG, bristles))
    found, _ = moves(track, begin, state)
    assert {"presliding", "quadratic_drag"} <= set(found.fit.model.prefixes)
