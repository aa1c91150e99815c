"""Steps and noise of signals whose steps and noise are known because the test made them."""

from __future__ import annotations

import numpy as np
import pytest
from fric.signals.instrument_noise import errors_like, level_of
from fric.signals.resolution import noise_of, step_of


@pytest.mark.parametrize("step", [1e-7, 0.25, 2.0 * np.pi / 4096])
def test_the_step_of_a_rounded_signal(step: float) -> None:
    rng = np.random.default_rng(11)
    smooth = 300.0 * step * np.sin(np.linspace(0.0, 40.0, 5000))
    rounded = step * np.round((smooth + 0.3 * step * rng.standard_normal(5000)) / step) + 0.1 * step
    assert step_of(rounded) == pytest.approx(step, rel=1e-6)
    assert step_of(smooth) == 0.0
    assert step_of(smooth + 1e-3 * step * rng.standard_normal(5000)) == 0.0


def test_the_step_of_an_encoder_is_found_also_where_the_axis_rests_and_hurries() -> None:
    random = np.random.default_rng(8)
    jumps = np.where(random.random(4000) < 0.1, random.integers(3, 90, 4000), 0)
    jumps[2000] = 1  # once
    assert step_of(np.cumsum(jumps) * 1e-5) == pytest.approx(1e-5, rel=1e-6)
    assert step_of(np.cumsum(random.standard_normal(4000))) == 0.0


def test_a_fine_step_over_a_long_travel_is_known_to_a_part_of_a_step_at_its_end() -> None:
    step, rng = 1.0 / 3.0 * 1e-6, np.random.default_rng(3)
    counts = np.cumsum(rng.integers(-400, 500, 40_000))
    found = step_of(counts * step)
    assert abs(found / step - 1.0) * float(np.ptp(counts)) < 0.1


def test_what_is_not_rounded_has_no_step_and_what_rests_neither() -> None:
    assert step_of(np.zeros(100)) == 0.0
    assert step_of(np.full(100, 0.123)) == 0.0


def test_white_noise_is_found_under_a_motion() -> None:
    t = np.linspace(0.0, 10.0, 5000)
    noisy = np.sin(2.0 * np.pi * t) + 1e-4 * np.random.default_rng(12).standard_normal(5000)
    assert noise_of(noisy) == pytest.approx(1e-4, rel=0.1)
    assert noise_of(noisy[:5]) == 0.0


def test_drawn_errors_are_as_large_as_those_of_the_instrument() -> None:
    rng = np.random.default_rng(5)
    smooth, step = 0.05 * np.sin(np.linspace(0.0, 60.0, 20_000)), 1e-4
    recorded = step * np.round((smooth + 0.4 * step * rng.standard_normal(20_000)) / step)
    made, true = errors_like(recorded, smooth, rng), recorded - smooth
    assert float(np.std(made)) == pytest.approx(float(np.std(true)), rel=0.1)
    assert level_of(recorded) == pytest.approx(float(np.std(true)), rel=0.2)
    # Of another origin: correlated errors would cancel in part instead of showing what errors do.
    assert abs(float(np.corrcoef(made, true)[0, 1])) < 0.1


def test_samples_taken_unevenly_are_no_noise() -> None:
    """A controller of 500 Hz logged every 10 or 12 ms: its noise is told, and the motion between samples is none."""
    rng = np.random.default_rng(8)
    time = np.cumsum(rng.choice([0.010, 0.012], size=6000))
    smooth = 1.5 * np.sin(2.0 * np.pi * 0.3 * time)
    noisy = smooth + 2e-5 * rng.standard_normal(time.shape)
    assert noise_of(noisy) > 1e-4
    assert noise_of(noisy, time=time) == pytest.approx(2e-5, rel=0.1)
    quick = np.abs(np.cos(2.0 * np.pi * 0.3 * time)) > 0.5
    assert noise_of(noisy, quick, time) == pytest.approx(2e-5, rel=0.1)
    # Evenly sampled, both ways are one.
    even = 0.01 * np.arange(6000)
    assert noise_of(noisy, time=even) == noise_of(noisy)
