"""Free runs over a recording, one or many, and what is done about the state in which each of them starts.

A run takes its start from the recording (:mod:`fric.signals.initial_state`), which leaves it uncertain by the
noise of the position, and by motion too quick to average over. So each start has a position and a velocity of its own to be
found beside the parameters theta,

    min  sum |r_i(theta, s_i)|^2 + sum_c w_c^2 ((s_ic - s_ic') / sigma_ic)^2  (+ kappa^2 sum of squared jumps between runs),

tied to the measured state s' by its standard error sigma (multiple shooting, Bock 1983; the tie is a Gaussian prior), or free.
w_c makes both sums comparable: w_c^2 = sum (J_c' d)^2 / sum |J_c|^2, with J_c the change of the errors with start component c
and d what force errors and noise change in them, is the mean square of the errors if they are white, and more if they are
correlated. Free starts give the better estimates even where the measured state is good: they take out of each run what a force
error before and early in it has done, the largest and most correlated part of its errors.

The path is not required to be continuous from run to run. A force error bends it away from the measured one, twice integrated,
and a continuous path would carry that through the whole recording, just as one long run does. It can be asked for (kappa),
where the force is known well.

The starts are eliminated: with J_s the change of all residuals with all starts, the residuals less what the starts can explain,
r - J_s (J_s'J_s)^-1 J_s' r, are a function of theta alone, whose minimum with J_s taken there is that of the whole. It is found
with J_s held, then the starts are moved and J_s taken anew, until they stay.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..model import Model
from ..record import Array, Index
from ..signals.initial_state import initial_state
from ..signals.resolution import noise_of
from ..simulation import Predictor, Simulator, intervals, substeps
from .equations import Equations
from .force_errors import ForceErrors
from .stretch import Stretch

__all__ = ["Run", "Shooting", "runs_over", "shooting"]

# Times the standard error: as good as no tie, but the velocity of a run that stays at rest is not left undetermined.
_FREE = np.array([1e6, 1e3])
_ESCAPED = 1e6
_GROWTH = 8  # of the number of steps, at most
_WEIGHING_DRAWS = 8
_SETTLING_STEPS = 3
_RESOLVED = 1e-9  # of the travel
_MATTERS = 0.03  # of the errors: a tenth of the parameters' variance at most, where these are a hundred independent numbers


@dataclass(frozen=True, eq=False)
class Run:
    """Samples ``first`` to ``last`` (exclusive) of a stretch, simulated on their own.

    Attributes:
        stretch: that it is part of.
        first: sample at which it starts.
        last: sample before which it ends.
        effort: over each interval [F].
        measured: position at the end of each interval [x].
        load: one value, or one per interval.
        temperature: the same.
        follows: True when it starts where the run before it ends.
    """

    stretch: Stretch
    first: int
    last: int
    effort: Array
    measured: Array
    load: Array
    temperature: Array
    follows: bool

    @property
    def n(self) -> int:
        """Number of intervals."""
        return self.last - self.first - 1


def runs_over(stretches: Sequence[Stretch], horizon: float | None) -> list[Run]:
    """Runs of ``horizon`` [s] each that share their last sample with the next one's first; None: one per stretch."""
    runs = []
    for s in stretches:
        n = s.time.shape[0]
        length = n if horizon is None else max(round(horizon / s.sample_time), 10)
        for first in range(0, n - 1, length):
            last = min(first + length + 1, n)
            if last - first < 4:
                continue
            load, temperature = (x[first : last - 1] if x.shape[0] > 1 else x for x in (s.load, s.temperature))
            effort = np.ascontiguousarray(intervals(s.effort[first:last], s.hold))
            runs.append(Run(s, first, last, effort, s.raw_position[first + 1 : last], load, temperature, first > 0))
    return runs


