"""What models leave on recordings held back, against sums and draws that are made otherwise."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from fric.diagnosis.fitting import State, refit
from fric.diagnosis.growth import Growth
from fric.diagnosis.judging import (
    HARDLY,
    as_fast,
    difference_of,
    energy_left,
    floor_of,
    growth_told,
    interval_of,
    locating,
    mean_square,
    most_left,
    nominal_part,
    paired,
    predictions_of,
    shown,
    unless_worse,
    with_errors,
    withdrawn,
)
from fric.diagnosis.settle import Step
from fric.diagnosis.start import DiagnosisError
from fric.diagnosis.track import Track
from fric.model import term
from fric.record import Record

from .small_axis import NOMINAL, followed, recorded, with_terms

DRAG = term("quadratic_drag", coefficient=15.0)


@pytest.fixture(scope="module")
def track() -> Track:
    return followed(DRAG)


@pytest.fixture(scope="module")
def grown(track: Track) -> Growth:
    """The nominal axis and the drag that it lacked."""
    begin, end = refit(track, NOMINAL), refit(track, with_terms(DRAG))
    step = Step("quadratic_drag", begin.left, end.left, begin.floor, begin.excess, (), ())
    return Growth(track, begin, end, (step,), (), 0.0)


def set_by_hand(growth: Growth, begin: tuple[float, float], end: tuple[float, float]) -> Growth:
    """The same with other sums of squares: left and floor of the nominal and of the grown model."""
    first, last = (
        State(state.fit, left, partial(lambda each: (each, ()), floor))
        for state, (left, floor) in zip((growth.begin, growth.end), (begin, end), strict=True)
    )
    return replace(growth, begin=first, end=last)


def test_the_mean_square_is_that_of_sums_over_residuals() -> None:
    assert mean_square([np.array([3.0, 4.0]), np.array([1.0, 0.0])]) == pytest.approx(13.0)


def test_little_known_of_the_floor_an_explanation_may_leave_more(grown: Growth) -> None:
    """15 % of what is missing, and six tenths of the floor over it; never more than what is hardly an explanation."""
    assert most_left(set_by_hand(grown, (100.0, 0.0), (1.0, 0.0))) == pytest.approx(0.15)
    assert most_left(set_by_hand(grown, (110.0, 10.0), (1.0, 0.0))) == pytest.approx(0.15 + 0.06)
    assert most_left(set_by_hand(grown, (110.0, 100.0), (1.0, 0.0))) == HARDLY
    three = replace(set_by_hand(grown, (100.0, 0.0), (1.0, 0.0)), steps=grown.steps * 3)
    assert most_left(three) == pytest.approx(0.05)  # many effects at once that leave something may stand in for one


def test_how_the_model_grew_is_told_in_shares_above_the_floor(grown: Growth) -> None:
    held = set_by_hand(grown, (110.0, 10.0), (30.0, 10.0))
    steps = (replace(grown.steps[0], after=60.0), replace(grown.steps[0], term="ripple#2", after=5.0))
    told = growth_told(replace(held, steps=steps))
    assert [(each.term, each.left) for each in told] == [("", 1.0), ("quadratic_drag", 0.5), ("ripple#2", 0.0)]
    assert [name for name, _ in withdrawn(replace(held, steps=steps), True)] == ["quadratic_drag", "ripple"]
    assert "worse" in withdrawn(held, True)[0][1]
    assert "no mismatch" in withdrawn(held, False)[0][1]


def test_the_recordings_held_back_must_give_what_the_others_promised(grown: Growth) -> None:
    """Eight floors were taken off: four tenths of them have to go here, too."""
    held = set_by_hand(grown, (90.0, 10.0), (10.0, 10.0))
    assert paired(held, {"refit": 5.0, "augmented": 1.7}, 1.0)
    assert not paired(held, {"refit": 5.0, "augmented": 1.9}, 1.0)
    assert not paired(replace(held, steps=()), {"refit": 5.0, "augmented": 0.0}, 1.0)


def test_the_recordings_held_back_are_followed_as_fast_as_what_is_missing_stands_out(track: Track) -> None:
    """To the fastest observer a faint mismatch drowns in the noise of the encoder; a large one doesn't."""
    noisy = recorded(DRAG, seed=1, noise=1e-5)
    clear = recorded(DRAG, seed=1, noise=1e-7)
    assert shown([clear], track, NOMINAL, as_track=False).bandwidth == 400.0
    assert shown([clear], track, NOMINAL, as_track=True).bandwidth == 45.0
    assert shown([noisy], track, NOMINAL, as_track=False).bandwidth < 400.0
    # Its mass is that of the recordings learnt from.
    assert shown([clear], replace(track, mass=2.5), NOMINAL, as_track=True).mass == 2.5


