"""Coverage of the intervals of every method over 200 simulated recordings; takes several minutes.

What is recorded and how it is counted: :mod:`fric_nodes.identification.calibration`.
"""

from __future__ import annotations

from ..identification.calibration import AXES, Calibration, calibrate
from ..identification.result import Options
from .benchmark import Benchmark, Figure

__all__ = ["BENCHMARK", "CASES", "figures_of"]

# None of these recordings was looked at while the methods were made.
_SEEDS = range(10_000, 10_200)
_PROCESSES = 2

CASES = {
    "inverse dynamics": ("rigid", "inverse-dynamics", Options()),
    "output error": ("rigid", "output-error", Options()),
    "output error, runs of 0.5 s": ("rigid", "output-error", Options(horizon=0.5)),
    "prediction error": ("rigid", "prediction-error", Options()),
    "prediction error, bristles": ("bristled", "prediction-error", Options()),
}
"""Axis, method and options of each case."""


def figures_of(name: str, found: Calibration) -> list[Figure]:
    """Coverage, and mean error over standard error, of each parameter."""
    figures = []
    for parameter, covered, bias in zip(found.names, found.coverage(0.9).tolist(), found.bias.tolist(), strict=True):
        figures += [
            Figure(f"{name}: {parameter}, 90 % intervals that hold the truth", covered, "1", ">= 0.85"),
            Figure(f"{name}: {parameter}, the same", covered, "1", "<= 0.95"),
            Figure(f"{name}: {parameter}, mean error over standard error", bias, "1"),
        ]
    return figures


def run() -> list[Figure]:
    """Coverage and bias per method and parameter."""
    figures: list[Figure] = []
    for name, (axis, method, options) in CASES.items():
        figures += figures_of(name, calibrate(AXES[axis], method, _SEEDS, options, _PROCESSES))
    return figures


BENCHMARK = Benchmark("calibration", "coverage of intervals over 200 recordings per method", run)
