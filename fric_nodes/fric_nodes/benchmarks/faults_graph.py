"""The fault table over the real graph: plant, controller, excitation and compensator in processes of their own.

Each fault is injected at random moments of the moving axis. What is judged is every force that the plant's drive was told, and
the true motion of the axis: force, force rate, speed and position within their limits, stops within the stated time.
"""

from __future__ import annotations

import sys
import tempfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from fric.bench.benchmark import Benchmark
from fric.figure import Figure

from ..domain import graph_domain

if TYPE_CHECKING:
    from ..fault_graph.faults import Outcome

__all__ = ["BENCHMARK", "inject"]

_TIMES = 20  # statistical: with none of 20 unsafe, fewer than 14 % of such faults are, at 95 % confidence


def inject(names: Sequence[str], times: int, told: Callable[[str], object]) -> dict[str, list[Outcome]]:
    """Each of the faults ``names`` so many times, in one graph; ``told`` takes a line about each."""
    # Who lists the benchmarks needs no ROS.
    from ..fault_graph.faults import FAULTS, trial
    from ..fault_graph.rig import GraphRig

    found: dict[str, list[Outcome]] = {}
    with tempfile.TemporaryDirectory() as folder, graph_domain() as domain, GraphRig(Path(folder), domain) as rig:
        for name in names:
            random = np.random.default_rng(zlib.crc32(name.encode()))
            found[name] = [trial(rig, FAULTS[name], random) for _ in range(times)]
            told(_line(name, found[name]))
    return found


def _line(name: str, of: Sequence[Outcome]) -> str:
    unsafe, samples = sum(each.unsafe for each in of), sum(each.samples for each in of)
    named, moved = sum(each.named for each in of), sum(each.moves for each in of)
    why = next((f"; {each.why}" for each in of if each.why), "")
    return f"{name:34} {len(of):4} injected {unsafe:4} of {samples:7} unsafe {named:4} named {moved:4} move again{why}"


def run() -> list[Figure]:
    """Unsafe samples of each fault, and shares over all."""
    from ..fault_graph.faults import FAULTS

    found = inject(list(FAULTS), _TIMES, lambda line: sys.stderr.write(f"{line}\n"))
    every = [each for of in found.values() for each in of]
    n, samples, unsafe = len(every), sum(each.samples for each in every), sum(each.unsafe for each in every)
    return [
        *(
            Figure(f"{name}, {len(of)} times", sum(e.unsafe for e in of), "unsafe samples", "== 0")
            for name, of in found.items()
        ),
        Figure(f"all, of {samples} samples", unsafe, "unsafe samples", "== 0"),
        Figure(f"cause named, of {n} faults", 100.0 * sum(e.named for e in every) / n, "%", ">= 99"),
        Figure("stops longer than stated", sum(e.slow_stops for e in every), "1", "== 0"),
        Figure("axis moves again", 100.0 * sum(e.moves for e in every) / n, "%", "== 100"),
    ]


BENCHMARK = Benchmark("faults-graph", "faults injected into a moving axis of the running graph", run, long=True)
