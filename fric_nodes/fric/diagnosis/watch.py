"""Watching a running machine: the force that its model lacks, block by block, against a floor, with a sequential test.

Two observers as in :mod:`fric.diagnosis.track`, a slow and a fast one, follow the samples and keep their states. The mean
square of the missing force over each block of a tenth of a second, divided by its floor, goes into a cumulative sum of
log-likelihood ratios for "the floor" against "twice the floor", the energy being taken as chi-squared with as many degrees of
freedom as the blocks at the beginning show. The exponential of such an increment has mean one while nothing changes, so that
the mean time to a false alarm is at least exp(threshold) blocks (Lorden 1971), whatever the motion; the threshold follows from
the time between false alarms that is wanted.

The floor is what the model lacks during the first seconds of motion, so what is announced is a change since then. A share of
the force (the tolerance) is added to it, and it is raised until the sum stays far below the threshold on the very blocks that
it was learnt from: a model that is a little off is off more in some motions than in others, and that is no change.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..model import Model
from ..record import Array, Record
from ..signals.resolution import noise_of, step_of
from ..simulation import substeps
from .runs import SETTLING
from .track import STEP_OF_RATE

__all__ = ["BANDWIDTHS", "Phase", "Watch", "WatchSettings"]

BANDWIDTHS = (25.0, 140.0)
"""Of the observers [rad/s]."""
_FAST = 1.0  # largest product of bandwidth and sample time
_CHANGING = 10.0  # the same: when a change began is not known better
_BLOCK = 0.1  # [s]
_MEASURING = 1.0  # [s] from which step and noise are known before anything is followed
_FEWEST = 200  # samples for that
_RATIO = 2.0  # of the floor, against which is tested
_STEPS_TO_ALARM = 6  # blocks at least: a single spike is no mismatch
_MOST = 1.5  # of the threshold, beyond which the sum doesn't grow, so that it finds back
_QUIET = 0.35  # of the threshold, which the sum must not pass on the blocks of the floor
_GAP = 2.5  # sample times
_STALE = 20  # samples older than the newest, one after the other, that are a new beginning
_LOOKED_AT = 8.0  # [s] of samples that are looked at for what changed
_CLEAR = 4.0  # mean energy since the change over the floor, from which on an observer sees it clearly
_LEAST_FREEDOM, _MOST_FREEDOM = 0.6, 12.0


class Phase(Enum):
    """What a watch is doing."""

    MEASURING = "measuring the sample time and the noise"
    LEARNING = "learning the floor"
    WATCHING = "watching"
    DETECTED = "mismatch detected"


@dataclass(frozen=True)
class WatchSettings:
    """How a machine is watched.

    Attributes:
        learning_time: of motion from which the floor is learnt [s].
        tolerance: share of the force that the model may be off at any time.
        false_alarm_time: mean time between false alarms, at least [s].
        hold: when the effort of a sample acts, see :attr:`fric.record.Record.effort_hold`.
    """

    learning_time: float = 10.0
    tolerance: float = 0.01
    false_alarm_time: float = 3.6e5
    hold: str = "preceding"


class Follower:
    """An observer that keeps its state from call to call.

    Args:
        model: that follows.
        bandwidth: of the observer [rad/s].
        step: time between samples [s].
    """

    def __init__(self, model: Model, bandwidth: float, step: float) -> None:
        z = math.exp(-bandwidth * step)
        self._model = model
        self._gains = 1.0 - z * z, (1.0 - z) ** 2
        self._scale = model.total_inertia * self._gains[1] / step**2
        self._substeps = min(substeps(model, step, STEP_OF_RATE), 60)
        self._values, self._plant_values = model.values, np.array(model.plant_values)
        self.settling = math.ceil(SETTLING / bandwidth / _BLOCK) + 1
        self.bandwidth = bandwidth

    def restart(self, position: float, velocity: float) -> None:
        """Begin anew at ``position`` [x] with ``velocity`` [x/s]; no block counts until the observer has settled."""
        start = self._model.plant.start(self._plant_values, position, velocity)
        self._state = np.ascontiguousarray(start, dtype=np.float64)
        self._inner = self._model.inner_states(velocity)
        self.skip = self.settling

    def follow(self, step: Array, effort: Array, position: Array, noise: float) -> Array:
        """The missing force [F] at the end of each interval, shape ``(n,)``."""
        found = np.empty(effort.shape[0])
        self._model.loops.observe(
            self._values, effort, position, step, self._substeps, np.ones(1), np.zeros(1),
            *self._gains, noise, self._state, *self._inner, found,
        )  # fmt: skip
        missing: Array = self._scale * found
        return missing


class Cusum:
    """The sequential test on the energies of one observer's blocks.

    Args:
        energies: of blocks where nothing has changed yet [F^2].
        allowed: energy of the tolerance in each of them [F^2].
        threshold: of the cumulative sum.
    """

    def __init__(self, energies: Array, allowed: Array, threshold: float) -> None:
        self.threshold = threshold
        mean = float(np.mean(energies))
        # The mean of a few blocks is uncertain itself.
        spread = float(np.std(energies))
        self.floor = mean + 2.0 * spread / math.sqrt(energies.size)
        ratios = energies / (self.floor + allowed)
        variance = max(float(np.var(ratios)), 1e-6)
        freedom = 2.0 * float(np.mean(ratios)) ** 2 / variance
        self.freedom = min(max(freedom, _LEAST_FREEDOM), _MOST_FREEDOM)
        self.sum = 0.0
        for _ in range(40):
            if self._largest(energies, allowed) <= _QUIET * threshold:
                break
            self.floor *= 1.15

    def _largest(self, energies: Array, allowed: Array) -> float:
        total = most = 0.0
        for energy, extra in zip(energies.tolist(), allowed.tolist(), strict=True):
            total = max(total + self._gain(energy / (self.floor + extra)), 0.0)
            most = max(most, total)
        return most

    def _gain(self, ratio: float) -> float:
        gain = 0.5 * self.freedom * ((1.0 - 1.0 / _RATIO) * ratio - math.log(_RATIO))
        return min(gain, self.threshold / _STEPS_TO_ALARM)

    def take(self, energy: float, allowed: float, moving: bool, detected: bool) -> float:
        """Take in a block and give its energy over the floor; at rest nothing speaks against what was detected."""
        ratio = energy / max(self.floor + allowed, 1e-300)
        gain = self._gain(ratio) if math.isfinite(ratio) else self.threshold / _STEPS_TO_ALARM
        if moving or gain > 0.0 or not detected:
            self.sum = min(max(self.sum + gain, 0.0), _MOST * self.threshold)
        return ratio


class Watch:
    """Follows a machine and says when it no longer is what its model says.

    Args:
        model: what the machine is meant to be.
        settings: how to watch.

    Attributes:
        phase: what is being done.
        changed: time at which the change began, as far as can be told, and detected at [s]; NaN before.
        ratio: energy of the missing force over its floor, per observer, of the newest block.
        counters: what was left out, by reason.
        learnt: seconds of motion that the floor rests on.
    """

    def __init__(self, model: Model, settings: WatchSettings | None = None) -> None:
        self.model = model
        self.settings = settings or WatchSettings()
        self.counters: Counter[str] = Counter()
        self._newest = -math.inf
        self.learn()

    def learn(self) -> None:
        """Forget the floor, and learn it anew."""
        self.phase = Phase.MEASURING
        self.changed = self.detected_at = math.nan
        self.ratio: tuple[float, ...] = ()
        self.learnt = 0.0
        self.step = self.noise = 0.0
        self.tests: list[Cusum] = []
        self._followers: list[Follower] = []
        self._learning: list[tuple[float, ...]] = []
        self._zero: list[float] = []  # per observer, when its sum was last zero, and its energies since
        self._seen: list[list[float]] = []
        self._force = 0.0
        self._stale = 0
        self._empty()

    def _empty(self) -> None:
        """Begin a new contiguous stretch."""
        self._pending: list[tuple[float, float, float]] = []
        self._last: tuple[float, float, float] | None = None
        self._history: list[Array] = []

    @property
    def threshold(self) -> float:
        """Of the cumulative sums, both observers counted."""
        return math.log(max(len(BANDWIDTHS) * self.settings.false_alarm_time / _BLOCK, math.e))

    @property
    def floor(self) -> tuple[float, ...]:
        """Root mean square of the missing force when nothing has changed, per observer [F]."""
        return tuple(math.sqrt(test.floor) for test in self.tests)

    def take(self, time: float, position: float, effort: float) -> None:
        """Take in a sample: stamp [s], position [x], effort [F] with the meaning of ``settings.hold``."""
        if not (math.isfinite(time) and math.isfinite(position) and math.isfinite(effort)):
            self.counters["not finite"] += 1
            return
        if time == self._newest:
            return  # a retransmission
        if time < self._newest:
            self.counters["stamp before the last one"] += 1
            self._stale += 1
            if self._stale < _STALE:
                return
            self.counters["new beginnings"] += 1
            self._zero = [time] * len(self._zero)
            self.changed = time if self.phase is Phase.DETECTED else math.nan
            self._empty()
        elif self.step and time - self._newest > _GAP * self.step:
            self.counters["gaps"] += 1
            self._empty()
        self._stale = 0
        self._newest = time
        self._pending.append((time, position, effort))
        if self.phase is Phase.MEASURING:
            if len(self._pending) > _FEWEST and time - self._pending[0][0] >= _MEASURING:
                self._measure()
        elif len(self._pending) > self._many:
            self._work()

    def _measure(self) -> None:
        samples = np.array(self._pending)
        self.step = float(np.median(np.diff(samples[:, 0])))
        self._many = max(round(_BLOCK / self.step), 1)
        self.noise = self._noise(samples[:, 1])
        rates = sorted({min(w, _FAST / self.step) for w in BANDWIDTHS})
        self._followers = [Follower(self.model, w, self.step) for w in rates]
        self.phase = Phase.LEARNING
        self._pending = self._pending[-1:]
        self._last = None

    @staticmethod
    def _noise(position: Array) -> float:
        return max(noise_of(position), 0.4 * step_of(position))

    def _work(self) -> None:
        """A block: what the observers find missing in it."""
        samples = np.array(self._pending)
        self._pending = self._pending[-1:]  # the next block's first interval begins here
        step = np.diff(samples[:, 0])
        effort = {"following": samples[:-1, 2], "preceding": samples[1:, 2]}.get(
            self.settings.hold, 0.5 * (samples[:-1, 2] + samples[1:, 2])
        )
        effort, position = np.ascontiguousarray(effort), np.ascontiguousarray(samples[1:, 1])
        if self._last is None:
            self._last = self._pending[-1]
            for follower in self._followers:
                follower.restart(float(samples[0, 1]), float((samples[1, 1] - samples[0, 1]) / step[0]))
        self._keep(samples[1:])
        missing = [follower.follow(step, effort, position, self.noise) for follower in self._followers]
        if not all(np.all(np.isfinite(part)) for part in missing):
            self.counters["observer began anew"] += 1
            self._last = None
            return
        ready = all(follower.skip == 0 for follower in self._followers)
        for follower in self._followers:
            follower.skip = max(follower.skip - 1, 0)
        moving = float(np.ptp(position)) > 8.0 * self.noise
        if moving:
            share = _BLOCK / 10.0
            level = float(np.mean(effort**2))
            self._force = level if self._force == 0.0 else (1.0 - share) * self._force + share * level
        if ready:
            energies = [float(np.mean(part**2)) for part in missing]
            self._judge(float(samples[-1, 0]), energies, moving)

    def _judge(self, time: float, energies: list[float], moving: bool) -> None:
        allowed = self.settings.tolerance**2 * self._force
        if self.phase is Phase.LEARNING:
            if moving:
                self._learning.append((*energies, allowed))
                self.learnt += _BLOCK
            if self.learnt >= self.settings.learning_time:
                self._finish_learning(time)
            return
        detected = self.phase is Phase.DETECTED
        pairs = zip(self.tests, energies, strict=True)
        self.ratio = tuple(test.take(energy, allowed, moving, detected) for test, energy in pairs)
        for k, test in enumerate(self.tests):
            if test.sum == 0.0:
                self._zero[k], self._seen[k] = time, []
            self._seen[k] = [*self._seen[k][-100:], self.ratio[k]]
        over = [k for k, test in enumerate(self.tests) if test.sum >= test.threshold]
        if over and not detected:
            self.phase = Phase.DETECTED
            self.changed, self.detected_at = max(self._zero[k] for k in over), time
        elif detected and all(test.sum == 0.0 for test in self.tests):
            self.phase = Phase.WATCHING
            self.changed = self.detected_at = math.nan

    def _finish_learning(self, time: float) -> None:
        table = np.array(self._learning)
        self.tests = [Cusum(table[:, k], table[:, -1], self.threshold) for k in range(len(self._followers))]
        self._zero, self._seen = [time] * len(self.tests), [[] for _ in self.tests]
        if self._history:
            self.noise = max(self.noise, self._noise(np.concatenate(self._history)[-10_000:, 1]))
        self.phase = Phase.WATCHING

    def _keep(self, samples: Array) -> None:
        self._history.append(samples)
        while len(self._history) > (_LOOKED_AT + 2.0) / _BLOCK:
            self._history.pop(0)

    @property
    def _mean(self) -> list[float]:
        return [float(np.mean(seen)) if seen else 0.0 for seen in self._seen]

    @property
    def clearest(self) -> Follower:
        """The fastest observer to which the change stands out clearly."""
        clear = [f for f, mean in zip(self._followers, self._mean, strict=True) if mean > _CLEAR]
        return clear[-1] if clear else self._followers[int(np.argmax(self._mean))]

    def clearest_floor(self) -> tuple[float, float]:
        """Bandwidth [rad/s] and floor [F] of :attr:`clearest`."""
        return self.clearest.bandwidth, self.floor[self._followers.index(self.clearest)]

    def since_change(self) -> Record | None:
        """The latest seconds since the change, without a gap; None when there are too few samples yet.

        They begin a little later: of a few hundredths of a second in which nothing had changed yet, an effect that explains all
        the rest would seem to be wrong.
        """
        if math.isnan(self.changed) or not self._history:
            return None
        samples = np.concatenate(self._history)
        first = max(self.changed + _CHANGING / self.clearest.bandwidth, samples[-1, 0] - _LOOKED_AT)
        samples = samples[samples[:, 0] >= first]
        if samples.shape[0] < _FEWEST:
            return None
        time, position, effort = samples.T
        return Record(
            time - time[0], position.copy(), effort.copy(),
            joint=self.model.joint, units=self.model.units, source="the machine", effort_hold=self.settings.hold,
        )  # fmt: skip
