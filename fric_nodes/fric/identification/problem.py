"""A fit as a least-squares problem: what bootstrap and profile likelihood go on from once its minimum is found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..record import Array, Index

__all__ = ["Problem"]


@dataclass(frozen=True, eq=False)
class Problem:
    """Residuals as a function of the free parameters, each in units of its own size.

    Attributes:
        names: of the free parameters.
        residual: residuals, shape ``(n,)``, of a point, shape ``(n_free,)``.
        point: where the sum of their squares is smallest.
        lower: bounds, shape ``(n_free,)``.
        upper: bounds, shape ``(n_free,)``.
        scale: value of each parameter where the point is one, shape ``(n_free,)``.
        starts: first residual of each stretch of time.
        weigh: the residuals when each square counts with a weight, from point and weights; None: times the weights' roots.
    """

    names: tuple[str, ...]
    residual: Callable[[Array], Array]
    point: Array
    lower: Array
    upper: Array
    scale: Array
    starts: Index
    weigh: Callable[[Array, Array], Array] | None = None

    def weighted(self, point: Array, weight: Array) -> Array:
        """The residuals at a point when the square of each counts with ``weight``, shape ``(n,)``."""
        return np.sqrt(weight) * self.residual(point) if self.weigh is None else self.weigh(point, weight)

    def jacobian(self, difference: float = 1e-3) -> Array:
        """Derivative of the residuals at the point by central differences, shape ``(n, n_free)``."""
        columns = []
        for k in range(self.point.shape[0]):
            ahead, behind = self.point.copy(), self.point.copy()
            ahead[k] = min(ahead[k] + difference, self.upper[k])
            behind[k] = max(behind[k] - difference, self.lower[k])
            columns.append((self.residual(ahead) - self.residual(behind)) / (ahead[k] - behind[k]))
        return np.array(columns).T