def test_a_recording_held_back_that_is_too_short_is_refused(track: Track) -> None:
    short = recorded(DRAG, duration=0.3)
    with pytest.raises(DiagnosisError, match="no valid part"):
        shown([short], track, NOMINAL, as_track=False)


def test_a_model_is_fitted_to_an_observer_as_fast_as_that_of_the_recordings_held_back(grown: Growth) -> None:
    fast = followed(DRAG, bandwidth=140.0)
    track, begin, end = as_fast([grown.track, fast], fast, grown)
    assert track is fast
    assert end.model.value("quadratic_drag.coefficient") == pytest.approx(15.0, rel=0.02)
    assert float(end.residual @ end.residual) < 0.01 * float(begin.residual @ begin.residual)
    # With an observer no faster nothing has to be fitted again; without steps both models are one.
    assert as_fast([grown.track, fast], grown.track, grown) == (grown.track, grown.begin.fit, grown.end.fit)
    _, alone, same = as_fast([grown.track, fast], fast, replace(grown, steps=()))
    assert same is alone


def test_the_floor_is_what_twins_leave_and_not_what_a_model_leaves_that_goes_astray(grown: Growth) -> None:
    noisy = Track.of([recorded(DRAG, noise=3e-5)], 45.0, NOMINAL)
    true, plain = grown.end.fit.model, grown.begin.fit.model
    lacking = noisy.residual(plain)
    own = floor_of(noisy, plain, true, lacking)
    # What noise leaves: that of the true model on the noisy recording itself.
    left = noisy.residual(true)
    assert mean_square(own) == pytest.approx(float(left @ left), rel=0.3)
    # Friction that falls steeply sticks and slips by chance, so that its twins leave some times as much. That counts as long as
    # it is far from all that is missing; where it comes near that, the quieter twins do.
    jerky = with_terms(term("stribeck", force=20.0, velocity=0.02))
    loud = mean_square(floor_of(noisy, plain, jerky, 100.0 * lacking))
    quiet = mean_square(floor_of(noisy, plain, jerky, 0.1 * left))
    assert loud > 2.0 * quiet
    assert quiet == pytest.approx(mean_square(own), rel=0.3)


def test_the_interval_of_a_share_is_that_of_blocks_drawn_again(track: Track) -> None:
    """Of white noise in n blocks: a tenth of the energy, whose spread follows from those of both sums of squares."""
    random = np.random.default_rng(1)
    before = random.standard_normal(20000)
    after = np.sqrt(0.1) * random.standard_normal(20000)
    low, high = interval_of(0.1, {"refit": before, "augmented": after}, [np.zeros(20000)])
    # The relative variance of a sum of n squares of normal values is 2/n; both are independent.
    expected = 0.1 * 1.96 * np.sqrt(2.0 / 20000 + 2.0 / 20000)
    assert low < 0.1 < high
    assert 0.5 * (high - low) == pytest.approx(expected, rel=0.5)


def test_the_interval_holds_the_share_and_what_chance_leaves_is_taken_off() -> None:
    ones = np.ones(2000)
    left = {"refit": 3.0 * ones, "augmented": np.sqrt(5.0) * ones}
    # Of 9 and 5 above a floor of 1 there stays one half, everywhere: no draw says anything else.
    assert interval_of(0.5, left, [ones, -ones]) == pytest.approx((0.5, 0.5))
    assert interval_of(0.7, left, [ones]) == pytest.approx((0.5, 0.7))
    # Less than nothing is nothing, more than all is all.
    assert interval_of(0.0, {"refit": 3.0 * ones, "augmented": 0.5 * ones}, [ones]) == (0.0, 0.0)


def test_standard_errors_are_the_scatter_over_many_noises() -> None:
    """Of fits to many recordings of one axis that differ by the noise of the force."""
    found, told = [], []
    for seed in range(12):
        made = recorded()
        noise = 1.0 * np.random.default_rng(seed).standard_normal(made.n_samples)
        noisy = Track.of([replace(made, effort=made.effort + noise)], 45.0, NOMINAL)
        fit = noisy.fit(NOMINAL, NOMINAL.names)
        found.append(fit.model.values)
        told.append([with_errors(noisy, fit).standard_errors[name] for name in NOMINAL.names])
    scatter, errors = np.std(found, axis=0, ddof=1), np.median(told, axis=0)
    # Of twelve draws a standard deviation is known within a factor of two.
    assert np.all(errors < 2.2 * scatter)
    assert np.all(errors > scatter / 2.2)


