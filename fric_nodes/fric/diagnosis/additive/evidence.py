"""Evidence of a linear model whose columns come in groups, each with a Gaussian prior of a size that the data set.

Equation:

    y = X_0 b + sum over g of X_g w_g + e,     w_g ~ N(0, s_g^2 I),   b unrestrained,   e ~ N(0, s_e^2 I)

Data and columns enter without what the base X_0 explains of them, which is the same as an unrestrained b. The logarithm of the
evidence p(y | s_1 ... s_e) is maximal over the sizes (type-II maximum likelihood, MacKay 1992; Tipping 2001 for groups of one).
The columns of a group are scaled together to a root mean square of one, so that s_g is the size of the function in units of y.
All that is needed are the sums of products X'X, X'y and y'y.

Rows that follow each other too closely are not independent. The evidence is therefore multiplied by the number of independent
rows over the number of rows, from the autocorrelation of the residuals (Bartlett's sum).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.linalg.lapack import dpotri

from ...record import Array, Index

__all__ = ["Grouped", "Weighed"]

_SMALLEST, _LARGEST = -9.0, 3.0  # natural logarithms of sizes over the data's own size: beyond, a function is nothing or all
_SMALL = -4.0  # the same, of a function with which a search begins
_ITERATIONS = 60
_RIDGE = 1e-10  # numerical: relative to the diagonal
_DAMPING = 1e-3  # numerical, of the curvature, where the first step begins
_FARTHEST = 2.0  # numerical: of a step, in natural logarithms of a size
_ENOUGH = 0.02  # numerical [nats]: a step that promises less isn't made
_ALIKE = 1e-6  # numerical: of a function's mean square, so that columns that nearly repeat each other don't matter


@dataclass(frozen=True, eq=False)
class Weighed:
    """A model with the sizes at which its evidence is largest.

    Attributes:
        groups: names of its groups.
        log_evidence: of all rows, not yet corrected for their dependence [nats].
        sizes: of the groups, natural logarithms over the data's size, in the order of ``groups``.
        noise: standard deviation of what nothing explains, in the data's unit.
        weights: posterior mean of all coefficients, in units of the scaled columns.
    """

    groups: tuple[str, ...]
    log_evidence: float
    sizes: tuple[float, ...]
    noise: float
    weights: Array


class Grouped:
    """Data, a base that is always there, and groups of columns that may be.

    Args:
        target: what is to be explained, shape ``(n,)``.
        base: columns without a group, shape ``(n, n_base)``.
        groups: columns by the name of their group, shape ``(n, k)`` each.
    """

    def __init__(self, target: Array, base: Array, groups: Mapping[str, Array]) -> None:
        scaled = base / np.maximum(np.linalg.norm(base, axis=0), 1e-300)
        left, values, _ = np.linalg.svd(scaled, full_matrices=False)
        self._basis: Array = left[:, values > _RIDGE]
        self.n = int(target.shape[0]) - self._basis.shape[1]
        self.names = tuple(groups)
        self._spans: dict[str, slice] = {}
        self._sizes: dict[str, float] = {}
        parts, first = [np.zeros((target.shape[0], 0))], 0
        for name, columns in groups.items():
            size = self._sizes[name] = float(np.sqrt(np.mean(columns**2)))
            parts.append(self._beside(columns) / max(size, 1e-300))
            self._spans[name] = slice(first, first + columns.shape[1])
            first += columns.shape[1]
        self.x = np.concatenate(parts, axis=1)
        self._gram = self.x.T @ self.x
        self._factors: dict[str, Array] = {}
        self._explain(target)

    def of(self, target: Array) -> Grouped:
        """The same base and groups for another ``target``, shape ``(n,)``."""
        other = copy(self)
        other._explain(target)
        return other

    def _explain(self, target: Array) -> None:
        beside = self._beside(target)
        self.size = float(np.sqrt(np.mean(beside**2))) or 1.0
        self.y = beside / self.size
        self._load = self.x.T @ self.y
        self._power = float(self.y @ self.y)

    def _beside(self, values: Array) -> Array:
        """``values`` without what the base explains of them."""
        return np.asarray(values - self._basis @ (self._basis.T @ values), dtype=np.float64)

    def explained_by_all(self) -> float:
        """Share of the target's energy beside the base that all groups explain at the sizes of largest evidence [1]."""
        left = self.y - self.x @ self.weighed(self.names).weights
        return 1.0 - float(left @ left) / max(self._power, 1e-300)

    def own(self, name: str) -> float:
        """Share of the energy of a group's columns that the base doesn't explain [1]."""
        return float(np.mean(self.x[:, self._spans[name]] ** 2))

    def explained(self, name: str, target: Array) -> float:
        """Share of the energy of ``target`` that the columns of a group explain, beside the base [1]."""
        beside = self._beside(target)
        solved = np.linalg.lstsq(self.x[:, self._spans[name]], beside, rcond=1e-8)[0]
        left = beside - self.x[:, self._spans[name]] @ solved
        return 1.0 - float(left @ left) / max(float(beside @ beside), 1e-300)

    def likeness(self, one: str, other: str) -> float:
        """Share of the energy of the columns of ``one`` that those of ``other`` explain, beside the base [1]."""
        mine, theirs = self._spans[one], self._spans[other]
        if other not in self._factors:
            gram = self._gram[theirs, theirs]
            gram = gram + _ALIKE * float(np.mean(np.diag(gram))) * np.eye(gram.shape[0])
            self._factors[other] = cholesky(gram, lower=True)
        explained = solve_triangular(self._factors[other], self._gram[theirs, mine], lower=True)
        return float(np.sum(explained**2)) / max(float(np.trace(self._gram[mine, mine])), 1e-300)

    def weighed(
        self, groups: Sequence[str], start: Mapping[str, float] | None = None, noise: float = -1.0, rounds: int = _ITERATIONS
    ) -> Weighed:
        """The model of the base and ``groups`` at the sizes of largest evidence.

        Args:
            groups: which of the groups are there.
            start: logarithms of sizes to begin with, by group.
            noise: likewise of the noise.
            rounds: iterations at most.
        """
        index, owner = self._selected(groups)
        gram, load = self._gram[np.ix_(index, index)], self._load[index]
        start = start or {}
        # From nothing at all no slope leads away.
        begin = np.array([*(max(start.get(name, -1.0), _SMALL) for name in groups), noise])

        z, value = self._largest(begin, gram, load, owner, rounds)
        weights = np.zeros(self.x.shape[1])
        weights[index] = self._posterior(z, gram, load, owner)
        return Weighed(tuple(groups), float(-value), tuple(z[:-1].tolist()), float(np.exp(z[-1])) * self.size, weights)

    def part(self, name: str, weighed: Weighed) -> Array:
        """What the group ``name`` explains, posterior mean in the data's unit, shape ``(n,)``."""
        span = self._spans[name]
        return self.size * (self.x[:, span] @ weighed.weights[span])

    def amounts(self, name: str, weighed: Weighed) -> Array:
        """Coefficients of the columns of a group as they were given, in the data's unit, shape ``(k,)``."""
        return np.asarray(self.size * weighed.weights[self._spans[name]] / self._sizes[name], dtype=np.float64)

    def residual(self, weighed: Weighed) -> Array:
        """What is left, in the data's unit, shape ``(n,)``."""
        return self.size * (self.y - self.x @ weighed.weights)

    def _selected(self, groups: Sequence[str]) -> tuple[Index, Index]:
        """Columns in use, and the number of the group of each."""
        index, owner = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        for k, name in enumerate(groups):
            span = self._spans[name]
            index.append(np.arange(span.start, span.stop))
            owner.append(np.full(span.stop - span.start, k))
        return np.concatenate(index), np.concatenate(owner)

    def _variance(self, z: Array, owner: Index) -> Array:
        return np.asarray(np.exp(2.0 * z[:-1])[owner], dtype=np.float64)

    def _posterior(self, z: Array, gram: Array, load: Array, owner: Index) -> Array:
        noise = np.exp(2.0 * z[-1])
        precision = gram / noise + np.diag(1.0 / self._variance(z, owner) + _RIDGE * np.diag(gram) / noise)
        return np.asarray(cho_solve((cholesky(precision, lower=True), True), load / noise))

    def _largest(self, begin: Array, gram: Array, load: Array, owner: Index, rounds: int) -> tuple[Array, float]:
        """Logarithms of the sizes and of the noise at which the evidence is largest, and minus its logarithm there.

        Fisher scoring, damped until a step doesn't lead uphill: the expected curvature is at hand once the posterior is, and a
        dozen steps take the place of some fifty that know the gradient alone.
        """
        lowest = np.append(np.full(begin.shape[0] - 1, _SMALLEST), _SMALLEST - 3.0)
        z = np.clip(begin, lowest, _LARGEST)
        value, gradient, curvature = self._negative(z, gram, load, owner)
        damping = _DAMPING
        for _ in range(rounds):
            free = ~(((z <= lowest) & (gradient > 0.0)) | ((z >= _LARGEST) & (gradient < 0.0)))
            held = curvature[np.ix_(free, free)]
            step = np.zeros_like(z)
            step[free] = np.linalg.solve(held + np.diag(damping * np.diag(held) + _RIDGE), -gradient[free])
            # Of a function that is nearly nothing the curvature is, too.
            step = np.clip(z + np.clip(step, -_FARTHEST, _FARTHEST), lowest, _LARGEST) - z
            promised = -float(gradient @ step)
            if promised < _ENOUGH:
                break
            trial = self._negative(z + step, gram, load, owner)
            if trial[0] <= value:
                z, (value, gradient, curvature) = z + step, trial
                damping *= 0.1
            elif damping > 1.0 / _DAMPING:
                break
            else:
                damping = max(10.0 * damping, _DAMPING)
        return z, value

    def _negative(self, z: Array, gram: Array, load: Array, owner: Index) -> tuple[float, Array, Array]:
        """Minus the logarithm of the evidence, its gradient by the logarithms of the sizes, and its expected curvature."""
        noise, variance = float(np.exp(2.0 * z[-1])), self._variance(z, owner)
        precision = gram / noise + np.diag(1.0 / variance + _RIDGE * np.diag(gram) / noise)
        lower = cholesky(precision, lower=True)
        mean = cho_solve((lower, True), load / noise)
        covariance, _ = dpotri(lower, lower=True)
        log_det = 2.0 * float(np.sum(np.log(np.diag(lower)))) + float(np.sum(np.log(variance)))
        left = self._power - 2.0 * float(mean @ load) + float(mean @ gram @ mean)
        misfit = left / noise + float(np.sum(mean**2 / variance))
        value = 0.5 * (self.n * np.log(2.0 * np.pi * noise) + misfit + log_det)
        # How far the data determine each combination of coefficients; on the diagonal MacKay's gamma.
        scaled = np.tril(covariance) / np.sqrt(variance)[:, None] / np.sqrt(variance)
        determined = np.eye(variance.shape[0]) - scaled - np.tril(scaled, -1).T
        single, squares = np.diag(determined), determined**2
        member = (owner[:, None] == np.arange(z.shape[0] - 1)).astype(np.float64)
        gradient = np.append(member.T @ (single - mean**2 / variance), self.n - float(np.sum(single)) - left / noise)
        curvature = np.empty((z.shape[0], z.shape[0]))
        curvature[:-1, :-1] = member.T @ squares @ member
        curvature[-1, :-1] = curvature[:-1, -1] = member.T @ (single - np.sum(squares, axis=1))
        curvature[-1, -1] = self.n - 2.0 * float(np.sum(single)) + float(np.sum(squares))
        return value, gradient, 2.0 * curvature
