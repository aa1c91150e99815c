"""Prediction error: the parameters whose model, corrected at every sample, predicts the next position best.

The model is simulated from sample to sample, so that what happens between samples (a body ringing on its bristles, a stop) is
not filtered away, and its state is pulled to the measured position after each one, so that no error builds up through the
integrator. Minimises the sum of squared innovations e_k = q_k - q_hat(k | k-1).

The correction is the steady-state Kalman filter of a double integrator whose acceleration is disturbed by the noise of the
force, with standard deviation s_a, and whose position is read with noise s_q. Its gains follow from the tracking index
L = s_a h^2 / s_q (Kalata 1984): r = (4 + L - sqrt(8 L + L^2)) / 4, alpha = 1 - r^2, beta = 2 (2 - alpha) - 4 sqrt(1 -
alpha). The index is chosen from the data, as the one with the smallest innovations. With a right model the innovations are
white, and least squares is maximum likelihood.

Where the noise of the force rules (a large index), an innovation is h^2 / (2 m) times that noise, and its plain sum of squares
would reward a mass that is too large. It is then weighed with the mass, e_k m: the force that is missing, regressed on a
motion that is known well, which is free of that bias.

The fit starts from the values of inverse dynamics and, since a Stribeck
velocity or a stiffness has wrong valleys of its own, from others over their range; the best after a few steps goes on.
Source: Ljung 1999, section 7.2 and 7.4 (prediction errors of a state-space model).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ..model import Model
from ..record import Array, Record
from ..simulate import intervals, substeps
from . import inverse_dynamics
from .conclusion import Fitted, concluded, standard_errors
from .equations import Equations, surroundings
from .free_parameters import FreeParameters, candidates
from .result import Identification, Method, Options
from .statistics import sandwich_covariance

__all__ = ["METHOD", "Run", "fit", "innovations", "runs_of"]

_INDICES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
_STEP_OF_RATE = 0.25  # coarser than a simulation's: from one sample to the next its error is far below any noise
_FORCE_NOISE_RULES = 0.3  # tracking index from which the noise of the force outweighs that of the position
_SETTLING = 20  # innovations dropped at the start of each run
_ENOUGH = 9000  # samples that the choice between starts looks at


def _gains(index: float) -> tuple[float, float]:
    """Alpha and beta for a tracking index."""
    r = (4.0 + index - math.sqrt(8.0 * index + index * index)) / 4.0
    alpha = 1.0 - r * r
    return alpha, 2.0 * (2.0 - alpha) - 4.0 * math.sqrt(1.0 - alpha)


@dataclass(frozen=True, eq=False)
class Run:
    """A valid contiguous part of a recording as it is, uneven stamps and all.

    Attributes:
        step: time between samples [s], shape ``(n,)``.
        effort: force over each interval [F], shape ``(n,)``.
        position: at the end of each interval [x], shape ``(n,)``.
        start: position and velocity at the beginning [x], [x/s].
        load: relative normal load, one value or ``(n,)``.
        temperature: difference from reference [K], one value or ``(n,)``.
        noise: of the position signal [x].
    """

    step: Array
    effort: Array
    position: Array
    start: tuple[float, float]
    load: Array
    temperature: Array
    noise: float

    def part(self, first: int, last: int) -> Run:
        """Intervals ``first`` to ``last`` (exclusive) as a run of their own."""
        position = self.position[first:last]
        begin = self.start
        if first > 0:
            before = float(self.position[first - 1])
            begin = (before, float((position[0] - before) / self.step[first]))
        load = self.load[first:last] if self.load.shape[0] > 1 else self.load
        temperature = self.temperature[first:last] if self.temperature.shape[0] > 1 else self.temperature
        return Run(self.step[first:last], self.effort[first:last], position, begin, load, temperature, self.noise)


def runs_of(record: Record) -> list[Run]:
    """The valid contiguous parts of ``record`` that are long enough to learn from."""
    load, temperature = surroundings(record)
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], record.mask, [False]]).astype(np.int8)))
    found = []
    for first, last in zip(bounds[::2].tolist(), bounds[1::2].tolist(), strict=True):
        if last - first < 10 * _SETTLING:
            continue
        position = record.position[first:last]
        step = np.diff(record.time[first:last])
        found.append(
            Run(
                step=step,
                effort=np.ascontiguousarray(intervals(record.effort[first:last], record.effort_hold)),
                position=np.ascontiguousarray(position[1:]),
                start=(float(position[0]), float((position[1] - position[0]) / step[0])),
                load=load[first : last - 1] if load.shape[0] > 1 else load,
                temperature=temperature[first : last - 1] if temperature.shape[0] > 1 else temperature,
                noise=_position_noise(position),
            )
        )
    return found


def innovations(model: Model, run: Run, index: float) -> Array:
    """Measured minus predicted position at each sample but the first ones [x]."""
    state = np.ascontiguousarray(model.plant.start(np.array(model.plant_values), *run.start), dtype=np.float64)
    loops = model.loops
    found = np.empty(run.effort.shape[0])
    alpha, beta = _gains(index)
    n_steps = substeps(model, float(np.median(run.step)), _STEP_OF_RATE)
    loops.observe(
        model.values, run.effort, run.position, run.step, n_steps, run.load, run.temperature, alpha, beta, run.noise,
        state, *model.inner_states(), found,
    )  # fmt: skip
    return found[_SETTLING:]


def _position_noise(position: Array) -> float:
    """Noise of a position signal [x], from its third differences, which no smooth motion survives."""
    return float(np.median(np.abs(np.diff(position, 3)))) / (0.6745 * math.sqrt(20.0))


def _minimise(
    start: Model, free: FreeParameters, runs: Sequence[Run], index: float, n_steps: int
) -> tuple[Array, Array, Array, bool]:
    """Values, scaled innovations, their derivative, and whether the solver converged, from ``start`` on."""
    values = start.values
    scale = np.abs(values[free.index])
    scale[scale == 0.0] = 1.0

    inertia = start.plant.inertia(*start.plant_values)

    def errors(scaled: Array) -> Array:
        trial = values.copy()
        trial[free.index] = scaled * scale
        model = start.with_values(trial)
        found = np.concatenate([innovations(model, run, index) for run in runs])
        if index >= _FORCE_NOISE_RULES:
            found = found * (model.plant.inertia(*model.plant_values) / inertia)
        # A run that escapes must cost much, not break the solver.
        return np.asarray(np.nan_to_num(found, nan=1e3, posinf=1e3, neginf=-1e3), dtype=np.float64)

    point = np.clip(values[free.index], free.lower, free.upper) / scale
    # Innovations are nanometres to micrometres: brought to one, so that the solver's tolerances mean something.
    unit = 1.0 / max(float(np.sqrt(np.mean(errors(point) ** 2))), 1e-300)
    answer = least_squares(
        lambda scaled: unit * errors(scaled),
        point,
        bounds=(free.lower / scale, free.upper / scale),
        x_scale="jac",
        diff_step=1e-4,
        xtol=1e-6,
        ftol=1e-7,
        max_nfev=n_steps,
    )
    values[free.index] = np.asarray(answer.x) * scale
    return values, np.asarray(answer.fun), np.asarray(answer.jac) / scale, answer.status > 0


def _excerpt(runs: Sequence[Run]) -> list[Run]:
    """As much of the beginning, the middle and the end of each run as it takes to choose between starts."""
    total = sum(run.effort.shape[0] for run in runs)
    share = min(1.0, _ENOUGH / total)
    parts = []
    for run in runs:
        n = run.effort.shape[0]
        length = int(share * n / 3)
        if length < 10 * _SETTLING:
            parts.append(run)
            continue
        parts += [run.part(first, first + length) for first in (0, (n - length) // 2, n - length)]
    return parts


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
        values, _, _, _ = _minimise(trial, free, runs, _INDICES[-1], 8)
        reached = trial.with_values(values)
        cost = sum(float(np.sum(innovations(reached, run, _INDICES[-1]) ** 2)) for run in runs)
        if cost < least:
            best, least = reached, cost
    return best


def fit(structure: Model, records: Sequence[Record], options: Options) -> Identification:
    """Fit ``structure`` to ``records`` by prediction error.

    Raises:
        IdentificationError: the recordings can't determine it.
    """
    begun = inverse_dynamics.fit_force(structure, records, options)
    start, free, found = begun.model, begun.free, begun.found
    known = standard_errors(free, begun.covariance)
    free = free.without({name for name in free.names if name not in known})
    runs = [run for record in records for run in runs_of(record)]
    free = free.within_reach(start, found)
    start = _best_start(start, free, _excerpt(runs), _other_starts(start, free, found))
    index = min(_INDICES, key=lambda trial: sum(float(np.sum(innovations(start, run, trial) ** 2)) for run in runs))
    values, left, jacobian, converged = _minimise(start, free, runs, index, 60)
    lengths = [run.effort.shape[0] - _SETTLING for run in runs]
    starts = np.cumsum([0, *lengths])[:-1]
    covariance = sandwich_covariance(jacobian, left, np.ones(left.shape[0]), starts)
    trouble = "" if converged else "not converged after 60 steps; start nearer to the machine's values (--model)"
    fitted = Fitted(start.with_values(values), free, covariance, begun.found, begun.messages)
    return concluded(METHOD.id, fitted, records, options, trouble)


METHOD = Method(
    id="prediction-error",
    title="prediction error from sample to sample",
    needs="as inverse dynamics, and a position signal that is fine beside what the force noise moves in one sample",
    source="Ljung 1999, sections 7.2 and 7.4",
    fit=fit,
)
