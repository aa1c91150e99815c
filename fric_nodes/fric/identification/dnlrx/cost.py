"""The inner half of Eq. 18: for given thresholds, the smallest sum of squares over everything in which a DNLRX is linear.

    J(d) = min_Phi ||u - A(d) Phi||^2,   A(d) = [X | D(d)],

with the history of the displacement and a column of ones in X, and the deformations of the springs in D. Three things make it
fast, and none changes its value:

- **Decimation.** Only some rows k of the full-rate regression enter, every hundredth say. They hold the same deformations as
  without decimation.
- **Turning points.** Between two of them the displacement is monotone, and Eq. 11 over a monotone way is one step: clipping
  the sum of increments of one sign is clipping them one by one. Deformations are therefore led from turning point to turning
  point and to the samples that enter, not from sample to sample.
- **X doesn't depend on d.** It is orthonormalised once; u and D are projected off it, and what is left is a small problem.

Columns are backward differences, x(k), x(k) - x(k-1), ..., which span the same space as the history itself, since that is
nearly collinear at a high rate; they are scaled, and decomposed by modified Gram-Schmidt with column pivoting. A column of
which less than ``TOLERANCE`` is left is dropped: no ridge, no bias.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ...engine.kernel import kernel, loop
from ...record import Array, Index
from .samples import Samples

__all__ = ["TOLERANCE", "Cost", "differences", "to_taps"]

TOLERANCE = 1e-7


def differences(values: Array, rows: Index, order: int) -> Array:
    """Backward differences of ``values`` ``(n, ...)`` at ``rows``, of order 0 to ``order``: ``(order + 1, n_rows, ...)``."""
    delayed = [values[rows - j] for j in range(order + 1)]
    found = []
    while delayed:
        found.append(delayed[0])
        delayed = [near - far for near, far in pairwise(delayed)]
    return np.array(found)


def to_taps(order: int) -> Array:
    """Matrix that turns coefficients of the differences into those of the history, shape ``(order + 1, order + 1)``."""
    return np.array([[(-1.0) ** j * math.comb(d, j) for d in range(order + 1)] for j in range(order + 1)])


@kernel
def deform(x: Any, fresh: Any, thresholds: Any, delta: Any, path: Any) -> None:
    """Deformations at every entry of a chain; where ``fresh`` isn't 0 all springs slide in that direction."""
    for s in range(x.shape[0]):
        if fresh[s] != 0.0:
            for i in range(thresholds.shape[0]):
                delta[i] = fresh[s] * thresholds[i]
        else:
            dx = x[s] - x[s - 1]
            for i in range(thresholds.shape[0]):
                delta[i] = min(max(delta[i] + dx, -thresholds[i]), thresholds[i])
        for i in range(thresholds.shape[0]):
            path[s, i] = delta[i]


@kernel
def dot(a: Any, b: Any) -> float:
    """The product of two vectors in four sums side by side, which a processor adds at once."""
    n = a.shape[0]
    s_0, s_1, s_2, s_3 = 0.0, 0.0, 0.0, 0.0
    for k in range(0, n - 3, 4):
        s_0 += a[k] * b[k]
        s_1 += a[k + 1] * b[k + 1]
        s_2 += a[k + 2] * b[k + 2]
        s_3 += a[k + 3] * b[k + 3]
    for k in range(n - n % 4, n):
        s_0 += a[k] * b[k]
    return (s_0 + s_1) + (s_2 + s_3)


@kernel
def take_out(rows: Any, direction: Any) -> None:
    """Take the unit vector ``direction`` out of each of ``rows``."""
    for c in range(rows.shape[0]):
        along = dot(rows[c], direction)
        for k in range(direction.shape[0]):
            rows[c, k] -= along * direction[k]


@kernel
def assemble(path: Any, pick: Any, left: Any, matrix: Any) -> None:
    """Differences of the deformations, then the force, one row for each: ``matrix`` of shape ``(n_columns + 1, n_rows)``."""
    n_rows, n_taps = pick.shape
    n_springs = path.shape[1]
    for j in range(n_taps):
        for r in range(n_rows):
            for i in range(n_springs):
                matrix[j * n_springs + i, r] = path[pick[r, j], i]
    for d in range(1, n_taps):
        for j in range(n_taps - 1, d - 1, -1):
            for i in range(n_springs):
                for r in range(n_rows):
                    matrix[j * n_springs + i, r] = matrix[(j - 1) * n_springs + i, r] - matrix[j * n_springs + i, r]
    for r in range(n_rows):
        matrix[n_taps * n_springs, r] = left[r]


