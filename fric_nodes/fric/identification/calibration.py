"""Do the intervals of a method cover? Many simulated recordings of a known axis, each fitted, and the truth looked for in them.

The axis follows a random motion under a PD law that reads its quantised position; the recorded force has noise that never
acted. Its truth is integrated with several times as many steps as a fit takes, so that a fit can't lean on the errors of its
own integrator. Each recording has a motion, a quantisation and a noise of its own. An interval of probability P that is what
it says holds the truth in a share P of the recordings; over n recordings that share has the standard deviation sqrt(P (1 -
P) / n).
"""

from __future__ import annotations

import math
import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import ndtri

from ..model import Model, build_model, term
from ..record import Array, Record
from ..simulation import Simulator, substeps
from ..threads import alone
from .result import Options

__all__ = ["AXES", "Calibration", "TestAxis", "calibrate", "recording"]

_FINER = 4  # the truth's steps beside those of a free run; a fit's one-step prediction takes fewer still
_TONES = 7


@dataclass(frozen=True)
class TestAxis:
    """An axis with known friction, and how it is moved and measured.

    Attributes:
        name: in a table.
        truth: the axis.
        start: the same structure with the values that a fit starts from.
        duration: of a recording [s].
        sample_time: [s].
        travel: of the random motion [m].
        slow: half the travel of two slow reversals at the start of the recording [m].
        stiffness: P of the loop [N/m].
        damping: D of the loop [N s/m].
        resolution: of the encoder [m].
        force_noise: standard deviation of the force signal [N].
    """

    __test__ = False  # no test class, whatever pytest makes of its name

    name: str
    truth: Model
    start: Model
    duration: float = 12.0
    sample_time: float = 2e-3
    travel: float = 0.1
    slow: float = 2e-3
    stiffness: float = 4000.0
    damping: float = 120.0
    resolution: float = 1e-7
    force_noise: float = 0.3


def _rigid() -> TestAxis:
    def model(mass: float, coulomb: float, viscous: float, bias: float) -> Model:
        terms = [term("coulomb", force=coulomb), term("viscous", coefficient=viscous), term("bias", force=bias)]
        return build_model("rigid", {"mass": mass}, terms)

    return TestAxis("rigid", model(2.0, 10.0, 35.0, 0.6), model(1.0, 1.0, 1.0, 0.0))


def _bristled() -> TestAxis:
    def model(mass: float, coulomb: float, viscous: float, bias: float, stiffness: float, damping: float) -> Model:
        terms = [
            term("coulomb", force=coulomb),
            term("viscous", coefficient=viscous),
            term("bias", force=bias),
            term("presliding", stiffness=stiffness, damping=damping),
        ]
        return build_model("rigid", {"mass": mass}, terms)

    return TestAxis("bristled", model(2.0, 10.0, 35.0, 0.6, 3e5, 400.0), model(1.0, 1.0, 1.0, 0.0, 1.0, 0.0))


AXES = {axis.name: axis for axis in (_rigid(), _bristled())}
"""Axes to calibrate on: one that sticks exactly, one on bristles."""


def _reference(axis: TestAxis, random: np.random.Generator) -> tuple[Array, Array]:
    """Position and velocity wanted: slow reversals, then a multisine with random phases that starts and ends gently."""
    time = axis.sample_time * np.arange(round(axis.duration / axis.sample_time))
    slow_time = 0.25 * axis.duration
    frequency = np.geomspace(0.25, 4.0, _TONES) * random.uniform(0.9, 1.1, _TONES)
    amplitude = axis.travel / frequency / np.sum(1.0 / frequency)
    angle = 2.0 * np.pi * np.outer(time, frequency) + random.uniform(0.0, 2.0 * np.pi, _TONES)
    fade = np.clip((time - slow_time) / 0.5, 0.0, 1.0)
    position = (np.sin(angle) @ amplitude) * fade**2 * (3.0 - 2.0 * fade)
    position += axis.slow * np.sin(2.0 * np.pi * 2.0 * time / slow_time) * (time < slow_time)
    return position, np.gradient(position, axis.sample_time)


