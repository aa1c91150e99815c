"""The graph in lock-step for an hour: memory of each process, and messages that are missing in the bag."""

from __future__ import annotations

from fric.bench.benchmark import Benchmark
from fric.figure import Figure

__all__ = ["BENCHMARK"]

_HOUR = 60  # [min]


def _for_minutes(minutes: int) -> list[Figure]:
    # Who lists the benchmarks needs no ROS.
    from ..soak import soaked

    return soaked(float(minutes), lock_step=True)


def _run() -> list[Figure]:
    return _for_minutes(_HOUR)


BENCHMARK = Benchmark("soak", "the graph for an hour in lock-step", _run, long=True, sized=_for_minutes, size="minutes")
