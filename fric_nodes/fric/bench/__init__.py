"""Benchmarks that a user can run with ``fric bench``: one file each, with a constant ``BENCHMARK``.

The figures of speed in the README and in docs/figures.md come from here.
"""

from __future__ import annotations

from ..registry import discover
from .benchmark import Benchmark

__all__ = ["BENCHMARKS", "Benchmark"]

BENCHMARKS: dict[str, Benchmark] = {
    benchmark.id: benchmark for benchmark in discover(f"{__name__}.benchmarks", "BENCHMARK", Benchmark)
}
"""Every benchmark by its id."""
