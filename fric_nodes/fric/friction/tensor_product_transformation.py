"""Tensor-product (TP) transformation: a parameter-varying matrix S(p) as a convex combination of a few constant ones.

Equation: S(p) = sum over i_1 ... i_N of w_1,i_1(p_1) ... w_N,i_N(p_N) S_i_1...i_N, the weights of each parameter not below zero
and summing to one (Szell Eqs. 4, 5). What comes out is the polytopic form that controllers are designed on by linear matrix
inequalities; the S_i_1...i_N are its vertices.

Steps:
1. S is sampled on a grid over a box of any dimension (:func:`sample`), or given as samples that were measured.
2. Higher-order singular value decomposition: of the samples unfolded along each parameter, the singular vectors whose singular
   values count. The vector of ones is put into each basis first and taken out of the samples, so that the weights can sum to
   one (SN) without a further step, and with the fewest weights that can. Leaving out the singular values s_k of all unfoldings
   changes the samples by at most sqrt(sum s_k^2) in the Frobenius norm (:attr:`TensorProduct.error_bound`).
3. In each basis the grid's points get barycentric coordinates in a simplex (:mod:`fric.friction.enclosing_simplex`):
   SN: vertices among the points, some weights may be negative; SNNN: blown up to hold all points, so none is; CNO
   (close to normal): of least volume, so that each weight comes as close to one as it finds.
4. The vertices belong to the weights by the inverse of that coordinate change: at the grid nothing is lost but rounding.

Between grid points the weights are interpolated linearly, which keeps them convex; :func:`deviation` says what that costs.
Source: Szell, Sec. 2; Baranyi, IEEE Trans. Industrial Electronics 2004 (transformation and types of weights); De Lathauwer,
De Moor, Vandewalle 2000 (decomposition and its error bound).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from ..errors import InputError
from ..record import Array
from .enclosing_simplex import blown_up, far_simplex, least_simplex

__all__ = ["Deviation", "TensorProduct", "TensorProductError", "Weighting", "deviation", "sample", "transform"]

Weighting = Literal["SN", "SNNN", "CNO"]
"""Sum to one; sum to one and non-negative; the same and close to normal."""


class TensorProductError(InputError):
    """Samples or a grid that no tensor-product model can be made from."""


class Deviation(NamedTuple):
    """How far a model is off, over some points: the largest and the root mean square, of the Frobenius norm and relative."""

    largest: float
    rms: float
    largest_relative: float
    rms_relative: float


@dataclass(frozen=True, eq=False)
class TensorProduct:
    """A polytopic model of S(p) with N parameters, matrices of shape ``(rows, columns)``.

    Attributes:
        grids: of each parameter, strictly increasing, ``(n_k,)``.
        weights: of each parameter at its grid, ``(n_k, I_k)``; every row sums to one.
        vertices: the constant matrices, ``(I_1, ..., I_N, rows, columns)``.
        singular_values: of each unfolding, the ones taken out, in falling order, those left out included.
        error_bound: largest Frobenius norm by which leaving some out can have changed the samples.
    """

    grids: tuple[Array, ...]
    weights: tuple[Array, ...]
    vertices: Array
    singular_values: tuple[Array, ...]
    error_bound: float

    @property
    def n_vertices(self) -> int:
        """Number of vertex matrices, R."""
        return int(np.prod(self.vertices.shape[:-2]))

    def weights_at(self, p: Array) -> tuple[Array, ...]:
        """Weights of each parameter at the points ``p``, ``(n_points, N)``: arrays ``(n_points, I_k)``.

        Outside the box a parameter counts as the end of its grid.
        """
        columns = np.reshape(p, (-1, len(self.grids))).T
        return tuple(_interpolated(*held) for held in zip(columns, self.grids, self.weights, strict=True))

    def at(self, p: Array) -> Array:
        """S at the points ``p``, ``(n_points, N)``: ``(n_points, rows, columns)``."""
        weights = self.weights_at(p)
        combined = np.einsum("pi,i...->p...", weights[0], self.vertices)
        for each in weights[1:]:
            combined = np.einsum("pi,pi...->p...", each, combined)
        return np.asarray(combined)

    def at_grid(self) -> Array:
        """S at every grid point, ``(n_1, ..., n_N, rows, columns)``."""
        return _times_all(self.vertices, self.weights)


def _interpolated(p: Array, grid: Array, weights: Array) -> Array:
    if grid.shape[0] == 1:
        return np.repeat(weights, p.shape[0], axis=0)
    p = np.clip(p, grid[0], grid[-1])
    k = np.clip(np.searchsorted(grid, p, side="right") - 1, 0, grid.shape[0] - 2)
    share = ((p - grid[k]) / (grid[k + 1] - grid[k]))[:, None]
    return np.asarray((1.0 - share) * weights[k] + share * weights[k + 1])


def _times(tensor: Array, matrix: Array, mode: int) -> Array:
    """Product of ``tensor`` with ``matrix`` along ``mode``: its index becomes the matrix's first."""
    return np.moveaxis(np.tensordot(matrix, tensor, axes=(1, mode)), 0, mode)


def _times_all(tensor: Array, matrices: Sequence[Array]) -> Array:
    for mode, matrix in enumerate(matrices):
        tensor = _times(tensor, matrix, mode)
    return tensor


def sample(matrix: Callable[[Array], Array], grids: Sequence[Array]) -> Array:
    """``matrix(p)``, ``(rows, columns)``, for ``p`` of shape ``(N,)`` at every point of the grid.

    Returns:
        Samples of shape ``(n_1, ..., n_N, rows, columns)``.
    """
    points = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, len(grids))
    values = np.stack([np.atleast_2d(np.asarray(matrix(p), dtype=np.float64)) for p in points])
    return values.reshape(*(grid.shape[0] for grid in grids), *values.shape[1:])


