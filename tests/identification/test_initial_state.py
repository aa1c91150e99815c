"""The state in which a recording begins, against motions that are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.result import Options
from fric.identification.scoring import score
from fric.model import build_model, term
from fric.signals.initial_state import initial_state
from fric.signals.instrument_noise import level_of
from numpy.typing import NDArray

Array = NDArray[np.float64]


def swings(random: np.random.Generator, time: Array) -> tuple[Array, float, float]:
    """Three sines: position, and the first position and velocity."""
    size = random.uniform(0.01, 0.05, 3)
    w = 2.0 * np.pi * random.uniform(0.3, 3.0, 3)
    phase = random.uniform(0.0, 2.0 * np.pi, 3)
    position = np.sum(size * np.sin(np.outer(time, w) + phase), axis=1)
    return position, float(position[0]), float(np.sum(size * w * np.cos(phase)))


@pytest.mark.parametrize("step", [2e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("kind", ["noise", "fine encoder", "coarse encoder"])
def test_intervals_hold_what_is_true(kind: str, step: float) -> None:
    time = step * np.arange(round(2.0 / step))
    held, error, simple = [], [], []
    for seed in range(100):
        random = np.random.default_rng(seed)
        position, first, velocity = swings(random, time)
        count = {"fine encoder": 1e-6, "coarse encoder": 1e-4}.get(kind, 0.0)
        offset = float(random.random())
        seen = position + offset + (1e-5 * random.standard_normal(time.shape[0]) if kind == "noise" else 0.0)
        seen = count * np.round(seen / count) if count else seen
        found = initial_state(time, seen)
        off = np.abs([found.position - first - offset, found.velocity - velocity])
        held.append(off < 1.645 * found.standard_errors)
        error.append(off[1])
        simple.append(abs((seen[1] - seen[0]) / step - velocity))
    # 90 % intervals; the part that covers a bias makes them wider, and a count of 100 is good to 6 %.
    assert np.all(np.mean(held, axis=0) > 0.82)
    assert np.median(error) < 0.5 * np.median(simple)
    assert np.median(error) < 0.02 * 0.3  # [m/s], of the motion's usual speed


def test_at_rest_the_velocity_is_known_to_a_step_per_window() -> None:
    time = 1e-3 * np.arange(2000)
    found = initial_state(time, np.full(2000, 0.123), error=1e-4 / np.sqrt(12.0))
    assert found.position == pytest.approx(0.123)
    assert found.velocity == pytest.approx(0.0, abs=1e-9)
    assert 0.2 * 1e-4 / 2.0 < found.standard_errors[1] < 10.0 * 1e-4 / 2.0


def test_a_reversal_behind_the_start_does_not_reach_into_it() -> None:
    # A triangle: beyond the corner at 0.1 s no polynomial holds.
    time = 1e-3 * np.arange(1000)
    position = 0.2 * np.abs(time - 0.1) + 1e-6 * np.random.default_rng(1).standard_normal(1000)
    found = initial_state(time, position)
    assert found.velocity == pytest.approx(-0.2, abs=5e-4)
    within = initial_state(time, position, at=50)
    assert within.velocity == pytest.approx(-0.2, abs=5e-4)


def test_few_samples_are_taken_as_they_are() -> None:
    assert initial_state(np.array([0.0, 0.1]), np.array([1.0, 1.2])).velocity == pytest.approx(2.0)
    with pytest.raises(ValueError, match="two samples"):
        initial_state(np.zeros(1), np.zeros(1))


def test_the_error_of_a_rounded_position_is_that_of_rounding() -> None:
    position = 1e-3 * np.round(0.3 * np.sin(0.01 * np.arange(3000)) / 1e-3)
    assert level_of(position) == pytest.approx(1e-3 / np.sqrt(12.0), rel=0.3)


@pytest.mark.parametrize("resolution", [1e-6, 2e-5, 1e-4])
def test_output_error_of_a_recording_that_begins_in_motion(slider: Any, resolution: float) -> None:
    whole = slider.record(noise=0.05, resolution=resolution)
    speed = np.gradient(slider.position, whole.sample_time)
    first = 3000 + int(np.argmax(np.abs(speed[3000:6000])))
    record = whole.slice(first, whole.n_samples)
    names = {"mass": 2.0, "coulomb.force": 8.0, "viscous.coefficient": 15.0, "bias.force": 0.8, "asymmetry.coefficient": 2.0}
    terms = [term("coulomb", force=1.0), term("viscous", coefficient=1.0), term("bias", force=0.0), term("asymmetry")]
    found = METHODS["output-error"].fit(build_model("rigid", {"mass": 1.0}, terms), [record], Options())
    for name, value in names.items():
        assert abs(found.model.value(name) - value) < 3.0 * found.model.standard_errors[name], name
    assert found.model.value("mass") == pytest.approx(2.0, rel=0.01)
    # What is left: rounding, and the noise of the force, which adds up in a free run.
    assert found.train.position_rmse < 1e-4 + 0.5 * resolution


def test_a_free_run_of_the_true_model_stays_with_a_recording_that_begins_in_motion(slider: Any) -> None:
    whole = slider.record(resolution=1e-5)
    speed = np.gradient(slider.position, whole.sample_time)
    record = whole.slice(3000 + int(np.argmax(np.abs(speed[3000:6000]))), whole.n_samples)
    friction = [term("coulomb", force=8.0), term("viscous", coefficient=15.0), term("asymmetry", coefficient=2.0)]
    terms = [*friction, term("bias", force=0.8)]
    true = build_model("rigid", {"mass": 2.0}, terms)
    # 1 % of the speed at the start would put it 0.4 mm off for good.
    assert score(true, [record], Options()).position_rmse < 1e-4
