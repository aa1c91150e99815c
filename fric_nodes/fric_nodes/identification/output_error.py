"""Output error: the parameters whose simulated motion, led by the measured force alone, comes closest to the measured one.

Minimises sum (q - q_hat)^2 over free runs of the compiled simulation, from the values that inverse dynamics finds, by
trust-region least squares. With the whole recording as one run this is the published test of an axis model; on an axis
whose position drifts away under small force errors, shorter runs (``horizon``) start again from the measured state, their
friction state led along the measured motion, so that no error builds up through the integrator.
Source: Ljung 1999, chapter 7 (output error); the runs' start states are those of the filtered recording.

Standard errors: in a free run an error of the force adds up for as long as friction lets it, so that the residuals of a whole
recording are few independent numbers, however many samples they have; no window over their correlation sees that. The errors
of the force themselves are short. They are taken from the equations of inverse dynamics at the values found (away from
reversals, where those are wrong by their filter), put together anew from blocks, and led through the same runs; with J the
Jacobian, J' times what they change in the position is a draw of the score, and the covariance is (J'J)^-1 S (J'J)^-1 with S the
mean square of the draws. The noise of the position, drawn with them, adds its part.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from ..model import Model
from ..record import Array, Index, Record
from ..simulate import Predictor, Simulator, intervals, substeps
from . import inverse_dynamics
from .bootstrap import block_length, drawn_series
from .conclusion import Fitted, concluded, standard_errors
from .equations import Equations, Stretch
from .free_parameters import FreeParameters
from .gauss_newton import minimise
from .innovations import noise_of
from .problem import Problem
from .result import Identification, Method, Options
from .scoring import driving_force

__all__ = ["METHOD", "fit", "problem"]

_DRAWS = 60  # of force errors: their spread is known to a tenth
_AWAY = 5  # rows on either side of a reversal or a rest, in which the filters mix two directions of friction


@dataclass(frozen=True)
class _Run:
    """Samples ``first`` to ``last`` (exclusive) of a stretch, simulated on their own."""

    stretch: Stretch
    first: int
    last: int


def _runs(stretches: Sequence[Stretch], horizon: float | None) -> list[_Run]:
    runs = []
    for stretch in stretches:
        n = stretch.time.shape[0]
        length = n if horizon is None else max(round(horizon / stretch.sample_time), 10)
        runs += [_Run(stretch, first, min(first + length + 1, n)) for first in range(0, n - 1, length)]
    return [run for run in runs if run.last - run.first > 2]


def _part(signal: Array, run: _Run) -> Array:
    """The run's part of a signal with one value per interval, or the one value that it has."""
    return signal[run.first : run.last - 1] if signal.shape[0] > 1 else signal


def _errors(model: Model, runs: Sequence[_Run], n_substeps: int, push: Mapping[int, Array] | None = None) -> Array:
    """Simulated minus measured position over all runs [x]; ``push`` is added to the force of each interval, by run."""
    errors = []
    leader: tuple[Stretch, Predictor] | None = None
    for number, run in enumerate(runs):
        s, part = run.stretch, slice(run.first, run.last)
        simulator = Simulator(model, float(s.position[run.first]), float(s.velocity[run.first]))
        if model.has_slip_dynamics:
            if leader is None or leader[0] is not s:
                leader = (s, Predictor(model))
            simulator.friction_state[:] = leader[1].friction_state
            q, v, a = (_part(signal, run) for signal in (s.position, s.velocity, s.acceleration))
            load, temperature = _part(s.load, run), _part(s.temperature, run)
            leader[1].run(_part(s.time, run), q, v, a, s.sample_time, load, temperature)
        effort = intervals(s.effort[part], s.hold)
        if push is not None:
            effort = effort + push[number]
        states, _ = simulator.run(effort, s.sample_time, n_substeps, _part(s.load, run), _part(s.temperature, run))
        errors.append(states[:, 0] - s.raw_position[part][1:])
    return np.concatenate(errors)


def _search(model: Model, free: FreeParameters, runs: Sequence[_Run], n_substeps: int) -> Problem:
    """The position errors as a function of the free parameters, each relative to its value in ``model``."""
    values = model.values
    scale = np.abs(values[free.index])
    scale[scale == 0.0] = 1.0

    def residual(scaled: Array) -> Array:
        trial = values.copy()
        trial[free.index] = scaled * scale
        errors = _errors(model.with_values(trial), runs, n_substeps)
        # A run that escapes must cost much, not break the solver.
        return np.nan_to_num(errors, nan=1e6, posinf=1e6, neginf=-1e6)

    starts = np.cumsum([0, *(run.last - run.first - 1 for run in runs)])[:-1]
    return Problem(free.names, residual, values[free.index] / scale, free.lower / scale, free.upper / scale, scale, starts)


