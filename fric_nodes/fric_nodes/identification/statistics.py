"""Covariance of least-squares estimates whose residuals are correlated in time.

For residuals r_k with Jacobian rows J_k the estimate's covariance is the sandwich A^-1 S A^-1 with A = J'WJ and S the long-run
variance of the scores s_k = w_k J_k r_k. S is estimated from the autocovariances of the scores with Bartlett weights,
S = G_0 + sum_l (1 - l/(L+1)) (G_l + G_l'), which stays positive semi-definite (Newey and West 1987). The lag L grows with the
correlation that is there: the first-order rule of Andrews 1991, evaluated on the residuals, with 4 (n/100)^(2/9) as its floor.
White residuals of equal variance give back the textbook covariance.

Where A isn't J'J (noise in J itself, see :mod:`fric_nodes.identification.prediction_error`) or the scores are no products of a
residual and a row, both are handed in as they are.
"""

from __future__ import annotations

import numpy as np

from ..record import Array, Index

__all__ = ["bartlett_lag", "long_run", "sandwich", "sandwich_covariance"]


def bartlett_lag(residual: Array) -> int:
    """Number of lags for Bartlett weights, from the first autocorrelation of ``residual``, shape ``(n,)``."""
    n = residual.shape[0]
    energy = float(residual @ residual)
    if n < 3 or energy == 0.0:
        return 0
    rho = min(max(float(residual[1:] @ residual[:-1]) / energy, 0.0), 0.99)
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
    n, n_parameters = score.shape
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    size[size == 0.0] = 1.0
    bread = np.linalg.pinv(information / np.outer(size, size), rcond=1e-12, hermitian=True)
    # The degrees of freedom that the fit has used up.
    meat = long_run(score / size, lag, starts) * n / max(n - n_parameters, 1)
    return np.asarray(bread @ meat @ bread / np.outer(size, size), dtype=np.float64)


def long_run(score: Array, lag: int, starts: Index) -> Array:
    """Variance of the sum of ``score``, (n, n_parameters), by autocovariances up to ``lag`` with Bartlett weights."""
    stretch = np.zeros(score.shape[0], dtype=np.int64)
    stretch[starts[starts < score.shape[0]]] = 1
    stretch = np.cumsum(stretch)
    meat = score.T @ score
    for shift in range(1, lag + 1):
        together = stretch[shift:] == stretch[:-shift]
        product = (score[shift:] * together[:, None]).T @ score[:-shift]
        meat += (1.0 - shift / (lag + 1.0)) * (product + product.T)
    return np.asarray(meat, dtype=np.float64)
