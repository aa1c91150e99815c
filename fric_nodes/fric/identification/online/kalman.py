"""Online identification by Kalman filter: from the first motion to an estimate that follows the axis sample by sample.

A filter needs to begin near enough. Recursive least squares on the same samples tells, from the first motion in both
directions, every parameter in which the force is linear; with five times its standard errors, so that the same samples may
be used again, that is where the filter begins. Nonlinear parameters begin at the structure's values. What has been recorded
meanwhile then goes through the filter, for each of the nonlinear ones from a few start values; the likeliest goes on. From it
two passes with a louder force lead near enough for slopes to hold: with values far off, the innovations would be taken for
kicks, and the first samples would be used with wrong slopes.

A step change of friction shows as force residuals that stay on one side for longer than they ever do. What was known of the
terms' linear parameters is then given up; if it goes on, what was known of all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...model import Model
from ...record import Array, Mask
from ...signals.resolution import noise_of
from ..free_parameters import FreeParameters
from ..result import Options
from .estimate import Estimate, State, model_with, status_of
from .kalman_filter import AHEAD, KalmanFilter, Noise
from .recursive import OnlineIdentifier

__all__ = ["KalmanIdentifier"]

_KEPT = 30_000  # samples of the start
_TRIED = 5000  # of them that start values are tried on
_FACTORS = (0.2, 0.45, 2.2, 5.0)
_DETERMINED = 0.05  # relative standard error at which a linear parameter is near enough, of the largest force for a force
_WIDER = 5.0  # start deviations beside the standard errors of least squares
_LEAST_RELATIVE = 0.02
_LOUD = (10.0, 3.0)  # times the noise of the force, in passes over the start that lead towards the values
_NONLINEAR = 0.5  # relative start deviation of what least squares can't tell
_LEAST = 1.5  # [s] of motion before that
_PATIENCE = 5.0  # [s] of motion after which the filter begins with what there is
_GAP = 10.0  # sample times without a sample after which the motion is anew
_REST_TIME = 0.1  # [s] within a few steps of the position signal
_REST_STEPS = 3.0
_FAST, _SLOW = 0.1, 20.0  # [s] over which a one-sided residual, and what is usual of it, are looked at
_CHANGED = 5.0  # times the usual
_KICKS = 0.3  # share of samples that kick the motion, which may be anything below that
_AGAIN = 3.0  # [s] within which a second change says that the first answer was not enough
_OPENED = 0.5  # of a parameter's size
_REOPENED, _REOPENED_AFTER = 0.1, 0.3  # of it, and when [s]: what came in around the change itself may have misled


@dataclass
class _Watch:
    """Mean residual of late and share of kicks, what is usual of its square and of them, and since when one is beyond that."""

    mean: float = 0.0
    kicks: float = 0.0
    usual: float = 0.0
    usual_kicks: float = 0.0
    beyond: float = 0.0
    age: float = 0.0
    last: float = -math.inf
    open_again: bool = False


class KalmanIdentifier:
    """Extended or unscented Kalman filter on the friction state; see :mod:`.kalman_filter` for the filter itself.

    Args:
        structure: the terms to estimate, slip dynamics and nonlinear parameters among them; its values are the start.
        forgetting_time: how long information counts, in time of informative motion [s]; infinite: for ever.
        options: which parameters are held at their value, or freed.
        kind: ``ekf`` or ``ukf``.
        hold: how a sample's force relates to the intervals beside it: ``following``, ``preceding`` or ``linear``.
    """

    averages_force = False

    def __init__(
        self,
        structure: Model,
        forgetting_time: float = 60.0,
        options: Options | None = None,
        kind: str = "ukf",
        hold: str = "preceding",
    ) -> None:
        self.options = Options() if options is None else options
        self.forgetting_time, self.kind, self.hold = forgetting_time, kind, hold
        self.title = {"ekf": "extended Kalman filter", "ukf": "unscented Kalman filter"}[kind]
        self.state = State.RUNNING
        self._restart(structure)

    def _restart(self, structure: Model) -> None:
        self.structure = structure
        self._free = FreeParameters.of(structure, self.options)
        static = structure.with_terms(held for held in structure.terms if held.effect.slip is None)
        names = set(static.names)
        known = Options(
            held=tuple(name for name in self.options.held if name in names),
            freed=tuple(name for name in self.options.freed if name in names),
            cutoff=self.options.cutoff,
            rest_velocity=self.options.rest_velocity,
        )
        self._starter = OnlineIdentifier(structure, math.inf, known)
        self._filter: KalmanFilter | None = None
        self._samples: list[tuple[float, float, float]] = []
        self._last: tuple[float, float, float] | None = None
        self._step = 0.0
        self._interrupted = False
        self._first_position = self._earlier = math.nan
        self._anchor, self._anchored, self._band = math.nan, 0.0, 0.0
        self._watch = _Watch()
        self._correlation = self._square = 0.0
        self._residual = 0.0
        self._energy = self._weight = 0.0
        self._changes = 0
        self.samples_used = self.samples_rejected = 0

    def reset(self, structure: Model | None = None) -> None:
        """Forget everything; with ``structure``, estimate other terms from now on."""
        self._restart(self.structure if structure is None else structure)

    def freeze(self, frozen: bool) -> None:
        """Hold the estimate as it is, or go on."""
        self.state = State.FROZEN if frozen else State.RUNNING
        self._last = None

    def update(self, time: float, position: float, effort: float) -> bool:
        """Take one sample; True when the estimate has changed.

        Args:
            time: [s], increasing.
            position: [x].
            effort: [F], as it was sent.
        """
        if self.state is not State.RUNNING:
            return False
        if not (math.isfinite(time) and math.isfinite(position) and math.isfinite(effort)):
            self.samples_rejected += 1
            return False
        last = self._last
        if last is not None and time <= last[0]:
            self.samples_rejected += 1
            if time < last[0] - 100.0 * self._step:
                self._last = None  # the clock was set back
            return False
        self._last = (time, position, effort)
        if last is None or (self._step > 0.0 and time - last[0] > max(_GAP * self._step, 0.05)):
            self._samples.clear()
            self._anchor, self._interrupted = math.nan, True
            return False
        duration = time - last[0]
        if self._interrupted and self._filter is not None:
            self._filter.set_moving(last[1], (position - last[1]) / duration, effort)
        self._interrupted = False
        self._step = duration if self._step == 0.0 else self._step + 0.01 * (duration - self._step)
        force = {"following": last[2], "preceding": effort, "linear": 0.5 * (last[2] + effort)}[self.hold]
        if self._filter is None:
            return self._start_up(time, position, last, effort, (duration, force, position))
        self._follow(duration, force, position)
        return True

    def _start_up(
        self, time: float, position: float, last: tuple[float, float, float], effort: float, sample: tuple[float, float, float]
    ) -> bool:
        """Gather samples, and let least squares learn from them, until the filter can begin."""
        if not self._samples:
            self._first_position, self._earlier = last[1], last[2]
        self._samples.append(sample)
        if len(self._samples) > _KEPT:
            half = len(self._samples) // 2
            self._first_position = self._samples[half - 1][2]
            del self._samples[:half]
        # The force at the instant of the earlier sample is the mean of those before and after it.
        at_last = {"following": 0.5 * (self._earlier + last[2]), "preceding": 0.5 * (last[2] + effort), "linear": last[2]}
        learnt = self._starter.update(last[0], last[1], at_last[self.hold])
        self._earlier = last[2]
        if not learnt or not self._near_enough():
            return False
        self._begin()
        return True

    def _near_enough(self) -> bool:
        found, free = self._starter.estimate(), self._free
        errors, values = found.standard_errors, np.abs(found.values)
        if not np.all(np.isfinite(errors)):
            return False
        dimension = {p.name: p.declaration.dimension for p in self.structure.parameters()}
        forces = np.array([dimension[name] == "F" for name in found.names])
        size = np.where(forces, np.max(values[forces], initial=0.0), values)
        moved = found.samples_used * self._step
        if moved < _LEAST or moved >= _PATIENCE:
            return moved >= _PATIENCE
        # A value on its bound came from somewhere beyond: motion in one direction does that, with a small standard error.
        bounds = {name: (lower, upper) for name, lower, upper in zip(free.names, free.lower, free.upper, strict=True)}
        inside = all(bounds[name][0] < value < bounds[name][1] for name, value in zip(found.names, found.values, strict=True))
        return inside and bool(np.all(errors < _DETERMINED * size))

    def _begin(self) -> None:
        """Make the filter, and let it go over what has been recorded."""
        free, found = self._free, self._starter.estimate()
        begun = self._starter.model()
        errors = dict(zip(found.names, found.standard_errors.tolist(), strict=True))
        lower = np.where(np.isfinite(free.lower), free.lower, 0.0)
        values = begun.values[free.index]
        deviations = _NONLINEAR * np.abs(values)
        forces = [abs(p.value) for p in begun.parameters() if p.declaration.dimension == "F"]
        # A value that came out at its bound of zero says nothing about its own size.
        largest = np.where((free.lower >= 0.0) & (np.abs(values) > 1e-9), _NONLINEAR * np.abs(values), np.inf)
        for k, name in enumerate(free.names):
            if name in errors:
                deviations[k] = max(min(_WIDER * errors[name], largest[k]), _LEAST_RELATIVE * abs(values[k]))
            elif values[k] == lower[k] == 0.0:
                deviations[k] = max(forces, default=1.0)
        noise, self._band = self._noise()
        tried = self._samples[-_TRIED:]
        best, likeliest = begun, -math.inf
        nonlinear = [int(k) for k, name in zip(free.index, free.names, strict=True) if name not in errors]
        trials = [begun]
        for k in nonlinear:
            for factor in _FACTORS:
                changed = begun.values
                changed[k] *= factor
                trials.append(begun.with_values(changed))
        for trial in trials if len(trials) > 1 else []:
            likelihood, _ = self._passed(trial, deviations, noise, tried)
            if likelihood > likeliest:
                best, likeliest = trial, likelihood
        for louder in _LOUD:
            _, best = self._passed(
                best, deviations * _beside(best, begun, free), replace(noise, force=louder * noise.force), self._samples
            )
        self._filter = self._filter_from(
            best, deviations * _beside(best, begun, free), noise, self._first_position, self._samples[0]
        )
        for duration, force, position in self._samples:
            self._follow(duration, force, position)
        self._samples = []

    def _filter_from(
        self,
        model: Model,
        deviations: Array,
        noise: Noise,
        position: float,
        first: tuple[float, float, float],
        ahead: int = AHEAD,
    ) -> KalmanFilter:
        duration, force, after = first
        motion = (position, (after - position) / duration, force)
        return KalmanFilter(model, self._free, deviations, noise, self.kind, self.forgetting_time, motion, ahead)

    def _passed(
        self, model: Model, deviations: Array, noise: Noise, samples: list[tuple[float, float, float]]
    ) -> tuple[float, Model]:
        """Logarithm of the likelihood of ``samples`` with ``model`` as the start, but for a constant, and where it leads."""
        # Only to come near: what the next samples tell would take twice the time.
        tried = self._filter_from(model, deviations, noise, samples[0][2], samples[1], 0)
        total = 0.0
        for duration, force, position in samples[1:]:
            tried.step(duration, force, position, False)
            total -= 0.5 * min(tried.surprise**2, 100.0) + math.log(tried.deviation)
        return (total, tried.model()) if math.isfinite(total) and np.all(np.isfinite(tried.mean)) else (-math.inf, model)

    def _noise(self) -> tuple[Noise, float]:
        """Of the signals, from what has been recorded so far, and the band within which a position rests [x]."""
        _, forces, positions = np.array(self._samples).T
        steps = np.abs(np.diff(positions))
        moved = steps[steps > 1e-12 * max(float(np.ptp(positions)), 1e-300)]
        resolution = float(np.min(moved)) if moved.size else 0.0
        white = max(noise_of(positions), 1e-9 * float(np.ptp(positions)))
        force = max(noise_of(forces), 1e-3 * float(np.std(forces)))
        # Where it creeps, what rounding does stays the same for a while: it counts with all it can be.
        return Noise(max(white, 0.5 * resolution), force), _REST_STEPS * max(math.sqrt(12.0) * white, resolution)

    def _follow(self, duration: float, force: float, position: float) -> None:
        """One sample through the filter."""
        assert self._filter is not None
        if not abs(position - self._anchor) <= self._band:
            self._anchor, self._anchored = position, 0.0
        self._anchored += duration
        resting = self._anchored > _REST_TIME
        kalman = self._filter
        kalman.step(duration, force, position, resting)
        if not np.all(np.isfinite(kalman.mean)):
            # What a model can't follow must not stay in the filter.
            self._restart(self.structure)
            return
        if resting:
            self._watch.mean = self._watch.kicks = 0.0
            return
        self.samples_used += 1
        residual = kalman.residual
        share = duration / _SLOW
        self._energy += residual * residual
        self._weight += 1.0
        surprise = min(max(kalman.surprise, -10.0), 10.0)
        self._correlation += share * (surprise * self._residual - self._correlation)
        self._square += share * (surprise * surprise - self._square)
        self._residual = surprise
        self._look_for_change(duration, surprise)

    def _look_for_change(self, duration: float, surprise: float) -> None:
        assert self._filter is not None
        watch = self._watch
        watch.age += duration
        watch.mean += duration / _FAST * (surprise - watch.mean)
        if watch.open_again and watch.age - watch.last > _REOPENED_AFTER:
            watch.open_again = False
            self._filter.open_up(self._terms_linear(), _REOPENED)
        watch.kicks += duration / _FAST * (float(self._filter.kicked) - watch.kicks)
        white = 0.5 * duration / _FAST
        limit = _CHANGED**2 * max(watch.usual, white)
        most = max(_KICKS, _CHANGED * watch.usual_kicks)
        if (watch.mean**2 <= limit and watch.kicks <= most) or watch.age < 2.0:
            share = duration / min(max(watch.age, 0.5), _SLOW)
            watch.usual += share * (min(watch.mean**2, limit) - watch.usual)
            watch.usual_kicks += share * (watch.kicks - watch.usual_kicks)
            watch.beyond = 0.0
            return
        watch.beyond += duration
        if watch.beyond < 0.5 * _FAST:
            return
        again = watch.age - watch.last < _AGAIN
        self._filter.open_up(np.ones_like(self._free.linear) if again else self._terms_linear(), _OPENED)
        self._changes += 1
        watch.open_again = True
        watch.last, watch.beyond, watch.mean, watch.kicks = watch.age, -0.5, 0.0, 0.0

    def _terms_linear(self) -> Mask:
        return self._free.linear & (self._free.index >= len(self.structure.plant_values))

    def covariance(self) -> Array:
        """Covariance of the estimate, shape ``(n_parameters, n_parameters)``; NaN while nothing is known."""
        n = len(self._free.names)
        if self._filter is None:
            return np.full((n, n), np.nan)
        rho = min(max(self._correlation / self._square, 0.0), 0.98) if self._square > 0.0 else 0.0
        return np.asarray(self._filter.covariance * (1.0 + rho) / (1.0 - rho), dtype=np.float64)

    def estimate(self) -> Estimate:
        """The estimate as it stands."""
        n = len(self._free.names)
        names, values, seen = self._free.names, self.structure.values[self._free.index], np.zeros(n, dtype=np.bool_)
        covariance = self.covariance()
        if self._filter is not None:
            values, seen = self._filter.values, self._filter.seen & (self._anchored <= _REST_TIME)
        errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        with np.errstate(invalid="ignore"):
            excited = np.asarray(errors < 0.2 * np.abs(values), dtype=np.bool_)
        status = status_of(self.state, self.samples_used, names, excited)
        if self._filter is not None and self.state is State.RUNNING and not np.all(seen):
            hidden = "every parameter" if not np.any(seen) else ", ".join(n for n, s in zip(names, seen, strict=True) if not s)
            status += f"; held, not excited by the present motion: {hidden}"
        rms = math.sqrt(self._energy / self._weight) if self._weight > 0 else math.nan
        return Estimate(
            names, values, np.asarray(errors, dtype=np.float64), covariance, excited, rms, self.samples_used,
            self.samples_rejected, self.state, status,
        )  # fmt: skip

    def model(self) -> Model:
        """The structure with the values estimated so far and their standard errors."""
        return model_with(self.structure, self.estimate())


def _beside(model: Model, other: Model, free: FreeParameters) -> Array:
    """Ratio of the free values of two models, 1 for those that are 0 in the other."""
    values, beside = model.values[free.index], other.values[free.index]
    return np.where(beside != 0.0, np.abs(values) / np.where(beside != 0.0, np.abs(beside), 1.0), 1.0)
