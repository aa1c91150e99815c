"""One compiled step of a model, beside a free run of the whole."""

from __future__ import annotations

import time

import numpy as np

from ...figure import Figure
from ...model import build_model, term
from ...simulation import simulate
from ..benchmark import Benchmark

__all__ = ["BENCHMARK"]

_N_STEPS = 400_000


def run() -> list[Figure]:
    """Nanoseconds per step, best of a few runs."""
    static = [
        term("coulomb", force=4.0),
        term("viscous", coefficient=10.0),
        term("stribeck", force=2.0, velocity=0.01),
    ]
    structures = {
        "Coulomb, viscous, Stribeck, exact stick": static,
        "with LuGre": [*static, term("presliding", stiffness=1e5, damping=100.0)],
    }
    effort = 12.0 * np.sin(np.arange(_N_STEPS) * 4.4e-3)
    figures = []
    for name, terms in structures.items():
        model = build_model("rigid", {"mass": 1.2}, terms)
        simulate(model, effort[:10], 1e-3, n_substeps=1, fused=True)
        spent = []
        for _ in range(3):
            start = time.perf_counter()
            simulate(model, effort, 1e-3, n_substeps=1, fused=True)
            spent.append(time.perf_counter() - start)
        figures.append(Figure(f"step, {name}", 1e9 * min(spent) / _N_STEPS, "ns"))
    return figures


BENCHMARK = Benchmark("stepping", "simulation step", run)
