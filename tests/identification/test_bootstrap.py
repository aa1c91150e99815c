"""Block bootstrap and profile likelihood against what is known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.identification.bootstrap import Bootstrap, block_bootstrap, drawn_series, drawn_weights
from fric.identification.problem import Problem
from fric.identification.profile import profile
from numpy.typing import NDArray

Array = NDArray[np.float64]
START = np.array([0])


def ar1(n: int, rho: float, rng: np.random.Generator) -> Array:
    noise = np.empty(n)
    noise[0] = rng.standard_normal()
    for k in range(1, n):
        noise[k] = rho * noise[k - 1] + math.sqrt(1.0 - rho**2) * rng.standard_normal()
    return noise


def linear(columns: Array, target: Array) -> Problem:
    point = np.linalg.lstsq(columns, target, rcond=None)[0]
    n = point.shape[0]
    # Shifted to one, as a problem's point is.
    return Problem(
        tuple(f"p{k}" for k in range(n)),
        lambda at: columns @ (at - 1.0) - (target - columns @ point),
        np.ones(n),
        np.full(n, -np.inf),
        np.full(n, np.inf),
        np.ones(n),
        START,
    )


@pytest.mark.parametrize(("rho", "rel"), [(0.0, 0.2), (0.8, 0.25)])
def test_the_spread_of_a_mean_of_correlated_values(rho: float, rel: float) -> None:
    rng = np.random.default_rng(1)
    n = 8000
    found = block_bootstrap(linear(np.ones((n, 1)), ar1(n, rho, rng)), n_replicates=200)
    assert found.covariance[0, 0] * n == pytest.approx((1.0 + rho) / (1.0 - rho), rel=2 * rel)
    low, high = found.interval(np.ones(1), 0.9)
    assert high[0] - low[0] == pytest.approx(2 * 1.645 * math.sqrt(found.covariance[0, 0]), rel=0.2)


def test_blocks_do_not_reach_across_the_start_of_a_stretch() -> None:
    rng = np.random.default_rng(2)
    starts = np.array([0, 50])
    for _ in range(200):
        weight = drawn_weights(100, 40, starts, rng)
        assert np.sum(weight) == pytest.approx(80.0)  # two blocks of 40
        assert np.all(np.diff(weight[48:52])[[0, 2]] <= 2.0)
    series = np.r_[np.zeros(50), np.ones(50)]
    for _ in range(50):
        drawn = drawn_series(series, 80, 40, starts, rng)
        assert np.all(np.ptp(drawn.reshape(2, 40), axis=1) == 0.0)


def test_the_profile_of_a_linear_parameter_is_its_standard_error() -> None:
    rng = np.random.default_rng(3)
    n = 500
    columns = np.c_[np.ones(n), np.linspace(0.0, 1.0, n)]
    problem = linear(columns, rng.standard_normal(n))
    found = profile(problem, 1, 0.37)
    assert found.upper - 1.0 == pytest.approx(1.645 * 0.37, rel=0.02)
    assert 1.0 - found.lower == pytest.approx(1.645 * 0.37, rel=0.02)


def test_the_profile_of_a_time_constant_is_as_lopsided_as_the_likelihood() -> None:
    # One parameter of y = exp(-t/T): the deviance can be typed down.
    t = np.linspace(0.0, 1.0, 200)
    deviation = 0.2
    exact = np.exp(-t)
    problem = Problem(
        ("T",),
        lambda at: (np.exp(-t / at[0]) - exact) / deviation,
        np.ones(1),
        np.array([0.05]),
        np.array([100.0]),
        np.ones(1),
        START,
    )
    slope = t * exact / deviation
    found = profile(problem, 0, 1.0 / math.sqrt(float(slope @ slope)))

    def deviance(constant: float) -> float:
        return float(np.sum((np.exp(-t / constant) - exact) ** 2)) / deviation**2

    assert deviance(found.lower) == pytest.approx(1.645**2, rel=0.05)
    assert deviance(found.upper) == pytest.approx(1.645**2, rel=0.05)
    assert found.upper - 1.0 > 1.1 * (1.0 - found.lower)


def test_a_parameter_that_cannot_be_bounded_has_no_limit() -> None:
    # tanh(v/v_S) at speeds far above v_S: smaller makes no difference.
    v = np.linspace(1.0, 2.0, 100)
    problem = Problem(
        ("v_S",),
        lambda at: (np.tanh(v / (0.3 * at[0])) - 1.0) / 0.05,
        np.array([0.8]),
        np.array([1e-3]),
        np.array([100.0]),
        np.array([0.3]),
        START,
    )
    found = profile(problem, 0, 0.5)
    assert found.lower == -math.inf
    assert math.isfinite(found.upper)


def test_of_nineteen_replicates_the_first_and_the_last_are_the_ends_of_ninety_per_cent() -> None:
    # The next replicate lies below the first of 19 with probability 1/20.
    estimates = np.arange(1.0, 20.0)[:, None]
    low, high = Bootstrap(estimates, 1).interval(np.array([9.0]), 0.9)
    assert (low[0], high[0]) == (2.0 * 9.0 - 19.0, 2.0 * 9.0 - 1.0)
