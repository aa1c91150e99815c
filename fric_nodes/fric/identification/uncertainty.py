"""How sure the values of a fit are: standard errors, block bootstrap or profile likelihood, and beside them the spread.

``sandwich`` takes the standard errors of the fit as they are. ``bootstrap`` fits drawn recordings: blocks of equations, or, in
output error, whose residuals are correlated over the whole recording, force errors put together from blocks and led through the
runs. ``profile`` walks along each nonlinear parameter while the others make up for it; linear ones keep their standard error.
Spread over recordings and over restarts need no assumption about the residuals; where they are wider than the intervals,
the model leaves out something that differs between recordings, or the misfit has several minima.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np
from scipy.special import ndtri

from ..errors import InputError
from ..model import Model
from ..record import Array, Record
from .bootstrap import Bootstrap, block_bootstrap
from .equations import Equations, equations
from .free_parameters import FreeParameters
from .gauss_newton import minimise
from .methods import inverse_dynamics, output_error, prediction_error
from .problem import Problem
from .profile import profile
from .result import Identification, IdentificationError, Method, Options
from .scoring import driving_force

__all__ = ["KINDS", "Intervals", "Uncertainty", "assess", "intervals", "over_recordings", "over_restarts", "problem_of"]

KINDS = ("sandwich", "bootstrap", "profile")
"""Ways to find intervals."""

_REPLICATES = 60
_RESTARTS = 6
_RESTART_SPREAD = 0.3  # of the logarithm of a start value
_DIFFERENCE = 1e-3


@dataclass(frozen=True, eq=False)
class Intervals:
    """Intervals of the fitted parameters; arrays of shape ``(n_parameters,)``, in SI.

    Attributes:
        kind: one of :data:`KINDS`.
        probability: of each interval.
        names: parameters that the fit could determine.
        estimate: their values.
        standard_errors: of this kind.
        lower: infinite where the recordings set no limit.
        upper: infinite where the recordings set no limit.
        notes: what else to know.
    """

    kind: str
    probability: float
    names: tuple[str, ...]
    estimate: Array
    standard_errors: Array
    lower: Array
    upper: Array
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Uncertainty(Intervals):
    """Intervals, and the spread of the estimates beside them.

    Attributes:
        restarts: standard deviation over fits from other starts.
        recordings: standard deviation over the recordings fitted one by one; NaN with one recording.
    """

    restarts: Array
    recordings: Array


def _free(result: Identification, options: Options) -> FreeParameters:
    """The fitted parameters that have a standard error."""
    free = FreeParameters.of(result.model, options)
    return free.without(set(free.names) - (set(result.fitted) & set(result.model.standard_errors)))


def _of_inverse_dynamics(model: Model, free: FreeParameters, found: Equations, robust: bool) -> Problem:
    use = inverse_dynamics.rows_of_fit(model, found)
    values = model.values
    scale = np.abs(values[free.index])
    scale[scale == 0.0] = 1.0

    # What the filters leave in the equations at the estimate is no misfit: it has been taken off the values.
    left = inverse_dynamics.filter_residual(model, found)

    def error(point: Array) -> Array:
        trial = values.copy()
        trial[free.index] = point * scale
        moved = model.with_values(trial)
        return np.asarray(driving_force(moved, found) - inverse_dynamics.predicted(moved, found) - left, dtype=np.float64)

    root = np.sqrt(inverse_dynamics.weights(error(values[free.index] / scale), use, robust))
    point, lower, upper = values[free.index] / scale, free.lower / scale, free.upper / scale
    # Rows that aren't used stay, as zeros, so that blocks are blocks of time.
    return Problem(free.names, lambda at: root * error(at), point, lower, upper, scale, found.starts)


def problem_of(result: Identification, records: Sequence[Record], options: Options) -> Problem:
    """The least-squares problem whose minimum ``result`` is.

    Raises:
        InputError: its method isn't a least-squares fit of a recording.
    """
    free, found = _free(result, options), equations(list(records), options, result.model)
    if result.method == inverse_dynamics.METHOD.id:
        return _of_inverse_dynamics(result.model, free, found, options.robust)
    if result.method == output_error.METHOD.id:
        return output_error.problem(result.model, free, found, options.horizon, options)[0]
    if result.method == prediction_error.METHOD.id:
        return prediction_error.problem(result.model, free, records, found)
    known = ", ".join(part.METHOD.id for part in (inverse_dynamics, output_error, prediction_error))
    raise InputError("--uncertainty", f"not available for the method '{result.method}'", f"use one of {known}")


def _shifted(problem: Problem, moved: Array, point: Array) -> Array:
    return problem.residual(point) + moved


def _bootstrap(result: Identification, problem: Problem, records: Sequence[Record], options: Options) -> tuple[Bootstrap, str]:
    if result.method != output_error.METHOD.id:
        found = block_bootstrap(problem, n_replicates=_REPLICATES)
        return found, f"{found.estimates.shape[0]} replicates from blocks of {found.length} equations"
    draws = output_error.problem(
        result.model, _free(result, options), equations(list(records), options, result.model), options.horizon, options
    )[1]
    estimates = []
    for moved in islice(draws, _REPLICATES):
        answer = minimise(
            partial(_shifted, problem, moved),
            problem.point,
            problem.lower,
            problem.upper,
            difference=_DIFFERENCE,
            max_iterations=15,
        )
        if answer.converged:
            estimates.append(answer.point)
    kept = np.array(estimates).reshape(len(estimates), problem.point.shape[0])
    return Bootstrap(kept, 0), f"{kept.shape[0]} replicates with force errors put together from blocks"


def assess(
    result: Identification, records: Sequence[Record], options: Options, kind: str = "sandwich", probability: float = 0.9
) -> Uncertainty:
    """Intervals for the parameters of ``result``, which was fitted to ``records`` with ``options``, and the spread beside them.

    Raises:
        InputError: ``kind`` isn't known, or not to be had for this method.
    """
    _check(kind)
    problem = problem_of(result, records, options)
    found = _intervals(problem, result, records, options, kind, probability)
    restarts = over_restarts(problem)
    recordings = over_recordings(result, records, options, problem.names)
    return Uncertainty(**vars(found), restarts=restarts, recordings=recordings)


def intervals(
    result: Identification, records: Sequence[Record], options: Options, kind: str = "sandwich", probability: float = 0.9
) -> Intervals:
    """The intervals of :func:`assess` alone.

    Raises:
        InputError: as there.
    """
    _check(kind)
    return _intervals(problem_of(result, records, options), result, records, options, kind, probability)


def _check(kind: str) -> None:
    if kind not in KINDS:
        raise InputError("--uncertainty", f"'{kind}' is not known", f"use one of {', '.join(KINDS)}")


def _intervals(
    problem: Problem, result: Identification, records: Sequence[Record], options: Options, kind: str, probability: float
) -> Intervals:
    estimate = problem.point * problem.scale
    errors = np.array([result.model.standard_errors[name] for name in problem.names])
    wide = float(ndtri(0.5 + 0.5 * probability))
    lower, upper = estimate - wide * errors, estimate + wide * errors
    notes: list[str] = []
    if kind == "bootstrap":
        found, note = _bootstrap(result, problem, records, options)
        errors = np.sqrt(np.diag(found.covariance)) * problem.scale
        ends = found.interval(problem.point, probability)
        lower, upper = (end * problem.scale for end in ends)
        notes.append(note)
    if kind == "profile":
        linear = _free(result, options).linear
        for k in np.flatnonzero(~linear):
            walked = profile(problem, int(k), float(errors[k] / problem.scale[k]), probability=probability)
            lower[k], upper[k] = walked.lower * problem.scale[k], walked.upper * problem.scale[k]
            for end, side in ((lower[k], "below"), (upper[k], "above")):
                if not math.isfinite(end):
                    notes.append(f"{problem.names[k]} has no limit {side}: these recordings don't determine one")
    return Intervals(kind, probability, problem.names, estimate, errors, lower, upper, tuple(notes))


def over_restarts(problem: Problem, seed: int = 1) -> Array:
    """Standard deviation of the estimates from random starts around the estimate, shape ``(n_parameters,)``, in SI."""
    random = np.random.default_rng(seed)
    ends = [problem.point]
    for _ in range(_RESTARTS):
        start = problem.point * np.exp(_RESTART_SPREAD * random.standard_normal(problem.point.shape[0]))
        answer = minimise(problem.residual, start, problem.lower, problem.upper, difference=_DIFFERENCE)
        ends.append(answer.point)
    return np.asarray(np.std(ends, axis=0, ddof=1) * problem.scale)


def over_recordings(result: Identification, records: Sequence[Record], options: Options, names: Sequence[str]) -> Array:
    """Standard deviation of the estimates over the recordings, each fitted alone; NaN with fewer than two that can be."""
    from . import METHODS

    method: Method = METHODS[result.method]
    found = []
    for record in records if len(records) > 1 else ():
        try:
            alone = method.fit(result.model, [record], options).model
        except IdentificationError:
            continue
        found.append([alone.value(name) for name in names])
    if len(found) < 2:
        return np.full(len(names), math.nan)
    return np.asarray(np.std(found, axis=0, ddof=1))
