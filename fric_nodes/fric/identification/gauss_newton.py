"""Nonlinear least squares within bounds, for many residuals and few parameters.

Gauss-Newton steps with Levenberg-Marquardt damping on the normal equations, columns scaled to one:

    (A + mu D) d = -g,   A = J'J,  g = J'r,  D = diag(A),   lower <= x + d <= upper,

bounds by an active set: a component that would leave is put on its bound and the rest solved again. The damping follows the
ratio of actual to predicted decrease (Nielsen 1999). A step needs only sums over the residuals, so that an iteration costs its
n_parameters + 1 evaluations and little else; decomposing the whole Jacobian costs more than the simulations that it comes from.
Where evaluations take long, every other Jacobian may be Broyden's secant update of the one before, which costs none, and the
columns of the others may come from several threads.
Source: Madsen, Nielsen, Tingleff 2004, sections 3.2 and 3.4; the active set is that of Bertsekas 1982 for simple bounds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..record import Array, Mask
from ..threads import mapped

__all__ = ["Solution", "minimise"]

_REACH = 0.7
_REACH_FROM_ZERO = 0.3
_FIRST_DAMPING = 1e-5
_FORESEEN = 0.5  # of a decrease, by which it may miss the promise


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the sum of squares is smallest.

    Attributes:
        point: shape ``(n_parameters,)``.
        residual: there, shape ``(n,)``.
        jacobian: there, shape ``(n, n_parameters)``; with ``secant`` it may be the update of one a step or two before.
        converged: False when the limit of iterations was reached before.
        iterations: number of Jacobians.
        free: True for parameters that no bound holds from going where less would be left, shape ``(n_parameters,)``.
    """

    point: Array
    residual: Array
    jacobian: Array
    converged: bool
    iterations: int
    free: Mask


def minimise(
    function: Callable[[Array], Array],
    start: Array,
    lower: Array,
    upper: Array,
    *,
    difference: float = 1e-5,
    point_tolerance: float = 1e-6,
    cost_tolerance: float = 1e-8,
    max_iterations: int = 60,
    most_slow: int = 0,
    secant: bool = False,
    threads: int = 1,
) -> Solution:
    """The point within bounds at which the sum of squares of ``function`` is smallest, near ``start``.

    Args:
        function: residuals, shape ``(n,)``, finite everywhere.
        start: shape ``(n_parameters,)``, of the order of one.
        lower: bounds, shape ``(n_parameters,)``.
        upper: bounds, shape ``(n_parameters,)``.
        difference: step of the forward differences, relative.
        point_tolerance: relative step at which to stop.
        cost_tolerance: relative decrease, predicted by the linear model, at which to stop.
        most_slow: number of steps in a row that decrease the cost by less than that, at which to stop; 0: no such limit.
        max_iterations: limit.
        secant: True to take differences at every other point only, where the step to it went as foreseen.
        threads: that evaluate ``function`` for differences; more than one helps where it leaves the interpreter to others.
    """
    point = np.clip(start, lower, upper)
    residual = function(point)
    cost = float(residual @ residual)
    damping, growth = _FIRST_DAMPING, 2.0
    slow = 0  # steps in a row that gained nearly nothing, as where differences can't see the minimum any better
    jacobian = np.empty((residual.shape[0], point.shape[0]))
    exact, foreseen = False, False  # the Jacobian at this point, and the step that led to it

    def solution(converged: bool, iterations: int) -> Solution:
        free = _inwards(jacobian.T @ residual, lower - point, upper - point)
        return Solution(point, residual, jacobian, converged, iterations, free)

    for iteration in range(1, max_iterations + 1):
        exact = not (secant and exact and foreseen)
        if exact:
            _differences(function, point, residual, upper, difference, jacobian, threads)
        normal, gradient = jacobian.T @ jacobian, jacobian.T @ residual
        for _ in range(30):
            step = _proposal(normal, gradient, damping, point, lower, upper)
            # Decrease of the sum of squares that the linear model promises.
            promised = -float(step @ (2.0 * gradient + normal @ step))
            small = np.all(np.abs(step) <= point_tolerance * (np.abs(point) + point_tolerance))
            if small or 0 < most_slow <= slow or 0.0 <= promised <= cost_tolerance * cost:
                return solution(True, iteration)
            if promised < 0.0:
                # A bound has bent the step uphill; a shorter one goes along the gradient.
                damping, growth = max(damping, 1e-6) * growth, 2.0 * growth
                continue
            trial = np.clip(point + step, lower, upper)
            trial_residual = function(trial)
            trial_cost = float(trial_residual @ trial_residual)
            gain = (cost - trial_cost) / promised
            if gain > 0.0:
                slow = slow + 1 if cost - trial_cost <= cost_tolerance * cost else 0
                foreseen = abs(gain - 1.0) < _FORESEEN
                if secant and foreseen:
                    moved = trial - point
                    jacobian += np.outer(trial_residual - residual - jacobian @ moved, moved / (moved @ moved))
                point, residual, cost = trial, trial_residual, trial_cost
                damping = max(damping * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 1e-12)
                growth = 2.0
                break
            damping *= growth
            growth *= 2.0
            if not exact:
                _differences(function, point, residual, upper, difference, jacobian, threads)
                normal, gradient, exact = jacobian.T @ jacobian, jacobian.T @ residual, True
        else:
            # No direction goes down: the differences have said all they can.
            return solution(True, iteration)
    if not (secant and foreseen):
        _differences(function, point, residual, upper, difference, jacobian, threads)
    return solution(False, max_iterations)


