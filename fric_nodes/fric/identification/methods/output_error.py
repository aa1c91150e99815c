"""Output error: the parameters whose simulated motion, led by the measured force alone, comes closest to the measured one.

Minimises sum (q - q_hat)^2 over free runs of the compiled simulation, from the values that inverse dynamics finds, by damped
Gauss-Newton steps. With the whole recording as one run this is the published test of an axis model. On an axis whose position
drifts away under small force errors, or that runs away without its controller, shorter runs (``horizon``) keep errors from
building up through the integrator; where they start is found with the parameters
(:mod:`fric.identification.multiple_shooting`), and so it is of a whole recording where the uncertainty of its first
state matters. Several starts (``starts``) search for a better minimum than the nearest.
Source: Ljung 1999, chapter 7 (output error).

Standard errors: in a free run an error of the force adds up for as long as friction lets it, so that the residuals of a whole
recording are few independent numbers, however many samples they have; no window over their correlation accounts for that. The
errors of the force themselves are short. They are measured (:mod:`fric.identification.force_errors`), put together anew from
blocks, and led through the same runs; with J the Jacobian, J' times what they change in the position is a draw of the score,
and the covariance is (J'J)^-1 S (J'J)^-1 with S the mean square of the draws. The noise of the position,
and the error of the runs' start states, drawn with them, add their part. J is made of secants as wide as the uncertainty.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from ...errors import InputError
from ...method_settings import FILTER, PARAMETERS
from ...model import Model
from ...record import Array, Record
from ..agreement import reconciled
from ..conclusion import Fitted, concluded, standard_errors
from ..equations import Equations
from ..force_errors import force_errors
from ..free_parameters import FreeParameters
from ..gauss_newton import Solution, minimise
from ..multi_start import Ends, best_of, spread_starts
from ..multiple_shooting import Shooting, shooting
from ..nested import best_with_nested
from ..problem import Problem
from ..result import Identification, Method, Options
from . import inverse_dynamics

__all__ = ["METHOD", "fit", "problem"]

_DIFFERENCE = 1e-3  # relative step of derivatives: wide enough to reach over the kinks of sticking
_COST_TOLERANCE = 1e-6  # a hundredth of a standard error, since the errors are no more than hundreds of independent ones
_MOST_SLOW = 3  # steps: where differences can't see the minimum any better
_WIDEST = 0.2  # relative, of secants over the uncertainty
_DRAWS = 60  # of force errors: their spread is known to a tenth
_BRIEF = 8  # iterations, after which a start that is far behind is given up
_ABOVE = 2.0  # times the cost at hand; numerical: a start this much worse rarely leads to a better end
_ROUNDS = 6  # at most, of parameters with the starts' influence held, and starts
_SETTLED = 0.02  # standard errors: a change of the parameters that needs no further round
_LOST = 0.5  # of the recorded motion's standard deviation: an error that says that the model goes elsewhere
START_STATES = ("measured", "tied", "free")


def _search(model: Model, free: FreeParameters, residual_of: Callable[[Model], Array], runs: Shooting) -> Problem:
    """The position errors as a function of the free parameters, each relative to its value in ``model``."""
    values = model.values
    scale = np.abs(values[free.index])
    scale[scale == 0.0] = 1.0

    def residual(scaled: Array) -> Array:
        trial = values.copy()
        trial[free.index] = scaled * scale
        return residual_of(model.with_values(trial))

    lower, upper = free.lower / scale, free.upper / scale
    point = np.clip(values[free.index] / scale, lower, upper)
    return Problem(free.names, residual, point, lower, upper, scale, runs.first_errors[:-1])


def problem(
    model: Model, free: FreeParameters, found: Equations, horizon: float | None, options: Options | None = None
) -> tuple[Problem, Iterator[Array]]:
    """The sum of squares that ``model`` is the minimum of, and draws of what errors of the force change in its residuals."""
    options = Options(horizon=horizon) if options is None else options
    runs, draws = _prepared(model, free, found, options)
    return _search(model, free, runs.reduced(model), runs), draws


def _prepared(model: Model, free: FreeParameters, found: Equations, options: Options) -> tuple[Shooting, Iterator[Array]]:
    """The runs with the starts that suit ``model``, and draws for their residuals."""
    runs = _runs(model, found, options)
    disturbance = force_errors(model, free, found)
    runs = runs.weighed(model, disturbance).settled(model)
    eliminate = runs.elimination(model)
    drawn = runs.draws(model, disturbance)
    return runs, drawn if eliminate is None else (eliminate(moved) for moved in drawn)


def _runs(model: Model, found: Equations, options: Options) -> Shooting:
    starts = options.start_states or ("measured" if options.horizon is None else "free")
    if starts not in START_STATES:
        raise InputError("start_states", f"'{starts}' is not known", f"use one of {', '.join(START_STATES)}")
    return shooting(model, found, options.horizon, starts, options.continuity)


@dataclass(frozen=True, eq=False)
class _Found:
    """One search from one start.

    Attributes:
        model: with the values found.
        answer: how the last round ended.
        scale: of its point.
        runs: with the starts found.
    """

    model: Model
    answer: Solution
    scale: Array
    runs: Shooting

    @property
    def cost(self) -> float:
        """Sum of squares at the end."""
        return float(self.answer.residual @ self.answer.residual)


def _minimised(model: Model, free: FreeParameters, runs: Shooting, max_iterations: int = 60, rounds: int = _ROUNDS) -> _Found:
    """Parameters and starts together, from ``model`` on."""
    for _ in range(rounds):
        runs = runs.settled(model)
        search = _search(model, free, runs.reduced(model), runs)
        answer = minimise(
            search.residual,
            search.point,
            search.lower,
            search.upper,
            difference=_DIFFERENCE,
            cost_tolerance=_COST_TOLERANCE,
            most_slow=_MOST_SLOW,
            max_iterations=max_iterations,
        )
        values = model.values
        values[free.index] = answer.point * search.scale
        model = model.with_values(values)
        finer = runs.refined(model)
        if finer.n_substeps == runs.n_substeps and (not runs.tied or _small(answer.point - search.point, answer)):
            break
        runs = finer
    return _Found(model, answer, search.scale, runs)


def _small(change: Array, answer: Solution) -> bool:
    """True when a change moves the errors by far less than they are uncertain, were they white."""
    moved = answer.jacobian @ change
    limit = _SETTLED**2 * float(answer.residual @ answer.residual) / answer.residual.shape[0]
    return bool(float(moved @ moved) <= limit)


def _covariance(
    found: _Found, free: FreeParameters, equations: Equations, options: Options, errors: Mapping[str, float]
) -> Array:
    """Of the estimate, shape ``(n_free, n_free)``; see the module. ``errors``: what the start's standard errors were."""
    runs, draws = _prepared(found.model, free, equations, options)
    search = _search(found.model, free, runs.reduced(found.model), runs)
    jacobian = _secants(search, np.array([errors[name] for name in free.names])) / search.scale
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    scaled = jacobian / scale
    bread = np.linalg.pinv(scaled.T @ scaled, rcond=1e-12, hermitian=True)
    scores = np.array([scaled.T @ moved for moved in islice(draws, _DRAWS)])
    return np.asarray(bread @ (scores.T @ scores / _DRAWS) @ bread / np.outer(scale, scale), dtype=np.float64)


