"""Quadrant peaks of two slides on a circle, over three decades of the acceleration at their reversals.

Each axis has one model, identified from one recording; each method's settings are the same at all feeds, as its autotune or, of
the quadrant pulse, its trial on a sine of 0.2 m/s^2 gives them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...figure import Figure
from ..benchmark import Benchmark
from ..compensation.circle import CIRCLE_METHODS, peak, rounds

__all__ = ["BENCHMARK", "run"]

ACCELERATIONS = (1e-3, 1e-2, 1e-1, 1.0)
"""Feed squared over radius [m/s^2]."""

SEEDS = (50_011, 50_013)
_BASE, _MODEL = CIRCLE_METHODS[0], CIRCLE_METHODS[-1]


def run(seeds: Sequence[int] = SEEDS, accelerations: Sequence[float] = ACCELERATIONS) -> list[Figure]:
    """Median peaks of the seeds, and how many times smaller the model's are."""
    figures = []
    for acceleration in accelerations:
        found = [{name: peak(error) for name, (_, error) in rounds(seed, acceleration).items()} for seed in seeds]
        at = f"reversals of {acceleration:g} m/s^2"
        for name in CIRCLE_METHODS:
            middle = float(np.median([each[name] for each in found]))
            figures.append(Figure(f"{at}, {name}: quadrant peak", 1e6 * middle, "um"))
        for name in CIRCLE_METHODS[:3]:
            factor = float(np.exp(np.mean([np.log(each[name] / each[_MODEL]) for each in found])))
            goal = ">= 20" if name == _BASE else ">= 5"
            figures.append(Figure(f"{at}: {name} over {_MODEL}", factor, "1", goal))
    return figures


BENCHMARK = Benchmark("circle", "quadrant peaks of a circle over three decades of reversal acceleration", run, long=True)
