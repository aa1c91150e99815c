"""Inverse dynamics: the force equation u = f(q, v, a) solved for the parameters, from filtered motion.

For a structure whose force is linear in its parameters this is least squares on the regressors (Gautier and Khalil; Janot,
Gautier, Brunot 2019 for the EMPS axis), with bounds, and with Huber weights against spikes where asked for. Nonlinear
parameters (a Stribeck velocity, a bristle stiffness) are tried over a grid of sensible values, the linear ones solved for
at each (separable least squares), and then all are refined together. The regressors are the model's own compiled terms
with one parameter set to one, so nothing is typed twice.

Samples at rest don't enter a fit of sliding friction: there the friction is whatever balances the drive, and sgn(v) is
noise. A structure with pre-sliding describes them and uses them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares, lsq_linear

from ...method_settings import FILTER, PARAMETERS
from ...model import Model
from ...record import Array, Mask, Record
from ..conclusion import Fitted, concluded
from ..equations import Equations, equations
from ..filter_bias import residual_of_filters
from ..free_parameters import FreeParameters, candidates
from ..nested import best_with_nested, searched_terms
from ..noise_bias import noise_bias, timing_covariance, unsure_by
from ..result import Identification, IdentificationError, Method, Options
from ..scoring import driving_force, force_along
from ..statistics import covariance_by_parts
from ..verdict import collinear

__all__ = ["METHOD", "fit", "fit_force"]

_HUBER = 1.345
_REWEIGHTINGS = 12


def predicted(model: Model, found: Equations) -> Array:
    """Force that ``model`` predicts at the rows of ``found``, shape ``(n_rows,)``."""
    return found.rows(lambda stretch: force_along(model, stretch))


def regressors(model: Model, found: Equations) -> Array:
    """One column per parameter in which the force is linear, zero elsewhere, shape ``(n_rows, n_parameters)``."""
    linear = np.array([parameter.declaration.linear for parameter in model.parameters()])
    base = np.where(linear, 0.0, model.values)
    columns = np.zeros((found.force.shape[0], linear.shape[0]))
    for number in np.flatnonzero(linear):
        unit = base.copy()
        unit[number] = 1.0
        columns[:, number] = predicted(model.with_values(unit), found)
    return columns


def weights(residual: Array, use: Mask, robust: bool) -> Array:
    """Weight of each squared residual, 0 where not used, shape ``(n_rows,)``; Huber's when ``robust``."""
    scale = 1.4826 * float(np.median(np.abs(residual[use])))
    if not robust or scale == 0.0:
        return use.astype(np.float64)
    return use.astype(np.float64) * np.minimum(1.0, _HUBER * scale / np.maximum(np.abs(residual), 1e-300))


def rows_of_fit(model: Model, found: Equations) -> Mask:
    """The rows that tell about ``model``: all if its friction is defined at rest, else those clear of it."""
    return np.ones_like(found.clear) if model.has_slip_dynamics else found.clear


@dataclass(frozen=True, eq=False)
class _LinearFit:
    values: Array
    residual: Array
    weight: Array
    cost: float


def _fit_linear(model: Model, found: Equations, free: FreeParameters, use: Mask, robust: bool) -> _LinearFit:
    """Bounded least squares for the free linear parameters, the others as in ``model``."""
    columns = regressors(model, found)
    values = model.values
    linear = np.array([parameter.declaration.linear for parameter in model.parameters()])
    values_of_held = np.where(linear, values, 0.0)
    values_of_held[free.index] = 0.0
    target = driving_force(model, found) - columns @ values_of_held
    part = columns[:, free.index]
    scale = np.linalg.norm(part[use], axis=0)
    scale[scale == 0.0] = 1.0
    weight = use.astype(np.float64)
    solution = np.zeros(free.index.shape[0])
    for _ in range(_REWEIGHTINGS if robust else 1):
        root = np.sqrt(weight)
        # The triangle has the same solution as all the rows, and a solver with bounds goes over it many times.
        rows = (root[:, None] * np.column_stack([part / scale, target]))[use]
        triangle: Any = np.linalg.qr(rows, mode="r")
        answer = lsq_linear(triangle[:, :-1], triangle[:, -1], bounds=(free.lower * scale, free.upper * scale))
        previous, solution = solution, np.asarray(answer.x) / scale
        residual = target - part @ solution
        weight = weights(residual, use, robust)
        if np.allclose(solution, previous, rtol=1e-6, atol=0.0):
            break
    values[free.index] = solution
    return _LinearFit(values, residual, weight, _cost(residual, use, robust))


def _cost(residual: Array, use: Mask, robust: bool) -> float:
    """Sum of squares; of absolute values when robust, since candidates have Huber scales of their own."""
    left = residual[use]
    return float(np.sum(np.abs(left))) if robust else float(left @ left)


