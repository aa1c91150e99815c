"""Sensitivity of a method's prediction to each parameter: the Jacobian on which statements about identifiability rest.

Column k is the derivative of the prediction (the force along the motion, or the position at the next sample) to parameter k,
by central differences of the compiled model. What a recording of that motion is worth follows from it: with A = J'J and S the
long-run variance of the scores J' e under the noise e of the rows, the estimate has the covariance A^-1 S A^-1. What a method
misses of the truth itself (the filters, at a reversal between two samples) is an error d of the rows that is no noise: it
shifts the estimate by A^-1 J' d. A, S and J' d of several recordings add up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..model import Model
from ..record import Array, Index, Mask, Record
from ..simulation import substeps
from .equations import equations
from .free_parameters import FreeParameters
from .innovations import SETTLING, innovations, runs_of
from .methods.inverse_dynamics import predicted, rows_of_fit
from .result import IdentificationError, Options
from .scoring import driving_force
from .statistics import bartlett_lag, long_run

__all__ = [
    "VIEWS",
    "ForceView",
    "Information",
    "StepView",
    "View",
    "information",
    "of_recordings",
    "sensitivities",
    "typical_sizes",
]

_DIFFERENCE = 1e-3  # of a parameter's size: wide enough for the kinks of friction
_INDICES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # tracking indices to choose from
_STEP_OF_RATE = 0.15  # from one sample to the next a coarser step than a simulation's will do
_SINGULAR = 1e-13  # least eigenvalue of a matrix whose diagonal is one
_BLIND = 1e-9  # of the largest: a direction of which nothing is known


@dataclass(frozen=True, eq=False)
class Information:
    """Information of recordings on the parameters, each in units of its size; see the module.

    Attributes:
        bread: A, shape ``(n_free, n_free)``.
        meat: S, shape ``(n_free, n_free)``.
        drift: J' d, shape ``(n_free,)``.
        size: of each parameter, shape ``(n_free,)``.
    """

    bread: Array
    meat: Array
    drift: Array
    size: Array

    def __add__(self, other: Information) -> Information:
        return Information(self.bread + other.bread, self.meat + other.meat, self.drift + other.drift, self.size)

    @property
    def alone(self) -> Array:
        """Standard error of each parameter over its size if all others were known, ``(n_free,)``; infinite where unseen."""
        seen = np.diag(self.bread)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(seen > 0.0, np.sqrt(np.diag(self.meat)) / seen, np.inf)

    def _inverse(self) -> tuple[Array, Array]:
        """The inverse of A, and the part of it in directions of which nothing is known."""
        root = np.sqrt(np.diag(self.bread))
        root[root == 0.0] = 1.0
        values, vectors = np.linalg.eigh(self.bread / np.outer(root, root))
        inverse = vectors / np.maximum(values, _SINGULAR)
        blind = values <= _BLIND * max(float(values[-1]), _SINGULAR)
        unseen = inverse[:, blind] @ vectors[:, blind].T
        return inverse @ vectors.T / np.outer(root, root), unseen / np.outer(root, root)

    @property
    def covariance(self) -> Array:
        """Of all parameters over their sizes, shape ``(n_free, n_free)``; huge, not infinite, where nothing is known."""
        inverse, unseen = self._inverse()
        # Where the bread knows nothing, its scores held no noise either: it is given what the others have.
        floor = float(np.trace(self.meat)) / max(float(np.trace(self.bread)), 1e-300)
        return np.asarray(inverse @ self.meat @ inverse + max(floor, 1e-12) * unseen, dtype=np.float64)

    @property
    def shift(self) -> Array:
        """Systematic error of each parameter over its size, shape ``(n_free,)``."""
        return np.asarray(self._inverse()[0] @ self.drift, dtype=np.float64)

    @property
    def errors(self) -> Array:
        """Standard error of each parameter over its size, shape ``(n_free,)``."""
        return np.asarray(np.sqrt(np.maximum(np.diag(self.covariance), 0.0)), dtype=np.float64)

    @property
    def total_errors(self) -> Array:
        """Root mean square error of each parameter over its size, standard error and shift together, shape ``(n_free,)``."""
        return np.asarray(np.hypot(self.errors, self.shift), dtype=np.float64)


class View(Protocol):
    """What a method makes of recordings: errors of a prediction, one for each row.

    Attributes:
        index: tracking index, where there is one.
        drifts: True when what the method misses of the truth itself shifts its estimate.
    """

    index: float
    drifts: bool

    def errors(self, model: Model) -> Array:
        """What ``model`` misses, shape ``(n,)``."""

    def rows(self) -> Mask:
        """Rows of all that a fit of the model would use, shape ``(n,)``."""

    def starts(self, use: Mask) -> Index:
        """First of each run of used rows of one stretch of time, among the used rows."""


def settled(view: View, options: Options) -> Options:
    """``options`` with the filter and the rows that ``view`` has chosen, where it has."""
    if not isinstance(view, ForceView):
        return options
    return replace(options, cutoff=view.found.cutoff, decimation=view.found.decimation)


class ForceView:
    """The force along the filtered motion, as inverse dynamics uses it, which removes the shift due to its filters."""

    drifts = False

    def __init__(self, model: Model, records: Sequence[Record], options: Options, index: float = 0.0) -> None:
        self.index = index
        self.found = equations(list(records), options, model)
        self._rows = rows_of_fit(model, self.found)

    def errors(self, model: Model) -> Array:
        """Acting less predicted force [F]."""
        return np.asarray(driving_force(model, self.found) - predicted(model, self.found), dtype=np.float64)

    def rows(self) -> Mask:
        """See :class:`View`."""
        return self._rows

    def starts(self, use: Mask) -> Index:
        """See :class:`View`."""
        row = np.flatnonzero(use)
        return np.flatnonzero(np.isin(row, self.found.starts) | (np.diff(row, prepend=row[0]) > 1))


class StepView:
    """The position from one sample to the next, as prediction error uses it.

    Args:
        model: decides on the steps of the simulation.
        records: what was measured.
        options: not used here.
        index: tracking index; 0 takes the one with the smallest innovations.
    """

    drifts = True

    def __init__(self, model: Model, records: Sequence[Record], options: Options, index: float = 0.0) -> None:
        self.runs = [run for record in records for run in runs_of(record)]
        if not self.runs:
            raise IdentificationError(records[0].source, "no valid part is long enough", "record for longer")
        self._n_substeps = max(substeps(model, run.sample_time, _STEP_OF_RATE) for run in self.runs)
        self.index = index or min(_INDICES, key=lambda trial: float(np.sum(self._innovations(model, trial) ** 2)))

    def _innovations(self, model: Model, index: float) -> Array:
        return innovations(model, self.runs, index, self._n_substeps)

    def errors(self, model: Model) -> Array:
        """Measured less predicted position [x]."""
        return self._innovations(model, self.index)

    def rows(self) -> Mask:
        """See :class:`View`."""
        return np.ones(sum(run.effort.shape[0] - SETTLING for run in self.runs), dtype=np.bool_)

    def starts(self, use: Mask) -> Index:
        """See :class:`View`."""
        return np.cumsum([0, *(run.effort.shape[0] - SETTLING for run in self.runs)])[:-1]


VIEWS: Mapping[str, type[ForceView] | type[StepView]] = {"force": ForceView, "position": StepView}
"""Views by what a method predicts."""


def typical_sizes(model: Model, free: FreeParameters, force: float, speed: float, way: float, time: float) -> Array:
    """A size for each free parameter from what belongs to the machine, by dimension alone, shape ``(n_free,)``.

    Args:
        model: whose parameters they are.
        free: the free ones.
        force: typical force [F].
        speed: typical speed [x/s].
        way: typical travel [x].
        time: a short time, such as a sample [s].
    """
    sizes = {
        "F": force,
        "F s/x": force / speed,
        "F s^2/x": force * way / speed**2,
        "F s^2/x^2": force / speed**2,
        "F/x": force / way,
        "x/s": speed,
        "x": way,
        "s": time,
    }
    dimensions = [parameter.declaration.dimension for parameter in model.parameters()]
    return np.array([sizes.get(dimensions[int(k)], 1.0) for k in free.index])


def sensitivities(view: View, model: Model, free: FreeParameters, size: Array) -> Array:
    """Derivative of minus the errors to each free parameter over its ``size``, shape ``(n, n_free)``."""
    columns = []
    values = model.values
    for k, number in enumerate(free.index.tolist()):
        ahead, behind = values.copy(), values.copy()
        step = _DIFFERENCE * size[k]
        ahead[number] = min(values[number] + step, free.upper[k])
        behind[number] = max(values[number] - step, free.lower[k])
        change = view.errors(model.with_values(behind)) - view.errors(model.with_values(ahead))
        columns.append(change * (size[k] / max(ahead[number] - behind[number], 1e-300)))
    return np.array(columns).reshape(len(columns), view.rows().shape[0]).T


def information(jacobian: Array, errors: Sequence[Array], starts: Index, size: Array, off: Array | None = None) -> Information:
    """What rows with these sensitivities are worth.

    Args:
        jacobian: at the rows that a fit uses, shape ``(n, n_free)``.
        errors: draws of the noise of these rows, shape ``(n,)`` each.
        starts: first row of each stretch.
        size: of each parameter, shape ``(n_free,)``.
        off: what the rows miss of the truth itself, shape ``(n,)``; None: nothing is known of it.
    """
    meat = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    for error in errors:
        scores = error[:, None] * jacobian
        meat += long_run(scores, bartlett_lag(error), starts) / len(errors)
    drift = np.zeros(jacobian.shape[1]) if off is None else jacobian.T @ off
    return Information(jacobian.T @ jacobian, meat, drift, size)


def of_recordings(view: View, model: Model, free: FreeParameters, size: Array, covariance: Array | None = None) -> Information:
    """What recordings that were made are worth, their noise being what ``model`` misses.

    Args:
        view: of the recordings.
        model: with the values found.
        free: the parameters.
        size: of each, shape ``(n_free,)``.
        covariance: of the estimates, where a fit has found it, shape ``(n_free, n_free)``.
    """
    use = view.rows()
    jacobian = sensitivities(view, model, free, size)[use]
    found = information(jacobian, [view.errors(model)[use]], view.starts(use), size)
    if covariance is None or not np.all(np.isfinite(covariance)):
        return found
    scaled = covariance / np.outer(size, size)
    return Information(found.bread, np.asarray(found.bread @ scaled @ found.bread), found.drift, size)
