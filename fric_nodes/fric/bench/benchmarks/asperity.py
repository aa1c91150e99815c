"""The asperity model against real time at 1 kHz, and how its cost grows with the number of asperities.

In the plant the population is part of an implicit step, which evaluates it several times; driven by a displacement it is
evaluated once per interval. Times are those of the processor, the best of a few runs.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ...figure import Figure
from ...friction.asperity import AsperityParameters, AsperityPopulation
from ...model import Model, build_model, term
from ...simulation import Simulator, substeps
from ..benchmark import Benchmark

__all__ = ["BENCHMARK"]

_N = 20_000
_H = 1e-3  # [s]
_WAVE = 1e-3  # [m]
_REPEATS = 3


def _model(n: int) -> Model:
    """A machine slide of 1 t, damped so much that it slides steadily at every speed."""
    population = term("presliding", "asperity", stiffness=1.6e6, wavelength=_WAVE, time=0.05, asperities=n)
    return build_model(
        "rigid", {"mass": 1000.0}, [term("coulomb", force=100.0), term("viscous", coefficient=40_000.0), population]
    )


def _spent(run: Callable[[], object], repeats: int = _REPEATS) -> float:
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        run()
        best = min(best, time.process_time() - start)
    return best


def _in_plant(n: int, force: float, n_steps: int) -> tuple[float, float]:
    """Time per step [s] and way per step [mean waves] under a force around ``force`` [N]."""
    simulator = Simulator(_model(n), fused=True)
    effort = force + 20.0 * np.sin(0.3 * np.arange(n_steps))
    states, _ = simulator.run(np.full(max(n_steps, 600) if n <= _N else n_steps, force), _H)
    spent = _spent(lambda: simulator.run(effort, _H)) / n_steps
    return spent, abs(float(states[-1, 1])) * _H / _WAVE


def _driven(n: int) -> float:
    """Time per asperity and interval along a displacement [s], a hundredth of a mean wave in each interval."""
    population = AsperityPopulation(AsperityParameters(), n)
    n_steps = max(4_000_000 // n, 20)
    position = 0.01 * np.arange(n_steps + 1)
    population.run(position, 0.01)
    return _spent(lambda: population.run(position, 0.01)) / (n_steps * n)


def run() -> list[Figure]:
    """Real-time factors and cost per asperity."""
    figures = []
    assert substeps(_model(_N), _H) == 1
    _in_plant(10, 50.0, 3)
    for name, force, goal in (
        ("pre-sliding", 50.0, ">= 1"),
        ("sliding", 760.0, ">= 1"),
        ("sliding faster", 2240.0, ">= 1"),
        ("sliding fast", 4150.0, ""),
        ("sliding very fast", 40_100.0, ""),
    ):
        spent, way = _in_plant(_N, force, 200)
        figures.append(
            Figure(f"{_N} asperities in the plant, {name}, {way:.2g} mean waves per step", _H / spent, "x real time", goal)
        )
    simulator = Simulator(_model(_N), fused=True)
    spent = _spent(lambda: [simulator.step(50.0, _H) for _ in range(100)]) / 100
    figures.append(Figure(f"{_N} asperities in the plant, pre-sliding, one call per sample", _H / spent, "x real time", ">= 1"))
    few, many = _driven(1000), _driven(1_000_000)
    figures += [
        Figure("driven, 1,000 asperities, cost of each", 1e9 * few, "ns"),
        Figure("driven, 1,000,000 asperities, cost of each", 1e9 * many, "ns"),
        Figure("driven: ratio of the two", many / few, "1", "<= 1.3"),
    ]
    few, many = _in_plant(1000, 50.0, 2000)[0] / 1000, _in_plant(1_000_000, 50.0, 3)[0] / 1_000_000
    figures += [
        Figure("in the plant, 1,000 asperities, cost of each", 1e9 * few, "ns"),
        Figure("in the plant, 1,000,000 asperities, cost of each", 1e9 * many, "ns"),
        Figure("in the plant: ratio of the two", many / few, "1"),
    ]
    return figures


BENCHMARK = Benchmark("asperity", "the asperity model", run)