def _search_static(model: Model, found: Equations, free: FreeParameters, robust: bool) -> Model:
    """The static structure with linear parameters solved for and nonlinear ones chosen on their grid.

    The grid is searched from the values given and from where the terms that have to be searched for do nothing.
    """
    linear, nonlinear = free.only(True), free.only(False)
    use = found.clear
    best = _fit_linear(model, found, linear, use, robust)
    for each in searched_terms(model, free):
        bare = _fit_linear(each.away(model.with_values(best.values)), found, linear, use, robust)
        best = bare if bare.cost < best.cost else best
    level = float(np.median(np.abs(found.force[use])))
    declared = list(model.parameters())
    for number, lower, upper in zip(nonlinear.index, nonlinear.lower, nonlinear.upper, strict=True):
        for value in candidates(declared[number].declaration.dimension, found, level):
            if not lower <= value <= upper:
                continue
            trial_values = best.values.copy()
            trial_values[number] = value
            trial = _fit_linear(model.with_values(trial_values), found, linear, use, robust)
            if trial.cost < best.cost:
                best = trial
    return model.with_values(best.values)


def _search_dynamic(model: Model, found: Equations, free: FreeParameters, robust: bool) -> Model:
    """The best start for the parameters of the slip dynamics, the static ones as they are."""
    declared = list(model.parameters())
    use = np.ones(found.force.shape[0], dtype=np.bool_)
    level = float(np.median(np.abs(found.force)))
    best, best_cost = model, np.inf
    nonlinear = free.only(False)
    for number, lower, upper in zip(nonlinear.index, nonlinear.lower, nonlinear.upper, strict=True):
        for value in candidates(declared[number].declaration.dimension, found, level):
            if not lower <= value <= upper:
                continue
            values = best.values
            values[number] = value
            trial = model.with_values(values)
            cost = _cost(driving_force(trial, found) - predicted(trial, found), use, robust)
            if cost < best_cost:
                best, best_cost = trial, cost
    return best


def _refine(model: Model, found: Equations, free: FreeParameters, use: Mask, robust: bool) -> tuple[Model, Array, Array, Array]:
    """All free parameters together by trust-region least squares: model, residual, Jacobian and weights at the optimum."""
    start = model.values
    scale = np.maximum(np.abs(start[free.index]), 1e-3 * _typical(model, found, free))

    def residual(scaled: Array) -> Array:
        values = start.copy()
        values[free.index] = scaled * scale
        trial = model.with_values(values)
        return driving_force(trial, found) - predicted(trial, found)

    weight = weights(residual(start[free.index] / scale), use, robust)
    free = free.within_reach(model, found)
    point = np.clip(start[free.index], free.lower, free.upper) / scale
    for _ in range(5):
        root = np.sqrt(weight)
        answer = least_squares(
            lambda scaled, root=root: root * residual(scaled),
            point,
            bounds=(free.lower / scale, free.upper / scale),
            diff_step=1e-5,
            xtol=1e-8,
            ftol=1e-10,
            max_nfev=60,
        )
        previous, point = point, np.asarray(answer.x)
        left = residual(point)
        weight = weights(left, use, robust)
        if not robust or np.allclose(point, previous, rtol=1e-4, atol=1e-9):
            break
    jacobian = np.asarray(answer.jac) / np.where(root > 0, root, 1.0)[:, None] / scale
    values = start.copy()
    values[free.index] = point * scale
    return model.with_values(values), left, jacobian, weight


def _nested_static(model: Model, found: Equations, free: FreeParameters, robust: bool) -> Model:
    """The best fit of a structure without slip dynamics, no worse than that of any part of it that does without a term."""
    use = rows_of_fit(model, found)

    def fit(start: Model, now: FreeParameters) -> tuple[Model, float]:
        ended, left, _, _ = _refine(_search_static(start, found, now, robust), found, now, use, robust)
        return ended, _cost(left, use, robust)

    if not searched_terms(model, free):
        return _search_static(model, found, free, robust)
    return best_with_nested(model, free, fit, lambda one: one)[0][0]


def _typical(model: Model, found: Equations, free: FreeParameters) -> Array:
    """Typical size of each free parameter, for those that start at zero."""
    force = float(np.std(found.force))
    speed = float(np.std(found.velocity))
    acceleration = float(np.std(np.concatenate([stretch.acceleration for stretch in found.stretches])))
    sizes = {"F": force, "F s/x": force / speed, "F s^2/x": force / acceleration, "x/s": speed}
    dimensions = [parameter.declaration.dimension for parameter in model.parameters()]
    return np.array([sizes.get(dimensions[number], 1.0) for number in free.index])