def _secants(search: Problem, errors: Array) -> Array:
    """Change of the residuals with each parameter over about its uncertainty, shape ``(n, n_free)``.

    Where a joint sticks and slips, a tangent can be many times steeper than the misfit is over that distance, and would promise
    as much more certainty.
    """
    columns = []
    for k, step in enumerate(np.clip(errors / search.scale, _DIFFERENCE, _WIDEST)):
        ahead, behind = search.point.copy(), search.point.copy()
        ahead[k], behind[k] = min(ahead[k] + step, search.upper[k]), max(behind[k] - step, search.lower[k])
        columns.append((search.residual(ahead) - search.residual(behind)) / (ahead[k] - behind[k]))
    return np.array(columns).T


def fit(structure: Model, records: Sequence[Record], options: Options) -> Identification:
    """Fit ``structure`` to ``records`` by output error.

    Raises:
        IdentificationError: the recordings can't determine it.
        InputError: an option isn't known.
    """
    begun = inverse_dynamics.fit_force(structure, records, options)
    start, free, found = begun.model, begun.free, begun.found
    known = standard_errors(free, begun.covariance)
    free = free.without({name for name in free.names if name not in known})
    runs = _runs(start, found, options)
    if runs.tied:
        runs = runs.weighed(start, force_errors(start, free, found))
    starts = [start, *spread_starts(start, free, found, options.starts - 1)]

    def briefly(model: Model) -> _Found:
        return _minimised(model, free, runs, _BRIEF, 1)

    def to_the_end(model: Model) -> _Found:
        return _minimised(model, free, runs.refined(model))

    best, ends = best_of(briefly, to_the_end, starts, free)
    given = best

    def fit(model: Model, now: FreeParameters) -> _Found:
        if now is free and model is given.model:
            return given
        brief = _minimised(model, now, runs.refined(model), _BRIEF, 1)
        # What is far behind after a few steps will not end below.
        return brief if brief.cost > _ABOVE * given.cost else _minimised(brief.model, now, runs.refined(brief.model))

    best, without = best_with_nested(best.model, free, fit, lambda one: (one.model, one.cost))
    free = free.without(set(without))
    messages = list(begun.messages)
    if without:
        messages.append(f"{', '.join(sorted(without))}: set to no effect, because the free run does not improve with it")
    if not options.start_states and not best.runs.tied and best.runs.start_matters(best.model):
        options = replace(options, start_states="tied")
        tied = replace(best.runs, tied=True).weighed(best.model, force_errors(best.model, free, found))
        best = _minimised(best.model, free, tied)
    covariance = _covariance(best, free, found, options, known)
    lost = _lost(best.model, free, covariance, known)
    if lost:
        free = free.without(set(lost))
        best = _minimised(best.model.with_values(_with(best.model, start, lost)), free, best.runs)
        covariance = _covariance(best, free, found, options, known)
        messages.append(f"{', '.join(lost)}: a free run does not determine it; held at the value of inverse dynamics")
    trouble = _escape(best, options)
    if not trouble and not best.answer.converged:
        remedy = "start nearer to the machine's values (--model), or shorten the runs (--horizon)"
        trouble = f"not converged after {best.answer.iterations} steps; {remedy}"
    covariance, doubts = reconciled(best.model, free, covariance, begun)
    fitted = Fitted(best.model, free, covariance, found, [*messages, *doubts])
    result = concluded(METHOD, fitted, records, options, trouble)
    return result if options.starts <= 1 else _with_starts(result, ends, free, covariance)