def transform(
    samples: Array,
    grids: Sequence[Array],
    *,
    weighting: Weighting = "CNO",
    tolerance: float = 1e-13,
    limits: Sequence[int] | None = None,
    enclosed: Array | None = None,
) -> TensorProduct:
    """The tensor-product model of ``samples``, ``(n_1, ..., n_N, rows, columns)``, over ``grids``.

    Args:
        samples: S at the grid points.
        grids: of each parameter, strictly increasing, ``(n_k,)``.
        weighting: kind of weights, see the module.
        tolerance: singular values up to this share of the samples' Frobenius norm are left out.
        limits: largest number of weights of each parameter; None: as many as the tolerance asks for.
        enclosed: further matrices, ``(k, rows, columns)``, that the polytope must hold; with one parameter only.

    Raises:
        TensorProductError: shapes don't go together, a grid isn't increasing, or a sample isn't finite.
    """
    samples = np.asarray(samples, dtype=np.float64)
    grids = tuple(np.asarray(grid, dtype=np.float64) for grid in grids)
    _check(samples, grids, limits, enclosed)
    n_grid = samples.shape[0]
    if enclosed is not None:
        samples = np.concatenate([samples, enclosed])
    smallest = tolerance * float(np.linalg.norm(samples))
    weights, inverses, spectra = [], [], []
    left_out = 0.0
    for mode in range(len(grids)):
        vectors, values = _basis(samples, mode)
        kept = int(np.sum(values > smallest))
        if limits is not None:
            kept = min(kept, limits[mode] - 1)
        left_out += float(np.sum(values[kept:] ** 2))
        points = np.sqrt(samples.shape[mode]) * vectors[:, :kept]
        h = _simplex(points, weighting)
        weights.append(_weights(points, h, weighting))
        # The basis is orthogonal with rows of length sqrt(n), so its transpose over n leads back to the simplex.
        ones = np.ones((samples.shape[mode], 1))
        inverses.append(np.linalg.solve(h, np.hstack([points, ones]).T) / samples.shape[mode])
        spectra.append(values)
    vertices = _times_all(samples, inverses)
    if enclosed is not None:
        weights[0] = weights[0][:n_grid]
    return TensorProduct(grids, tuple(weights), vertices, tuple(spectra), float(np.sqrt(left_out)))


def _basis(samples: Array, mode: int) -> tuple[Array, Array]:
    """Left singular vectors and singular values of the unfolding along ``mode``, the vector of ones taken out."""
    unfolded = np.moveaxis(samples, mode, 0).reshape(samples.shape[mode], -1)
    vectors, values, _ = np.linalg.svd(unfolded - unfolded.mean(axis=0), full_matrices=False)
    return vectors, values


def _simplex(points: Array, weighting: Weighting) -> Array:
    if points.shape[1] == 0:
        return np.ones((1, 1))
    if weighting == "CNO":
        return least_simplex(points)
    far = far_simplex(points)
    return far if weighting == "SN" else blown_up(points, far)


def _weights(points: Array, h: Array, weighting: Weighting) -> Array:
    weights = np.hstack([points, np.ones((points.shape[0], 1))]) @ h
    # What is below zero in an enclosing simplex is rounding.
    return weights if weighting == "SN" else np.maximum(weights, 0.0)


def _check(samples: Array, grids: tuple[Array, ...], limits: Sequence[int] | None, enclosed: Array | None) -> None:
    where = "tensor product"
    expected = tuple(grid.shape[0] if grid.ndim == 1 else 0 for grid in grids)
    if not grids or samples.ndim != len(grids) + 2 or samples.shape[:-2] != expected:
        problem = f"samples of shape {samples.shape} over a grid of {expected} points"
        raise TensorProductError(where, problem, "give one matrix (rows, columns) for each grid point")
    for number, grid in enumerate(grids):
        if grid.size == 0 or not np.all(np.isfinite(grid)) or not np.all(np.diff(grid) > 0.0):
            raise TensorProductError(where, f"grid of parameter {number} doesn't increase", "sort it and drop what is double")
    if not np.all(np.isfinite(samples)):
        raise TensorProductError(where, "a sample is not finite", "leave out grid points where the matrix isn't defined")
    if limits is not None and (len(limits) != len(grids) or min(limits) < 1):
        raise TensorProductError(
            where, f"limits {tuple(limits)} for {len(grids)} parameters", "give one of at least 1 for each"
        )
    if enclosed is not None and (len(grids) != 1 or enclosed.shape[1:] != samples.shape[1:]):
        problem = f"{enclosed.shape} matrices to enclose beside {samples.shape[-2:]} of {len(grids)} parameters"
        raise TensorProductError(where, problem, "enclose matrices of the same shape, with one parameter")


def deviation(model: TensorProduct, matrix: Callable[[Array], Array], points: Array) -> Deviation:
    """How far ``model`` is from ``matrix`` at ``points``, ``(n_points, N)``; relative to the norm of the matrix there."""
    points = np.reshape(points, (-1, len(model.grids)))
    true = np.stack([np.atleast_2d(np.asarray(matrix(p), dtype=np.float64)) for p in points])
    off = np.linalg.norm(model.at(points) - true, axis=(1, 2))
    relative = off / np.linalg.norm(true, axis=(1, 2))
    return Deviation(
        float(np.max(off)), float(np.sqrt(np.mean(off**2))), float(np.max(relative)), float(np.sqrt(np.mean(relative**2)))
    )
