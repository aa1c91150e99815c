"""Estimates of one quantity from several data sets, put together: the random-effects model of meta-analysis.

Estimate y_i with standard error s_i:  y_i = x_i' b + d_i + e_i,  e_i ~ N(0, s_i^2),  d_i ~ N(0, tau^2): what the data sets have
in common is x_i' b, and tau is how much the quantity itself differs from one to the next. With x_i = 1 that is a mean, with
x_i = (1, t_i) a line in time.

tau^2 by the method of moments. With W = diag(1/s_i^2) and P = W - W X (X'WX)^-1 X'W, Q = y'Py has the expectation
k - p + tau^2 tr P (DerSimonian and Laird 1986, Controlled Clinical Trials 7, 177-188; with covariates Thompson and Sharp 1999,
Statistics in Medicine 18, 2693-2708). Then b by least squares with the weights 1/(s_i^2 + tau^2), and its covariance
q (X'WX)^-1, q being the weighted mean square of the residuals, with Student's t of k - p degrees of freedom (Hartung and Knapp
2001, Statistics in Medicine 20, 3875-3889; Knapp and Hartung 2003, ibid. 22, 2693-2710). The intervals hold for independent
data sets and don't count what is wrong in all of them alike.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from ..record import Array

__all__ = ["Common", "random_effects"]


class Common(NamedTuple):
    """What several estimates have in common.

    Attributes:
        values: coefficients b, shape ``(p,)``; NaN with fewer estimates than coefficients.
        errors: their standard errors, shape ``(p,)``; infinite with no more estimates than coefficients.
        half: half the width of their 95 % intervals, shape ``(p,)``; as ``errors``.
        scatter: standard deviation tau of what the data sets don't have in common, in the unit of the estimates.
    """

    values: Array
    errors: Array
    half: Array
    scatter: float


def _fitted(values: Array, variance: Array, columns: Array) -> tuple[Array, Array, float, float]:
    """Coefficients, (X'WX)^-1, Q and tr P for these variances, see above."""
    weight = 1.0 / variance
    weighted = columns * weight[:, None]
    inverse = np.asarray(np.linalg.inv(columns.T @ weighted), dtype=np.float64)
    found = inverse @ (weighted.T @ values)
    trace = float(np.sum(weight) - np.sum(inverse * (weighted.T @ weighted)))
    return found, inverse, float(weight @ (values - columns @ found) ** 2), trace


def random_effects(values: Array, errors: Array, columns: Array | None = None) -> Common:
    """Put estimates together.

    Args:
        values: estimates, shape ``(k,)``.
        errors: their standard errors, positive, shape ``(k,)``.
        columns: X, of full rank where ``k`` is ``p`` or more, shape ``(k, p)``; None for a mean.
    """
    k = values.shape[0]
    x = np.ones((k, 1)) if columns is None else columns
    p = x.shape[1]
    unknown = np.full(p, np.inf)
    if k < p:
        return Common(np.full(p, np.nan), unknown, unknown, math.nan)
    # In the unit of a typical error, so that no square vanishes or overflows.
    unit = float(np.median(errors))
    y, variance = values / unit, (errors / unit) ** 2
    found, inverse, square, trace = _fitted(y, variance, x)
    if k == p:
        return Common(found * unit, unknown, unknown, math.nan)
    scatter = max((square - (k - p)) / max(trace, 1e-300), 0.0)
    found, inverse, square, _ = _fitted(y, variance + scatter, x)
    error = unit * np.sqrt(square / (k - p) * np.diag(inverse))
    return Common(found * unit, error, float(stdtrit(k - p, 0.975)) * error, unit * math.sqrt(scatter))