def _with_starts(result: Identification, ends: Ends, free: FreeParameters, covariance: Array) -> Identification:
    """``result`` with what the other starts came to."""
    fitted_errors = dict(zip(free.names, np.sqrt(np.diag(covariance)), strict=True))
    errors = np.array([fitted_errors.get(name, np.nan) for name in ends.names])
    doubt = ends.warning(errors)
    return replace(result, notes=(*result.notes, ends.note(errors)), warnings=(*result.warnings, *([doubt] if doubt else [])))


def _lost(model: Model, free: FreeParameters, covariance: Array, known: Mapping[str, float]) -> list[str]:
    """Parameters to be searched for whose error in the free run is as large as their value, and larger than by the force."""
    errors = np.sqrt(np.diag(covariance))
    return [
        name
        for k, name in enumerate(free.names)
        if not free.linear[k] and not errors[k] < abs(model.value(name)) and known[name] < min(errors[k], np.inf)
    ]


def _with(model: Model, other: Model, names: Sequence[str]) -> Array:
    """The values of ``model``, those of ``names`` as in ``other``, shape ``(n_parameters,)``."""
    return np.where([name in names for name in model.names], other.values, model.values)


def _escape(best: _Found, options: Options) -> str:
    """What to say when the motion found has little to do with the recorded one; empty when it has."""
    errors, _ = best.runs.errors(best.model)
    measured = np.concatenate([run.stretch.position for run in best.runs.runs])
    if float(np.std(errors)) < _LOST * float(np.std(measured)):
        return ""
    horizon = "whole recordings" if options.horizon is None else f"{options.horizon:g} s"
    return f"the free run does not follow the recording over {horizon}: not to be relied on; shorten the runs (--horizon)"


METHOD = Method(
    id="output-error",
    title="output error of a free run",
    needs="as inverse dynamics; a nearly complete structure, because errors of the force add up in a free run",
    source="Ljung 1999, chapter 7; multiple shooting: Bock 1983",
    fit=fit,
    predicts="position",
    uses=(*FILTER, *PARAMETERS, "horizon", "starts", "start_states", "continuity"),
)
