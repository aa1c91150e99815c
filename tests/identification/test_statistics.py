"""The covariance against the textbook for white residuals, and against theory for correlated ones."""

from __future__ import annotations

import numpy as np
import pytest
from fric_nodes.identification.statistics import bartlett_lag, sandwich_covariance
from numpy.typing import NDArray

Array = NDArray[np.float64]
START = np.array([0])


def ar1(n: int, rho: float, rng: np.random.Generator) -> Array:
    noise = np.empty(n)
    noise[0] = rng.standard_normal()
    for k in range(1, n):
        noise[k] = rho * noise[k - 1] + np.sqrt(1.0 - rho**2) * rng.standard_normal()
    return noise


def test_white_residuals_give_the_textbook_covariance() -> None:
    rng = np.random.default_rng(1)
    jacobian = rng.standard_normal((20_000, 3)) @ np.array([[1.0, 0.5, 0.0], [0.0, 2.0, 0.3], [0.0, 0.0, 1e-3]])
    residual = 0.7 * rng.standard_normal(20_000)
    found = sandwich_covariance(jacobian, residual, np.ones(20_000), START)
    textbook = 0.7**2 * np.linalg.inv(jacobian.T @ jacobian)
    np.testing.assert_allclose(np.diag(found), np.diag(textbook), rtol=0.1)
    scale = np.sqrt(np.outer(np.diag(textbook), np.diag(textbook)))
    np.testing.assert_allclose(found / scale, textbook / scale, atol=0.1)


@pytest.mark.parametrize("rho", [0.5, 0.8, 0.9])
def test_ar1_residuals_on_a_slow_regressor_widen_by_the_long_run_variance(rho: float) -> None:
    # A constant regressor: the variance of a mean is (1 + rho) / (1 - rho) times that of white noise.
    rng = np.random.default_rng(2)
    n = 40_000
    found = sandwich_covariance(np.ones((n, 1)), ar1(n, rho, rng), np.ones(n), START)[0, 0] * n
    assert found == pytest.approx((1.0 + rho) / (1.0 - rho), rel=0.2)


def test_ar1_residuals_on_a_white_regressor_do_not_widen() -> None:
    rng = np.random.default_rng(3)
    n = 40_000
    jacobian = rng.standard_normal((n, 1))
    found = sandwich_covariance(jacobian, ar1(n, 0.9, rng), np.ones(n), START)[0, 0] * n
    assert found == pytest.approx(1.0, rel=0.15)


def test_correlation_does_not_reach_across_the_start_of_a_stretch() -> None:
    # Pairs of equal residuals: correlated within a stretch, and not at all once each sample is a stretch of its own.
    rng = np.random.default_rng(4)
    residual = np.repeat(rng.standard_normal(5000), 2)
    ones = np.ones((10_000, 1))
    joined = sandwich_covariance(ones, residual, np.ones(10_000), START)[0, 0] * 10_000
    apart = sandwich_covariance(ones, residual, np.ones(10_000), np.arange(10_000))[0, 0] * 10_000
    assert apart == pytest.approx(1.0, rel=0.1)
    assert joined == pytest.approx(2.0, rel=0.15)


def test_samples_without_weight_do_not_count() -> None:
    rng = np.random.default_rng(5)
    n = 4000
    jacobian, residual = rng.standard_normal((n, 2)), rng.standard_normal(n)
    weight = np.ones(n)
    weight[2000:] = 0.0
    residual[2000:] = 1e6
    found = sandwich_covariance(jacobian, residual, weight, START)
    textbook = np.linalg.inv(jacobian[:2000].T @ jacobian[:2000])
    np.testing.assert_allclose(np.diag(found), np.diag(textbook), rtol=0.35)


def test_the_lag_grows_with_the_correlation_and_stays_below_the_record() -> None:
    rng = np.random.default_rng(6)
    lags = [bartlett_lag(ar1(5000, rho, rng)) for rho in (0.0, 0.5, 0.9, 0.98)]
    assert lags == sorted(lags)
    assert lags[0] < 20 < lags[-1]
    assert bartlett_lag(np.cumsum(rng.standard_normal(40))) <= 10
    assert bartlett_lag(np.zeros(100)) == 0
    assert bartlett_lag(np.ones(2)) == 0
