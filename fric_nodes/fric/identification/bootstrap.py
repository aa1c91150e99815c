"""Moving-block bootstrap: how far an estimate would move on other recordings of the same kind.

Blocks of consecutive rows, longer than their correlation, are drawn with replacement until there are as many rows as before
(Kuensch 1989); a block never reaches across the start of a stretch. For a least-squares fit a drawn recording is the
old one with every row counted as often as it was drawn, so that each replicate is the same fit with other weights: from the
estimate on, a few Gauss-Newton steps lead there.

The variance over the replicates is that of a Bartlett window as long as a block, and in a short series as much too small. The
replicates are moved away from the estimate by the root of what is missing
(:func:`fric.identification.statistics.window_loss`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..record import Array, Index
from .gauss_newton import minimise
from .problem import Problem
from .statistics import bartlett_lag, window_loss

__all__ = ["Bootstrap", "block_bootstrap", "block_length", "drawn_series", "drawn_weights"]


def block_length(score: Array) -> int:
    """Length of a block for rows with these ``score``, shape ``(n, n_parameters)``: well over their longest correlation."""
    lags = [bartlett_lag(column) for column in score.T]
    return int(min(max(2 * max(lags, default=0), 2), max(score.shape[0] // 4, 1)))


def _first_rows(n: int, length: int, starts: Index) -> Index:
    """Where a block of ``length`` can begin without reaching across the start of a stretch; anywhere if nowhere else."""
    stretch = np.zeros(n, dtype=np.int64)
    stretch[starts[(starts > 0) & (starts < n)]] = 1
    stretch = np.cumsum(stretch)
    first = np.arange(n - length + 1)
    whole = first[stretch[first] == stretch[first + length - 1]]
    return whole if whole.size else first


def drawn_weights(n: int, length: int, starts: Index, random: np.random.Generator) -> Array:
    """How often each of ``n`` rows is drawn, shape ``(n,)``; their sum is about ``n``."""
    first = _first_rows(n, length, starts)
    chosen = random.choice(first, size=max(round(n / length), 1))
    edges = np.zeros(n + 1)
    np.add.at(edges, chosen, 1.0)
    np.add.at(edges, chosen + length, -1.0)
    return np.asarray(np.cumsum(edges[:-1]), dtype=np.float64)


def drawn_series(series: Array, n: int, length: int, starts: Index, random: np.random.Generator) -> Array:
    """A series of ``n`` values, put together from blocks of ``series``."""
    length = min(length, series.shape[0])
    first = _first_rows(series.shape[0], length, starts)
    chosen = random.choice(first, size=-(-n // length))
    return np.asarray(series[(chosen[:, None] + np.arange(length)).ravel()[:n]], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Bootstrap:
    """The replicates and their spread.

    Attributes:
        estimates: shape ``(n_replicates, n_parameters)``; those whose fit did not converge are left out.
        length: of a block, in rows.
    """

    estimates: Array
    length: int

    @property
    def covariance(self) -> Array:
        """Of the estimates, shape ``(n_parameters, n_parameters)``."""
        return np.atleast_2d(np.cov(self.estimates, rowvar=False))

    def interval(self, estimate: Array, probability: float = 0.9) -> tuple[Array, Array]:
        """The basic bootstrap interval: the replicates' quantiles, mirrored at the estimate; shape ``(n_parameters,)`` each.

        Of n replicates in order, the next one lies below the k-th with probability k/(n + 1). With the few that there are,
        places between the first and the last of them would leave out more than they should (0.87 for 0.9 with sixty).
        """
        ends = [0.5 - 0.5 * probability, 0.5 + 0.5 * probability]
        low, high = np.quantile(self.estimates, ends, axis=0, method="weibull")
        return 2.0 * estimate - high, 2.0 * estimate - low


def _weighted(problem: Problem, weight: Array, point: Array) -> Array:
    return problem.weighted(point, weight)


def block_bootstrap(
    problem: Problem,
    *,
    n_replicates: int = 100,
    seed: int = 1,
    length: int | None = None,
    difference: float = 1e-3,
) -> Bootstrap:
    """Replicates of a least-squares fit around its minimum.

    Args:
        problem: the fit, at its minimum.
        n_replicates: how many.
        seed: of the draws.
        length: of a block in rows; None: from the correlation of the scores.
        difference: relative step of the derivatives.
    """
    at_point = problem.residual(problem.point)
    score = problem.jacobian(difference) * at_point[:, None]
    if length is None:
        length = block_length(score)
    n_used, n_free = int(np.sum(np.any(score != 0.0, axis=1))), problem.point.shape[0]
    wider = math.sqrt(window_loss(length - 1, n_used) * n_used / max(n_used - n_free, 1))
    random = np.random.default_rng(seed)
    found = []
    for _ in range(n_replicates):
        weight = drawn_weights(at_point.shape[0], length, problem.starts, random)
        answer = minimise(
            partial(_weighted, problem, weight),
            problem.point,
            problem.lower,
            problem.upper,
            difference=difference,
            max_iterations=15,
        )
        if answer.converged:
            found.append(problem.point + wider * (answer.point - problem.point))
    return Bootstrap(np.array(found).reshape(len(found), problem.point.shape[0]), length)