@dataclass(frozen=True, eq=False)
class Shooting:
    """All runs, and where each starts.

    Attributes:
        runs: of all recordings.
        n_substeps: steps per sample of each run: the same for every trial, since a change of it would look like a slope.
        most_substeps: of each run, up to which that number may grow: a search may stray to where a step would take for ever.
        start: position and velocity of each run, shape ``(n_runs, 2)``.
        measured: the same, as measured.
        spread: its standard error, shape ``(n_runs, 2)``.
        tied: False when starts are taken as measured.
        free: True when nothing ties them to what was measured.
        continuity: weight of jumps between runs.
        weight: w of position and velocity, shape ``(2,)``.
    """

    runs: Sequence[Run]
    n_substeps: Sequence[int]
    most_substeps: Sequence[int]
    start: Array
    measured: Array
    spread: Array
    tied: bool
    free: bool = False
    continuity: float = 0.0
    weight: Array = field(default_factory=lambda: np.ones(2))

    @property
    def first_errors(self) -> Index:
        """Number of the first error of each run, and of the end."""
        return np.cumsum([0, *(run.n for run in self.runs)])

    def errors(self, model: Model, push: Sequence[Array] | None = None, start: Array | None = None) -> tuple[Array, Array]:
        """Simulated minus measured position [x], shape ``(n,)``, and the state at the end of each run, ``(n_runs, 2)``.

        Args:
            model: that is simulated.
            push: added to the force of each interval of each run [F].
            start: of each run, where it isn't :attr:`start`.
        """
        start = self.start if start is None else start
        first = self.first_errors
        errors, ends = np.empty(int(first[-1])), np.empty((len(self.runs), 2))
        leaders = _leaders(model, self.runs) if model.has_slip_dynamics else None
        simulator = Simulator(model, fused=True)
        encoder = list(model.plant.encoder)
        values = np.array(model.plant_values)
        friction, memory = (part.copy() for part in (simulator.friction_state, simulator.memory))
        for number, run in enumerate(self.runs):
            simulator.states[:] = model.plant.start(values, float(start[number, 0]), float(start[number, 1]))
            simulator.friction_state[:] = friction if leaders is None else leaders[number]
            simulator.memory[:] = memory
            simulator.time = float(run.stretch.time[run.first])
            effort = run.effort if push is None else run.effort + push[number]
            states, _ = simulator.run(effort, run.stretch.sample_time, self.n_substeps[number], run.load, run.temperature)
            np.subtract(states[:, encoder[0]], run.measured, out=errors[first[number] : first[number + 1]])
            ends[number] = states[-1, encoder]
        # A run that escapes must cost much, not break the solver.
        return _finite(errors), _finite(ends)

    def residual(self, model: Model) -> Array:
        """Position errors, then jumps between runs and ties of the starts, where there are any [x]."""
        errors, ends = self.errors(model)
        return self._joined(errors, ends, self.start)

    def _joined(self, errors: Array, ends: Array, start: Array) -> Array:
        if not self.tied:
            return errors
        rows = [errors]
        if self.continuity:
            rows.append((self._jump_scale * (ends[:-1] - start[1:])[self._joints]).ravel())
        rows.append((self.weight * (start - self.measured) / self._tie).ravel())
        return np.concatenate(rows)

    @property
    def _joints(self) -> Index:
        """Runs that another one follows."""
        return np.flatnonzero([run.follows for run in self.runs[1:]])

    @property
    def _jump_scale(self) -> Array:
        """A jump of velocity counts as much as the way that it makes over a typical run."""
        length = float(np.median([run.n * run.stretch.sample_time for run in self.runs]))
        return self.continuity * np.array([1.0, length])

    @property
    def _tie(self) -> Array:
        return self.spread * _FREE if self.free else self.spread

    def elimination(self, model: Model) -> _Elimination | None:
        """What takes out of residuals what the starts can explain around ``model``; None where they are as measured."""
        if not self.tied:
            return None
        n_runs, first = len(self.runs), self.first_errors
        base, base_ends = self.errors(model)
        owner = np.repeat(np.arange(n_runs), np.diff(first))
        blocks, jumps = [], []
        for c in range(2):
            moved = self.start.copy()
            moved[:, c] += self.spread[:, c]
            errors, ends = self.errors(model, start=moved)
            shape = (base.shape[0], 2 * n_runs)
            column = (errors - base) / self.spread[owner, c]
            blocks.append(sparse.csc_matrix((column, (np.arange(base.shape[0]), 2 * owner + c)), shape=shape))
            jumps.append((ends - base_ends) / self.spread[:, [c]])
        rows = [blocks[0] + blocks[1]]
        if self.continuity:
            rows.append(self._jump_rows(jumps))
        rows.append(sparse.diags((self.weight / self._tie).ravel()))
        return _Elimination(sparse.vstack(rows, format="csc"))

    def _jump_rows(self, changes: Sequence[Array]) -> sparse.csc_matrix:
        """Derivative of the weighted jumps with respect to all starts; ``changes[c]``: of the ends with component c."""
        matrix = sparse.lil_matrix((2 * self._joints.shape[0], 2 * len(self.runs)))
        scale = self._jump_scale
        for number, joint in enumerate(self._joints.tolist()):
            for part in range(2):
                row = 2 * number + part
                matrix[row, 2 * joint] = scale[part] * changes[0][joint, part]
                matrix[row, 2 * joint + 1] = scale[part] * changes[1][joint, part]
                matrix[row, 2 * joint + 2 + part] = -scale[part]
        return matrix.tocsc()

    def draws(self, model: Model, disturbance: ForceErrors, seed: int = 1) -> Iterator[Array]:
        """What force errors and noise like those of the recording change in the residuals, without end."""
        random = np.random.default_rng(seed)
        undisturbed, calm_ends = self.errors(model)
        stretches = list(dict.fromkeys(run.stretch for run in self.runs))
        level = np.concatenate([np.full(run.n, noise_of(run.stretch.raw_position)) for run in self.runs])
        while True:
            forces = {s: disturbance.drawn(s.time.shape[0] - 1, s.sample_time, random) for s in stretches}
            push = [forces[run.stretch][run.first : run.last - 1] for run in self.runs]
            # A measured start is wrong by its spread, in a draw as in the recording: it shows in the tie, or in the run.
            offset = self.spread * random.standard_normal(self.start.shape)
            errors, ends = self.errors(model, push, self.start if self.tied else self.start + offset)
            moved = errors - undisturbed + level * random.standard_normal(level.shape[0])
            if self.tied:
                change = ends - calm_ends
                moved = self._joined(moved, change, np.zeros_like(change))
                moved[-offset.size :] = (self.weight * offset / self._tie).ravel()
            yield moved

    def weighed(self, model: Model, disturbance: ForceErrors) -> Shooting:
        """The same with the weights that belong to ``model``."""
        if not self.tied:
            return self
        plain = replace(self, tied=False)
        base, _ = self.errors(model)
        first = self.first_errors[:-1]
        drawn = plain.draws(model, disturbance)
        moved = np.array([next(drawn) for _ in range(_WEIGHING_DRAWS)])
        weight = np.ones(2)
        for c in range(2):
            start = self.start.copy()
            start[:, c] += self.spread[:, c]
            slope = self.errors(model, start=start)[0] - base
            explained = np.add.reduceat(moved * slope, first, axis=1)
            power = float(np.sum(slope**2))
            if power > 0.0:
                weight[c] = np.sqrt(float(np.mean(np.sum(explained**2, axis=1))) / power)
        return replace(self, weight=weight)

    def refined(self, model: Model) -> Shooting:
        """The same with as many steps per sample as ``model`` asks for, if these are more, and no more than may be."""
        wanted = [substeps(model, run.stretch.sample_time) for run in self.runs]
        known = zip(wanted, self.n_substeps, self.most_substeps, strict=True)
        return replace(self, n_substeps=[max(now, min(asked, most)) for asked, now, most in known])

    def start_matters(self, model: Model) -> bool:
        """True when the uncertainty of the starts changes the errors of ``model`` by more than can be neglected."""
        base, _ = self.errors(model)
        changed = 0.0
        for c in range(2):
            moved = self.start.copy()
            moved[:, c] += self.spread[:, c]
            changed += float(np.sum((self.errors(model, start=moved)[0] - base) ** 2))
        return changed > _MATTERS**2 * float(base @ base)

    def settled(self, model: Model) -> Shooting:
        """The same with the starts that suit ``model``."""
        best = self
        if not self.tied:
            return best
        residual = best.residual(model)
        for _ in range(_SETTLING_STEPS):
            eliminate = best.elimination(model)
            assert eliminate is not None
            step = eliminate.step(residual).reshape(-1, 2)
            before = float(residual @ residual)
            # Halved where the way to the minimum is bent.
            for share in (1.0, 0.5, 0.25):
                trial = best._where_better(replace(best, start=best.start + share * step), model, residual)
                trial_residual = trial.residual(model)
                if float(trial_residual @ trial_residual) < before:
                    best, residual = trial, trial_residual
                    break
            if before - float(residual @ residual) <= 1e-6 * before:
                break
        return best

    def _where_better(self, trial: Shooting, model: Model, residual: Array) -> Shooting:
        """``trial``, whose start is taken only in those runs that it suits, where each run is on its own."""
        if self.continuity:
            return trial
        better = trial._cost_of_runs(trial.residual(model)) < self._cost_of_runs(residual)
        return replace(trial, start=np.where(better[:, None], trial.start, self.start))

    def _cost_of_runs(self, residual: Array) -> Array:
        """Sum of squares of each run's errors and ties, shape ``(n_runs,)``."""
        first = self.first_errors
        squares = residual**2
        ties: Array = squares[first[-1] :].reshape(-1, 2).sum(axis=1)
        return np.add.reduceat(squares[: first[-1]], first[:-1]) + ties

    def reduced(self, model: Model) -> Callable[[Model], Array]:
        """The residuals less what starts can explain, as a function of the model near ``model``."""
        eliminate = self.elimination(model)
        if eliminate is None:
            return self.residual
        return lambda trial: eliminate(self.residual(trial))


