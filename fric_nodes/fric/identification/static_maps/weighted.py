"""Linear least squares of values with errors of their own, and a scatter beside them.

Values y_k with standard errors s_k come from experiments that also differ from one another (temperature, lubricant,
mounting), which no s_k shows: Var y_k = s_k^2 + tau^2, with tau such that the weighted sum of squares equals its degrees of
freedom, 0 where it is below them already (Paule and Mandel 1982).

With few experiments an interval hangs on how well its own variance is known. Where a scatter had to be found from n - p
degrees of freedom, its quantile is that of Student's t with as many; where the values agree as well as their errors say, what
is known of the variance are these errors, and the quantile is that of *their* freedom. Half a dozen degrees too few would
make an interval from three experiments four times too wide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.optimize import brentq

from ...record import Array

__all__ = ["Weighted", "as_normal", "weighted"]


@dataclass(frozen=True, eq=False)
class Weighted:
    """A fit.

    Attributes:
        values: shape ``(n_parameters,)``.
        covariance: shape ``(n_parameters, n_parameters)``.
        freedom: degrees of freedom of the quantile to take.
        scatter: tau.
        misfit: root of the reduced sum of squares in the errors alone; near 1 or below when there is no scatter.
    """

    values: Array
    covariance: Array
    freedom: int
    scatter: float
    misfit: float


def weighted(columns: Array, y: Array, error: Array, known: int) -> Weighted:
    """Fit ``y``, ``(n,)``, with errors ``error``, by ``columns``, ``(n, n_parameters)``.

    Args:
        columns: of rank ``n_parameters``.
        y: the values.
        error: their standard errors.
        known: degrees of freedom from which the errors were found.
    """
    scale = np.linalg.norm(columns, axis=0)
    freedom = y.shape[0] - columns.shape[1]
    error = np.maximum(error, 1e-12 * float(np.max(np.abs(y))) + 1e-300)

    def solve(tau: float) -> tuple[Array, Array, float]:
        root = 1.0 / np.sqrt(error**2 + tau**2)
        rows = root[:, None] * (columns / scale)
        values = np.linalg.lstsq(rows, root * y, rcond=None)[0]
        return values, rows, float(np.sum((root * y - rows @ values) ** 2))

    tau = 0.0
    alone = solve(0.0)[2]
    if freedom >= 1 and alone > freedom:
        high = 10.0 * float(np.ptp(y)) + float(np.max(error))
        tau = float(brentq(lambda t: solve(t)[2] - freedom, 0.0, high))
    values, rows, _ = solve(tau)
    covariance = np.linalg.pinv(rows.T @ rows, hermitian=True) / np.outer(scale, scale)
    used = max(freedom if tau > 0.0 else known, 1)
    return Weighted(values / scale, np.asarray(covariance), used, tau, float(np.sqrt(alone / max(freedom, 1))))


def as_normal(freedom: int) -> float:
    """What a standard error is to be multiplied by so that the normal distribution's interval of 90 % is Student's.

    A model's standard errors come without their degrees of freedom.
    """
    return float(stats.t.ppf(0.95, max(freedom, 1)) / stats.norm.ppf(0.95))