def _differences(
    function: Callable[[Array], Array],
    point: Array,
    residual: Array,
    upper: Array,
    difference: float,
    jacobian: Array,
    threads: int,
) -> None:
    """Forward differences into ``jacobian``; backward where the bound is in the way."""

    def column(number: int) -> None:
        shift = difference * max(abs(float(point[number])), 1e-3)
        if point[number] + shift > upper[number]:
            shift = -shift
        moved = point.copy()
        moved[number] += shift
        jacobian[:, number] = (function(moved) - residual) / (moved[number] - point[number])

    mapped(column, range(point.shape[0]), threads)


def _proposal(normal: Array, gradient: Array, damping: float, point: Array, lower: Array, upper: Array) -> Array:
    """The damped step within bounds, shortened where a parameter would change by more than most of its size.

    A scale that has shrunk to nothing at once has no way back.
    """
    step = _bounded_step(normal, gradient, damping, lower - point, upper - point)
    reach = _REACH * np.maximum(np.abs(point), _REACH_FROM_ZERO)
    return np.asarray(step / max(1.0, float(np.max(np.abs(step) / reach))), dtype=np.float64)


def _inwards(gradient: Array, lowest: Array, highest: Array) -> Mask:
    """True for parameters that don't stay: at a bound with the gradient pointing out, one does."""
    return ~((lowest >= 0.0) & (gradient > 0.0)) & ~((highest <= 0.0) & (gradient < 0.0))


def _bounded_step(normal: Array, gradient: Array, damping: float, lowest: Array, highest: Array) -> Array:
    """Step that minimises the damped quadratic model within ``lowest`` to ``highest``, approximately where bounds bind."""
    size = np.sqrt(np.diag(normal))
    free = (size > 0.0) & _inwards(gradient, lowest, highest)
    step = np.zeros(gradient.shape[0])
    while np.any(free):
        scale = size[free]
        scaled = normal[np.ix_(free, free)] / np.outer(scale, scale)
        load = gradient[free] + normal[np.ix_(free, ~free)] @ step[~free]
        found = np.linalg.lstsq(scaled + damping * np.eye(scale.shape[0]), -load / scale, rcond=1e-14)[0] / scale
        clipped = np.clip(found, lowest[free], highest[free])
        out = clipped != found
        step[free] = clipped
        if not np.any(out):
            break
        free[np.flatnonzero(free)[out]] = False
    return step
