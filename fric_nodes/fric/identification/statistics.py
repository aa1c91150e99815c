"""Covariance of least-squares estimates whose residuals are correlated in time.

For residuals r_k with Jacobian rows J_k the estimate's covariance is the sandwich A^-1 S A^-1 with A = J'WJ and S the long-run
variance of the scores s_k = w_k J_k r_k. S is estimated from the autocovariances of the scores with Bartlett weights,
S = G_0 + sum_l (1 - l/(L+1)) (G_l + G_l'), which stays positive semi-definite (Newey and West 1987). The lag L grows with the
correlation that is there: the first-order rule of Andrews 1991, evaluated on the residuals, with 4 (n/100)^(2/9) as its floor.
In a short series that estimate is too small and is widened (Kiefer and Vogelsang 2005). Many white residuals of equal variance
give back the textbook covariance.

Where A isn't J'J (noise in J itself, see :mod:`fric.identification.methods.prediction_error`) or the scores are no products of
a residual and a row, both are handed in as they are.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.special import ndtri, stdtrit

from ..record import Array, Index

__all__ = [
    "bartlett_lag",
    "by_parts",
    "covariance_by_parts",
    "definite",
    "long_run",
    "parts_of",
    "sandwich",
    "sandwich_covariance",
    "window_loss",
]

_PARTS = 40  # of a series
_PART_OF_LAG = 3
_LEAST = 0.05  # share of the information that is left in any direction


def bartlett_lag(residual: Array) -> int:
    """Number of lags for Bartlett weights, from the first autocorrelation of ``residual``, shape ``(n,)``; zeros are gaps."""
    n = residual.shape[0]
    first, second = residual[:-1], residual[1:]
    both = (first != 0.0) & (second != 0.0)
    energy = float(np.sqrt(np.sum(first[both] ** 2) * np.sum(second[both] ** 2)))
    if n < 3 or energy == 0.0:
        return 0
    rho = min(max(float(first @ second) / energy, 0.0), 0.99)
    alpha = 4.0 * rho**2 / (1.0 - rho**2) ** 2
    lag = max(1.1447 * (alpha * n) ** (1.0 / 3.0), 4.0 * (n / 100.0) ** (2.0 / 9.0))
    return int(min(np.ceil(lag), n // 4))


def sandwich_covariance(jacobian: Array, residual: Array, weight: Array, starts: Index) -> Array:
    """Covariance of the estimate, shape ``(n_parameters, n_parameters)``.

    Args:
        jacobian: derivative of the residuals, shape ``(n, n_parameters)``.
        residual: shape ``(n,)``.
        weight: of each squared residual in the fit, shape ``(n,)``.
        starts: indices at which a new stretch of time begins; correlation isn't carried across them.
    """
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    scaled = jacobian / scale
    score = (weight * residual)[:, None] * scaled
    lag = bartlett_lag(np.sqrt(weight) * residual)
    return sandwich(scaled.T @ (weight[:, None] * scaled), score, lag, starts) / np.outer(scale, scale)


def sandwich(information: Array, score: Array, lag: int, starts: Index) -> Array:
    """Covariance of the estimate that makes the sum of ``score`` zero, shape ``(n_parameters, n_parameters)``.

    Args:
        information: derivative of that sum, positive definite, shape ``(n_parameters, n_parameters)``.
        score: shape ``(n, n_parameters)``.
        lag: up to which scores are correlated.
        starts: as in :func:`sandwich_covariance`.
    """
    n_parameters = score.shape[1]
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    size[size == 0.0] = 1.0
    bread = np.linalg.pinv(information / np.outer(size, size), rcond=1e-12, hermitian=True)
    # The degrees of freedom that the fit has used up.
    n = int(np.sum(np.any(score != 0.0, axis=1)))
    meat = long_run(score / size, lag, starts) * n / max(n - n_parameters, 1) * window_loss(lag, n)
    return np.asarray(bread @ meat @ bread / np.outer(size, size), dtype=np.float64)


def by_parts(information: Array, score: Array) -> Array:
    """Covariance of an estimate from what its parts say, ``(n_parameters, n_parameters)``.

    Where few events carry a parameter, each has pulled the estimate towards itself, and its own score is smaller than its
    noise. With H_b = A^-1/2 A_b A^-1/2 the share of part b in the information, its score is enlarged by (1 - H_b)^-1/2, which
    makes its mean square right for white residuals (CR2 of Bell and McCaffrey 2002). Where few parts count, the covariance
    itself is unsure; that is made up as they do, by Student's quantile over the normal one at 90 %, with
    3 (sum d^2)^2 / sum d^4 degrees of freedom, d being what each part changes.

    Args:
        information: derivative of the sum of scores of each part, ``(n_parts, n_parameters, n_parameters)``.
        score: their sum over each part, ``(n_parts, n_parameters)``.
    """
    whole = np.sum(information, axis=0)
    size = np.sqrt(np.maximum(np.diag(whole), 0.0))
    size[size == 0.0] = 1.0
    values, vectors = np.linalg.eigh(whole / np.outer(size, size))
    inverse = (vectors / np.sqrt(np.maximum(values, 1e-12 * values[-1]))).T / size
    left, directions = np.linalg.eigh(np.eye(size.shape[0]) - inverse @ information @ inverse.T)
    # A part that all of a parameter hangs on would have no noise of its own left.
    each = (score @ inverse.T)[:, None, :] @ directions / np.sqrt(np.maximum(left, _LEAST))[:, None, :]
    off = (each @ directions.transpose(0, 2, 1))[:, 0, :] @ inverse
    square = np.sum(off**2, axis=0)
    freedom = np.clip(3.0 * square**2 / np.maximum(np.sum(off**4, axis=0), 1e-300), 3.0, score.shape[0] - 1.0)
    wide = stdtrit(freedom, 0.95) / ndtri(0.95)
    return np.asarray((off.T @ off) * np.outer(wide, wide), dtype=np.float64)


def covariance_by_parts(jacobian: Array, residual: Array, weight: Array, starts: Index) -> Array:
    """As :func:`sandwich_covariance`, by :func:`by_parts`."""
    score = (weight * residual)[:, None] * jacobian
    first = parts_of(residual.shape[0], bartlett_lag(np.sqrt(weight) * residual), starts)
    bounds = zip(first, [*first[1:], residual.shape[0]], strict=True)
    information = np.array([jacobian[low:high].T @ (weight[low:high, None] * jacobian[low:high]) for low, high in bounds])
    return by_parts(information, np.add.reduceat(score, first, axis=0))


def parts_of(n: int, lag: int, starts: Index) -> Index:
    """First rows of parts of ``n`` rows: longer than ``lag``, none across ``starts``."""
    length = max(_PART_OF_LAG * lag, n // _PARTS, 1)
    bounds = [*starts.tolist(), n]
    return np.array(
        [k for first, last in pairwise(bounds) for k in range(first, max(last - length // 2, first + 1), length)],
        dtype=np.int64,
    )


def definite(corrected: Array, plain: Array) -> Array:
    """``corrected``, of which noise may leave less than a twentieth of ``plain`` in some direction, kept above that."""
    values, vectors = np.linalg.eigh(plain)
    values = np.maximum(values, 1e-12 * values[-1])
    root = vectors * np.sqrt(values)
    inverse = (vectors / np.sqrt(values)).T
    shares, directions = np.linalg.eigh(inverse @ corrected @ inverse.T)
    inner = (directions * np.clip(shares, _LEAST, None)) @ directions.T
    return np.asarray(root @ inner @ root.T, dtype=np.float64)


def window_loss(lag: int, n: int) -> float:
    """By how much the variance is to be widened for what the weights cut off and for its own uncertainty.

    With a window that is a share b of the series, 90 % of the estimates lie within 1.645 + 2.186 b + 0.314 b^2 - 0.343 b^3
    standard errors (Kiefer and Vogelsang 2005, table 1), not within 1.645.
    """
    b = min((lag + 1.0) / max(n, 1), 1.0)
    return float(((1.6449 + 2.1859 * b + 0.3142 * b**2 - 0.3427 * b**3) / 1.6449) ** 2)


def long_run(score: Array, lag: int, starts: Index) -> Array:
    """Variance of the sum of ``score``, (n, n_parameters), by autocovariances up to ``lag`` with Bartlett weights.

    statsmodels has this sum too (``S_nw_panel``, the same to the last bit) and takes 2.7 times as long for it (20000 x 6, 40
    lags). It has no rule for the lag of a series with gaps, and no widening for short ones; what is left is not worth a
    dependency of 65 MB.
    """
    stretch = np.zeros(score.shape[0], dtype=np.int64)
    stretch[starts[starts < score.shape[0]]] = 1
    stretch = np.cumsum(stretch)
    meat = score.T @ score
    for shift in range(1, lag + 1):
        together = stretch[shift:] == stretch[:-shift]
        product = (score[shift:] * together[:, None]).T @ score[:-shift]
        meat += (1.0 - shift / (lag + 1.0)) * (product + product.T)
    return np.asarray(meat, dtype=np.float64)
