"""Noise of the force at low frequencies is told from physics by whether it goes with the motion."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.fitting import refit
from fric.diagnosis.going_with_motion import going_with_motion, only_noise
from fric.diagnosis.growth import FAINTLY, NAMELESS
from fric.diagnosis.track import Track
from fric.model import Term, term
from fric.record import Record
from fric.simulation import simulate
from numpy.typing import NDArray
from scipy.signal import lfilter

from .small_axis import NOMINAL, STEP, with_terms

WHITE = 0.05  # [N], noise from sample to sample
DURATION = 20.0  # [s]
PUSHES = ((9.0, 0.61), (8.0, 1.13), (6.0, 2.29))  # [N], [Hz]


def followed(*lacks: Term, slow: float = 0.0, seed: int = 3) -> Track:
    """An axis pushed by forces that never come again alike, as an observer follows it.

    Args:
        lacks: what the nominal model doesn't have.
        slow: standard deviation [N] of a noise of the force that is over after 0.1 s.
        seed: of the noise.
    """
    random = np.random.default_rng(seed)
    time = STEP * np.arange(round(DURATION / STEP))
    push = sum(size * np.sin(2.0 * np.pi * rate * time + np.sin(0.9 * rate * time)) for size, rate in PUSHES)
    moved = simulate(with_terms(*lacks), push, STEP, n_substeps=4)
    position = moved.position[: time.size] + 1e-7 * random.standard_normal(time.size)
    kept = np.exp(-STEP / 0.1)
    drifting: NDArray[np.float64] = lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], random.standard_normal(time.size))
    force = push + WHITE * random.standard_normal(time.size) + slow * drifting
    return Track.of([Record(time, position, force, effort_hold="following")], 45.0, NOMINAL)


@pytest.mark.parametrize("seed", [3, 4])
def test_slow_noise_of_the_force_is_no_physics(seed: int) -> None:
    track = followed(slow=0.014, seed=seed)
    state = refit(track, NOMINAL)
    # It stands out so far that physics without a name would be told of.
    assert NAMELESS < state.excess / state.floor < FAINTLY
    assert only_noise(track, NOMINAL)


@pytest.mark.parametrize(
    "missing",
    [term("ripple", sine=0.04, cosine=0.0, period=0.01), term("stribeck", force=0.06, velocity=0.05)],
    ids=["ripple", "Stribeck"],
)
def test_physics_that_stands_out_as_little_goes_with_the_motion(missing: Term) -> None:
    track = followed(missing)
    state = refit(track, NOMINAL)
    assert NAMELESS < state.excess / state.floor < FAINTLY
    assert not only_noise(track, NOMINAL)


def test_what_stands_out_far_is_never_put_down_to_noise() -> None:
    track = followed(slow=0.1)
    state = refit(track, NOMINAL)
    assert state.excess > FAINTLY * state.floor
    assert not only_noise(track, NOMINAL)


def test_most_of_a_ripple_goes_with_the_motion_and_little_of_slow_noise_does() -> None:
    share = []
    for track in (followed(term("ripple", sine=0.2, cosine=0.0, period=0.01)), followed(slow=0.03)):
        state = refit(track, NOMINAL)
        share.append(going_with_motion(track, state) / state.excess)
    assert share[0] > 0.5
    assert share[1] < 0.3