@loop
def _costs(
    trials: Any, x: Any, fresh: Any, pick: Any, left: Any, basis: Any, tolerance: float,
    delta: Any, path: Any, matrix: Any, original: Any, direction: Any, out: Any,
) -> None:  # fmt: skip
    """The cost of each row of ``trials``, ``(n_trials, M)``."""
    n_columns = matrix.shape[0] - 1
    for t in range(trials.shape[0]):
        deform(x, fresh, trials[t], delta, path)
        assemble(path, pick, left, matrix)
        for c in range(n_columns):
            original[c] = dot(matrix[c], matrix[c])
        for b in range(basis.shape[0]):
            take_out(matrix, basis[b])
        for _ in range(n_columns):
            best, most, size = -1, tolerance * tolerance, 0.0
            for c in range(n_columns):
                if original[c] > 0.0:
                    square = dot(matrix[c], matrix[c])
                    if square > most * original[c]:
                        best, most, size = c, square / original[c], math.sqrt(square)
            if best < 0:
                break
            for r in range(matrix.shape[1]):
                direction[r] = matrix[best, r] / size
            original[best] = 0.0
            for c in range(n_columns + 1):
                if c == n_columns or original[c] > 0.0:
                    take_out(matrix[c : c + 1], direction)
        out[t] = dot(matrix[n_columns], matrix[n_columns])


class Cost:
    """J(d) over ``n_rows`` rows of a regression, in percent of the force's spread over them (Eq. 19).

    Args:
        parts: what to fit.
        order: ``(M, n_delta, n)``.
        rows: samples of each part that enter, none before lambda.
    """

    def __init__(self, parts: Sequence[Samples], order: tuple[int, int, int], rows: Sequence[Index]) -> None:
        self.order = order
        n_springs, n_delta, n = order
        chain, fresh, pick, fixed, force = [], [], [], [], []
        length = 0
        for part, at in zip(parts, rows, strict=True):
            kept = _chain(part.position, at, n_delta)
            chain.append(part.position[kept])
            fresh.append(np.append(part.start.direction, np.zeros(kept.shape[0] - 1)))
            pick.append(length + np.searchsorted(kept, at[:, None] - np.arange(n_delta + 1)))
            length += kept.shape[0]
            fixed.append(np.vstack([differences(part.position, at, n), np.ones(at.shape[0])]).T)
            force.append(part.force[at])
        u = np.concatenate(force)
        self.n_rows = u.shape[0]
        self._total = float(np.sum((u - np.mean(u)) ** 2))
        basis = _orthonormal(np.concatenate(fixed))
        self._basis = np.ascontiguousarray(basis.T)
        self._left = u - basis @ (basis.T @ u)
        self._chain, self._fresh, self._pick = np.concatenate(chain), np.concatenate(fresh), np.concatenate(pick)
        n_columns = n_springs * (n_delta + 1) + 1
        self._work = (
            np.empty(n_springs),
            np.empty((length, n_springs)),
            np.empty((n_columns, self.n_rows)),
            np.empty(n_columns),
            np.empty(self.n_rows),
        )
        self.evaluations = 0

    def many(self, thresholds: Array) -> Array:
        """NOE [%] for each row of ``thresholds`` ``(n_trials, M)`` [x], shape ``(n_trials,)``."""
        out = np.empty(thresholds.shape[0])
        _costs(
            np.ascontiguousarray(thresholds), self._chain, self._fresh, self._pick, self._left, self._basis, TOLERANCE,
            *self._work, out,
        )  # fmt: skip
        self.evaluations += thresholds.shape[0]
        return 100.0 * out / self._total

    def __call__(self, thresholds: Array) -> float:
        """NOE [%] for ``thresholds`` ``(M,)`` [x]."""
        return float(self.many(thresholds[None, :])[0])


def _chain(position: Array, rows: Index, n_delta: int) -> Index:
    """The first sample, the turning points, and every sample whose deformation enters at ``rows``, ascending."""
    step = np.diff(position)
    turns = 1 + np.flatnonzero(step[1:] * step[:-1] <= 0.0)
    wanted = (rows[:, None] - np.arange(n_delta + 1)).ravel()
    return np.unique(np.concatenate([[0], turns, wanted]))


def _orthonormal(columns: Array) -> Array:
    """An orthonormal basis of ``columns`` ``(n_rows, n_columns)``, without what is linearly dependent."""
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    left, singular, _ = np.linalg.svd(columns / scale, full_matrices=False)
    return np.asarray(left[:, singular > TOLERANCE * singular[0]])
