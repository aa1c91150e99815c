"""Estimates put together: a published meta-analysis, and how often the intervals hold."""

from __future__ import annotations

import numpy as np
import pytest
from fric.identification.random_effects import random_effects

# Thirteen trials of a vaccine (Colditz et al. 1994, JAMA 271, 698-702): cases and others with it, and without; latitude [deg].
TRIALS = np.array(
    [
        (4, 119, 11, 128, 44), (6, 300, 29, 274, 55), (3, 228, 11, 209, 42), (62, 13536, 248, 12619, 52),
        (33, 5036, 47, 5761, 13), (180, 1361, 372, 1079, 44), (8, 2537, 10, 619, 19), (505, 87886, 499, 87892, 13),
        (29, 7470, 45, 7232, 27), (17, 1699, 65, 1600, 42), (186, 50448, 141, 27197, 18), (5, 2493, 3, 2338, 33),
        (27, 16886, 29, 17825, 33),
    ],
    dtype=np.float64,
)  # fmt: skip


def ratios() -> tuple[np.ndarray, np.ndarray]:
    """Logarithm of the relative risk of each trial, and its standard error."""
    a, b, c, d = TRIALS[:, :4].T
    return np.log(a / (a + b) / (c / (c + d))), np.sqrt(1 / a - 1 / (a + b) + 1 / c - 1 / (c + d))


def test_the_mean_is_the_published_one() -> None:
    # DerSimonian-Laird: -0.7141, tau^2 0.3088 (Viechtbauer 2010, J. Stat. Softw. 36(3)).
    found = random_effects(*ratios())
    assert found.values[0] == pytest.approx(-0.7141, abs=5e-5)
    assert found.scatter**2 == pytest.approx(0.3088, abs=5e-5)
    assert found.half[0] / found.errors[0] == pytest.approx(2.178813, abs=1e-5)  # Student's t, 12 degrees of freedom


def test_the_slope_is_the_published_one() -> None:
    # On latitude, by the method of moments: slope -0.0292, tau^2 0.0633 (the same).
    columns = np.column_stack([np.ones(TRIALS.shape[0]), TRIALS[:, 4]])
    found = random_effects(*ratios(), columns)
    assert found.values[1] == pytest.approx(-0.0292, abs=5e-5)
    assert found.scatter**2 == pytest.approx(0.0633, abs=5e-5)


@pytest.mark.parametrize("scatter", [0.0, 3.0])
def test_intervals_hold_as_often_as_they_say(scatter: float) -> None:
    generator = np.random.default_rng(3)
    errors = generator.uniform(0.5, 2.0, 10)
    hours = np.arange(10.0)
    columns = np.column_stack([np.ones(10), hours - 4.5])
    held = []
    for _ in range(2000):
        values = 7.0 - 0.4 * columns[:, 1] + np.hypot(errors, scatter) * generator.standard_normal(10)
        line = random_effects(values, errors, columns)
        mean = random_effects(values + 0.4 * columns[:, 1], errors)
        held.append((abs(line.values[1] + 0.4) < line.half[1], abs(mean.values[0] - 7.0) < mean.half[0]))
    # 2,000 trials: a share of 95 % has a standard deviation of 0.5 %.
    assert np.all(np.abs(np.mean(held, axis=0) - 0.95) < 0.02)


def test_units_do_not_matter() -> None:
    values, errors = ratios()
    small, large = (random_effects(unit * values, unit * errors) for unit in (1e-200, 1e200))
    assert small.values[0] * 1e200 == pytest.approx(large.values[0] * 1e-200)
    assert small.scatter * 1e200 == pytest.approx(large.scatter * 1e-200)


def test_one_estimate_has_no_interval() -> None:
    found = random_effects(np.array([3.0]), np.array([0.1]))
    assert found.values[0] == pytest.approx(3.0)
    assert np.isinf(found.half[0])
    assert np.isnan(found.scatter)
