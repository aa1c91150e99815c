"""How often the checks of recordings find a moderate fault, and how often they raise a false alarm; takes some minutes.

What the recordings are: :mod:`fric.instrument.trials`. A fault counts as found when its own check names it; a false
alarm is a clean recording in which any check finds a fault. Clean recordings are of two kinds, by two simulators: those that
the faults are put into, and ordinary tests (:mod:`fric.instrument.trials.ordinary`). Beside each share stand the counts
and Wilson's 95 % interval for the share that a larger number of recordings would show.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.stats import binomtest

from ...figure import Figure
from ...instrument import inspect
from ...instrument.trials.faults import FAULTS
from ...instrument.trials.score import false_alarms, hits, ordinary_alarms
from ...record import Record
from ..benchmark import Benchmark

__all__ = ["BENCHMARK"]

# None of these recordings was looked at while the checks were made.
_SEEDS = range(50_000, 50_020)
_CLEAN = range(50_000, 50_072)  # each axis with each motion once
_ORDINARY = range(50_000, 50_500)


def _long() -> Record:
    """60 s at 1 kHz."""
    random = np.random.default_rng(1)
    time_ = 1e-3 * np.arange(60_000, dtype=np.float64)
    phase = random.uniform(0.0, 6.28, 7)
    frequency = np.geomspace(0.2, 4.0, 7)
    angle = 2.0 * np.pi * np.outer(time_, frequency) + phase
    position = 0.01 * np.sum(np.sin(angle), axis=1)
    velocity = 0.01 * np.sum(2.0 * np.pi * frequency * np.cos(angle), axis=1)
    acceleration = -0.01 * np.sum((2.0 * np.pi * frequency) ** 2 * np.sin(angle), axis=1)
    effort = 2.0 * acceleration + 8.0 * np.sign(velocity) + 10.0 * velocity + 0.1 * random.standard_normal(60_000)
    return Record(time_, np.round(position / 1e-6) * 1e-6, effort, reference=position, velocity=velocity)


def _share(name: str, count: int, trials: int, goal: str = "") -> Figure:
    interval = binomtest(count, trials).proportion_ci(0.95, "wilson")
    return Figure(f"{name}: {count} of {trials} (95 %: {interval.low:.3f} to {interval.high:.3f})", count / trials, "1", goal)


def run() -> list[Figure]:
    """Rate of hits per fault, false alarms, and speed."""
    figures = []
    for fault in FAULTS:
        found = hits(fault, _SEEDS)
        figures.append(_share(f"{fault.name}: found by '{fault.check}'", found.found, found.trials, ">= 0.95"))
    wrong, _ = false_alarms(_CLEAN)
    figures.append(_share("clean recordings with a fault found", len({seed for seed, _ in wrong}), len(_CLEAN), "<= 0.02"))
    said = ordinary_alarms(_ORDINARY)
    figures.append(_share("ordinary recordings with a fault found", said.wrong, said.trials, "<= 0.01"))
    for check, count in sorted(said.warnings.items()):
        figures.append(_share(f"ordinary recordings with a false warning by '{check}'", count, said.trials))
    for check, count in sorted(said.limits.items()):
        figures.append(_share(f"ordinary recordings with a limit named by '{check}'", count, said.trials))
    record = _long()
    started = time.perf_counter()
    inspect([record])
    figures.append(Figure("all checks on 60 s at 1 kHz", time.perf_counter() - started, "s", "<= 2"))
    return figures


BENCHMARK = Benchmark("instrument", "faults of recordings: hits and false alarms", run)
"""Hits and false alarms of the checks."""
