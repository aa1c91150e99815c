"""A benchmark of nothing."""

from __future__ import annotations

from fric.bench.benchmark import Benchmark
from fric.figure import Figure

BENCHMARK = Benchmark("nothing", "how long nothing takes", lambda: [Figure("nothing", 0.0, "s", "<= 0")])
