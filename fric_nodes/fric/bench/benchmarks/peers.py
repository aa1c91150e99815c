"""fric beside what an engineer would otherwise use, task by task, in one run; the tasks are in :mod:`fric.bench.peers`."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from ...figure import Figure
from ...registry import discover
from ..benchmark import Benchmark
from ..peer import Peer, measure

__all__ = ["BENCHMARK"]


def run() -> list[Figure]:
    """The ratio of each pair with its spread over the turns, both times, and what stands beside them."""
    peers = discover(f"{__package__.rpartition('.')[0]}.peers", "PEER", Peer)
    with tempfile.TemporaryDirectory() as folder:
        pairs = [pair for peer in peers for pair in peer.prepare(Path(folder))]
        return measure(pairs, lambda line: sys.stderr.write(f"{line}\n"))


BENCHMARK = Benchmark("peers", "fric beside what one would otherwise use (long: 5 minutes)", run, long=True)