def _finite(values: Array) -> Array:
    return np.asarray(np.nan_to_num(values, nan=_ESCAPED, posinf=_ESCAPED, neginf=-_ESCAPED), dtype=np.float64)


class _Elimination:
    """Takes out of residuals what a change of the starts explains to first order."""

    def __init__(self, slope: sparse.csc_matrix) -> None:
        self._slope = slope
        self._solver = splu(sparse.csc_matrix(slope.T @ slope))

    def step(self, residual: Array) -> Array:
        """Change of the starts that makes the residuals smallest."""
        return np.asarray(-self._solver.solve(self._slope.T @ residual), dtype=np.float64)

    def __call__(self, residual: Array) -> Array:
        return np.asarray(residual + self._slope @ self.step(residual), dtype=np.float64)


def _leaders(model: Model, runs: Sequence[Run]) -> list[Array]:
    """Friction state at the start of each run, led along the measured motion of its stretch."""
    found: list[Array] = []
    led: Predictor | None = None
    for run in runs:
        if not run.follows or led is None:
            led = Predictor(model, fused=True)
        found.append(led.friction_state.copy())
        s, inner = run.stretch, slice(run.first, run.last - 1)
        led.run(
            s.time[inner], s.position[inner], s.velocity[inner], s.acceleration[inner], s.sample_time, run.load, run.temperature
        )
    return found