def test_how_far_a_given_value_is_off_is_told_in_percent_of_the_fitted_one(grown: Growth) -> None:
    """Given 30 N s/m where 20 are found is half as much too much; a value found at zero tells no percentage."""
    fit = replace(grown.begin.fit, model=NOMINAL.with_value("coulomb.force", 0.0))
    part = nominal_part(NOMINAL.with_value("viscous.coefficient", 30.0).with_value("mass", 1.0), fit)
    assert part.parameters["viscous.coefficient"] == 30.0
    assert part.refit_parameters["viscous.coefficient"] == 20.0
    assert part.parameter_error_percent == pytest.approx({"mass": -50.0, "viscous.coefficient": 50.0})


def test_the_difference_of_two_models_stands_where_the_force_differs() -> None:
    """A friction that is larger around one place: the energy of the difference is there, without the observer's delay."""
    bump = term("position_dependence", "local", amplitude=1.0, position=0.08, width=0.01)
    made = recorded(bump)
    fast = locating([made], Track.of([made], 45.0, NOMINAL), _plain(made))
    assert fast.bandwidth == pytest.approx(500.0)  # one over the sample time, that is as fast as it may be
    (energy,) = difference_of(fast, NOMINAL, with_terms(bump))
    near = np.abs(fast.runs[0].position - 0.08) < 0.02
    assert 0.0 < np.mean(near) < 0.3
    assert np.sum(energy[near]) > 0.9 * np.sum(energy)
    shape = np.exp(-(((fast.runs[0].position - 0.08) / 0.01) ** 2))
    late = [float(np.roll(np.sqrt(energy), -k) @ shape) for k in range(-5, 6)]
    assert abs(int(np.argmax(late)) - 5) <= 1  # samples, of the two by which the observer is late
    # The force that differs is that of the Coulomb friction times the bump, 4 N at its top.
    assert np.sqrt(np.quantile(energy, 0.995)) == pytest.approx(4.0, rel=0.25)


def _plain(made: Record) -> Growth:
    track = Track.of([made], 45.0, NOMINAL)
    state = refit(track, NOMINAL)
    return Growth(track, state, state, (), (), 1.0)


def test_energy_that_noise_makes_is_no_energy(track: Track) -> None:
    """What twins leave on average is taken off twice: of noise hardly anything stays, of a burst nearly all."""
    n = track.residual(NOMINAL).shape[0]
    random = np.random.default_rng(2)
    noise = random.standard_normal(n)
    burst = noise + 20.0 * ((np.arange(n) > 800) & (np.arange(n) < 900))
    quiet, loud = (energy_left(track, each, [random.standard_normal(n)])[0] for each in (noise, burst))
    assert np.sum(quiet) < 0.2 * n
    assert np.sum(loud) == pytest.approx(99 * 400.0, rel=0.1)
    (run,), late = track.runs, round(2.0 / (45.0 * 2e-3))
    at = np.flatnonzero(loud > 100.0)
    offset = run.effort.shape[0] - n - late  # the settling before, the observer's delay behind
    assert at[0] == pytest.approx(801 + offset, abs=8)
    assert at[-1] == pytest.approx(899 + offset, abs=8)


def test_measured_and_predicted_force_stand_at_the_time_at_which_they_act(grown: Growth) -> None:
    """The low-passed force of a slow sine is the sine itself, at its time; predictions differ by what a model lacks."""
    held = [recorded(DRAG, seed=3), recorded(DRAG, seed=4)]
    track = Track.of(held, 400.0, NOMINAL)
    nothing = np.zeros(track.residual(NOMINAL).shape[0])
    left = {"nominal": nothing + 2.0, "refit": nothing, "augmented": nothing - 1.0}
    found = predictions_of(held, track, left)
    assert [each.source for each in found] == ["run 3", "run 4"]
    for each in found:
        assert np.all(np.diff(each.time) > 0.0)
        force = 18.0 * np.sin(5.0 * each.time) + 9.0 * np.sin(17.0 * each.time)
        assert each.force_measured == pytest.approx(force, abs=0.8)
        assert each.force_nominal - each.force_measured == pytest.approx(2.0)
        assert each.force_refit == pytest.approx(each.force_measured)
        assert each.force_augmented - each.force_measured == pytest.approx(-1.0)


def test_what_only_helps_stays_where_the_recordings_held_back_agree(grown: Growth) -> None:
    plain = replace(grown, end=grown.begin, steps=())
    model = grown.begin.fit.model
    pulled = model.with_terms((*model.terms, term("bias", force=2.0)))
    harms = replace(plain, end=replace(plain.end, fit=replace(plain.end.fit, model=pulled)), steps=grown.steps, unhelped=plain)
    helps = replace(grown, unhelped=plain)
    held = [recorded(DRAG, seed=5)]
    assert unless_worse(held, [grown.track], helps) is helps
    assert unless_worse(held, [grown.track], harms) is plain  # the axis pulls no way
    assert unless_worse(held, [grown.track], plain) is plain
