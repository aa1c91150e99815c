"""Output-error fit of six parameters on 24,841 samples at 1 kHz: a simulated axis of the size of the EMPS benchmark.

The recording is made here (a ball-screw axis under force in both directions, quantised and noisy); the fit starts from inverse
dynamics and runs the whole recording as one free run, and again in runs of half a second with starts of their own.

Beside it, in the same run, the same fit with scipy's solve_ivp and curve_fit (:mod:`fric.bench.by_scipy`), from the same
values of inverse dynamics. That one takes minutes for the whole recording, so that both get its first 4,000 samples; how long
it would take for all of them follows from its time per sample, with as many free runs, and is said to be reckoned.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ...figure import Figure
from ...identification import METHODS
from ...identification.result import Identification, Options
from ...model import Model, build_model, term
from ...record import Record
from ...simulation import simulate
from ..benchmark import Benchmark
from ..by_scipy import fit_by_scipy

__all__ = ["BENCHMARK", "HELD", "NAMES", "STRIBECK", "recording", "structure", "truth"]

_N_SAMPLES = 24_841
_STRETCH = 4_000
STRIBECK = 0.02
"""Velocity of the Stribeck curve [m/s]; held in the fit."""


def truth() -> Model:
    """The axis that is simulated."""
    return build_model(
        "rigid",
        {"mass": 95.0},
        [
            term("coulomb", force=20.0),
            term("viscous", coefficient=200.0),
            term("asymmetry", coefficient=-37.0),
            term("bias", force=-3.0),
            term("stribeck", force=5.0, velocity=STRIBECK),
        ],
    )


def recording() -> Record:
    """The recording of it."""
    generator = np.random.default_rng(7)
    at = np.arange(_N_SAMPLES, dtype=np.float64) * 1e-3
    effort = sum(30.0 * np.sin(2 * np.pi * f * at + p) for f, p in ((0.16, 0.0), (0.41, 1.0), (1.07, 2.0), (2.3, 0.5)))
    effort = np.asarray(effort) - 3.0
    motion = simulate(truth(), effort, 1e-3, n_substeps=4)
    resolution = 1e-7
    position = np.round(motion.position / resolution) * resolution
    return Record(
        at, position, effort + 0.5 * generator.standard_normal(_N_SAMPLES), effort_hold="following", source="benchmark"
    )


def structure() -> Model:
    """What is fitted, with its start values."""
    return build_model(
        "rigid",
        {"mass": 1.0},
        [
            term("coulomb", force=1.0),
            term("viscous", coefficient=1.0),
            term("asymmetry"),
            term("bias", force=0.0),
            term("stribeck", force=0.0, velocity=STRIBECK),
        ],
    )


HELD = ("asymmetry.force", "stribeck.velocity")
_OPTIONS = Options(held=HELD)
NAMES = ("mass", "coulomb.force", "stribeck.force", "asymmetry.coefficient", "viscous.coefficient", "bias.force")
"""The six free parameters."""


def _timed(method: str, record: Record, options: Options) -> tuple[Identification, float]:
    """A fit and its time [s], the better of two, which other programs disturb less."""
    spent = np.inf
    for _ in range(2):
        start = time.perf_counter()
        found = METHODS[method].fit(structure(), [record], options)
        spent = min(spent, time.perf_counter() - start)
    return found, spent


def _beside_scipy(record: Record, whole: float) -> list[Figure]:
    """Times on a stretch of ``record``; ``whole``: time of the fit on all of it [s]."""
    part = record.slice(0, _STRETCH)
    begun, _ = _timed("inverse-dynamics", part, _OPTIONS)
    mine, spent = _timed("output-error", part, _OPTIONS)
    other = fit_by_scipy(part, np.array([begun.model.value(name) for name in NAMES]), STRIBECK)
    label = f"{_STRETCH:,} samples"
    reckoned = other.spent * _N_SAMPLES / _STRETCH
    return [
        Figure(f"output error, {label}", spent, "s"),
        Figure("its free-run position RMSE", mine.train.position_rmse, "m"),
        Figure(f"solve_ivp and curve_fit, {label}, {other.n_evaluations} free runs", other.spent, "s"),
        Figure("its free-run position RMSE", other.rmse, "m"),
        Figure(f"how many times faster, {label}", other.spent / spent, "1"),
        Figure(f"how many times faster, {_N_SAMPLES:,} samples (scipy reckoned at {reckoned:.0f} s)", reckoned / whole, "1"),
    ]


def run() -> list[Figure]:
    """Time of the fits after compilation."""
    record = recording()
    METHODS["output-error"].fit(structure(), [record.slice(0, 3000)], _OPTIONS)
    _, inverse = _timed("inverse-dynamics", record, _OPTIONS)
    found, spent = _timed("output-error", record, _OPTIONS)
    _, in_runs = _timed("output-error", record, replace(_OPTIONS, horizon=0.5))
    return [
        Figure("inverse dynamics, 6 parameters, 24,841 samples", inverse, "s"),
        Figure("output error, 6 parameters, 24,841 samples", spent, "s", "<= 1.0"),
        Figure("its free-run position RMSE", found.train.position_rmse, "m"),
        Figure("the same in runs of 0.5 s with free starts", in_runs, "s"),
        *_beside_scipy(record, spent),
    ]


BENCHMARK = Benchmark("fitting", "identification", run)
