"""The mechanism behind a DNLRX: mass, force terms, Maxwell springs and their thresholds, refined together.

    u = m a + sum_j c_j r_j(x, v) + sum_i k_i delta_i(Delta_i)

The search for the thresholds runs on displacement and force that were low-pass filtered alike, as in the paper. A low-pass and
Eq. 11 can't be interchanged, though: a filtered displacement turns later and less sharply than the body, and the thresholds
found from it are off by some percent where the body turns within a few periods of the cutoff. So here the deformations follow
the displacement under a low-pass four times as wide, and are then passed through the narrow one as the force was ("parallel"
filtering, Gautier 1997); they are followed between the samples too and averaged as the force is, since a spring may turn round
within a sample or two. With that, all parameters are refined by least squares within bounds, starting from the search.

The derivative of a deformation with respect to its threshold is a state too: the direction in which the spring last slid, 1 or
-1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares, lsq_linear
from scipy.stats import chi2

from ...engine.kernel import loop
from ...model import Model
from ...record import Array, Index
from ..free_parameters import FreeParameters
from ..scoring import force_along
from ..statistics import bartlett_lag, covariance_by_parts
from .linear import least_squares as determined
from .samples import FILTER_ORDER, Prepared, Samples

__all__ = ["Mechanism", "find_mechanism", "without_surplus"]

_WIDE = 4.0  # cutoff for the deformations over that for the force
_WIDEST = 0.2  # of the sample rate
_EDGE = 2.0  # periods of the cutoff that are left out after t_sl, where the filter knows nothing of before
_CLEAR = 5.0  # residuals: a parameter whose force is smaller may be off by a fifth and more
_BETWEEN = 4  # values of the position from one sample to the next
_BY_CHANCE = float(chi2.ppf(0.99, 2))
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
        cost: sum of squared residuals [F^2].
        noise: their long-run variance [F^2].
    """

    linear: Array
    stiffness: Array
    thresholds: Array
    covariance: Array
    undetermined: tuple[int, ...]
    buried: tuple[int, ...]
    cost: float
    noise: float


@loop
def _deform_and_slope(x: Any, direction: float, thresholds: Any, bent: Any, slope: Any) -> None:
    """Eq. 11 along ``x`` from where all springs slide, and d delta/d Delta, as means since the last sample; both ``(M, n)``.

    ``x`` has ``_BETWEEN`` values from one sample to the next, ``((n - 1) _BETWEEN + 1,)``.
    """
    for i in range(thresholds.shape[0]):
        limit = thresholds[i]
        d, s = direction * limit, direction
        bent[i, 0], slope[i, 0] = d, s
        for k in range(1, bent.shape[1]):
            mean_d, mean_s = 0.0, 0.0
            for j in range((k - 1) * _BETWEEN + 1, k * _BETWEEN + 1):
                mean_d += 0.5 * d
                mean_s += 0.5 * s
                d += x[j] - x[j - 1]
                if d > limit:
                    d, s = limit, 1.0
                elif d < -limit:
                    d, s = -limit, -1.0
                mean_d += 0.5 * d
                mean_s += 0.5 * s
            bent[i, k], slope[i, k] = mean_d / _BETWEEN, mean_s / _BETWEEN


def _as_the_force(means: Array) -> Array:
    """From means between samples, ``(M, n)``, means over two around each, as force, velocity and acceleration of the equations.

    A spring may go from one limit to the other within a sample or two. What is lost of it by reading it at samples alone is
    half a per cent in fast turns, but five of a viscous force.
    """
    return np.asarray(0.5 * (means + np.concatenate([means[:, 1:], means[:, -1:]], axis=1)))


