"""Prediction error: the parameters whose model, corrected at every sample, predicts the next position best.

What is predicted, and how the model follows the recording, is in :mod:`fric.identification.innovations`; the tracking
index of its correction is the one with the smallest innovations.

The noise of the recorded force never moved the axis, yet it moves the model, and an innovation holds the model's answer to
it. So does the noise of the position. Let e(theta) be the innovations. With small noise they are the answer to the true
signals, which vanishes at the true parameters, plus a linear answer to the noise of mean square V(theta); the latter is
smaller for a mass, a stiffness, or a damping that is too large, and the plain sum of squares ends up there. V can be known:
noise like that of the recording, drawn once, is added to its signals, and V(theta) is the mean square of what that changes
in the innovations. With C = mean e^2 at a reference point and V_0 the value there,

    r(theta) = e(theta) / sqrt(1 + (V(theta) - V_0) / C)

has a mean square that is smallest at the truth: E mean r^2 = C at the truth, whatever the slope of V, and more elsewhere.
What is in C besides V, such as a force that acts without being recorded, stays as in plain least squares. Noise also changes
the mean of the innovations, where it shakes a contact loose; the mean of what drawn noise and its opposite change is taken
off e.

How much of the fast part of the recorded force is noise, and how much did act, the position tells: noise is answered by the
model and not by the axis. That share is the regression of e on what the fast part of the force changes in e, between 0 and
1.

Standard errors: the sum of the scores s_k = e_k e'_k - d_k d'_k, with d the answer to the drawn noise and ' a derivative, is
zero at the estimate. Its derivative is E'E' - D'D' in the mean, without the noise in E. Both are summed over parts of the
recording longer than the correlation of the scores, and the covariance follows from these sums
(:func:`fric.identification.statistics.by_parts`): the damping of bristles shows in a few instants in which sliding
breaks loose, and each of them counts for much. What the drawn noise adds to the error is in the scores as well.

The fit starts from the values of inverse dynamics and, since a Stribeck velocity or a stiffness has wrong valleys of its
own, from others over their range; the best after a few steps goes on. Source: Ljung 1999, sections 7.2 and 7.4 (prediction
errors of a state-space model). The correction for noise is derived here; it is of the kind of corrected scores (Nakamura
1990), found by simulation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import savgol_filter

from ...method_settings import FILTER, PARAMETERS
from ...model import Model
from ...record import Array, Index, Record
from ...simulation import substeps
from ..agreement import reconciled, unsuited
from ..conclusion import Fitted, concluded, standard_errors
from ..equations import Equations
from ..free_parameters import FreeParameters, candidates
from ..gauss_newton import Solution, minimise
from ..innovations import SETTLING, Run, excerpt, innovations, runs_of
from ..problem import Problem
from ..result import Identification, IdentificationError, Method, Options
from ..statistics import bartlett_lag, by_parts, definite, parts_of
from . import inverse_dynamics

__all__ = ["METHOD", "fit", "problem"]

_INDICES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
_STEP_OF_RATE = 0.15  # coarser than a simulation's: from one sample to the next its error is far below any noise
_DIFFERENCE = 1e-3  # relative step of derivatives: wide enough to reach over the kinks of sticking
_ENOUGH = 9000  # samples that the choice between starts looks at
_START_STEPS = 5
_MOST_STEPS = 40
_DRAWS = 3  # of the noise
_NEARLY_ALL = 0.8  # of the innovations' power, from which on noise is taken to be all of it
_ROUNDS = 3  # at most, of noise and tracking index found, and fit
_NOTHING = 1e-6  # numerical: of the value by inverse dynamics
_SETTLED = 0.1  # change of the share of noise that needs no further round


@dataclass(frozen=True, eq=False)
class _Fit:
    """The innovations as a function of the free parameters, each relative to its value at the reference point.

    Attributes:
        model: the reference point.
        free: the free parameters.
        runs: the recording.
        drawn: the recording with more noise.
        index: tracking index.
        n_substeps: steps of the model per sample.
    """

    model: Model
    free: FreeParameters
    runs: Sequence[Run]
    drawn: Sequence[Sequence[Run]]
    index: float
    n_substeps: int

    @property
    def scale(self) -> Array:
        """Size of the free parameters, shape ``(n_free,)``."""
        size = np.abs(self.model.values[self.free.index])
        size[size == 0.0] = 1.0
        return size

    def at(self, point: Array) -> Model:
        """The model at a point."""
        values = self.model.values
        values[self.free.index] = point * self.scale
        return self.model.with_values(values)

    def both(self, point: Array) -> tuple[Array, Array]:
        """Innovations without what noise adds to their mean [x], shape ``(n,)``, and parts of their noise, ``(n_parts, n)``.

        The sum of the parts' mean squares is that of the noise. Drawn noise and its opposite give, by half their difference,
        the part that is linear in it, and by half their sum what it adds to the mean: friction that noise shakes loose.
        """
        model = self.at(point)
        plain = innovations(model, self.runs, self.index, self.n_substeps)
        if not self.drawn:
            return plain, np.empty((0, plain.shape[0]))
        answers = [innovations(model, runs, self.index, self.n_substeps) - plain for runs in self.drawn]
        up, down = np.array(answers[::2]), np.array(answers[1::2])
        odd, even = 0.5 * (up - down), 0.5 * (up + down)
        n = odd.shape[0]
        middle = np.mean(even, axis=0)
        # The mean of n draws is taken off: the recording's own deviation from it and the draws' are left.
        rest = (even - middle) * math.sqrt((1.0 + 1.0 / n) / max(n - 1, 1))
        return plain - middle, np.concatenate([odd / math.sqrt(n), rest])

    def problem(self) -> Problem:
        """The corrected sum of squares around the reference point, whose innovations are of the order of one there."""
        scale = self.scale
        lower, upper = self.free.lower / scale, self.free.upper / scale
        start = np.clip(self.model.values[self.free.index] / scale, lower, upper)
        plain, changed = self.both(start)
        share = _rated(float(np.mean(plain**2)), _power(changed))

        def weigh(point: Array, weight: Array) -> Array:
            # Noise counts with the weight of the samples that it is in.
            square = max(float(weight @ plain**2), 1e-300)
            found, moved = self.both(point)
            noise = share * float(np.sum((moved**2 - changed**2) @ weight))
            unit = square / plain.shape[0] * max(1.0 + noise / square, 1e-3)
            return np.asarray(np.sqrt(weight) * found / math.sqrt(unit), dtype=np.float64)

        def residual(point: Array) -> Array:
            return weigh(point, np.ones(plain.shape[0]))

        starts = np.cumsum([0, *(run.effort.shape[0] - SETTLING for run in self.runs)])[:-1]
        return Problem(self.free.names, residual, start, lower, upper, scale, starts, weigh)

    def minimised(self, max_iterations: int) -> Solution:
        """Where the corrected sum of squares is smallest, from the reference point on."""
        found = self.problem()
        return minimise(
            found.residual, found.point, found.lower, found.upper, difference=_DIFFERENCE, max_iterations=max_iterations
        )

    def covariance(self, starts: Index) -> Array:
        """Of the estimate that the reference point is, shape ``(n_free, n_free)``."""
        n = self.free.index.shape[0]
        scale = self.scale
        middle = self.model.values[self.free.index] / scale
        plain, changed = self.both(middle)
        square, known = float(np.mean(plain**2)), _power(changed)
        share = _rated(square, known)
        slopes, noise_slopes = np.empty((n, plain.shape[0])), np.empty((n, *changed.shape))
        for k in range(n):
            ahead, behind = middle.copy(), middle.copy()
            ahead[k] = min(middle[k] + _DIFFERENCE, self.free.upper[k] / scale[k])
            behind[k] = max(middle[k] - _DIFFERENCE, self.free.lower[k] / scale[k])
            above, below = self.both(ahead), self.both(behind)
            slopes[k] = (above[0] - below[0]) / (ahead[k] - behind[k])
            noise_slopes[k] = (above[1] - below[1]) / (ahead[k] - behind[k])
        score = slopes * plain
        if self.drawn:
            noise_score = np.einsum("knt,nt->kt", noise_slopes, changed)
            score = score - share * noise_score
            if share != 1.0:
                # The size of the noise is itself an estimate, from the same innovations.
                excess = plain**2 - share * np.sum(changed**2, axis=0)
                score = score - np.outer(np.sum(noise_score, axis=1) / np.sum(changed**2), excess)
        lag = max(bartlett_lag(each) for each in score)
        parts = parts_of(score.shape[1], lag, starts)
        sums = np.add.reduceat(score, parts, axis=1).T
        whole = np.empty((2, parts.shape[0], n, n))
        for number, (first, last) in enumerate(zip(parts, [*parts[1:], score.shape[1]], strict=True)):
            part = slice(first, last)
            whole[0, number] = slopes[:, part] @ slopes[:, part].T
            whole[1, number] = np.einsum("knt,lnt->kl", noise_slopes[:, :, part], noise_slopes[:, :, part])
        plain_sum, noise_sum = np.sum(whole, axis=1)
        corrected = plain_sum - share * noise_sum
        kept_whole = definite(corrected, plain_sum)
        # What keeps the whole definite is shared among the parts.
        kept = whole[0] - share * whole[1] + (kept_whole - corrected) / parts.shape[0]
        return by_parts(kept, sums) * np.outer(scale, scale)


def _rated(square: float, known: float) -> float:
    """By how much the power of the drawn noise is to be multiplied, where the innovations have the power ``square``.

    Noise can't explain more than there is; and where it explains nearly all, the difference is the error of its own estimate.
    """
    return square / known if known > _NEARLY_ALL * square else 1.0


def _power(parts: Array) -> float:
    return float(np.sum(np.mean(parts**2, axis=1)))


def _with_noise(runs: Sequence[Run], force_share: float) -> list[list[Run]]:
    """Copies of the recording with noise like its own added and then taken off, the same at every call."""
    random = np.random.default_rng(1)
    drawn = []
    for _ in range(_DRAWS):
        up, down = [], []
        for run in runs:
            effort: Array = run.force_noise(random) * math.sqrt(force_share)
            position: Array = run.noise * random.standard_normal(run.effort.shape)
            up.append(run.moved(effort, position))
            down.append(run.moved(-effort, -position))
        drawn += [up, down]
    return drawn


def _share_that_is_noise(model: Model, runs: Sequence[Run], index: float, n_substeps: int) -> float:
    """How much of the fast part of the recorded force did not act, as a share of its power."""
    without = []
    for run in runs:
        limit = 4.0 * run.effort_noise
        fast = np.clip(run.effort - savgol_filter(run.effort, 7, 3), -limit, limit)
        without.append(run.moved(-fast, np.zeros_like(fast)))
    left = innovations(model, runs, index, n_substeps)
    answer = left - innovations(model, without, index, n_substeps)
    power = float(answer @ answer)
    return min(max(float(left @ answer) / power, 0.0), 1.0) if power > 0.0 else 0.0


def _prepared(model: Model, free: FreeParameters, runs: Sequence[Run], force_share: float) -> _Fit:
    """The fit around ``model``, whose innovations tell the tracking index."""
    n_substeps = _substeps(model, runs)
    index = min(_INDICES, key=lambda trial: float(np.sum(innovations(model, runs, trial, n_substeps) ** 2)))
    return _Fit(model, free, runs, _with_noise(runs, force_share), index, n_substeps)


def _substeps(model: Model, runs: Sequence[Run]) -> int:
    return max(substeps(model, run.sample_time, _STEP_OF_RATE) for run in runs)


def _other_starts(start: Model, free: FreeParameters, found: Equations) -> list[Model]:
    """The start with one nonlinear parameter at a time moved to a quarter, half and three quarters of its candidates."""
    declared = list(start.parameters())
    level = float(np.median(np.abs(found.force)))
    others = []
    for k in free.only(False).index:
        tried = candidates(declared[int(k)].declaration.dimension, found, level)
        for share in (0.25, 0.5, 0.75):
            if tried.size:
                values = start.values
                values[int(k)] = tried[round(share * (tried.size - 1))]
                others.append(start.with_values(values))
    return others


def _best_start(start: Model, free: FreeParameters, runs: Sequence[Run], others: Sequence[Model]) -> Model:
    """The one of the starts that comes furthest in a few steps, with the state pulled hard to the measurement."""
    if not others:
        return start
    best, least = start, math.inf
    for trial in (start, *others):
        fit = _Fit(trial, free, runs, (), _INDICES[-1], _substeps(trial, runs))
        reached = fit.at(fit.minimised(_START_STEPS).point)
        cost = float(np.sum(innovations(reached, runs, _INDICES[-1], _substeps(reached, runs)) ** 2))
        if cost < least:
            best, least = reached, cost
    return best


def _settled(model: Model, free: FreeParameters, runs: Sequence[Run]) -> tuple[Model, Solution, _Fit]:
    """The corrected fit from ``model`` on: what it found, how it ended, and with which settings."""
    rough = _prepared(model, free, runs, 0.0)
    model = rough.at(replace(rough, drawn=()).minimised(_MOST_STEPS).point)
    share = _share_that_is_noise(model, runs, rough.index, _substeps(model, runs))
    for _ in range(_ROUNDS):
        problem = _prepared(model, free, runs, share)
        answer = problem.minimised(_MOST_STEPS)
        model = problem.at(answer.point)
        # Steps, tracking index and noise are those of the point before: where they change much, another round.
        before, share = share, _share_that_is_noise(model, runs, problem.index, problem.n_substeps)
        if abs(share - before) <= _SETTLED and _substeps(model, runs) <= problem.n_substeps:
            break
    return model, answer, problem


def problem(model: Model, free: FreeParameters, records: Sequence[Record], found: Equations) -> Problem:
    """The sum of squares that ``model`` is the minimum of, for what goes on from there."""
    runs = [run for record in records for run in runs_of(record)]
    share = _share_that_is_noise(model, runs, _prepared(model, free, runs, 0.0).index, _substeps(model, runs))
    return _prepared(model, free.within_reach(model, found), runs, share).problem()


def _above_nothing(free: FreeParameters, start: Model) -> FreeParameters:
    """``free`` with what must be positive kept above nearly nothing, so that no step makes a prediction infinite."""
    least = {p.name: _NOTHING * p.value for p in start.parameters() if p.declaration.positive}
    return replace(free, lower=np.maximum(free.lower, [least.get(name, -math.inf) for name in free.names]))


def _refuse_nothing(model: Model, start: Model, source: str) -> None:
    """Refuse an inertia or a stiffness that comes out at nearly nothing beside its value in ``start``."""
    for p in model.parameters():
        if p.declaration.positive and p.value < 2.0 * _NOTHING * start.value(p.name):
            raise IdentificationError(
                source,
                f"from sample to sample its noise hides what the force moves: '{p.name}' comes out at nothing",
                "use the method output-error or inverse-dynamics",
            )


def fit(structure: Model, records: Sequence[Record], options: Options) -> Identification:
    """Fit ``structure`` to ``records`` by prediction error.

    Raises:
        IdentificationError: the recordings can't determine it, or what must be positive comes out at nothing.
    """
    begun = inverse_dynamics.fit_force(structure, records, options)
    start, free, found = begun.model, begun.free, begun.found
    known = standard_errors(free, begun.covariance)
    free = free.without({name for name in free.names if name not in known})
    runs = [run for record in records for run in runs_of(record)]
    free = _above_nothing(free.within_reach(start, found), start)
    model = _best_start(start, free, excerpt(runs, _ENOUGH), _other_starts(start, free, found))
    starts = np.cumsum([0, *(run.effort.shape[0] - SETTLING for run in runs)])[:-1]
    model, answer, problem = _settled(model, free, runs)
    _refuse_nothing(model, start, records[0].source)
    covariance = replace(problem, model=model).covariance(starts)
    remedy = "start nearer to the machine's values (--model)"
    trouble = "" if answer.converged else f"not converged after {_MOST_STEPS} steps; {remedy}"
    covariance, doubts = reconciled(model, free, covariance, begun, unsuited(records))
    fitted = Fitted(model, free, covariance, found, [*begun.messages, *doubts])
    return concluded(METHOD, fitted, records, options, trouble)


METHOD = Method(
    id="prediction-error",
    title="prediction error from sample to sample",
    needs="as inverse dynamics, and a position signal that is fine beside what the force noise moves in one sample",
    source="Ljung 1999, sections 7.2 and 7.4",
    fit=fit,
    predicts="position",
    uses=(*FILTER, *PARAMETERS),
)
