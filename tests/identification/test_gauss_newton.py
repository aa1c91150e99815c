"""The solver on problems whose answers are known."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from fric.identification.gauss_newton import Solution, minimise
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


def decaying(point: Array) -> Array:
    """A decaying oscillation at 300 times, shape ``(300,)``."""
    time = np.linspace(0.0, 4.0, 300)
    return np.asarray(point[0] * np.exp(-point[1] * time) * np.cos(point[2] * time + point[3]))


TRUTH = np.array([2.0, 0.7, 5.0, 0.3])
START = np.array([1.0, 1.0, 4.6, 0.8])
ANYWHERE = np.full(4, np.inf)
TARGET = decaying(TRUTH) + 0.05 * np.random.default_rng(3).standard_normal(300)


def test_secants_reach_the_same_minimum_with_fewer_evaluations() -> None:
    count = {False: 0, True: 0}

    def run(secant: bool) -> Solution:
        def residual(x: Array) -> Array:
            count[secant] += 1
            return decaying(x) - TARGET

        return minimise(residual, START, -ANYWHERE, ANYWHERE, secant=secant, cost_tolerance=1e-12)

    by_secants, by_differences = run(True), run(False)
    np.testing.assert_allclose(by_secants.point, by_differences.point, rtol=1e-4)
    np.testing.assert_allclose(by_secants.point, TRUTH, rtol=0.1)
    assert count[True] < count[False]
    # Its Jacobian may be that of a point nearby, not that of another place.
    apart = np.linalg.norm(by_secants.jacobian - by_differences.jacobian, axis=0)
    assert np.all(apart < 0.02 * np.linalg.norm(by_differences.jacobian, axis=0))


def test_threads_change_nothing_but_who_evaluates() -> None:
    names = set()

    def residual(x: Array) -> Array:
        names.add(threading.current_thread().name)
        return decaying(x) - TARGET

    alone, together = (minimise(residual, START, -ANYWHERE, ANYWHERE, threads=n) for n in (1, 3))
    assert np.array_equal(alone.point, together.point)
    assert np.array_equal(alone.jacobian, together.jacobian)
    assert len(names) > 1


def test_what_a_thread_raises_is_raised() -> None:
    def residual(x: Array) -> Array:
        if threading.current_thread() is not threading.main_thread():
            raise ValueError("a column")
        return x

    with pytest.raises(ValueError, match="a column"):
        minimise(residual, np.ones(3), -np.ones(3), np.ones(3), threads=2)
