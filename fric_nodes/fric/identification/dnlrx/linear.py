"""The linear parameters of a DNLRX for given thresholds, and how sure they are (Amthor et al. 2008, Eq. 17).

Columns are those of :mod:`.cost`, backward differences, scaled; they are decomposed by QR with column pivoting, and of a
column of which nothing is left the coefficient stays zero and its name is reported: no ridge. The coefficients of the
differences are then turned into those of the history.

The covariance is that of thresholds and linear parameters together, since both were fitted: the force's derivative with respect
to a threshold, sum_j Theta_ji d delta_i(k-j)/d Delta_i, stands beside the regressors. It takes account of residuals that are
correlated in time (:mod:`.statistics`). What five or ten springs can't follow of a smooth curve is such a residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg

from ...friction.dnlrx import DnlrxModel
from ...friction.dnlrx_regression import deformations, from_coefficients
from ...record import Array, Index
from ..statistics import sandwich_covariance
from .cost import TOLERANCE, differences, to_taps
from .samples import Prepared, Samples

__all__ = ["Linear", "affordable", "covariance", "design", "least_squares", "names_of", "rows_of", "solve", "threshold_columns"]

_MOST_NUMBERS = 2e7  # of a matrix: 160 MB


@dataclass(frozen=True, eq=False)
class Linear:
    """Least squares for given thresholds.

    Attributes:
        model: with the thresholds and what was found.
        coefficients: of the columns of :func:`design`, shape ``(n_columns,)``.
        kept: the columns that could be told from the others, ascending.
        undetermined: names of those that could not, whose coefficients are zero.
    """

    model: DnlrxModel
    coefficients: Array
    kept: Index
    undetermined: tuple[str, ...]


def names_of(order: tuple[int, int, int]) -> tuple[str, ...]:
    """Names of the linear parameters in the order of Eq. 17, then of the thresholds."""
    n_springs, n_delta, n = order
    springs = range(1, n_springs + 1)
    return (
        *(f"g_{j}" for j in range(n + 1)),
        *(f"Theta_{j}_{i}" for j in range(n_delta + 1) for i in springs),
        "b",
        *(f"Delta_{i}" for i in springs),
    )


def rows_of(parts: Sequence[Samples], order: tuple[int, int, int], every: int = 1) -> list[Index]:
    """Every ``every``-th sample of each part from lambda on."""
    first = max(order[1:])
    return [np.arange(first, part.position.shape[0], every, dtype=np.int64) for part in parts]


def affordable(parts: Sequence[Samples], order: tuple[int, int, int]) -> list[Index]:
    """Every sample, or of a long recording so many that the matrix stays within memory."""
    n_springs, n_delta, n = order
    numbers = sum(part.position.shape[0] for part in parts) * (n + 2 + (n_delta + 2) * n_springs)
    return rows_of(parts, order, max(int(np.ceil(numbers / _MOST_NUMBERS)), 1))


def design(
    parts: Sequence[Samples], thresholds: Array, order: tuple[int, int, int], rows: Sequence[Index]
) -> tuple[Array, Array]:
    """Differences of displacement and deformations, ones; and the force: ``(n_rows, n_columns)`` and ``(n_rows,)``."""
    _, n_delta, n = order
    blocks, force = [], []
    for part, at in zip(parts, rows, strict=True):
        delta = deformations(part.position, thresholds, part.deformation(thresholds))
        bent = differences(delta, at, n_delta)
        moved = differences(part.position, at, n).T
        blocks.append(np.hstack([moved, *bent, np.ones((at.shape[0], 1))]))
        force.append(part.force[at])
    return np.concatenate(blocks), np.concatenate(force)


def solve(prepared: Prepared, thresholds: Array, order: tuple[int, int, int], rows: Sequence[Index]) -> Linear:
    """Least squares over ``rows`` of each part, with ``thresholds`` [x] of shape ``(M,)``."""
    columns, force = design(prepared.parts, thresholds, order, rows)
    coefficients, kept = least_squares(columns, force)
    taps = _transform(order) @ coefficients
    model = from_coefficients(taps, thresholds, order[2], order[1], prepared.sample_time)
    names = np.array(names_of(order)[: columns.shape[1]])
    lost = np.setdiff1d(np.arange(columns.shape[1]), kept)
    return Linear(model, coefficients, kept, tuple(names[lost].tolist()))


def least_squares(columns: Array, force: Array) -> tuple[Array, Index]:
    """Coefficients ``(n_columns,)``, zero for what can't be told from the rest, and the columns that can."""
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    upper: Any = np.linalg.qr(np.column_stack([columns / scale, force]), mode="r")
    decomposed: Any = linalg.qr(upper[:, :-1], mode="economic", pivoting=True)
    q, r, pivot = decomposed
    size = np.abs(np.diag(r))
    rank = int(np.sum(size > TOLERANCE * size[0])) if size.size else 0
    coefficients = np.zeros(columns.shape[1])
    solved = linalg.solve_triangular(r[:rank, :rank], (q.T @ upper[:, -1])[:rank])
    coefficients[pivot[:rank]] = solved
    return coefficients / scale, np.sort(pivot[:rank]).astype(np.int64)


def _transform(order: tuple[int, int, int]) -> Array:
    """From coefficients of differences to those of Eq. 17, square."""
    n_springs, n_delta, n = order
    return np.asarray(linalg.block_diag(to_taps(n), np.kron(to_taps(n_delta), np.eye(n_springs)), 1.0))


def threshold_columns(parts: Sequence[Samples], thresholds: Array, rows: Sequence[Index], filtered: Array) -> Array:
    """Derivative of the force with respect to each threshold [F/x], shape ``(n_rows, M)``.

    Args:
        parts: the stretches.
        thresholds: [x], shape ``(M,)``.
        rows: of each part.
        filtered: coefficients of the differences of the deformations, shape ``(n_delta + 1, M)``.
    """
    blocks = []
    for part, at in zip(parts, rows, strict=True):
        step = 1e-3 * thresholds
        up, down = (deformations(part.position, d, part.deformation(d)) for d in (thresholds + step, thresholds - step))
        slope = (up - down) / (2.0 * step)
        blocks.append(np.einsum("jrm,jm->rm", differences(slope, at, filtered.shape[0] - 1), filtered))
    return np.concatenate(blocks)


def covariance(prepared: Prepared, found: Linear) -> Array:
    """Of the linear parameters in the order of Eq. 17 and then the thresholds, square; zero for what was not determined.

    Rows four times as dense as the low-pass lets anything through hold all that there is to know.
    """
    order = found.model.order
    n_springs, n_delta, n = order
    every = max(int(1.0 / (4.0 * prepared.cutoff * prepared.sample_time)), 1)
    rows = rows_of(prepared.parts, order, every)
    columns, force = design(prepared.parts, found.model.thresholds, order, rows)
    residual = force - columns @ found.coefficients
    theta = found.coefficients[n + 1 : -1].reshape(n_delta + 1, n_springs)
    moving = threshold_columns(prepared.parts, found.model.thresholds, rows, theta)
    kept = np.append(found.kept, columns.shape[1] + np.arange(n_springs))
    starts = np.cumsum([0, *(at.shape[0] for at in rows[:-1])])
    jacobian = np.column_stack([columns, moving])[:, kept]
    whole = np.zeros((columns.shape[1] + n_springs,) * 2)
    whole[np.ix_(kept, kept)] = sandwich_covariance(jacobian, residual, np.ones(residual.shape[0]), starts)
    transform = linalg.block_diag(_transform(order), np.eye(n_springs))
    return np.asarray(transform @ whole @ transform.T)
