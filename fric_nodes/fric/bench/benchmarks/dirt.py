"""Coverage of the intervals of every method on dirty recordings; takes tens of minutes.

The methods that fit a force get the recordings of :mod:`.dirty_axis`, whose truth and dirt are drawn anew for each seed. The
others get the experiments of their own calibration, whose signals are then made as dirty as there: rounded by an encoder of 300
to a million steps, with white noise, stamps that jitter, and single-precision time.
"""

from __future__ import annotations

import math
import multiprocessing
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...figure import Figure
from ...identification import METHODS
from ...identification.calibration import Calibration
from ...identification.result import Identification, IdentificationError, Options
from ...identification.start import start_model
from ...record import Array, Record, Units
from ...signals.conditioning import conditioned
from ...signals.stamps import rounded_grid
from ...threads import alone
from ..benchmark import Benchmark
from ..dirty_axis import drawn, recorded
from ..trials import Finding, of_model
from . import calibration_forced as forced
from . import calibration_oscillation as oscillation
from . import calibration_static as static
from . import calibration_tensor_product as tensor_product
from . import calibration_two_stage as two_stage

__all__ = ["BENCHMARK", "CASES", "SEEDS", "dirtied", "figures"]

SEEDS = range(40_000, 40_200)
"""None of these recordings was looked at while the methods were made."""

_PROCESSES = 2
_ALL = (0.85, 0.95)
_EACH = (0.80, 0.98)
_FAR = 5.0  # standard errors
_SELDOM = 0.01  # share of the recordings

Answer = tuple[Mapping[str, tuple[float, float]], bool]
"""Estimate less truth, and standard error, by name; and whether the answer warns."""


def dirtied(record: Record, random: np.random.Generator) -> Record:
    """``record`` through a coarser instrument, drawn by ``random``; as it is after reading."""

    def among(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    travel = max(float(np.ptp(record.position)), 1e-300)
    step = travel / among(300.0, 1e6)
    noise = random.choice([0.0, among(0.05, 1.0)]) * step
    position = step * np.round((record.position + noise * random.standard_normal(record.n_samples)) / step)
    effort = record.effort
    if np.ptp(effort) > 0.0:
        effort = effort + among(1e-3, 0.02) * float(np.std(effort)) * random.standard_normal(record.n_samples)
    period = record.sample_time
    late = random.uniform(0.0, min(random.choice([0.0, among(1e-5, 5e-4)]), 0.9 * period), record.n_samples)
    stamps: Array = record.time + late
    if random.random() < 0.15:
        stamps = (stamps + 3600.0).astype(np.float32).astype(np.float64)
    even = rounded_grid(stamps)
    stamps = stamps if even is None else even[0]
    grows = np.concatenate([[True], np.diff(stamps) > 0.0])
    changed = {"position": position[grows], "effort": effort[grows], "time": stamps[grows] - stamps[0]}
    extra = {name: values[grows] for name, values in record.extra.items()}
    return conditioned(replace(record, **changed, extra=extra, velocity=None, reference=None, valid=None))


def _of_axis(method: str, seed: int) -> Answer:
    axis, dirt = drawn(seed)
    structure = start_model(["coulomb", "viscous", "bias"], "axis", Units())
    found = METHODS[method].fit(structure, [conditioned(recorded(axis, dirt, seed))], Options())
    return of_model(found, axis.named()), _warns(found)


def _of_experiment(trial: Callable[..., Finding], seed: int) -> Answer:
    change = partial(dirtied, random=np.random.default_rng(seed + 5_000_000))
    heard: list[bool] = []
    return trial(seed, change=change, heard=lambda found: heard.append(_warns(found))), any(heard)


def _springs(seed: int, **told: Any) -> Finding:
    """Strokes of each pace in turn."""
    paces = tuple(two_stage.PACES.values())
    return two_stage.trial(paces[seed % len(paces)], seed, **told)


def _of_ladder(seed: int) -> Answer:
    random = np.random.default_rng(seed + 5_000_000)
    records = [dirtied(record, random) for record in static.ladder(np.random.default_rng(seed), 0.0)]
    found = static.mapped(records)
    return of_model(found, static.CURVE), _warns(found)


def _warns(found: Identification) -> bool:
    return bool(found.warnings) or "not " in found.status


_EXPERIMENTS: dict[str, Callable[..., Finding]] = {
    **{method: partial(oscillation.free, method) for method in oscillation.CASES},
    "parametric-oscillation": oscillation.parametric,
    "forced-oscillation": forced.trial,
    "two-stage": _springs,
    "tensor-product": tensor_product.trial,
}

CASES: dict[str, Callable[[int], Answer]] = {
    **{name: partial(_of_axis, name) for name in ("inverse-dynamics", "output-error", "prediction-error")},
    **{method: partial(_of_experiment, trial) for method, trial in _EXPERIMENTS.items()},
    "static-map": _of_ladder,
}
"""A trial for each method."""


class _Guarded:
    """A trial that gives None where the recording is refused."""

    def __init__(self, trial: Callable[[int], Answer]) -> None:
        self.trial = trial

    def __call__(self, seed: int) -> Answer | None:
        try:
            return self.trial(seed)
        except IdentificationError:
            return None


def figures(method: str, seeds: Sequence[int], n_processes: int = _PROCESSES) -> list[Figure]:
    """Coverage of ``method`` over ``seeds``, and how often it is far off without a word."""
    guarded = _Guarded(CASES[method])
    if n_processes == 1:
        answers = [guarded(seed) for seed in seeds]
    else:
        with ProcessPoolExecutor(n_processes, multiprocessing.get_context("spawn"), initializer=alone) as pool:
            answers = list(pool.map(guarded, seeds, chunksize=4))
    kept = [answer for answer in answers if answer is not None]
    if not kept:
        return [Figure(f"{method}: recordings refused", float(len(answers)), "", f"<= {len(answers) - 1}")]
    names = tuple(kept[0][0])
    estimates, errors = (np.array([[row[name][k] for name in names] for row, _ in kept]) for k in (0, 1))
    counted = Calibration(names, np.zeros(len(names)), estimates, errors)
    covered = counted.coverage(0.9)
    far = np.any(np.abs(estimates) > _FAR * np.nan_to_num(errors, nan=math.inf), axis=1)
    silent = far & ~np.array([warns for _, warns in kept])
    every = float(np.mean(covered))
    found = [
        Figure(f"{method}: 90 % intervals that hold the truth", every, "1", f">= {_ALL[0]}"),
        Figure(f"{method}: the same", every, "1", f"<= {_ALL[1]}"),
        Figure(f"{method}: recordings far off without a warning", float(np.mean(silent)), "1", f"<= {_SELDOM}"),
        Figure(f"{method}: recordings refused", float(len(answers) - len(kept)), ""),
    ]
    for name, share in zip(names, covered.tolist(), strict=True):
        found += [
            Figure(f"{method}: {name}, 90 % intervals that hold the truth", share, "1", f">= {_EACH[0]}"),
            Figure(f"{method}: {name}, the same", share, "1", f"<= {_EACH[1]}"),
        ]
    return found


def run(seeds: Sequence[int] = SEEDS) -> list[Figure]:
    """All methods."""
    return [figure for method in CASES for figure in figures(method, seeds)]


BENCHMARK = Benchmark("dirt", "coverage of the intervals of every method on dirty recordings", run, long=True)
"""Coverage on dirty recordings."""
