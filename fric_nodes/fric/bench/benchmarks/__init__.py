"""The benchmarks: one per file, found by being here (a constant ``BENCHMARK``)."""
