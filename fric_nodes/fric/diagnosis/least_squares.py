"""Values of a model's parameters for which a residual is least: nonlinear least squares within bounds.

Each free parameter is measured in units of its ``scale``, so that steps of the solver are comparable between parameters. The
solver is the Gauss-Newton method of :mod:`fric.identification.gauss_newton`. A parameter stays between the bounds that it was
declared with and those that are given for this fit, and above zero where it is positive by its meaning.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..identification.gauss_newton import Solution, minimise
from ..model import Model
from ..record import Array

__all__ = ["FROM_NEAR", "INFLATION", "Bounds", "Fit", "fitted_values", "limits_of"]

Bounds = dict[str, tuple[float, float]]
"""Least and largest value of parameters by their names, in their units."""

INFLATION = 2.0
"""Numerical: of what all blocks leave together, the most that is left where a block or a half is left out."""
FROM_NEAR = 8
"""Numerical: iterations of a fit from where nearly everything fits."""
_TINY = 1e-9  # numerical: of its scale, the least that a positive parameter may be


@dataclass(frozen=True, eq=False)
class Fit:
    """A model that has been fitted to a track.

    Attributes:
        model: with its values.
        names: of the parameters that were free.
        solution: residual [F] and Jacobian at the optimum, in units of ``scale``.
        scale: of each free parameter.
    """

    model: Model
    names: tuple[str, ...]
    solution: Solution
    scale: Array

    @property
    def residual(self) -> Array:
        """The force that is missing [F], shape ``(n,)``."""
        return self.solution.residual

    @property
    def jacobian(self) -> Array:
        """Derivative of the residual, shape ``(n, n_free)``, per ``scale`` of each parameter."""
        return self.solution.jacobian


def fitted_values(
    residual: Callable[[Model], Array], model: Model, names: Sequence[str], scale: Array, bounds: Bounds, **how: Any
) -> tuple[Model, Solution]:
    """``model`` with the parameters ``names`` such that the ``residual`` is least, and the solution in units of ``scale``.

    Args:
        residual: of a model [F], shape ``(n,)``.
        model: to begin with.
        names: of the free parameters.
        scale: of each of them.
        bounds: of some of them, beside those that they were declared with.
        how: tolerances and limits of :func:`fric.identification.gauss_newton.minimise`.
    """
    index = np.array([model.names.index(name) for name in names], dtype=np.int64)
    lower, upper = limits_of(model, names, scale, bounds)
    values = model.values

    def at(point: Array) -> Model:
        trial = values.copy()
        trial[index] = point * scale
        return model.with_values(trial)

    answer = minimise(lambda point: residual(at(point)), values[index] / scale, lower, upper, **how)
    return at(answer.point), answer


def limits_of(model: Model, names: Sequence[str], scale: Array, bounds: Bounds) -> tuple[Array, Array]:
    """Least and largest value of the parameters ``names`` in units of ``scale``, shape ``(n_names,)`` each."""
    index = [model.names.index(name) for name in names]
    declared = [parameter.declaration for parameter in model.parameters()]
    lower, upper = np.empty(len(index)), np.empty(len(index))
    for k, name in enumerate(names):
        p = declared[index[k]]
        low, high = bounds.get(name, (-np.inf, np.inf))
        lower[k], upper[k] = max(p.lower, low, _TINY * scale[k] if p.positive else -np.inf), min(p.upper, high)
    return lower / scale, upper / scale
