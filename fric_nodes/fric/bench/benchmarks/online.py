"""Online estimators side by side: time to follow a step of friction, wandering at rest, time per sample, coverage.

The axis follows a multisine under a PD law that reads its quantised position; the recorded force has noise that never
acted. For the step its Coulomb friction changes from one sample to the next; for the rest it stands for ten minutes while
the drive pushes below break-away and the encoder flickers by a count. Intervals are counted over 200 recordings of
:mod:`fric.identification.calibration`, each from its first sample to its last; takes several minutes.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from ...axis import SimulatedAxis
from ...identification.calibration import AXES, TestAxis, recording
from ...identification.online import ESTIMATORS, Estimator, make_estimator
from ...model import Model
from ...record import Array
from ..benchmark import Benchmark, Figure
from ..trials import Finding, count, figures_of

__all__ = ["BENCHMARK", "Followed", "Moved", "Wandered", "follow", "moved", "wander"]

# None of these recordings was looked at while the estimators were made.
_SEEDS = range(31_000, 31_200)
_FORGETTING_TIME = 60.0  # [s], as the node has it
_STEP = 2e-3  # [s]
_TONES = np.array([0.25, 0.45, 0.8, 1.3, 2.1, 3.1])  # [Hz]
_TRAVEL = 0.1  # [m]
_LOOKS = 25  # samples between two looks at the estimate


@dataclass(frozen=True, eq=False)
class Moved:
    """What the instruments say, shape ``(n,)`` each; the force of a sample acts until the next."""

    time: Array
    position: Array
    force: Array


def moved(axis: TestAxis, models: list[tuple[float, Model]], seed: int, stops: bool = False) -> Moved:
    """A motion along a multisine, through several models one after the other, each for its time [s]; it may stop at last."""
    random = np.random.default_rng(seed)
    body = SimulatedAxis(models[0][1], resolution=axis.resolution)
    n = [round(duration / _STEP) for duration, _ in models]
    at: Array = _STEP * np.arange(sum(n), dtype=np.float64)
    phase = random.uniform(0.0, 2.0 * np.pi, _TONES.size)
    amplitude = _TRAVEL / _TONES / np.sum(1.0 / _TONES)
    fade = np.clip(at / 0.5, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(at / 0.5, 0.0, 1.0))
    # Time of the reference; it runs slower during half a second, and stands still for another one.
    pace = np.clip((at[-1] - 0.5 - at) / 0.5, 0.0, 1.0) if stops else np.ones(at.size)
    inner = _STEP * np.cumsum(pace)
    wanted = fade * (np.sin(2.0 * np.pi * np.outer(inner, _TONES) + phase) @ amplitude)
    rate = np.gradient(wanted, _STEP)
    changes = dict(zip(np.cumsum([0, *n[:-1]]).tolist(), (model for _, model in models), strict=True))
    positions, forces = np.empty(at.size), np.empty(at.size)
    before = body.measure().position
    for k in range(at.size):
        if k and k in changes:
            body.become(changes[k])
        seen = body.measure().position
        force = axis.stiffness * (wanted[k] - seen) + axis.damping * (rate[k] - (seen - before) / _STEP)
        positions[k], forces[k], before = seen, force, seen
        body.advance(float(force), _STEP)
    noise: Array = axis.force_noise * random.standard_normal(at.size)
    return Moved(at, positions, forces + noise)


def _feed(estimator: Estimator, run: Moved, looks: int = 0) -> tuple[Array, Array]:
    """Feed a motion; the times of ``looks`` at it and the values at them, ``(n_looks,)`` and ``(n_looks, n_parameters)``."""
    force: Array = run.force
    if estimator.averages_force:
        force = 0.5 * (force + np.concatenate([force[:1], force[:-1]]))
    times, values = [], []
    for k, sample in enumerate(zip(run.time.tolist(), run.position.tolist(), force.tolist(), strict=True)):
        estimator.update(*sample)
        if looks and k % looks == 0:
            times.append(sample[0])
            values.append(estimator.estimate().values)
    return np.array(times), np.array(values)


def _made(kind: str, axis: TestAxis) -> Estimator:
    return make_estimator(kind, axis.start, _FORGETTING_TIME, hold="following")


@dataclass(frozen=True, eq=False)
class Followed:
    """Estimates of the changed parameter over time, what it is, and when they stay within 5 % of it after the change [s]."""

    time: Array
    value: Array
    truth: Array
    settled: float


def follow(kind: str, factor: float = 1.5, seed: int = 1, before: float = 15.0, after: float = 10.0) -> Followed:
    """Let Coulomb friction change by ``factor`` and watch the estimate."""
    axis, name = AXES["rigid"], "coulomb.force"
    changed = axis.truth.with_value(name, factor * axis.truth.value(name))
    run = moved(axis, [(before, axis.truth), (after, changed)], seed)
    estimator = _made(kind, axis)
    times, values = _feed(estimator, run, _LOOKS)
    value = values[:, estimator.estimate().names.index(name)]
    truth = np.where(times < before, axis.truth.value(name), changed.value(name))
    beyond = np.flatnonzero(np.abs(value - truth) > 0.05 * truth)
    last = float(times[beyond[-1]]) + _LOOKS * _STEP if beyond.size else before
    return Followed(times, value, truth, max(last - before, 0.0) if last < times[-1] else np.inf)


@dataclass(frozen=True)
class Wandered:
    """Largest change of an estimate over a rest: in standard errors and of the value; and of a standard error itself."""

    errors: float
    share: float
    widened: float


def wander(kind: str, duration: float = 600.0, step: float = _STEP, seed: int = 2) -> Wandered:
    """Learn for 15 s, and rest for ``duration`` [s], of which a sample is taken every ``step`` [s]."""
    axis = AXES["rigid"]
    estimator = _made(kind, axis)
    run = moved(axis, [(16.0, axis.truth)], seed, stops=True)
    _feed(estimator, run)
    begun = estimator.estimate()
    random = np.random.default_rng(seed)
    n = round(duration / step)
    at = run.time[-1] + step * np.arange(1, n + 1)
    flicker = axis.resolution * (random.uniform(size=n) < 0.1)
    push = 4.0 * np.sin(2.0 * np.pi * 0.05 * at) + axis.force_noise * random.standard_normal(n)
    _, values = _feed(estimator, Moved(at, run.position[-1] + flicker, push), 5000)
    change = np.max(np.abs(values - begun.values), axis=0)
    errors = estimator.estimate().standard_errors / begun.standard_errors
    return Wandered(
        float(np.max(change / begun.standard_errors)), float(np.max(change / np.abs(begun.values))), float(np.max(errors) - 1.0)
    )


def _microseconds(kind: str) -> float:
    """Of one sample at 1 kHz, once the estimator is under way."""
    axis = AXES["rigid"]
    run = moved(axis, [(25.0, axis.truth)], 3)
    estimator = _made(kind, axis)
    half = run.time.size // 2
    _feed(estimator, Moved(run.time[:half], run.position[:half], run.force[:half]))
    start = time.perf_counter()
    _feed(estimator, Moved(run.time[half:], run.position[half:], run.force[half:]))
    return 1e6 * (time.perf_counter() - start) / (run.time.size - half)


@dataclass(frozen=True)
class _Trial:
    """An estimator over one recording of an axis."""

    kind: str
    axis: str

    def __call__(self, seed: int) -> Finding:
        axis = AXES[self.axis]
        record = recording(axis, seed)
        # Bristles can't be told from nothing: they start half as stiff again, and as damped.
        near = {p.name: 1.5 * p.value for p in axis.truth.parameters() if p.name.startswith("presliding")}
        start = axis.start
        for name, value in near.items():
            start = start.with_value(name, value)
        estimator = make_estimator(self.kind, start, _FORGETTING_TIME, hold="following")
        _feed(estimator, Moved(record.time, record.position, record.effort))
        found = estimator.estimate()
        rows = zip(found.names, found.values.tolist(), found.standard_errors.tolist(), strict=True)
        return {name: (value - axis.truth.value(name), error) for name, value, error in rows}


def run() -> list[Figure]:
    """Figures per estimator."""
    figures: list[Figure] = []
    for kind in ESTIMATORS:
        for factor in (1.5, 0.7):
            settled = max(follow(kind, factor, seed).settled for seed in range(4))
            figures.append(Figure(f"{kind}: Coulomb friction times {factor}, within 5 %, slowest of 4", settled, "s", "<= 3"))
        found = wander(kind)
        figures += [
            Figure(f"{kind}: 10 min at rest, largest change in standard errors", found.errors, "1", "<= 0.5"),
            Figure(f"{kind}: 10 min at rest, largest change of a value", found.share, "1", "<= 0.01"),
            Figure(f"{kind}: 10 min at rest, growth of a standard error", found.widened, "1", "<= 0.1"),
            Figure(f"{kind}: one sample", _microseconds(kind), "us", "<= 200"),
        ]
    for kind, axis in (("rls", "rigid"), ("ekf", "rigid"), ("ukf", "rigid"), ("ekf", "bristled"), ("ukf", "bristled")):
        calibration, refused = count(_Trial(kind, axis), _SEEDS)
        figures += figures_of(f"{kind}, {axis} axis", calibration, refused)
    return figures


BENCHMARK = Benchmark("online", "online estimators side by side", run, long=True)
