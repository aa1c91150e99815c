"""Output error: the parameters whose simulated motion, led by the measured force alone, comes closest to the measured one.

Minimises sum (q - q_hat)^2 over free runs of the compiled simulation, from the values that inverse dynamics finds, by
trust-region least squares. With the whole recording as one run this is the published test of an axis model; on an axis
whose position drifts away under small force errors, shorter runs (``horizon``) start again from the measured state, their
friction state led along the measured motion, so that no error builds up through the integrator.
Source: Ljung 1999, chapter 7 (output error); the runs' start states are those of the filtered recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model import Model
from ..record import Array, Record
from ..simulate import Predictor, Simulator, intervals, substeps
from . import inverse_dynamics
from .conclusion import Fitted, concluded, standard_errors
from .equations import Stretch
from .gauss_newton import minimise
from .result import Identification, Method, Options
from .statistics import sandwich_covariance

__all__ = ["METHOD", "fit"]


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


def _errors(model: Model, runs: Sequence[_Run], n_substeps: int) -> Array:
    """Simulated minus measured position over all runs [x]."""
    errors = []
    leader: tuple[Stretch, Predictor] | None = None
    for run in runs:
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
        states, _ = simulator.run(effort, s.sample_time, n_substeps, _part(s.load, run), _part(s.temperature, run))
        errors.append(states[:, 0] - s.raw_position[part][1:])
    return np.concatenate(errors)


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
    values = start.values
    scale = np.abs(values[free.index])
    scale[scale == 0.0] = 1.0

    # The same for every trial: a change from one number of sub-steps to the next would look like a slope.
    n_substeps = max(substeps(start, stretch.sample_time) for stretch in found.stretches)

    def residual(scaled: Array) -> Array:
        trial = values.copy()
        trial[free.index] = scaled * scale
        errors = _errors(start.with_values(trial), runs, n_substeps)
        # A run that escapes must cost much, not break the solver.
        return np.nan_to_num(errors, nan=1e6, posinf=1e6, neginf=-1e6)

    answer = minimise(residual, values[free.index] / scale, free.lower / scale, free.upper / scale)
    values[free.index] = answer.point * scale
    starts = np.cumsum([0, *(run.last - run.first - 1 for run in runs)])[:-1]
    jacobian = answer.jacobian / scale
    covariance = sandwich_covariance(jacobian, answer.residual, np.ones(answer.residual.shape[0]), starts)
    trouble = ""
    if not answer.converged:
        remedy = "start nearer to the machine's values (--model), or shorten the runs (--horizon)"
        trouble = f"not converged after {answer.iterations} steps; {remedy}"
    fitted = Fitted(start.with_values(values), free, covariance, begun.found, begun.messages)
    return concluded(METHOD.id, fitted, records, options, trouble)


METHOD = Method(
    id="output-error",
    title="output error of a free run",
    needs="as inverse dynamics; a structure that is nearly complete, since a free run adds up every error",
    source="Ljung 1999, chapter 7",
    fit=fit,
)
