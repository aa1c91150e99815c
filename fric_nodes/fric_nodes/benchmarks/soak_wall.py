"""The graph in wall time for an hour: memory of each process, and messages that are missing in the bag."""

from __future__ import annotations

from fric.bench.benchmark import Benchmark
from fric.figure import Figure

__all__ = ["BENCHMARK"]

_HOUR = 60  # [min]


def _for_minutes(minutes: int) -> list[Figure]:
    # Who lists the benchmarks needs no ROS.
    from ..soak import soaked

    return soaked(float(minutes), lock_step=False)


def _run() -> list[Figure]:
    return _for_minutes(_HOUR)


BENCHMARK = Benchmark("soak-wall", "the graph for an hour in wall time", _run, long=True, sized=_for_minutes, size="minutes")