def problem(model: Model, free: FreeParameters, found: Equations, horizon: float | None) -> tuple[Problem, Iterator[Array]]:
    """The sum of squares that ``model`` is the minimum of, and draws of what errors of the force change in its residuals."""
    runs = _runs(found.stretches, horizon)
    n_substeps = max(substeps(model, stretch.sample_time) for stretch in found.stretches)
    return _search(model, free, runs, n_substeps), _draws(model, found, runs, n_substeps)


def _force_errors(model: Model, found: Equations) -> tuple[Array, Index]:
    """What the equations of inverse dynamics miss [F] away from reversals and rest, and the rows without their neighbour."""
    error = driving_force(model, found) - inverse_dynamics.predicted(model, found)
    steady = np.sign(found.velocity) * found.sliding
    good = steady != 0.0
    for shift in range(1, _AWAY + 1):
        good[shift:] &= steady[shift:] == steady[:-shift]
        good[:-shift] &= steady[shift:] == steady[:-shift]
    # Where next to nothing is away from reversals, what is left is better than nothing.
    row = np.flatnonzero(good if np.sum(good) >= 20 else found.sliding)
    return error[row], np.flatnonzero(np.isin(row, found.starts) | (np.diff(row, prepend=row[0]) > 1))


def _draws(model: Model, found: Equations, runs: Sequence[_Run], n_substeps: int) -> Iterator[Array]:
    """What force errors and position noise like those of the recording change in the position errors [x], without end."""
    error, starts = _force_errors(model, found)
    length = block_length(error[:, None])
    row_time = float(np.median(np.diff(found.time)))
    random = np.random.default_rng(1)
    undisturbed = _errors(model, runs, n_substeps)
    noises = [noise_of(run.stretch.raw_position) for run in runs]
    while True:
        push = {}
        noise = []
        for number, run in enumerate(runs):
            n = run.last - run.first - 1
            time = run.stretch.sample_time * np.arange(n)
            rows = drawn_series(error, int(time[-1] / row_time) + 2, length, starts, random)
            push[number] = np.interp(time, row_time * np.arange(rows.shape[0]), rows)
            noise.append(noises[number] * random.standard_normal(n))
        moved = np.nan_to_num(_errors(model, runs, n_substeps, push), nan=1e6, posinf=1e6, neginf=-1e6)
        yield moved - undisturbed + np.concatenate(noise)


def _covariance(model: Model, jacobian: Array, found: Equations, runs: Sequence[_Run], n_substeps: int) -> Array:
    """Of the estimate, shape ``(n_free, n_free)``; see the module."""
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    scaled = jacobian / scale
    bread = np.linalg.pinv(scaled.T @ scaled, rcond=1e-12, hermitian=True)
    scores = np.array([scaled.T @ moved for moved in islice(_draws(model, found, runs, n_substeps), _DRAWS)])
    return np.asarray(bread @ (scores.T @ scores / _DRAWS) @ bread / np.outer(scale, scale), dtype=np.float64)


def fit(structure: Model, records: Sequence[Record], options: Options) -> Identification:
    """Fit ``structure`` to ``records`` by output error.

    Raises:
        IdentificationError: the recordings can't determine it.
    """
    begun = inverse_dynamics.fit_force(structure, records, options)
    start, free, found = begun.model, begun.free, begun.found
    known = standard_errors(free, begun.covariance)
    free = free.without({name for name in free.names if name not in known})
    runs = _runs(found.stretches, options.horizon)
    # The same for every trial: a change from one number of sub-steps to the next would look like a slope.
    n_substeps = max(substeps(start, stretch.sample_time) for stretch in found.stretches)
    search = _search(start, free, runs, n_substeps)
    answer = minimise(search.residual, search.point, search.lower, search.upper)
    values = start.values
    values[free.index] = answer.point * search.scale
    fitted_model = start.with_values(values)
    covariance = _covariance(fitted_model, answer.jacobian / search.scale, found, runs, n_substeps)
    trouble = ""
    if not answer.converged:
        remedy = "start nearer to the machine's values (--model), or shorten the runs (--horizon)"
        trouble = f"not converged after {answer.iterations} steps; {remedy}"
    fitted = Fitted(fitted_model, free, covariance, found, begun.messages)
    return concluded(METHOD.id, fitted, records, options, trouble)


METHOD = Method(
    id="output-error",
    title="output error of a free run",
    needs="as inverse dynamics; a structure that is nearly complete, since a free run adds up every error",
    source="Ljung 1999, chapter 7",
    fit=fit,
)
