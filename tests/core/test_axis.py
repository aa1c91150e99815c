"""The simulated axis with its drive and sensors, against hand calculation."""

from __future__ import annotations

import numpy as np
import pytest
from fric_nodes.axis import SimulatedAxis
from fric_nodes.model import build_model

FREE = build_model("rigid", {"mass": 2.0}, [])


def test_moves_as_a_free_mass_and_reports_the_encoder_s_steps() -> None:
    axis = SimulatedAxis(FREE, resolution=1e-4)
    axis.advance(4.0, 0.1)
    axis.advance(4.0, 0.1)
    measured = axis.measure()
    # a = 2 m/s^2 for 0.2 s: 0.04 m
    assert axis.position == pytest.approx(0.04, rel=1e-9)
    assert measured.position == pytest.approx(0.04, abs=5.1e-5)
    assert measured.position / 1e-4 == pytest.approx(round(measured.position / 1e-4), abs=1e-9)
    assert measured.velocity == pytest.approx(0.2, abs=1e-3)


def test_effort_is_the_mean_force_that_acted_since_the_last_measurement() -> None:
    axis = SimulatedAxis(FREE, force_limit=5.0)
    axis.measure()
    axis.advance(2.0, 0.003)
    axis.advance(-50.0, 0.001)
    assert axis.measure().effort == pytest.approx((2.0 * 3 - 5.0) / 4)
    assert axis.saturated == 1


def test_noise_has_the_size_asked_for_and_follows_the_seed() -> None:
    def efforts(seed: int) -> np.ndarray:
        axis = SimulatedAxis(FREE, force_noise=0.3, seed=seed)
        values = []
        for _ in range(4000):
            axis.advance(0.0, 1e-3)
            values.append(axis.measure().effort)
        return np.array(values)

    first = efforts(1)
    assert first.std() == pytest.approx(0.3, rel=0.05)
    assert first.mean() == pytest.approx(0.0, abs=0.03)
    assert np.array_equal(first, efforts(1))
    assert not np.array_equal(first, efforts(2))
