"""Rate of the lock-step loop: plant, excitation, compensator and PID in four processes over DDS."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from fric.bench.benchmark import Benchmark
from fric.figure import Figure
from fric.shared_files import config_file

from fric_nodes.demo.graph import Graph, NodeSetup
from fric_nodes.domain import graph_domain

__all__ = ["BENCHMARK", "samples_per_second"]

_DURATION = 20.0  # [s] of the axis, at 500 Hz


def samples_per_second(duration: float = _DURATION) -> float:
    """Rate in wall time, as the plant counts it, over ``duration`` [s] of the axis."""
    loop: dict[str, object] = {"lock_step": True}
    nodes = [
        NodeSetup("excitation", loop, config_file("demo_motion.yaml")),
        NodeSetup("compensator", loop | {"model_file": config_file("demo_axis.yaml")}, config_file("compensator.yaml")),
        NodeSetup("pid", loop, config_file("pid_lock_step.yaml")),
        NodeSetup("plant", loop | {"duration": duration}, config_file("plant.yaml")),
    ]
    with tempfile.TemporaryDirectory() as folder, graph_domain() as domain, Graph(nodes, Path(folder), domain) as graph:
        graph.wait_for("plant", timeout=120.0)
        graph.stop()
        words = graph.text_of("plant")
    found = re.search(r"(\d+(?:\.\d+)?) samples/s", words)
    assert found is not None, words
    return float(found.group(1))


def run() -> list[Figure]:
    """Samples per second."""
    return [Figure("lock-step loop, four processes", samples_per_second(), "samples/s", ">= 800")]


BENCHMARK = Benchmark("lock-step", "the lock-step loop", run)
