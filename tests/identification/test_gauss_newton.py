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


def test_secants_reach_the_same_minimum_with_fewer_evaluations() -> None:
    time = np.linspace(0.0, 4.0, 300)
    truth = np.array([2.0, 0.7, 5.0, 0.3])
    count = {False: 0, True: 0}

    def run(secant: bool) -> Array:
        def residual(x: Array) -> Array:
            count[secant] += 1
            return x[0] * np.exp(-x[1] * time) * np.cos(x[2] * time + x[3]) - target

        target = truth[0] * np.exp(-truth[1] * time) * np.cos(truth[2] * time + truth[3])
        target = target + 0.05 * np.random.default_rng(3).standard_normal(300)
        free = np.full(4, np.inf)
        return minimise(residual, np.array([1.0, 1.0, 4.6, 0.8]), -free, free, secant=secant, cost_tolerance=1e-12).point

    np.testing.assert_allclose(run(True), run(False), rtol=1e-4)
    np.testing.assert_allclose(run(True), truth, rtol=0.1)
    assert count[True] / 2 < count[False]  # it was run twice
