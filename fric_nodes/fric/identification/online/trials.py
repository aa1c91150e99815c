"""Trials of online estimators on a simulated axis: a step of friction to follow, and a rest at which to stay.

The axis follows a multisine under a PD law that reads its quantised position; the recorded force has noise that never acted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...axis import SimulatedAxis
from ...model import Model
from ...record import Array
from ..calibration import AXES, TestAxis
from . import make_estimator
from .estimate import Estimator

__all__ = ["Followed", "Moved", "Wandered", "feed", "follow", "made", "moved", "wander"]

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


def feed(estimator: Estimator, run: Moved, looks: int = 0) -> tuple[Array, Array]:
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


def made(kind: str, axis: TestAxis) -> Estimator:
    """The estimator ``kind`` for ``axis``, as the node makes it."""
    return make_estimator(kind, axis.start, hold="following")


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
    estimator = made(kind, axis)
    times, values = feed(estimator, run, _LOOKS)
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
    estimator = made(kind, axis)
    run = moved(axis, [(16.0, axis.truth)], seed, stops=True)
    feed(estimator, run)
    begun = estimator.estimate()
    random = np.random.default_rng(seed)
    n = round(duration / step)
    at = run.time[-1] + step * np.arange(1, n + 1)
    flicker = axis.resolution * (random.uniform(size=n) < 0.1)
    push = 4.0 * np.sin(2.0 * np.pi * 0.05 * at) + axis.force_noise * random.standard_normal(n)
    _, values = feed(estimator, Moved(at, run.position[-1] + flicker, push), 5000)
    change = np.max(np.abs(values - begun.values), axis=0)
    errors = estimator.estimate().standard_errors / begun.standard_errors
    return Wandered(
        float(np.max(change / begun.standard_errors)), float(np.max(change / np.abs(begun.values))), float(np.max(errors) - 1.0)
    )