def fit_force(model: Model, records: Sequence[Record], options: Options) -> Fitted:
    """The fit itself, for this method and as the start of others."""
    found = equations(list(records), options, model)
    if int(np.sum(found.sliding)) < 2 * len(model.names):
        raise IdentificationError(
            records[0].source,
            "the joint hardly moves",
            f"record motion faster than {found.rest_velocity:.3g} {model.units.position}/s",
        )
    free = FreeParameters.of(model, options)
    static = model.with_terms(held for held in model.terms if held.effect.slip is None)
    static_free = FreeParameters.of(static, _for_structure(options, static))
    twins = collinear(static, regressors(static, found)[:, static_free.index], static_free, found.clear)
    messages = [twin.message for twin in twins]
    free = free.without({twin.name for twin in twins})
    static_free = static_free.without({twin.name for twin in twins})
    if model.has_slip_dynamics:
        static = _search_static(static, found, static_free, options.robust)
    else:
        static = _nested_static(static, found, static_free, options.robust)
    by_name = {parameter.name: parameter.value for parameter in static.parameters()}
    model = model.with_values(np.array([by_name.get(p.name, p.value) for p in model.parameters()]))
    if model.has_slip_dynamics:
        model = _search_dynamic(model, found, free.without(set(static_free.names)), options.robust)
    use = rows_of_fit(model, found)
    model, residual, jacobian, weight = _refine(model, found, free, use, options.robust)
    size = np.linalg.norm(jacobian[use], axis=0) * np.abs(model.values[free.index])
    inside = ~free.at_bound(model) & (size > 1e-9 * np.max(size, initial=0.0))
    covariance = np.full((len(free.names), len(free.names)), np.nan)
    model, known = _without_filter_bias(model, found, free, jacobian, weight)
    covariance[np.ix_(inside, inside)] = covariance_by_parts(jacobian[:, inside], residual - known, weight, found.starts)
    if not model.has_slip_dynamics:
        bias = noise_bias(model, found, free, weight, inside)
        values = model.values
        values[free.index] = np.clip(values[free.index] - bias, free.lower, free.upper)
        model, covariance = model.with_values(values), covariance + unsure_by(bias)
    timing = timing_covariance(found, jacobian, weight, inside, model.has_command_path)
    return Fitted(model, free, covariance + timing, found, messages, timing)


def filter_residual(model: Model, found: Equations) -> Array:
    """What filters leave in the equations at the values of ``model``, ``(n_rows,)``: nothing without slip dynamics."""
    if model.has_slip_dynamics and not model.has_command_path:
        residual = residual_of_filters(model, found)
        if np.all(np.isfinite(residual)):
            return residual
    return np.zeros(found.force.shape[0])


def _without_filter_bias(
    model: Model, found: Equations, free: FreeParameters, jacobian: Array, weight: Array
) -> tuple[Model, Array]:
    """``model`` less what the filters do to its values, and the part of the residual that is theirs, ``(n_rows,)``.

    The model is left as it is where that can't be told or leads out of bounds.
    """
    residual = filter_residual(model, found)
    inside = ~free.at_bound(model)
    size = np.linalg.norm(jacobian[:, inside], axis=0)
    root = np.sqrt(weight)
    scaled = root[:, None] * jacobian[:, inside] / np.where(size > 0.0, size, 1.0)
    # The Jacobian is that of measured minus predicted.
    off = -np.linalg.lstsq(scaled, root * residual, rcond=1e-9)[0] / np.where(size > 0.0, size, 1.0)
    values = model.values
    values[free.index[inside]] -= off
    within = np.all((values[free.index] > free.lower) & (values[free.index] < free.upper) | ~inside)
    if not np.any(residual) or not within:
        return model, np.zeros_like(residual)
    return model.with_values(values), residual + jacobian[:, inside] @ off


def _for_structure(options: Options, model: Model) -> Options:
    """The options without names that ``model`` doesn't have."""
    held = tuple(name for name in options.held if name in model.names)
    freed = tuple(name for name in options.freed if name in model.names)
    return Options(held=held, freed=freed, bounds=tuple(bound for bound in options.bounds if bound[0] in model.names))


def fit(structure: Model, records: Sequence[Record], options: Options) -> Identification:
    """Fit ``structure`` to ``records`` by inverse dynamics.

    Raises:
        IdentificationError: the recordings can't determine it.
    """
    return concluded(METHOD, fit_force(structure, records, options), records, options)


METHOD = Method(
    id="inverse-dynamics",
    title="inverse dynamics by least squares",
    needs="motion in both directions at several speeds and accelerations; position and force",
    source="Gautier 1997; Janot, Gautier, Brunot 2019",
    fit=fit,
    predicts="force",
    uses=(*FILTER, *PARAMETERS, "robust"),
)
