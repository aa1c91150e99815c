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
from typing import NamedTuple

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


class _Limits(NamedTuple):
    """Where to stop: relative step, relative decrease of the cost, number of slow steps in a row."""

    point: float
    cost: float
    slow: int


class _Descent:
    """One minimisation on its way: the point reached, its residuals and their Jacobian."""

    def __init__(
        self,
        function: Callable[[Array], Array],
        start: Array,
        bounds: tuple[Array, Array],
        difference: float,
        secant: bool,
        threads: int,
    ) -> None:
        self._function = function
        self._bounds = bounds
        self._difference = difference
        self._secant = secant
        self._threads = threads
        self._point = start
        self._residual = function(start)
        self._cost = float(self._residual @ self._residual)
        self._damping, self._growth = _FIRST_DAMPING, 2.0
        self._slow = 0  # steps in a row that gained nearly nothing, as where differences can't see the minimum any better
        self._jacobian = np.empty((self._residual.shape[0], start.shape[0]))
        self._exact, self._foreseen = False, False  # the Jacobian at this point, and the step that led to it

    def solution(self, converged: bool, iterations: int) -> Solution:
        """The point reached."""
        lower, upper = self._bounds
        free = _inwards(self._jacobian.T @ self._residual, lower - self._point, upper - self._point)
        return Solution(self._point, self._residual, self._jacobian, converged, iterations, free)

    def stopped(self, iterations: int) -> Solution:
        """The point reached when no further step is allowed."""
        if not (self._secant and self._foreseen):
            self._differentiate()
        return self.solution(False, iterations)

    def _differentiate(self) -> tuple[Array, Array]:
        """Take the Jacobian here anew; the normal matrix and the gradient."""
        _differences(
            self._function, self._point, self._residual, self._bounds[1], self._difference, self._jacobian, self._threads
        )
        self._exact = True
        return self._jacobian.T @ self._jacobian, self._jacobian.T @ self._residual

    def ends(self, limits: _Limits) -> bool:
        """Go one step down; True where there is none worth going."""
        lower, upper = self._bounds
        if self._secant and self._exact and self._foreseen:
            self._exact = False
            normal, gradient = self._jacobian.T @ self._jacobian, self._jacobian.T @ self._residual
        else:
            normal, gradient = self._differentiate()
        for _ in range(30):
            step = _proposal(normal, gradient, self._damping, self._point, lower, upper)
            # Decrease of the sum of squares that the linear model promises.
            promised = -float(step @ (2.0 * gradient + normal @ step))
            small = np.all(np.abs(step) <= limits.point * (np.abs(self._point) + limits.point))
            if small or 0 < limits.slow <= self._slow or 0.0 <= promised <= limits.cost * self._cost:
                return True
            if promised < 0.0:
                # A bound has bent the step uphill; a shorter one goes along the gradient.
                self._damping, self._growth = max(self._damping, 1e-6) * self._growth, 2.0 * self._growth
                continue
            if self._goes_down(np.clip(self._point + step, lower, upper), promised, limits.cost):
                return False
            self._damping *= self._growth
            self._growth *= 2.0
            if not self._exact:
                normal, gradient = self._differentiate()
        # No direction goes down: the differences have said all they can.
        return True

    def _goes_down(self, trial: Array, promised: float, tolerance: float) -> bool:
        """Go to ``trial`` when the cost is smaller there."""
        residual = self._function(trial)
        cost = float(residual @ residual)
        gain = (self._cost - cost) / promised
        if not gain > 0.0:
            return False
        self._slow = self._slow + 1 if self._cost - cost <= tolerance * self._cost else 0
        self._foreseen = abs(gain - 1.0) < _FORESEEN
        if self._secant and self._foreseen:
            moved = trial - self._point
            self._jacobian += np.outer(residual - self._residual - self._jacobian @ moved, moved / (moved @ moved))
        self._point, self._residual, self._cost = trial, residual, cost
        self._damping = max(self._damping * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 1e-12)
        self._growth = 2.0
        return True


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
    descent = _Descent(function, np.clip(start, lower, upper), (lower, upper), difference, secant, threads)
    limits = _Limits(point_tolerance, cost_tolerance, most_slow)
    for iteration in range(1, max_iterations + 1):
        if descent.ends(limits):
            return descent.solution(True, iteration)
    return descent.stopped(max_iterations)


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
