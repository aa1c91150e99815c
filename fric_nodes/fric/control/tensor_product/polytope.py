"""The vertices of a quasi-LPV plant, and the weights that its gains are interpolated by.

S(p) = [A(p) B(p)] is sampled over the parameters' grids and decomposed as in
:mod:`fric.friction.tensor_product_transformation`. What comes out is checked: weights not below zero that sum
to one, and the samples given back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...friction.tensor_product_transformation import TensorProduct, Weighting, sample, transform
from ...record import Array
from .quasi_lpv import QuasiLpvPlant, TensorProductControlError

__all__ = ["Polytope", "polytope"]

_CONVEX = 1e-9  # numerical tolerance: weights are sums of a few numbers of magnitude one
_GIVEN_BACK = 1e-6  # numerical tolerance of the samples, of each element's largest magnitude
_SINGULAR = 1e-10  # numerical tolerance: singular values below this share are rounding


@dataclass(frozen=True, eq=False)
class Polytope:
    """A plant between its vertices, in its own units.

    Attributes:
        plant: it was made of.
        product: the tensor-product model of its scaled matrices.
        a: A at the vertices, ``(n_vertices, n_variants, n, n)``: a variant is a vertex of the parameters that aren't scheduled.
        b: B likewise, ``(n_vertices, n_variants, n)``.
        reconstruction: largest difference from the samples, over the largest magnitude of each element.
        convexity: largest violation of convexity of the weights.
    """

    plant: QuasiLpvPlant
    product: TensorProduct
    a: Array
    b: Array
    reconstruction: float
    convexity: float

    @property
    def n_vertices(self) -> int:
        """Number of vertices that have a gain of their own."""
        return int(self.a.shape[0])

    @property
    def weight_tables(self) -> tuple[tuple[str, Array, Array], ...]:
        """Name, grid ``(n_k,)`` and weights ``(n_k, I_k)`` of each scheduled parameter; vertices count the last fastest."""
        held = zip(self.plant.parameters, self.product.weights, strict=True)
        return tuple((each.name, each.grid, weights) for each, weights in held if each.scheduled)

    def vertex_name(self, number: int) -> str:
        """Vertex ``number`` in words."""
        sizes = [table[2].shape[1] for table in self.weight_tables]
        at = np.unravel_index(number, sizes)
        place = ", ".join(f"{table[0]} {k + 1}/{n}" for table, k, n in zip(self.weight_tables, at, sizes, strict=True))
        return f"{number + 1} ({place}; a_22 = {float(np.mean(self.a[number, :, 2, 2])):.3g} 1/s)"


def polytope(plant: QuasiLpvPlant, weighting: Weighting = "CNO") -> Polytope:
    """The polytope of ``plant``; ``weighting`` is CNO (close to normal) or SNNN (non-negative, summing to one).

    Raises:
        TensorProductControlError: the weights aren't convex or the samples aren't given back.
    """
    grids = [each.grid for each in plant.parameters]
    samples = sample(plant.matrix, grids)
    # Each element over its largest magnitude, so that none is lost beside a larger one.
    sizes = np.max(np.abs(samples), axis=tuple(range(len(grids))))
    sizes[sizes == 0.0] = 1.0
    product = transform(samples / sizes, grids, weighting=weighting, tolerance=_SINGULAR)
    convexity = max(max(float(np.max(np.abs(w.sum(axis=1) - 1.0))), float(-np.min(w))) for w in product.weights)
    reconstruction = float(np.max(np.abs(product.at_grid() - samples / sizes)))
    if convexity > _CONVEX or reconstruction > _GIVEN_BACK:
        problem = f"weights convex to {convexity:.2g}, samples given back to {reconstruction:.2g}"
        raise TensorProductControlError("tensor-product model", problem, "take SNNN weights, or narrower ranges")
    n, count = len(plant.states), len(grids)
    scheduled = [k for k, each in enumerate(plant.parameters) if each.scheduled]
    others = [k for k in range(count) if k not in scheduled]
    ordered = np.transpose(product.vertices * sizes, (*scheduled, *others, count, count + 1))
    n_vertices = int(np.prod([product.weights[k].shape[1] for k in scheduled]))
    vertices = ordered.reshape(n_vertices, -1, n, n + 1)
    return Polytope(plant, product, vertices[..., :n], vertices[..., n], reconstruction, convexity)
