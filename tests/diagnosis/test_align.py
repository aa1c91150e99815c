"""Clocks of two recordings: against motions whose shift is known, filters in closed form and the scatter over many noises."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.diagnosis.align import BANDWIDTH, Alignment, CompareError, align, velocity_of
from fric.record import Array, Record

H = 1e-3


def place(time: Array) -> Array:
    """Position [m] of a motion that does not repeat itself."""
    return np.asarray(0.05 * np.sin(2.1 * time + 0.2) + 0.02 * np.sin(6.7 * time + 1.0) + 0.004 * np.sin(20.9 * time + 2.0))


def moved(first: float = 0.0, seconds: float = 8.0, noise: float = 1e-6, seed: int = 0) -> Record:
    """The motion from ``first`` [s] on, by a clock that begins at zero there; effort is that of 2 kg alone."""
    time = H * np.arange(round(seconds / H))
    there = time + first
    force = 2.0 * (place(there + 1e-4) - 2.0 * place(there) + place(there - 1e-4)) / 1e-8
    return Record(time, place(there) + noise * np.random.default_rng(seed).standard_normal(time.size), force, source="axis")


@pytest.mark.parametrize("rate", [20.0, BANDWIDTH, 400.0])
def test_a_velocity_is_the_derivative_low_passed_twice_by_the_second_order_filter(rate: float) -> None:
    """Forward and backward a Butterworth filter passes 1/(1 + (w/w_c)^4) of a sine, without phase: one half at w_c."""
    time = H * np.arange(6000)
    record = Record(time, np.sin(rate * time), np.cos(time))
    inside = slice(1000, 5000)
    found = velocity_of(record)[inside]
    warped = math.tan(0.5 * rate * H) / math.tan(0.5 * BANDWIDTH * H)  # of the bilinear transform
    passed = np.sin(rate * H) / H / (1.0 + warped**4)  # of which a central difference takes sin(wh)/h
    assert found == pytest.approx(passed * np.cos(rate * time[inside]), abs=1e-3 * rate)


def test_a_velocity_stands_at_the_stamps_of_its_recording() -> None:
    """Stamps that are uneven don't bend it."""
    jitter = 0.2 * H * np.random.default_rng(3).uniform(-1.0, 1.0, 4000)
    time = H * np.arange(4000) + jitter
    record = Record(time - time[0], 0.1 * np.sin(5.0 * time), np.cos(time))
    assert velocity_of(record)[500:3500] == pytest.approx(0.5 * np.cos(5.0 * time)[500:3500], abs=2e-3)


@pytest.mark.parametrize("late", [0.0, 0.2, 0.2345])
def test_the_offset_is_by_how_much_later_the_other_clock_began(late: float) -> None:
    """It comes out between the samples, too."""
    found = align(moved(0.0), moved(late, seconds=6.0, seed=1), efforts=False)
    assert found.offset == pytest.approx(-late, abs=2e-5)
    assert found.ratio == pytest.approx(1.0, abs=2e-5)
    assert found.offset_told
    assert not found.by_effort


def test_a_clock_that_runs_faster_is_told() -> None:
    time = H * np.arange(8000)
    fast = Record(time, place(time / 1.002), np.cos(time), source="fast")
    found = align(moved(), fast, efforts=False)
    assert found.ratio == pytest.approx(1.002, abs=2e-5)
    assert found.offset == pytest.approx(0.0, abs=1e-4)


def test_the_standard_errors_are_no_smaller_than_the_scatter_over_many_noises() -> None:
    """They may be larger, by some times: the rest is low-passed, and counts as if it hung together for longer."""
    noise = 2e-4
    found = [align(moved(noise=noise, seed=k), moved(0.1, noise=noise, seed=100 + k), efforts=False) for k in range(40)]
    scatter = np.std([each.offset for each in found]), np.std([each.ratio for each in found])
    told = np.mean([each.offset_error for each in found]), np.mean([each.ratio_error for each in found])
    # Of 40 draws a standard deviation is known within a quarter.
    assert 0.75 * scatter[0] < told[0] < 6.0 * scatter[0]
    assert 0.75 * scatter[1] < told[1] < 6.0 * scatter[1]


def test_of_many_shifts_that_fit_a_periodic_motion_the_one_with_the_longest_overlap_counts() -> None:
    time = H * np.arange(8000)
    pure = Record(time, np.sin(2.0 * np.pi * time), np.cos(time))
    assert align(pure, pure, efforts=False).offset == pytest.approx(0.0, abs=1e-6)


def test_the_scale_of_a_shift_is_the_inverse_of_the_rate_of_a_sine() -> None:
    """Its velocity changes by its own size within 1/w."""
    time = H * np.arange(8001)
    pure = Record(time, np.cos(np.pi * time), np.cos(time))  # at rest at both ends
    assert align(pure, pure, efforts=False).motion_time == pytest.approx(1.0 / np.pi, rel=0.01)


def test_efforts_align_where_the_motions_agree_only_roughly() -> None:
    """Of a simulation without feedback the motion goes its own way, under the same force."""
    real = moved(0.25, seconds=6.0)
    own_way = moved()
    wander = 0.15 * np.sin(0.9 * own_way.time + 0.3) + 0.02 * np.sin(4.1 * own_way.time)
    simulated = Record(own_way.time, own_way.position + wander, own_way.effort, source="simulated")
    found = align(simulated, real, efforts=True)
    assert found.by_effort
    assert found.offset == pytest.approx(-0.25, abs=H)
    # Anywhere within a sample: the standard deviation of a uniform distribution.
    assert found.offset_error == pytest.approx(H / math.sqrt(12.0))
    assert not found.ratio_told
    assert "from the efforts" in found.offset_in_words
    assert not align(simulated, real, efforts=False).by_effort


def test_motions_of_another_excitation_are_refused() -> None:
    time = H * np.arange(8000)
    other = Record(time, np.cumsum(np.random.default_rng(2).standard_normal(8000)) * 1e-4, np.cos(time), source="other")
    with pytest.raises(CompareError, match="no motion in common"):
        align(moved(), other, efforts=False)


def test_what_is_told_hangs_on_its_95_percent_interval() -> None:
    sure = Alignment(0.5, 0.01, 1.001, 1e-4, motion_time=0.02)
    assert sure.offset_told
    assert sure.interval == pytest.approx((0.5 - 0.0196, 0.5 + 0.0196))
    assert sure.offset_in_words == "0.5 s ± 0.02 s (95 %)"
    assert sure.ratio_in_words == "1.001 ± 0.0002 (95 %)"
    # Twice the error makes a shift of another motion out of it; one of the clocks may be off by a hundredth at most.
    unsure = Alignment(0.5, 0.011, 1.001, 0.006, motion_time=0.02)
    assert not unsure.offset_told
    assert not unsure.ratio_told
    assert "cannot be told" in unsure.offset_in_words
    assert "cannot be told" in unsure.ratio_in_words
