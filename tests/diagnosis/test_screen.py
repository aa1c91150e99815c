"""Candidates at first order: sums over blocks against least squares block by block, and axes that lack one effect or two."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.along import Along
from fric.diagnosis.candidates import Candidate, candidates, scales_of
from fric.diagnosis.fitting import State, free_names, refit
from fric.diagnosis.screen import Gram, Promise, Screening, blocks_of, columns_of, restraint, screen
from fric.diagnosis.track import Track
from fric.model import term
from fric.record import Array

from .small_axis import NOMINAL, followed, recorded

BLOCKS = np.array([0, 30, 55, 90])


def columns(n: int, seed: int = 0) -> Array:
    return np.random.default_rng(seed).standard_normal((120, n)) * np.geomspace(1.0, 1e4, n)


def left_out_in_turn(everything: Array, target: int, used: list[int], held: Array) -> float:
    """Each block predicted from least squares on all other blocks, solved as stacked equations."""
    total = 0.0
    for first, last in zip(BLOCKS, [*BLOCKS[1:], 120], strict=True):
        others = np.delete(np.arange(120), np.arange(first, last))
        held_back = np.diag(np.sqrt(held[used]))
        rows = np.concatenate([everything[np.ix_(others, used)], held_back])
        wanted = np.concatenate([everything[others, target], np.zeros(len(used))])
        found = np.linalg.lstsq(rows, wanted, rcond=None)[0]
        total += float(np.sum((everything[first:last, target] - everything[first:last][:, used] @ found) ** 2))
    return total


@pytest.mark.parametrize("held", [0.0, 300.0])
@pytest.mark.parametrize("used", [[1], [2, 4], [1, 3, 5]])
def test_what_is_left_of_blocks_is_that_of_least_squares_without_each(used: list[int], held: float) -> None:
    everything = columns(6)
    back = np.zeros(6)
    back[used[0]] = held
    gram = Gram(everything, BLOCKS, back)
    assert gram.left(0, used) == pytest.approx(left_out_in_turn(everything, 0, used, back), rel=1e-6)


def test_without_columns_all_is_left() -> None:
    everything = columns(3)
    assert Gram(everything, BLOCKS).left(1, []) == pytest.approx(float(everything[:, 1] @ everything[:, 1]))


@pytest.mark.parametrize("held", [0.0, 300.0, 1e300])
@pytest.mark.parametrize("size", [0.0, 1e-170])
def test_a_column_that_is_nothing_takes_nothing(held: float, size: float) -> None:
    """As where a limit is never reached: the fit is that of the other columns."""
    everything = columns(4)
    everything[:, 3] *= size
    gram = Gram(everything, BLOCKS, np.array([0.0, 0.0, 0.0, held]))
    assert gram.left(0, [1, 3]) == pytest.approx(gram.left(0, [1]), rel=1e-6)
    assert gram.solved(0, [1, 3])[0] == pytest.approx(gram.solved(0, [1])[0], rel=1e-6)


def test_many_sets_at_once_come_to_the_same_as_one_after_the_other() -> None:
    everything = columns(8)
    gram = Gram(everything, BLOCKS)
    sets = np.array([[a, b] for a in range(1, 8) for b in range(1, 8) if a != b] * 11)  # more than are solved together
    each = [left_out_in_turn(everything, 0, list(pair), np.zeros(8)) for pair in sets[:42].tolist()]
    assert gram.lefts(0, sets) == pytest.approx(np.tile(each, 11), rel=1e-6)


def test_coefficients_take_away_what_they_are_solved_for() -> None:
    """A column that is added with its coefficient cancels: the sign is that of what a candidate changes."""
    everything = columns(4)
    everything[:, 0] = 2.0 * everything[:, 1] - 5e-4 * everything[:, 3]
    assert Gram(everything, BLOCKS).solved(0, [1, 3]) == pytest.approx([-2.0, 5e-4], rel=1e-6)
    held = np.array([0.0, 1e3, 0.0, 0.0])
    # One coefficient c of a column a that is held back by h: c = -a.r / (a.a + h).
    a, r = everything[:, 1], everything[:, 0]
    assert Gram(everything, BLOCKS, held).solved(0, [1]) == pytest.approx([-(a @ r) / (a @ a + 1e3)], rel=1e-6)


@pytest.fixture(scope="module")
def dragged() -> tuple[Track, State]:
    """An axis with a drag that its model has not."""
    track = followed(term("quadratic_drag", coefficient=15.0))
    return track, refit(track, NOMINAL)


@pytest.fixture(scope="module")
def screened(dragged: tuple[Track, State]) -> Screening:
    track, state = dragged
    return screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance)


def test_blocks_are_ten_of_about_equal_length() -> None:
    first = blocks_of(followed(), 1234)
    assert first[0] == 0
    assert np.ptp(np.diff([*first, 1234])) <= 1
    assert first.size == 10
    assert blocks_of(followed(), 4).tolist() == [0, 1, 2, 3]  # no empty ones


def test_a_coefficient_is_held_back_as_if_it_were_known_to_its_own_size(dragged: tuple[Track, State]) -> None:
    """The variance of an independent value of what is left: the sum of squares over their number, of half the bandwidth."""
    track, state = dragged
    duration = 0.002 * track.n_samples
    expected = float(np.sum(state.fit.residual**2)) / (0.5 * 45.0 * duration)
    assert restraint(track, state.fit) == pytest.approx(expected, rel=0.01)


def test_a_column_is_the_force_per_unit_of_its_amplitude(dragged: tuple[Track, State]) -> None:
    track, state = dragged
    trials = [
        term("bias", force=0.5),
        term("ripple", cosine=0.2, sine=0.1, period=0.05),
        term("asymmetry", force=0.3, coefficient=1.0),
    ]
    bias, ripple, asymmetry = columns_of(track, state.fit, trials)
    assert bias.amplitudes == ("force",)
    assert np.median(bias.parts[0]) == pytest.approx(1.0, abs=0.1)  # a newton that the model needs more
    assert ripple.amplitudes == ("cosine", "sine")
    assert len(ripple.parts) == 2
    # A sine over the position and the cosine are of one size, whatever the sizes at which they were tried.
    sizes = [float(np.sqrt(np.mean(part**2))) for part in ripple.parts]
    assert sizes[0] == pytest.approx(sizes[1], rel=0.3)
    # Friction that differs by the way is |v|: it pulls one way.
    speed = np.abs(track.seen([np.abs(each.velocity) for each in track.motion]))
    assert asymmetry.parts[asymmetry.amplitudes.index("coefficient")] == pytest.approx(speed, abs=0.2 * float(np.max(speed)))


def test_the_effect_that_is_missing_is_the_best_and_the_coefficient_is_its_size(screened: Screening) -> None:
    best = screened.tried[0]
    assert best.column.term.effect.id == "quadratic_drag"
    assert best.coefficients == pytest.approx([15.0], rel=0.1)
    assert best.left < 0.02 * screened.alone
    assert best.gain == pytest.approx(screened.alone - best.left)
    assert best.by_chance < 1e-3 * best.gain
    assert [each.left for each in screened.tried] == sorted(each.left for each in screened.tried)


def test_what_the_refit_had_in_its_place_comes_back(dragged: tuple[Track, State], screened: Screening) -> None:
    """Viscous friction had taken some of the drag over; the candidate gives the true 20 N s/m again."""
    _, state = dragged
    assert abs(state.fit.model.value("viscous.coefficient") - 20.0) > 2.0
    at = free_names(state.fit.model).index("viscous.coefficient")
    moved = state.fit.model.value("viscous.coefficient") + screened.tried[0].moved[at] * state.fit.scale[at]
    assert moved == pytest.approx(20.0, abs=0.5)


def test_each_effect_stands_once_and_its_other_laws_beside_it(screened: Screening) -> None:
    names = [each.column.term.effect.id for each in screened.tried if each.column.term.effect.neutral is not None]
    assert len(names) == len(set(names))
    beside = {each.column.term.effect.key for each in screened.laws}
    assert not beside & {each.column.term.effect.key for each in screened.tried}
    assert any(key.startswith("dwell_time/") for key in beside)


def test_a_pair_of_effects_that_are_both_missing_leaves_least() -> None:
    track = followed(term("quadratic_drag", coefficient=15.0), term("ripple", cosine=1.5, sine=0.0, period=0.04))
    state = refit(track, NOMINAL)
    wanted = [each for each in candidates(state.fit.model, scales_of(track)) if each.effect.id in PAIRED]
    found = screen(track, state.fit, wanted, state.chance)
    one, other, left = found.pairs[0]
    assert {one.column.term.effect.id, other.column.term.effect.id} == {"quadratic_drag", "ripple"}
    assert left < 0.3 * found.tried[0].left
    sizes = {each.column.term.effect.id: each.coefficients for each in (one, other)}
    assert sizes["quadratic_drag"] == pytest.approx([15.0], rel=0.2)
    at = free_names(state.fit.model).index("viscous.coefficient")
    for each in (one, other):  # with both there, viscous friction is what it was
        assert state.fit.model.value("viscous.coefficient") + each.moved[at] * state.fit.scale[at] == pytest.approx(
            20.0, abs=2.0
        )
    assert [each[2] for each in found.pairs] == sorted(each[2] for each in found.pairs)
    assert screen(track, state.fit, wanted, state.chance, in_pairs=False).pairs == ()


PAIRED = ("quadratic_drag", "ripple", "bias", "stiffness")


def test_beside_nothing_missing_what_candidates_gain_is_what_they_gain_by_chance() -> None:
    track = Track.of([recorded(noise=3e-5)], 45.0, NOMINAL)
    state = refit(track, NOMINAL)
    found = screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False)
    by_chance = max(each.by_chance for each in found.tried)
    assert found.tried[0].gain < 3.0 * by_chance
    # A few values chosen among some hundred trials take a small part off noise.
    assert by_chance < 0.2 * min(float(each @ each) for each in state.chance)


def test_a_structure_whose_opposite_is_missing_is_not_offered() -> None:
    """An axis without the backlash that its twin has: what a play would have to take away again."""
    track = followed(term("quadratic_drag", coefficient=15.0))
    state = refit(track, NOMINAL)
    for candidate in candidates(state.fit.model, scales_of(track)):
        if candidate.effect.neutral is None:
            found = screen(track, state.fit, [candidate], (), in_pairs=False)
            for each in (*found.tried, *found.laws):
                assert each.coefficients[0] > 0.0


def test_of_many_periods_those_go_on_that_promise_most() -> None:
    """The period lies between two of the grid, which are the ones that are kept; a finer one comes from the spectrum."""
    track = followed(term("ripple", cosine=1.0, sine=0.5, period=0.031))
    state = refit(track, NOMINAL)
    ripple = next(each for each in candidates(state.fit.model, scales_of(track)) if each.effect.id == "ripple")
    kept = [trial.by_name["period"] for trial in Promise(Along(track), state.fit).narrowed(ripple)]
    grid = np.array([trial.by_name["period"] for trial in ripple.trials])
    assert 1 <= len(kept) <= 2 < grid.size
    cycles = scales_of(track).travel / np.array(kept)
    assert abs(cycles[0] - scales_of(track).travel / 0.031) <= 0.5


def test_a_period_finer_than_the_grid_is_taken_from_the_spectrum() -> None:
    fine = 0.004  # some fifty cycles over the travel
    long = recorded(term("ripple", cosine=2.0, sine=0.0, period=fine), duration=10.0)
    track = Track.of([long], 400.0, NOMINAL)
    state = refit(track, NOMINAL)
    ripple = next(each for each in candidates(state.fit.model, scales_of(track)) if each.effect.id == "ripple")
    assert min(trial.by_name["period"] for trial in ripple.trials) > 1.5 * fine
    kept = [trial.by_name["period"] for trial in Promise(Along(track), state.fit).narrowed(ripple)]
    assert kept[0] == pytest.approx(fine, rel=3e-3)


def test_what_the_fitted_parameters_do_as_well_is_not_followed_up(dragged: tuple[Track, State]) -> None:
    """A second ripple of the same period changes nothing; and what can't be absent is left to the observer."""
    track, _ = dragged
    ripple = term("ripple", cosine=0.1, sine=0.1, period=0.05)
    state = refit(track, NOMINAL.with_terms((*NOMINAL.terms, ripple)))
    promise = Promise(Along(track), state.fit)
    again = term("ripple", cosine=0.1, sine=0.1, period=state.fit.model.value("ripple.period"))
    other = term("ripple", cosine=0.1, sine=0.1, period=0.08)
    # Neither of the trials, nor any that the spectrum tells.
    assert again not in promise.narrowed(Candidate(again.effect, (again, other)))
    springs = tuple(term("compliance", stiffness=k) for k in (1e4, 1e5, 1e6))
    assert promise.narrowed(Candidate(springs[0].effect, springs)) == list(springs)
