"""Profile likelihood: how far a parameter can be moved before no choice of the others makes up for it.

A nonlinear parameter (a Stribeck velocity, a bristle stiffness) may be well bounded on one side and hardly on the other, which
a standard error can't express. With C(x) the smallest sum of squares when the parameter is held at x, the interval is where

    D(x) = (C(x) - C_min) [(J'J)^-1]_jj / s_j^2 <= chi^2_1(P),

s_j being the parameter's standard error with correlation of the residuals taken into account: near the minimum C grows
as (x - x_j)^2 / [(J'J)^-1]_jj, so that for a linear parameter D is (x - x_j)^2 / s_j^2, the interval that of the standard
error. For white residuals it is the likelihood ratio (Venzon and Moolgavkar 1988); the factor is the vertical adjustment of
Chandler and Bate 2007 for residuals that are not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from ..record import Array
from .gauss_newton import minimise
from .problem import Problem

__all__ = ["Profile", "profile"]

_FIRST_STEP = 0.5  # standard errors
_GROWTH = 1.5
_MOST_TRIALS = 14
_ROOT_TRIALS = 6


@dataclass(frozen=True, eq=False)
class Profile:
    """How the misfit grows to both sides of an estimate.

    Attributes:
        value: where the parameter was held, ascending, shape ``(n,)``.
        deviance: D there, shape ``(n,)``.
        lower: end of the interval; minus infinity where the recording sets none.
        upper: end of the interval; infinity where the recording sets none.
    """

    value: Array
    deviance: Array
    lower: float
    upper: float


@dataclass
class _Side:
    """One walk away from the estimate, each fit starting where the last one ended."""

    misfit: Callable[[float, Array], tuple[float, Array]]
    others: Array
    trials: list[tuple[float, float]]

    def deviance(self, value: float) -> float:
        found, self.others = self.misfit(value, self.others)
        self.trials.append((value, found))
        return found

    def end(self, start: float, step: float, limit: float, threshold: float) -> float:
        """Where the deviance passes ``threshold``; infinite when it doesn't before ``limit`` or in sensible time."""
        inside, d_inside = start, 0.0
        for _ in range(_MOST_TRIALS):
            outside = min(max(inside + step, min(start, limit)), max(start, limit))
            d_outside = self.deviance(outside)
            if d_outside > threshold:
                break
            if outside == limit:
                return math.copysign(math.inf, step)
            inside, d_inside, step = outside, d_outside, step * _GROWTH
        else:
            return math.copysign(math.inf, step)
        for _ in range(_ROOT_TRIALS):
            # The root of the deviance is nearly a straight line.
            low, high, wanted = math.sqrt(max(d_inside, 0.0)), math.sqrt(d_outside), math.sqrt(threshold)
            middle = inside + (outside - inside) * min(max((wanted - low) / (high - low), 0.05), 0.95)
            d_middle = self.deviance(middle)
            if abs(d_middle - threshold) < 0.02 * threshold:
                return middle
            if d_middle > threshold:
                outside, d_outside = middle, d_middle
            else:
                inside, d_inside = middle, d_middle
        return 0.5 * (inside + outside)


def profile(
    problem: Problem, number: int, standard_error: float, *, probability: float = 0.9, difference: float = 1e-3
) -> Profile:
    """The profile of parameter ``number`` around the minimum of ``problem``, in units of its point.

    Args:
        problem: the fit, at its minimum.
        number: index of the parameter.
        standard_error: of the parameter, with correlation of the residuals taken into account.
        probability: of the interval.
        difference: relative step of the derivatives.
    """
    residual, point, lower, upper = problem.residual, problem.point, problem.lower, problem.upper
    at_point = residual(point)
    least = float(at_point @ at_point)
    jacobian = problem.jacobian(difference)
    size = np.linalg.norm(jacobian, axis=0)
    size[size == 0.0] = 1.0
    scaled = jacobian / size
    white = float(np.linalg.pinv(scaled.T @ scaled, hermitian=True)[number, number]) / size[number] ** 2
    rest = np.arange(point.shape[0]) != number

    def misfit(value: float, others: Array) -> tuple[float, Array]:
        def at(trial: Array) -> Array:
            whole = point.copy()
            whole[rest], whole[number] = trial, value
            return residual(whole)

        if not np.any(rest):
            left = at(others)
            return (float(left @ left) - least) * white / standard_error**2, others
        answer = minimise(at, others, lower[rest], upper[rest], difference=difference, max_iterations=15)
        return (float(answer.residual @ answer.residual) - least) * white / standard_error**2, answer.point

    threshold = float(ndtri(0.5 + 0.5 * probability)) ** 2
    start = float(point[number])
    below, above = _Side(misfit, point[rest], []), _Side(misfit, point[rest], [])
    low = below.end(start, -_FIRST_STEP * standard_error, float(lower[number]), threshold)
    high = above.end(start, _FIRST_STEP * standard_error, float(upper[number]), threshold)
    trials = sorted([*below.trials, (start, 0.0), *above.trials])
    return Profile(np.array([value for value, _ in trials]), np.array([found for _, found in trials]), low, high)