def recording(axis: TestAxis, seed: int) -> Record:
    """What the instruments of ``axis`` record over a motion that belongs to ``seed``."""
    random = np.random.default_rng(seed)
    wanted, rate = (part.tolist() for part in _reference(axis, random))
    h = axis.sample_time
    n_substeps = _FINER * substeps(axis.truth, h)
    simulator = Simulator(axis.truth, random.uniform(0.0, 1e-3), 0.0)
    offset = simulator.position
    positions, efforts = np.empty(len(wanted)), np.empty(len(wanted))
    before = seen = round(simulator.position / axis.resolution) * axis.resolution
    given = np.empty(1)
    for k, (q, v) in enumerate(zip(wanted, rate, strict=True)):
        positions[k] = seen
        given[0] = axis.stiffness * (q + offset - seen) + axis.damping * (v - (seen - before) / h)
        efforts[k] = given[0]
        simulator.run(given, h, n_substeps)
        before, seen = seen, round(simulator.position / axis.resolution) * axis.resolution
    efforts += axis.force_noise * random.standard_normal(efforts.shape[0])
    time = h * np.arange(efforts.shape[0], dtype=np.float64)
    return Record(time, positions, efforts, effort_hold="following", source=f"{axis.name} axis, seed {seed}")


@dataclass(frozen=True, eq=False)
class Calibration:
    """Estimates over many recordings.

    Attributes:
        names: of the parameters.
        truth: shape ``(n_parameters,)``.
        estimates: shape ``(n_recordings, n_parameters)``.
        errors: standard errors, same shape; NaN where the method gave none.
        ends: of intervals that aren't those of the standard errors, shape ``(2, n_recordings, n_parameters)``, or None.
        probability: of these.
    """

    names: tuple[str, ...]
    truth: Array
    estimates: Array
    errors: Array
    ends: Array | None = None
    probability: float = 0.9

    def coverage(self, probability: float = 0.9) -> Array:
        """Share of recordings whose interval of that probability holds the truth, per parameter; no interval is a miss."""
        if self.ends is not None:
            if probability != self.probability:
                raise ValueError(f"the intervals are of probability {self.probability:g}, not {probability:g}")
            return np.asarray(np.mean((self.ends[0] <= self.truth) & (self.truth <= self.ends[1]), axis=0))
        wide = float(ndtri(0.5 + 0.5 * probability)) * self.errors
        return np.asarray(np.mean(np.abs(self.estimates - self.truth) <= wide, axis=0))

    @property
    def bias(self) -> Array:
        """Mean error over the typical standard error, per parameter."""
        typical = np.nanmedian(self.errors, axis=0)
        return np.asarray(np.mean(self.estimates - self.truth, axis=0) / typical)

    @property
    def spread(self) -> Array:
        """Spread of the estimates over the typical standard error, per parameter; 1 is right."""
        return np.asarray(np.std(self.estimates, axis=0, ddof=1) / np.nanmedian(self.errors, axis=0))


def _one(axis: TestAxis, method: str, options: Options, kind: str, seed: int) -> tuple[Array, Array, Array]:
    """Estimate, standard errors and ends of the intervals, ``(2, n_parameters)``."""
    from . import METHODS
    from .uncertainty import intervals

    records = [recording(axis, seed)]
    found = METHODS[method].fit(axis.start, records, options)
    names = _free(axis)
    estimate = np.array([found.model.value(name) for name in names])
    errors = np.array([found.model.standard_errors.get(name, math.nan) for name in names])
    ends = np.full((2, len(names)), math.nan)
    if kind != "sandwich":
        each = intervals(found, records, options, kind)
        at = [names.index(name) for name in each.names]
        ends[:, at], errors[at] = (each.lower, each.upper), each.standard_errors
    return estimate, errors, ends


def _free(axis: TestAxis) -> tuple[str, ...]:
    return tuple(p.name for p in axis.truth.parameters() if not p.declaration.shape and p.name != "load_share")


def calibrate(
    axis: TestAxis, method: str, seeds: Sequence[int], options: Options, n_processes: int = 1, kind: str = "sandwich"
) -> Calibration:
    """Fit a recording of ``axis`` for each seed, by ``method``.

    Args:
        axis: what is recorded.
        method: id of the identification method.
        seeds: one recording each.
        options: of the fits.
        n_processes: that share the work; 1: this one.
        kind: of the intervals, see :data:`fric.identification.uncertainty.KINDS`.
    """
    work = partial(_one, axis, method, options, kind)
    if n_processes == 1:
        rows = [work(seed) for seed in seeds]
    else:
        with ProcessPoolExecutor(n_processes, multiprocessing.get_context("spawn"), initializer=alone) as pool:
            rows = list(pool.map(work, seeds, chunksize=4))
    names = _free(axis)
    truth = np.array([axis.truth.value(name) for name in names])
    estimates, errors, ends = (np.array([row[k] for row in rows]) for k in range(3))
    return Calibration(names, truth, estimates, errors, None if kind == "sandwich" else ends.swapaxes(0, 1))
