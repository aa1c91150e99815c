"""The covariance against the textbook for white residuals, and against theory for correlated ones."""

from __future__ import annotations

import numpy as np
import pytest
from fric.identification.statistics import bartlett_lag, by_parts, sandwich_covariance
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


def test_intervals_of_a_short_correlated_series_hold_the_mean() -> None:
    rng = np.random.default_rng(7)
    n, trials, hits = 120, 1000, 0
    for _ in range(trials):
        series = ar1(n + 50, 0.5, rng)[50:]
        mean = float(np.mean(series))
        hits += abs(mean) <= 1.645 * np.sqrt(sandwich_covariance(np.ones((n, 1)), series - mean, np.ones(n), START)[0, 0])
    # Without the allowance for the window it is 0.82.
    assert 0.835 <= hits / trials <= 0.93


def test_gaps_neither_add_nor_take_correlation() -> None:
    rng = np.random.default_rng(8)
    series = ar1(20_000, 0.8, rng)
    gaps = rng.random(20_000) < 0.3
    assert bartlett_lag(np.where(gaps, 0.0, series)) == pytest.approx(bartlett_lag(series), rel=0.1)


def test_parts_of_white_residuals_give_the_textbook_covariance() -> None:
    rng = np.random.default_rng(9)
    found = []
    for _ in range(40):
        jacobian = rng.standard_normal((4000, 2)) @ np.array([[1.0, 0.5], [0.0, 1e-3]])
        residual = 0.7 * rng.standard_normal(4000)
        parts = np.split(np.arange(4000), 40)
        information = np.array([jacobian[part].T @ jacobian[part] for part in parts])
        score = np.array([jacobian[part].T @ residual[part] for part in parts])
        textbook = 0.7**2 * np.linalg.inv(jacobian.T @ jacobian)
        found.append(np.diag(by_parts(information, score)) / np.diag(textbook))
    # Student's quantile with some 39 degrees of freedom over the normal one, squared.
    np.testing.assert_allclose(np.mean(found, axis=0), 1.06, atol=0.1)


def test_parts_cover_where_few_parts_carry_the_estimate() -> None:
    rng = np.random.default_rng(10)
    # Three of thirty parts hold nearly all of the information: their scores at the estimate show less than their noise.
    size = np.where(np.arange(30) < 3, 6.0, 1.0)
    hits, plain = 0, 0
    for _ in range(1500):
        measured = rng.standard_normal(30)
        estimate = float(size @ measured / (size @ size))
        score = size * (measured - estimate * size)
        hits += abs(estimate) <= 1.645 * np.sqrt(by_parts((size**2)[:, None, None], score[:, None])[0, 0])
        plain += abs(estimate) <= 1.645 * np.sqrt(np.sum(score**2)) / (size @ size)
    assert plain / 1500 < 0.82
    assert 0.84 <= hits / 1500 <= 0.95
    assert hits > plain + 75
