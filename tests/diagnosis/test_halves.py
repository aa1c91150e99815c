"""What each half of a recording says of a term: against whole fits to either half, of what is there and of what is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis.fitting import State, free_names, refit
from fric.diagnosis.halves import Halves
from fric.diagnosis.track import Track
from fric.model import Model, term
from fric.record import Array

from .small_axis import NOMINAL, recorded, with_terms

DRAG = term("quadratic_drag", coefficient=15.0)
SPRING = term("stiffness", stiffness=1.0, position=0.0)
TERMS = (DRAG, SPRING)


@pytest.fixture(scope="module")
def judged() -> tuple[Track, State, Halves]:
    """An axis with a drag and without a spring, the model with both; the force is noisy."""
    made = recorded(DRAG, duration=8.0, noise=1e-6)
    noise = 0.5 * np.random.default_rng(4).standard_normal(made.n_samples)
    track = Track.of([replace(made, effort=made.effort + noise)], 45.0, NOMINAL)
    state = refit(track, with_terms(*TERMS))
    return track, state, Halves(track, state)


def at(state: State, name: str) -> int:
    return state.fit.model.prefixes.index(name)


def quarters(n: int) -> Array:
    """The number of the quarter of each row, 0 to 3."""
    return np.repeat(np.arange(4), [len(part) for part in np.array_split(np.arange(n), 4)])


def test_what_is_there_is_told_by_either_half_and_what_is_not_by_none(judged: tuple[Track, State, Halves]) -> None:
    _, state, halves = judged
    drag, spring = (halves.of(at(state, name)) for name in ("quadratic_drag", "stiffness"))
    assert min(half.nats for half in drag) > 30.0
    assert max(half.nats for half in spring) < 3.0
    assert halves.least(at(state, "quadratic_drag")) == min(half.nats for half in drag)
    assert halves.least(at(state, "stiffness")) == min(half.nats for half in spring)


def test_the_values_of_a_half_are_those_of_a_whole_fit_to_it(judged: tuple[Track, State, Halves]) -> None:
    """First and third quarter by themselves, then second and fourth; of the other half a tenth of each residual counts."""
    track, state, halves = judged
    n = state.fit.residual.shape[0]
    for half, odd in zip(halves.of(at(state, "quadratic_drag")), (0, 1), strict=True):
        weights = np.where(quarters(n) % 2 == odd, 1.0, 0.1)
        alone = track.fit(state.fit.model, free_names(state.fit.model), weights=weights).model
        name = "quadratic_drag.coefficient"
        assert set(half.parameters) == {name}
        assert half.parameters[name] == pytest.approx(alone.value(name), abs=0.1 * abs(alone.value(name) - 15.0) + 0.15)


def test_the_gain_is_that_of_white_noise_where_what_is_left_is_white(judged: tuple[Track, State, Halves]) -> None:
    """Of N independent values the likelihood ratio is (N/2) ln(without/with): the residual at every time constant is one."""
    track, state, halves = judged
    without = refit(track, Model(NOMINAL.plant, NOMINAL.plant_values, (*NOMINAL.terms, SPRING)))
    stride = round(1.0 / (45.0 * 2e-3))
    rows = quarters(state.fit.residual.shape[0])
    for half, odd in zip(halves.of(at(state, "quadratic_drag")), (0, 1), strict=True):
        judged_on = (rows % 2 != odd)[::stride]
        lacks = [float(np.sum(each.fit.residual[::stride][judged_on] ** 2)) for each in (without, state)]
        expected = 0.5 * np.sum(judged_on) * np.log(lacks[0] / lacks[1])
        # What the drag leaves out wanders, which counts for less than as many independent values.
        assert 0.2 * expected < half.nats < 1.2 * expected


def test_halves_agree_about_what_is_there_as_far_as_their_values_do(judged: tuple[Track, State, Halves]) -> None:
    """Energy of the force that only the drag brings about, over that of the difference of both values."""
    track, state, halves = judged
    place, name = at(state, "quadratic_drag"), "quadratic_drag.coefficient"
    values = [half.parameters[name] for half in halves.of(place)]
    k = state.fit.names.index(name)
    others = np.delete(state.fit.jacobian, k, axis=1)
    column = state.fit.jacobian[:, k] / state.fit.scale[k]
    own = column - others @ np.linalg.lstsq(others, column, rcond=None)[0]
    differs = float(np.sum((own * (values[0] - values[1])) ** 2))
    without = refit(track, with_terms(SPRING))
    force = float(np.sum((without.fit.residual - state.fit.residual) ** 2))
    assert halves.agreement(place) == pytest.approx(np.log(force / differs), abs=0.3)
    assert halves.agreement(place) > 3.0 + halves.agreement(at(state, "stiffness"))


def test_a_machine_that_changes_in_between_makes_its_halves_contradict_each_other() -> None:
    """A ripple of 3 N is there in the first and third quarter only: what they say of it makes the others worse."""
    ripple = term("ripple", cosine=3.0, sine=0.0, period=0.05)
    track = Track.of([recorded(ripple), recorded(seed=1)] * 2, 45.0, NOMINAL)
    state = refit(track, with_terms(ripple))
    halves = Halves(track, state)
    place = at(state, "ripple")
    first, second = (half.parameters["ripple.cosine"] for half in halves.of(place))
    assert (first, second) == (pytest.approx(3.0, abs=0.3), pytest.approx(0.0, abs=0.3))
    assert halves.least(place) < -10.0
    # The ripple is 1.5 N on average, and 3 N are between what both say.
    assert halves.agreement(place) == pytest.approx(np.log((1.5 / 3.0) ** 2), abs=0.5)


def test_a_slow_wander_hides_nothing_that_is_fast() -> None:
    """A wander is foretold from what came before: a ripple as large stands out from what is new, and hardly from all of it."""
    ripple = term("ripple", cosine=0.8, sine=0.0, period=0.03)
    made = recorded(ripple, duration=8.0, noise=1e-6)
    wander = 0.8 * np.sin(0.9 * made.time + 0.4)
    track = Track.of([replace(made, effort=made.effort + wander)], 45.0, NOMINAL)
    state = refit(track, with_terms(ripple))
    by_size = 0.5 * track.independent * np.log(refit(track, NOMINAL).left / state.left)
    nats = Halves(track, state).least(at(state, "ripple"))
    assert by_size < 5.0
    assert nats > 40.0
