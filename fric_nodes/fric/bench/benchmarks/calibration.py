"""Coverage of the intervals of every method over 200 simulated recordings; takes several minutes.

What is recorded and how it is counted: :mod:`fric.identification.calibration`.
"""

from __future__ import annotations

from ...figure import Figure
from ...identification.calibration import AXES, calibrate
from ...identification.result import Options
from ..benchmark import Benchmark
from ..trials import figures_of

__all__ = ["BENCHMARK", "CASES"]

# None of these recordings was looked at while the methods were made.
_SEEDS = range(10_000, 10_200)
_FEWER = range(10_000, 10_040)
_PROCESSES = 2

CASES = {
    "inverse dynamics": ("rigid", "inverse-dynamics", Options()),
    "inverse dynamics, bristles": ("bristled", "inverse-dynamics", Options()),
    "output error": ("rigid", "output-error", Options()),
    "output error, runs of 0.5 s": ("rigid", "output-error", Options(horizon=0.5)),
    "prediction error": ("rigid", "prediction-error", Options()),
    "prediction error, bristles": ("bristled", "prediction-error", Options()),
}
"""Axis, method and options of each case."""

KINDS = {
    "inverse dynamics, bootstrap": ("rigid", "inverse-dynamics", "bootstrap"),
    "inverse dynamics, bristles, profile": ("bristled", "inverse-dynamics", "profile"),
    "prediction error, bootstrap": ("rigid", "prediction-error", "bootstrap"),
    "prediction error, bristles, profile": ("bristled", "prediction-error", "profile"),
}
"""Axis, method and kind of interval of each case; these intervals take a hundred fits each, so that fewer are counted."""


def run() -> list[Figure]:
    """Coverage and bias per method and parameter."""
    figures: list[Figure] = []
    for name, (axis, method, options) in CASES.items():
        figures += figures_of(name, calibrate(AXES[axis], method, _SEEDS, options, _PROCESSES))
    for name, (axis, method, kind) in KINDS.items():
        figures += figures_of(name, calibrate(AXES[axis], method, _FEWER, Options(), _PROCESSES, kind))
    return figures


BENCHMARK = Benchmark("calibration", "coverage of intervals over 200 recordings per method", run, long=True)
