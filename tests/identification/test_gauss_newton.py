"""The solver on problems whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest
from fric_nodes.identification.gauss_newton import minimise
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

Array = NDArray[np.float64]
FREE = np.full(2, np.inf)


def test_a_linear_problem_gives_what_lstsq_gives() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((200, 4)), rng.standard_normal(200)
    found = minimise(lambda x: a @ x - b, np.ones(4), np.full(4, -np.inf), np.full(4, np.inf), cost_tolerance=1e-16)
    np.testing.assert_allclose(found.point, np.linalg.lstsq(a, b, rcond=None)[0], rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(found.jacobian, a, atol=1e-7)
    assert found.converged


@pytest.mark.parametrize("seed", range(8))
def test_bounds_bind_as_in_bounded_linear_least_squares(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.standard_normal((60, 4)), 3.0 * rng.standard_normal(60)
    lower, upper = np.full(4, -0.1), np.full(4, 0.15)
    found = minimise(lambda x: a @ x - b, np.full(4, 0.01), lower, upper, cost_tolerance=1e-16)
    expected = lsq_linear(a, b, bounds=(lower, upper), tol=1e-14).x
    assert np.all(found.point >= lower)
    assert np.all(found.point <= upper)
    np.testing.assert_allclose(np.sum((a @ found.point - b) ** 2), np.sum((a @ expected - b) ** 2), rtol=1e-6)


def test_the_curved_valley_of_rosenbrock() -> None:
    def residual(x: Array) -> Array:
        return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])

    found = minimise(residual, np.array([-1.2, 1.0]), -FREE, FREE, difference=1e-7, max_iterations=200)
    np.testing.assert_allclose(found.point, [1.0, 1.0], rtol=1e-5)


def test_an_exponential_whose_time_constant_starts_ten_times_off() -> None:
    t = np.linspace(0.0, 5.0, 400)
    y = 3.0 * np.exp(-t / 0.7)
    found = minimise(lambda x: x[0] * np.exp(-t / x[1]) - y, np.array([1.0, 7.0]), np.array([0.0, 1e-3]), FREE)
    np.testing.assert_allclose(found.point, [3.0, 0.7], rtol=1e-4)


def test_a_parameter_without_any_trace_stays_where_it_is() -> None:
    t = np.linspace(0.0, 1.0, 50)
    found = minimise(lambda x: x[0] * t - 2.0 * t, np.array([1.0, 5.0]), -FREE, FREE)
    assert found.point[0] == pytest.approx(2.0, rel=1e-6)
    assert found.point[1] == 5.0


def test_the_limit_of_iterations_is_told() -> None:
    def residual(x: Array) -> Array:
        return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])

    found = minimise(residual, np.array([-1.2, 1.0]), -FREE, FREE, max_iterations=2)
    assert not found.converged
    assert found.iterations == 2
