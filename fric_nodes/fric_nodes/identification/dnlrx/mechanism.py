"""The mechanism behind a DNLRX: mass, force terms, Maxwell springs and their thresholds, refined together.

    u = m a + sum_j c_j r_j(x, v) + sum_i k_i delta_i(Delta_i)

The search for the thresholds runs on displacement and force that were low-pass filtered alike, as in the paper. A low-pass and
Eq. 11 can't be interchanged, though: a filtered displacement turns later and less sharply than the body, and the thresholds
found from it are off by some percent where the body turns within a few periods of the cutoff. So here the deformations follow
the displacement under a low-pass four times as wide, and are then passed through the narrow one as the force was ("parallel"
filtering, Gautier 1997); with that, all parameters are refined by least squares within bounds, starting from the search.

The derivative of a deformation with respect to its threshold is a state too: the direction in which the spring last slid, 1 or
-1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal
from scipy.optimize import least_squares, lsq_linear

from ...engine.kernel import loop
from ...model import Model
from ...record import Array, Index
from ..free_parameters import FreeParameters
from ..scoring import force_along
from ..statistics import sandwich_covariance
from .linear import least_squares as determined
from .samples import FILTER_ORDER, Prepared, Samples

__all__ = ["Mechanism", "find_mechanism"]

_WIDE = 4.0  # cutoff for the deformations over that for the force
_WIDEST = 0.2  # of the sample rate
_EDGE = 2.0  # periods of the cutoff that are left out after t_sl, where the filter knows nothing of before
_CLEAR = 5.0  # residuals: a parameter whose force is smaller may be off by a fifth and more
_LEAST = 1e-6  # of the strongest spring: a weaker one isn't there


@dataclass(frozen=True, eq=False)
class Mechanism:
    """What was found.

    Attributes:
        linear: mass and parameters of force terms, in the order of the free parameters; zero where undetermined.
        stiffness: k_i [F/x], shape ``(n_springs,)``, all positive.
        thresholds: Delta_i [x], ascending, shape ``(n_springs,)``.
        covariance: of linear parameters, stiffnesses, thresholds and the Coulomb level sum k_i Delta_i; NaN where a
            parameter lies on its bound or isn't determined.
        undetermined: numbers of the linear parameters that leave no trace of their own.
        buried: numbers of those whose force isn't clearly larger than what is left unexplained. The residual of a smooth curve
            followed by a few springs isn't noise: what looks like inertia in it goes into the mass, and no standard error
            shows it.
    """

    linear: Array
    stiffness: Array
    thresholds: Array
    covariance: Array
    undetermined: tuple[int, ...]
    buried: tuple[int, ...]


@loop
def _deform_and_slope(x: Any, direction: float, thresholds: Any, bent: Any, slope: Any) -> None:
    """Eq. 11 along ``x`` from where all springs slide, and d delta/d Delta; both ``(M, n_samples)``."""
    for i in range(thresholds.shape[0]):
        limit = thresholds[i]
        d, s = direction * limit, direction
        bent[i, 0], slope[i, 0] = d, s
        for k in range(1, x.shape[0]):
            d += x[k] - x[k - 1]
            if d > limit:
                d, s = limit, 1.0
            elif d < -limit:
                d, s = -limit, -1.0
            bent[i, k], slope[i, k] = d, s


class _Problem:
    """The regression, row by row of every part.

    Args:
        base: the model's plant and force terms.
        free: their linear parameters to fit.
        prepared: the samples.
    """

    def __init__(self, base: Model, free: FreeParameters, prepared: Prepared) -> None:
        step = prepared.sample_time
        self._parts = prepared.parts
        self._narrow: Any = signal.butter(FILTER_ORDER, 2.0 * prepared.cutoff * step, output="sos")
        wide: Any = signal.butter(FILTER_ORDER, 2.0 * min(_WIDE * prepared.cutoff, _WIDEST / step) * step, output="sos")
        edge = int(np.ceil(_EDGE / prepared.cutoff / step))
        every = max(int(1.0 / (4.0 * prepared.cutoff * step)), 1)
        self._rows = [np.arange(edge, part.position.shape[0] - edge, every) for part in self._parts]
        self._x = [
            np.ascontiguousarray(signal.sosfiltfilt(wide, part.stretch.raw_position)[part.first :][: part.position.shape[0]])
            for part in self._parts
        ]
        self.fixed, self.force = _fixed(base, free, self._parts, self._rows)
        self.starts: Index = np.cumsum([0, *(at.shape[0] for at in self._rows[:-1])])

    def springs(self, thresholds: Array) -> tuple[Array, Array]:
        """Deformations and their derivatives with respect to the thresholds, filtered, each ``(n_rows, M)``."""
        found: tuple[list[Array], list[Array]] = ([], [])
        for part, x, at in zip(self._parts, self._x, self._rows, strict=True):
            shape = (thresholds.shape[0], x.shape[0])
            pair = np.empty(shape), np.empty(shape)
            _deform_and_slope(x, part.start.direction, np.ascontiguousarray(thresholds), *pair)
            for each, kept in zip(pair, found, strict=True):
                kept.append(signal.sosfiltfilt(self._narrow, each, axis=1)[:, at].T)
        return np.concatenate(found[0]), np.concatenate(found[1])


def _fixed(base: Model, free: FreeParameters, parts: Sequence[Samples], rows: Sequence[Index]) -> tuple[Array, Array]:
    """Regressors of the free linear parameters, ``(n_rows, n_free)``, and the force less what is held, ``(n_rows,)``."""
    held = base.values
    held[free.index] = 0.0
    still = np.where([p.declaration.linear for p in base.parameters()], 0.0, base.values)
    blocks, force = [], []
    for part, at in zip(parts, rows, strict=True):
        seen = part.first + at
        block = np.empty((at.shape[0], len(free.names)))
        for column, number in enumerate(free.index):
            unit = still.copy()
            unit[number] = 1.0
            block[:, column] = force_along(base.with_values(unit), part.stretch)[seen]
        blocks.append(block)
        force.append(part.force[at] - force_along(base.with_values(held), part.stretch)[seen])
    return np.concatenate(blocks), np.concatenate(force)


def find_mechanism(base: Model, free: FreeParameters, prepared: Prepared, thresholds: Array) -> Mechanism | None:
    """The mechanism near ``thresholds`` [x], shape ``(M,)``; None when no spring has a positive stiffness.

    Args:
        base: the model's plant and force terms; what isn't free is held at its value.
        free: linear parameters to fit.
        prepared: the samples.
        thresholds: where the search ended.
    """
    problem = _Problem(base, free, prepared)
    n_linear = len(free.names)
    bent, _ = problem.springs(thresholds)
    columns = np.hstack([problem.fixed, bent])
    _, kept = determined(columns, problem.force)
    lower = np.concatenate([free.lower, np.zeros(thresholds.shape[0])])
    upper = np.concatenate([free.upper, np.full(thresholds.shape[0], np.inf)])
    scale = np.linalg.norm(columns[:, kept], axis=0)
    answer = lsq_linear(columns[:, kept] / scale, problem.force, bounds=(lower[kept] * scale, upper[kept] * scale))
    start = np.zeros(columns.shape[1])
    start[kept] = np.asarray(answer.x) / scale
    stiffness = start[n_linear:]
    there = np.flatnonzero(stiffness > _LEAST * max(float(np.max(stiffness, initial=0.0)), np.finfo(np.float64).tiny))
    if there.size == 0:
        return None
    linear = np.array([k for k in kept.tolist() if k < n_linear], dtype=np.int64)
    values, jacobian, residual, inside = _refined(
        problem, free, prepared, linear, start[linear], (stiffness[there], thresholds[there])
    )
    return _mechanism(problem, linear, n_linear, (values, jacobian, residual, inside))


def _refined(
    problem: _Problem,
    free: FreeParameters,
    prepared: Prepared,
    linear: Index,
    start: Array,
    springs: tuple[Array, Array],
) -> tuple[Array, Array, Array, Array]:
    """Least squares for everything: values (linear, stiffnesses, thresholds), Jacobian, residual, and what is inside bounds."""
    n, m = linear.shape[0], springs[0].shape[0]
    fixed = problem.fixed[:, linear]
    point = np.concatenate([start, *springs])
    # As multiples of where the search ended, so that all are of one size; what ended at zero, of what it takes to be seen.
    reach = np.linalg.norm(np.hstack([fixed, np.ones((fixed.shape[0], 2 * m))]), axis=0)
    size = np.maximum(np.abs(point), 1e-9 * float(np.linalg.norm(problem.force)) / reach)
    size[n + m :] = springs[1]
    lower = np.concatenate([free.lower[linear], np.zeros(m), np.full(m, prepared.lowest)]) / size
    upper = np.concatenate([free.upper[linear], np.full(m, np.inf), np.full(m, prepared.highest)]) / size
    seen: dict[bytes, tuple[Array, Array]] = {}

    def springs_at(scaled: Array) -> tuple[Array, Array]:
        thresholds = scaled[n + m :] * size[n + m :]
        key = thresholds.tobytes()
        if key not in seen:
            seen.clear()
            seen[key] = problem.springs(thresholds)
        return seen[key]

    def residual(scaled: Array) -> Array:
        values = scaled * size
        return np.asarray(fixed @ values[:n] + springs_at(scaled)[0] @ values[n : n + m] - problem.force)

    def jacobian(scaled: Array) -> Array:
        bent, slope = springs_at(scaled)
        return np.asarray(np.hstack([fixed, bent, slope * (scaled * size)[n : n + m]]) * size)

    begin = np.clip(point / size, lower + 1e-9, upper - 1e-9)
    answer = least_squares(residual, begin, jac=jacobian, bounds=(lower, upper), ftol=1e-10, xtol=1e-8, max_nfev=60)
    scaled = np.asarray(answer.x)
    inside = (scaled - lower > 1e-6) & (upper - scaled > 1e-6)
    # The solver stops a hair before a bound.
    scaled = np.where(inside, scaled, np.where(scaled - lower < upper - scaled, lower, upper))
    return scaled * size, jacobian(scaled) / size, residual(scaled), inside


def _mechanism(problem: _Problem, linear: Index, n_linear: int, found: tuple[Array, Array, Array, Array]) -> Mechanism:
    """Sorted, with its covariance."""
    values, jacobian, residual, inside = found
    n = linear.shape[0]
    m = (values.shape[0] - n) // 2
    order = np.argsort(values[n + m :])
    whole = np.concatenate([np.arange(n), n + order, n + m + order])
    values, jacobian, inside = values[whole], jacobian[:, whole], inside[whole]
    full = np.zeros(n_linear)
    full[linear] = values[:n]
    stiffness, thresholds = values[n : n + m], values[n + m :]
    inner = np.full((values.shape[0],) * 2, np.nan)
    inner[np.ix_(inside, inside)] = sandwich_covariance(
        jacobian[:, inside], residual, np.ones(residual.shape[0]), problem.starts
    )
    at = np.concatenate([linear, n_linear + np.arange(2 * m)])
    covariance = np.full((n_linear + 2 * m + 1,) * 2, np.nan)
    covariance[np.ix_(at, at)] = inner
    # The Coulomb level is sum k_i Delta_i.
    weight = np.concatenate([np.zeros(n), thresholds, stiffness])
    known = np.where(np.isnan(inner), 0.0, inner)
    covariance[-1, at] = covariance[at, -1] = known @ weight
    covariance[-1, -1] = weight @ known @ weight
    left = _CLEAR * float(np.sqrt(np.mean(residual**2)))
    forces = np.sqrt(np.mean((jacobian[:, :n] * values[:n]) ** 2, axis=0))
    buried = tuple(int(k) for k, force in zip(linear, forces, strict=True) if force < left)
    lost = tuple(k for k in range(n_linear) if k not in set(linear.tolist()))
    return Mechanism(full, stiffness, thresholds, covariance, lost, buried)
