"""How often the checks of recordings find a moderate fault, and how often they raise a false alarm; takes some minutes.

What the recordings are: :mod:`fric_nodes.instrument.trials`. A fault counts as found when its own check names it; a false
alarm is a clean recording in which any check finds a fault.
"""

from __future__ import annotations

import time

import numpy as np

from ..instrument import inspect
from ..instrument.trials.faults import FAULTS
from ..instrument.trials.score import false_alarms, hits
from ..record import Record
from .benchmark import Benchmark, Figure

__all__ = ["BENCHMARK"]

# None of these recordings was looked at while the checks were made.
_SEEDS = range(50_000, 50_030)
_CLEAN = range(50_000, 50_216)


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


def run() -> list[Figure]:
    """Rate of hits per fault, false alarms, and speed."""
    figures = []
    for fault in FAULTS:
        found = hits(fault, _SEEDS)
        figures.append(Figure(f"{fault.name}: found by '{fault.check}'", found.found / found.trials, "1", ">= 0.95"))
    wrong, warnings = false_alarms(_CLEAN)
    share = len({seed for seed, _ in wrong}) / len(_CLEAN)
    figures.append(Figure("clean recordings with a fault found", share, "1", "<= 0.02"))
    for check, count in sorted(warnings.items()):
        if count:
            figures.append(Figure(f"clean recordings with a warning by '{check}'", count / len(_CLEAN), "1"))
    record = _long()
    started = time.perf_counter()
    inspect([record])
    figures.append(Figure("all checks on 60 s at 1 kHz", time.perf_counter() - started, "s", "<= 2"))
    return figures


BENCHMARK = Benchmark("instrument", "faults of recordings: hits and false alarms", run)
"""Hits and false alarms of the checks."""
