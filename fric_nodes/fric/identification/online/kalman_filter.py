"""Kalman filter on the friction state: motion, slip states and parameters of a model together, one sample at a time.

The model itself is the process: from one sample to the next it is led by its compiled step, from points around the mean
(:mod:`fric.identification.online.loops`). What isn't known of the force goes through the model like the force itself,
so that a contact that sticks isn't shaken by it. What is measured is the position, and the force.

Extended: slopes over one standard deviation to either side, wide enough to reach over the kinks of friction. With a derivative
at a point the filter is certain of a contact that sticks, and lost when it slips. Unscented: points at sqrt(3) standard
deviations, where a normal distribution has its fourth moment. What slopes leave out counts as noise.

The recorded force is the last state: what acted is that, give or take its noise. Slopes at the recorded force, and at a motion
that follows from it, hold this noise, and a regressor with noise in it makes its parameter too small. So each interval is led
several times: first to learn, from its end and those of the next intervals, at which motion it began and which force acted;
then with the slopes there, along what that leaves unknown, referred back to what was known before. That is an iterated filter
with a lag; the estimate is as many samples late.

An innovation beyond four standard deviations is put down to a kick of the motion (a reversal that came a little earlier, a
knock), so that it moves the state and hardly the parameters. Force residuals larger than the noise of the start raise it.

Parameters that must be positive (a mass, a stiffness, a Stribeck velocity) are estimated by their logarithms; the others
are kept within their bounds. Terms with memory (a lag, the age of a contact) are led along the mean.

Gain scheduling. The information on the parameters that came in during the last seconds is kept apart. What it leaves
undetermined by itself isn't seen just now (any sliding parameter at rest, Coulomb friction and bias in one direction only,
the mass without acceleration): such a parameter is held with its standard error, and nothing of it is forgotten. For the
others old information gives way to new along the direction of each sample, and never to more than comes in (after Kulhavy
1987), which is a process noise that is there only with news.

Source: Julier and Uhlmann 2004 (unscented transform); van der Merwe and Wan 2001 (its square root); Schmidt 1966 (what is
not estimated is considered); Bell and Cathey 1993 (iterated filter); Garcia-Fernandez and others 2015 (points around what is
known afterwards); Kulhavy 1987 (directional forgetting).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from ...model import Model
from ...record import Array, Mask
from ...simulation import substeps
from ..free_parameters import FreeParameters
from .loops import carry, collapse, correct, scatter, tell

__all__ = ["AHEAD", "KalmanFilter", "Noise"]

AHEAD = 3
"""Samples that tell about the beginning of an interval, beside that at its end."""

_WIDTHS = {"ekf": 1.0, "ukf": math.sqrt(3.0)}
_STEP_OF_RATE = 0.15  # as in prediction error: from one sample to the next its error is far below any noise
_LIMIT = 4.0  # standard deviations of an innovation beyond which it isn't noise
_SMOOTH_TIME = 0.02  # [s] of steady news: the noise in them is quicker
_TELLING = 0.3  # of a parameter's size: standard error from the news alone above which it isn't seen
_NEWS_TIME = 2.0  # [s] over which information counts as new
_SCHEDULE_TIME = 0.1  # [s] between two looks at what can be seen
_MOST_STATES = 12  # of slip dynamics; with more of them, they are led along the mean
_LOG_LIMIT = 2.3  # largest standard deviation of a logarithm: a factor of ten
_LOUDER = 0.05  # how fast the force noise follows what is found of it, per look


_Sample = tuple[float, float, float, bool]


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the position [x] and force signals [F]."""

    position: float
    force: float


