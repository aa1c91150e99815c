"""Time and memory of a diagnosis: 60 s and 600 s at 1 kHz of an axis with a Stribeck effect that its nominal model lacks.

Each diagnosis runs in a process of its own, so that the peak of the memory is its own, with compiled structures taken from the
disk: a short diagnosis goes before it. Beside them what is found: long recordings are diagnosed on an excerpt
(:mod:`fric.diagnosis.excerpt`), which must neither change the verdict nor cost accuracy on unseen data.
"""

from __future__ import annotations

import resource
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from ...diagnosis import diagnose
from ...figure import Figure
from ...model import Model, Term, build_model, term
from ...record import Record
from ...simulation import simulate
from ...threads import end_with_parent
from ..benchmark import Benchmark

__all__ = ["BENCHMARK"]

_STEP = 1e-3  # [s]
_SHORT, _HELD_BACK = 12.0, 20.0  # [s]
_FREQUENCIES = (0.13, 0.31, 0.77, 1.3)  # [Hz]


@dataclass(frozen=True)
class _Run:
    """What one diagnosis took and found."""

    spent: float
    peak: float
    effects: tuple[str, ...]
    rest: float


def _axis(*more: Term) -> Model:
    """A stage on a weak spring, which keeps it from wandering off under force."""
    terms = [term("coulomb", force=6.0), term("viscous", coefficient=20.0), term("stiffness", stiffness=60.0), *more]
    return build_model("rigid", {"mass": 5.0}, terms)


def _recording(duration: float, seed: int) -> Record:
    generator = np.random.default_rng(seed)
    time_ = np.arange(round(duration / _STEP), dtype=np.float64) * _STEP
    phases = generator.uniform(0.0, 2.0 * np.pi, len(_FREQUENCIES))
    effort = sum(11.0 * np.sin(2.0 * np.pi * f * time_ + p) for f, p in zip(_FREQUENCIES, phases, strict=True))
    effort = np.asarray(effort, dtype=np.float64)
    motion = simulate(_axis(term("stribeck", force=2.5, velocity=0.02)), effort, _STEP, n_substeps=8)
    position = np.round(motion.position / 1e-6) * 1e-6
    measured = effort + 0.1 * generator.standard_normal(time_.shape[0])
    return Record(time_, position, measured, effort_hold="following", source=f"{duration:g} s")


def _diagnosed(duration: float) -> _Run:
    held_back = _recording(_HELD_BACK, 2)
    diagnose([_recording(_SHORT, 3)], [held_back], _axis())
    train = _recording(duration, 1)
    begun = time.perf_counter()
    found = diagnose([train], [held_back], _axis())
    spent = time.perf_counter() - begun
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0**2  # kB on Linux
    score = found.validation
    rest = (score.noe_augmented - score.noise_floor) / (score.noe_refit - score.noise_floor)
    return _Run(spent, peak, tuple(each.effect for each in found.findings), rest)


def run() -> list[Figure]:
    """Time and memory after compilation, and what was found."""
    figures = []
    for duration, limit in ((60.0, 30), (600.0, 180)):
        with ProcessPoolExecutor(1, get_context("spawn"), initializer=end_with_parent) as pool:
            found = pool.submit(_diagnosed, duration).result()
        name = f"{duration:g} s at 1 kHz"
        figures += [
            Figure(f"diagnosis of {name}", found.spent, "s", f"<= {limit}"),
            Figure(f"its memory at most, {name}", found.peak, "GB", "<= 1"),
            Figure(f"only the concealed effect found, {name}", float(found.effects == ("stribeck",)), "1", "== 1"),
            Figure(f"left of what was missing on unseen data, {name}", 100.0 * found.rest, "%", "<= 10"),
        ]
    return figures


BENCHMARK = Benchmark("diagnosis", "time and memory of a diagnosis", run, long=True)
"""A diagnosis of a long recording."""