def _finer(x: Array) -> Array:
    """``x``, ``(n,)``, with ``_BETWEEN`` values from one sample to the next, ``((n - 1) _BETWEEN + 1,)``."""
    at = np.arange(x.shape[0], dtype=np.float64)
    fine = np.arange((x.shape[0] - 1) * _BETWEEN + 1) / _BETWEEN
    return np.ascontiguousarray(CubicSpline(at, x)(fine))


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
            _finer(signal.sosfiltfilt(wide, part.stretch.raw_position)[part.first :][: part.position.shape[0]])
            for part in self._parts
        ]
        self.fixed, self.force = _fixed(base, free, self._parts, self._rows)
        self.starts: Index = np.cumsum([0, *(at.shape[0] for at in self._rows[:-1])])

    def springs(self, thresholds: Array) -> tuple[Array, Array]:
        """Deformations and their derivatives with respect to the thresholds, filtered, each ``(n_rows, M)``."""
        found: tuple[list[Array], list[Array]] = ([], [])
        for part, x, at in zip(self._parts, self._x, self._rows, strict=True):
            shape = (thresholds.shape[0], part.position.shape[0])
            pair = np.empty(shape), np.empty(shape)
            _deform_and_slope(x, part.start.direction, np.ascontiguousarray(thresholds), *pair)
            for each, kept in zip(pair, found, strict=True):
                kept.append(signal.sosfiltfilt(self._narrow, _as_the_force(each), axis=1)[:, at].T)
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


def _long_run_variance(residual: Array, n_parameters: int) -> float:
    """Of white noise whose sums would vary as those of ``residual``, ``(n,)``, do [F^2]."""
    n = residual.shape[0]
    energy = float(residual @ residual)
    lags = range(1, min(bartlett_lag(residual), n - 1) + 1)
    together = sum(float(residual[k:] @ residual[: n - k]) for k in lags)
    return float(max(energy + 2.0 * together, energy) / max(n - n_parameters, 1))


def _covariance(jacobian: Array, residual: Array, starts: Index) -> Array:
    """The sandwich, and no standard error in it below that of a residual which is the same noise everywhere.

    A few long strokes may decide on a parameter, and of as few the sandwich knows the variance badly: on average it is right,
    but it is too small where it happens to be small. The other one takes the variance, and how much more the correlation in
    time lets sums vary than white noise would, from all of the residual.
    """
    sandwich = covariance_by_parts(jacobian, residual, np.ones(residual.shape[0]), starts)
    size = np.linalg.norm(jacobian, axis=0)
    size[size == 0.0] = 1.0
    scaled = jacobian / size
    same = (
        _long_run_variance(residual, jacobian.shape[1]) * np.diag(np.linalg.pinv(scaled.T @ scaled, hermitian=True)) / size**2
    )
    wide = np.sqrt(np.maximum(same / np.maximum(np.diag(sandwich), np.finfo(np.float64).tiny), 1.0))
    return np.asarray(sandwich * np.outer(wide, wide))


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
    inner[np.ix_(inside, inside)] = _covariance(jacobian[:, inside], residual, problem.starts)
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
    cost, noise = float(residual @ residual), _long_run_variance(residual, values.shape[0])
    return Mechanism(full, stiffness, thresholds, covariance, lost, buried, cost, noise)


def without_surplus(base: Model, free: FreeParameters, prepared: Prepared, found: Mechanism) -> Mechanism:
    """``found`` less the springs that it doesn't need.

    The order of a DNLRX is chosen where displacement and force are filtered alike, and in fast turns one more spring makes up
    for what that takes away. Here nothing has to be made up for: a spring may go when its stiffness and threshold lower the sum
    of squares by no more than two parameters do by chance. Tried are the one that is the least certain, and the smaller of the
    two whose thresholds are the closest.
    """
    while found.stiffness.shape[0] > 1:
        n = found.linear.shape[0]
        spread = np.sqrt(np.diag(found.covariance))[n : n + found.stiffness.shape[0]]
        sure = np.where(np.isfinite(spread) & (spread > 0.0), found.stiffness / np.maximum(spread, 1e-300), 0.0)
        candidates = {int(np.argmin(sure)), int(np.argmin(np.diff(np.log(found.thresholds))))}
        fewer = [find_mechanism(base, free, prepared, np.delete(found.thresholds, k)) for k in sorted(candidates)]
        best = min((each for each in fewer if each is not None), key=lambda each: each.cost, default=None)
        if best is None or best.cost - found.cost > _BY_CHANCE * best.noise:
            break
        found = best
    return found