class KalmanFilter:
    """One filter; made with start values and their standard deviations.

    Args:
        model: process, with the start values.
        free: what is estimated of it.
        deviations: of the start values, in SI, shape ``(n_theta,)``; also the largest that they may become.
        noise: of the signals.
        kind: ``ekf`` or ``ukf``.
        forgetting_time: how long information counts [s].
        motion: position [x], velocity [x/s] and force [F] at the start.
        ahead: samples that tell about the beginning of an interval, beside that at its end.

    Attributes:
        mean: parameters (or their logarithms), plant states, slip states, shape ``(n,)``.
        root: of their covariance, lower triangular, shape ``(n, n)``.
        seen: True for each parameter on which there is news, shape ``(n_theta,)``.
        innovation: of the last sample [x].
        deviation: that it was expected to have [x].
    """

    def __init__(
        self,
        model: Model,
        free: FreeParameters,
        deviations: Array,
        noise: Noise,
        kind: str,
        forgetting_time: float,
        motion: tuple[float, float, float],
        ahead: int = AHEAD,
    ) -> None:
        position, velocity, force = motion
        self._n_ahead = ahead
        self._model, self._free, self._noise, self._forgetting_time = model, free, noise, forgetting_time
        self._unscented, self._width = kind == "ukf", _WIDTHS[kind]
        self._base = model.values
        declared = [parameter.declaration for parameter in model.parameters()]
        self._is_log = np.array([float(declared[int(k)].positive) for k in free.index])
        start = np.clip(self._base[free.index], free.lower, free.upper)
        logs = self._is_log > 0.0
        theta = np.where(logs, np.log(np.where(logs, start, 1.0)), start)
        spread = np.where(logs, np.minimum(deviations / np.where(logs, start, 1.0), _LOG_LIMIT), deviations)
        states = np.ascontiguousarray(model.plant.start(np.array(model.plant_values), position, velocity), dtype=np.float64)
        slips, memory = model.inner_states(velocity)
        self._led = slips.shape[0] > _MOST_STATES
        n_theta, n_x, n_z = theta.shape[0], states.shape[0], 0 if self._led else slips.shape[0]
        n = n_theta + n_x + n_z + 1
        self._n_theta, self._n_z = n_theta, n_z
        self.mean = np.concatenate([theta, states, slips[:n_z], [force]])
        self.root = np.zeros((n, n))
        seen, rate = (n_theta + k for k in model.plant.encoder)
        self._seen_state, self._rate_state = seen, rate
        self.root[np.diag_indices(n_theta)] = spread
        self._most = spread.copy()
        self._force_noise = noise.force
        self._loudness = 1.0
        self._floor = np.zeros(n)
        self._floor[seen] = 1e-2 * noise.position
        self._floor[n_theta + n_x : n - 1] = 1e-6 * self._level()
        m = 2 * n + 1
        self._points, self._values, self._forces = np.empty((m, n)), np.empty((m, self._base.shape[0])), np.empty(m)
        self._states, self._slips = np.empty((m, n_x)), np.zeros((m, slips.shape[0]))
        self._memories, self._friction = np.zeros((m, memory.shape[0])), np.empty(m)
        self._z_next = np.empty(2 * slips.shape[0])
        self._constants = np.zeros(sum(held.effect.constants(held.values) for held in model.terms))
        self._work, self._gain, self._out = np.empty((n, 3 * n + 5)), np.empty(n), np.zeros(3)
        self._around = np.array([0.0, 1.0, 0.0])
        self._news, self._smooth = np.zeros((n_theta, n_theta)), np.zeros(n_theta)
        self._held = np.zeros(n_theta)
        self._since = self._age = 0.0
        self._n_substeps, self._step = 1, -1.0
        self._shift, self._plain, self._columns = np.zeros(n), np.eye(n), np.zeros((n, n))
        self._narrow, self._widen = np.eye(n), np.eye(n)
        self._ahead: deque[_Sample] = deque()
        self.innovation, self.deviation, self.residual, self.surprise = 0.0, 1.0, 0.0, 0.0
        self.seen: Mask = np.ones(n_theta, dtype=np.bool_)
        self.set_moving(position, velocity, force)
        # At the beginning there is no older news to compare with.
        self.seen = np.ones(n_theta, dtype=np.bool_)
        self._held[:] = 0.0

    def set_moving(self, position: float, velocity: float, force: float) -> None:
        """Begin anew with the motion; what is known of the parameters stays, and is held until there is news.

        Args:
            position: [x].
            velocity: [x/s].
            force: [F].
        """
        self._ahead.clear()
        n_theta, n = self._n_theta, self.mean.shape[0]
        model = self.model()
        slips, memory = model.inner_states(velocity)
        states = model.plant.start(np.array(model.plant_values), position, velocity)
        self.mean[n_theta:] = np.concatenate([states, slips[: self._n_z], [force]])
        self._slips[:], self._memories[:] = slips, memory
        deviation = np.full(n - n_theta, 3.0 * self._noise.position)
        deviation[self._rate_state - n_theta] = max(0.3 * abs(velocity), 1e-3)
        deviation[states.shape[0] : -1] = 0.3 * self._level()
        deviation[-1] = self._noise.force
        self.root[n_theta:] = 0.0
        self.root[range(n_theta, n), range(n_theta, n)] = deviation
        self._news[:], self._smooth[:] = 0.0, 0.0
        self._held[:] = 1.0
        self.seen = np.zeros(n_theta, dtype=np.bool_)

    def _level(self) -> float:
        """Deflection of slip states in the model's sliding, by its stiffest part [x]; for start values only."""
        forces = [p.value for p in self._model.parameters() if p.declaration.dimension == "F"]
        stiffness = [p.value for p in self._model.parameters() if p.declaration.dimension == "F/x"]
        return max(forces, default=0.0) / max(stiffness) if stiffness and max(stiffness) > 0.0 else 1e-6

    @property
    def values(self) -> Array:
        """Estimates in SI, shape ``(n_theta,)``."""
        theta = self.mean[: self._n_theta]
        logs = self._is_log > 0.0
        values = np.where(logs, np.exp(np.where(logs, theta, 0.0)), theta)
        return np.asarray(np.clip(values, self._free.lower, self._free.upper), dtype=np.float64)

    @property
    def slopes(self) -> Array:
        """Change of each value with its state, shape ``(n_theta,)``."""
        return np.where(self._is_log > 0.0, self.values, 1.0)

    @property
    def covariance(self) -> Array:
        """Of the estimates in SI, shape ``(n_theta, n_theta)``."""
        root = self.slopes[:, None] * self.root[: self._n_theta, : self._n_theta]
        return np.asarray(root @ root.T, dtype=np.float64)

    def model(self) -> Model:
        """The model with the values estimated so far."""
        values = self._base.copy()
        values[self._free.index] = self.values
        return self._model.with_values(values)

    def step(self, duration: float, force: float, position: float, resting: bool) -> None:
        """Lead the filter over one interval, and correct it by the position at its end.

        Args:
            duration: [s].
            force: recorded, over the interval [F].
            position: measured [x].
            resting: True when the joint rests, so that nothing is to be learnt.
        """
        self._ahead.append((duration, force, position, resting))
        if len(self._ahead) > self._n_ahead:
            self._take(self._ahead.popleft())

    def _take(self, sample: _Sample) -> None:
        """Lead the filter over one interval and correct it; those that follow tell more about its beginning."""
        duration, force, position, resting = sample
        if abs(duration - self._step) > 0.01 * self._step:
            self._step = duration
            self._n_substeps = substeps(self.model(), duration, _STEP_OF_RATE)
        held = np.ones_like(self._held) if resting else self._held
        forgotten = 0.0
        if math.isfinite(self._forgetting_time):
            forgotten = min(self._n_theta * duration / self._forgetting_time, 0.5)
        self._smooth_out(sample)
        self._lead(duration, force)
        self._around[0] += duration
        fresh, fade = 1.0 - math.exp(-duration / _SMOOTH_TIME), math.exp(-duration / _NEWS_TIME)
        correct(
            self.mean, self.root, self._seen_state, self._rate_state, duration, self._n_theta, position, self._noise.position,
            _LIMIT, held, forgotten, self._most, self._news, fade, self._smooth, fresh, self._work, self._gain, self._out,
        )  # fmt: skip
        self.innovation, self.deviation = float(self._out[0]), float(self._out[1])
        self.residual = force - float(self.mean[-1])
        self.surprise = -self.innovation / self.deviation
        self._loudness += (1.0 - math.exp(-duration / _NEWS_TIME)) * (min(self.surprise**2, _LIMIT**2) - self._loudness)
        self._age += duration
        self._since += duration
        if self._since >= _SCHEDULE_TIME:
            self._since = 0.0
            self._schedule()
            self._step = -1.0

    @property
    def kicked(self) -> bool:
        """True when the last sample was put down to a kick."""
        return abs(self.innovation) > _LIMIT * self.deviation

    def _smooth_out(self, sample: _Sample) -> None:
        """What the ends of this interval and of those that follow tell about its beginning."""
        begun = self.mean.copy(), self.root.copy(), self._slips[0].copy(), self._memories[0].copy()
        self._shift[:], self._narrow[:], self._widen[:] = 0.0, self._plain, self._plain
        shift, narrow, widen = np.zeros_like(self._shift), self._plain.copy(), self._plain.copy()
        columns = self._columns
        for number, (duration, force, position, _) in enumerate((sample, *self._ahead)):
            before = self.root.copy()
            self._lead(duration, force)
            if number == 0:
                columns = self._columns.copy()
            else:
                carry(columns, before, self._columns, self._work)
            if not tell(
                self.mean, self.root, self._seen_state, position, self._noise.position, _LIMIT, columns, shift, narrow, widen,
                self._work,
            ):  # fmt: skip
                break
        self._shift, self._narrow, self._widen = shift, narrow, widen
        self.mean[:], self.root[:], self._slips[0], self._memories[0] = begun

    def _lead(self, duration: float, force: float) -> None:
        """Lead mean and root over an interval, with slopes around what is known of its beginning from later."""
        slips = self._slips[:, : self._n_z]
        scatter(
            self.mean, self.root, self._width, force, self._force_noise, self._shift, self._narrow, self._base,
            self._free.index, self._is_log, self._free.lower, self._free.upper, self._points, self._values, self._forces,
            self._states, slips, self._memories,
        )  # fmt: skip
        if self._led:
            self._slips[1:] = self._slips[0]
        self._model.loops.fan(
            self._values, self._forces, duration, self._n_substeps, self._around, self._states, self._slips, self._memories,
            self._friction, self._z_next, self._constants,
        )  # fmt: skip
        collapse(
            self._points, self._states, slips, self._n_theta, self._width, self._unscented, self._shift, self._widen,
            self._columns, self._floor, self.mean, self._work, self.root,
        )  # fmt: skip

    def _schedule(self) -> None:
        """Keep parameters in their bounds, and look which of them can be seen."""
        theta, logs = self.mean[: self._n_theta], self._is_log > 0.0
        lower = np.where(logs, -np.inf, self._free.lower)
        # What the model can't say counts as noise; what is quieter than the signal was at the start doesn't make it quieter.
        louder = self._force_noise * self._loudness ** (0.5 * _LOUDER)
        self._force_noise = max(louder, self._noise.force)
        np.clip(theta, lower, np.where(logs, np.inf, self._free.upper), out=theta)
        if self._age < _NEWS_TIME:
            return
        self.seen = self._told() < _TELLING * self._sizes()
        self._held = (~self.seen).astype(np.float64)

    def _told(self) -> Array:
        """Standard error of each parameter from the news alone; infinite where they don't tell it from others."""
        scale = np.sqrt(np.maximum(np.diag(self._news), 1e-300))
        values, vectors = np.linalg.eigh(self._news / np.outer(scale, scale))
        square = np.sum(vectors**2 / np.maximum(values, 1e-12), axis=1)
        return np.asarray(np.sqrt(square) / scale, dtype=np.float64)

    def _sizes(self) -> Array:
        """What a parameter's error is to be compared with: its value, and for forces the largest of them."""
        size = np.where(self._is_log > 0.0, 1.0, np.abs(self.values))
        declared = [parameter.declaration for parameter in self._model.parameters()]
        dimension = [declared[int(k)].dimension for k in self._free.index]
        for kind in set(dimension):
            of_kind = np.array([d == kind for d in dimension])
            if not np.any(self._is_log[of_kind] > 0.0):
                size[of_kind] = np.maximum(size[of_kind], 0.5 * np.max(size[of_kind]))
        return np.asarray(np.where(size > 0.0, size, np.inf), dtype=np.float64)

    def open_up(self, which: Mask, share: float) -> None:
        """Let go of what is known of some parameters: to a standard deviation of ``share`` of the size of each."""
        n = self._n_theta
        sizes = self._sizes()
        fresh = np.minimum(share * np.where(np.isfinite(sizes), sizes, 0.0), self._most)
        work = np.zeros((self.mean.shape[0],) * 2)
        work[:n, :n] = np.diag(np.where(which, fresh, 0.0))
        upper = np.asarray(np.linalg.qr(np.hstack([self.root, work]).T, mode="r"), dtype=np.float64)
        lower = upper.T
        self.root = np.ascontiguousarray(lower * np.where(np.diag(lower) < 0.0, -1.0, 1.0))
        self._news[:] = 0.0
        self._age = 0.0
        self._force_noise, self._loudness = self._noise.force, 1.0
        self.seen = np.ones(n, dtype=np.bool_)
        self._held[:] = 0.0
