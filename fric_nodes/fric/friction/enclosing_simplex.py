"""A simplex around a cloud of points: what makes weighting functions sum to one, be non-negative, and come close to one.

Points y_i in d dimensions have the barycentric coordinates w_i = [y_i, 1] H with respect to a simplex whose d + 1 vertices are
the rows of the inverse of H (without its last column). They sum to one for every simplex. They are non-negative exactly when
the simplex holds all points, and the smaller it is, the closer each of them comes to one at some point.

- One dimension: the interval from the smallest to the largest point, which is the convex hull itself.
- Else the simplex of least volume is sought. Its volume is 1/(d! |det H|). With one column of H given by the sum, the
  determinant is linear in each other column, and so are the conditions w >= 0: one column after the other is found by a linear
  programme, which can't make the simplex larger, until the volume falls no more. The starts are simplices of far points
  (successive projection from several first points), blown up about their centroids until they hold all points; the smallest
  result counts. It is one that no change of a facet (with another giving way) makes smaller, which needn't be the smallest of
  all.

Source: Chan, Chi, Huang, Ma, IEEE Trans. Signal Processing 2009 (cyclic linear programmes); Araujo et al. 2001 (successive
projection).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from ..record import Array

__all__ = ["blown_up", "far_simplex", "least_simplex"]

_ROUNDS = 60
_GAIN = 1e-6
_STARTS = 5
_HULL_DIMENSIONS = 5  # beyond, finding the hull costs more than the constraints that it saves


def _with_ones(points: Array) -> Array:
    return np.column_stack([points, np.ones(points.shape[0])])


def far_simplex(points: Array, first: int | None = None) -> Array:
    """H of the simplex with vertices among ``points``, ``(n, d)``: each next is the farthest from those before.

    Shape ``(d + 1, d + 1)``. The points must not lie in a hyperplane. In one dimension it holds all points. Without a
    ``first`` one it is the farthest from the mean.
    """
    dimensions = points.shape[1]
    if dimensions == 1:
        chosen = [int(np.argmax(points[:, 0])), int(np.argmin(points[:, 0]))]
    else:
        chosen = [int(np.argmax(np.sum((points - points.mean(axis=0)) ** 2, axis=1))) if first is None else first]
        left = points - points[chosen[0]]
        for _ in range(dimensions):
            chosen.append(int(np.argmax(np.sum(left**2, axis=1))))
            along = left[chosen[-1]] / np.linalg.norm(left[chosen[-1]])
            left = left - np.outer(left @ along, along)
    return np.asarray(np.linalg.inv(_with_ones(points[chosen])))


def blown_up(points: Array, h: Array) -> Array:
    """``h``, with its simplex blown up about the centroid just so far that it holds all ``points``."""
    outside = max(0.0, -float(np.min(_with_ones(points) @ h)))
    grown = h.copy()
    grown[-1] += outside
    return np.asarray(grown / (1.0 + h.shape[0] * outside))


def least_simplex(points: Array) -> Array:
    """H, ``(d + 1, d + 1)``, of the least simplex found around ``points``, ``(n, d)``; see the module."""
    dimensions = points.shape[1]
    if dimensions == 1:
        return far_simplex(points)
    corners = points[ConvexHull(points).vertices] if dimensions <= _HULL_DIMENSIONS else points
    firsts = np.unique(np.linspace(0, corners.shape[0] - 1, _STARTS).astype(int)).tolist()
    tries = [_shrunk(corners, blown_up(corners, far_simplex(corners, first))) for first in (None, *firsts)]
    # The linear programmes keep their conditions to 1e-7; here they are kept to rounding.
    return blown_up(points, max(tries, key=_size))


def _size(h: Array) -> float:
    """Goes as one over the volume."""
    return abs(float(np.linalg.det(h)))


def _shrunk(points: Array, h: Array) -> Array:
    """``h`` after all the changes of one column that make its simplex smaller."""
    rows = _with_ones(points)
    n = h.shape[1]
    for _ in range(_ROUNDS):
        before = _size(h)
        for shift in range(1, n):
            for column in range(n):
                h = _with_best_column(rows, h, column, (column + shift) % n)
        if _size(h) <= before * (1.0 + _GAIN):
            break
    return h


def _with_best_column(rows: Array, h: Array, column: int, other: int) -> Array:
    """``h`` with the ``column`` that makes |det H| greatest, the ``other`` one taking up what is left to the sum."""
    total = h[:, column] + h[:, other]
    # det H with column `other` = total - column is det with `other` replaced by `total`: linear in the column.
    replaced = h.copy()
    replaced[:, other] = total
    cofactors = np.empty(h.shape[0])
    for i in range(h.shape[0]):
        replaced[:, column] = 0.0
        replaced[i, column] = 1.0
        cofactors[i] = np.linalg.det(replaced)
    best = h
    for sign in (1.0, -1.0):
        found = linprog(
            -sign * cofactors / np.linalg.norm(cofactors),
            A_ub=np.vstack([-rows, rows]),
            b_ub=np.concatenate([np.zeros(rows.shape[0]), rows @ total]),
            bounds=(None, None),
            method="highs",
        )
        if not found.success:
            continue
        trial = h.copy()
        trial[:, column] = found.x
        trial[:, other] = total - found.x
        if _size(trial) > _size(best):
            best = trial
    return best
