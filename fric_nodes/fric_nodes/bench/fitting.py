"""Output-error fit of six parameters on 24,841 samples at 1 kHz: a simulated axis of the size of the EMPS benchmark.

The recording is made here (a ball-screw axis under force in both directions, quantised and noisy); the fit starts from inverse
dynamics and runs the whole recording as one free run.
"""

from __future__ import annotations

import time

import numpy as np

from ..identification import METHODS
from ..identification.result import Options
from ..model import build_model, term
from ..record import Record
from ..simulate import simulate
from .benchmark import Benchmark, Figure

__all__ = ["BENCHMARK"]

_N_SAMPLES = 24_841


def _recording() -> Record:
    truth = build_model(
        "rigid",
        {"mass": 95.0},
        [
            term("coulomb", force=20.0),
            term("viscous", coefficient=200.0),
            term("asymmetry", coefficient=-37.0),
            term("bias", force=-3.0),
            term("stribeck", force=5.0, velocity=0.02),
        ],
    )
    generator = np.random.default_rng(7)
    at = np.arange(_N_SAMPLES, dtype=np.float64) * 1e-3
    effort = sum(30.0 * np.sin(2 * np.pi * f * at + p) for f, p in ((0.16, 0.0), (0.41, 1.0), (1.07, 2.0), (2.3, 0.5)))
    effort = np.asarray(effort) - 3.0
    motion = simulate(truth, effort, 1e-3, n_substeps=4)
    resolution = 1e-7
    position = np.round(motion.position / resolution) * resolution
    return Record(
        at, position, effort + 0.5 * generator.standard_normal(_N_SAMPLES), effort_hold="following", source="benchmark"
    )


def run() -> list[Figure]:
    """Time of the fit after compilation."""
    record = _recording()
    structure = build_model(
        "rigid",
        {"mass": 1.0},
        [
            term("coulomb", force=1.0),
            term("viscous", coefficient=1.0),
            term("asymmetry"),
            term("bias", force=0.0),
            term("stribeck", force=0.0, velocity=0.02),
        ],
    )
    # Six free: mass, Coulomb, viscous, its asymmetry, bias, Stribeck surplus.
    options = Options(held=("asymmetry.force", "stribeck.velocity"))
    METHODS["output-error"].fit(structure, [record.slice(0, 3000)], options)
    start = time.perf_counter()
    METHODS["inverse-dynamics"].fit(structure, [record], options)
    inverse = time.perf_counter() - start
    start = time.perf_counter()
    found = METHODS["output-error"].fit(structure, [record], options)
    spent = time.perf_counter() - start
    return [
        Figure("inverse dynamics, 6 parameters, 24,841 samples", inverse, "s"),
        Figure("output error, 6 parameters, 24,841 samples", spent, "s", "<= 1.0"),
        Figure("its free-run position RMSE", found.train.position_rmse, "m"),
    ]


BENCHMARK = Benchmark("fitting", "identification", run)