def shooting(model: Model, found: Equations, horizon: float | None, starts: str, continuity: float) -> Shooting:
    """The runs over ``found``, each starting as measured.

    Args:
        model: whose rates say how many steps a sample takes.
        found: the recordings.
        horizon: length of the runs [s]; None: whole recordings.
        starts: ``tied`` to the measured state, ``free``, or as ``measured``.
        continuity: weight of jumps between runs.
    """
    runs = runs_over(found.stretches, horizon)
    measured, spread = _starts(runs, found.cutoff)
    n_substeps = [substeps(model, run.stretch.sample_time) for run in runs]
    most = [_GROWTH * number for number in n_substeps]
    return Shooting(runs, n_substeps, most, measured, measured, spread, starts != "measured", starts == "free", continuity)


def _starts(runs: Sequence[Run], cutoff: float) -> tuple[Array, Array]:
    """Position [x] and velocity [x/s] at the start of each run, and their standard errors, shape ``(n_runs, 2)`` each."""
    found = [initial_state(run.stretch.time, run.stretch.raw_position, run.first, run.stretch.position_error) for run in runs]
    # What a difference of two runs can still be told from.
    least = np.array([_RESOLVED * float(np.ptp(run.stretch.raw_position)) for run in runs])[:, None]
    spread = np.maximum([state.standard_errors for state in found], least * np.array([1.0, 2.0 * np.pi * cutoff]))
    return np.array([(state.position, state.velocity) for state in found]), np.maximum(spread, np.finfo(np.float64).tiny)
