"""The whole graph for an hour: what each process keeps in memory, and whether every message reaches the bag.

Seven processes: plant, excitation, compensator, PID, identifier, monitor and recorder, on an axis whose motion repeats. The
memory of a process is what it has to itself (``Anonymous`` in Linux' ``smaps_rollup``): pages of files and shared libraries,
which the system takes back when it needs them, don't count. The first sixth of the run is warm-up; growth is that of the median
of the last sixth over the median of the second one.

In lock-step every sample has a stamp that is known beforehand, so a message that is missing in the bag is seen by its stamp,
whatever the recorder says. In wall time the recorder's own count is what there is: gaps in the numbers by which the middleware
counts the messages of a publisher.
"""

from __future__ import annotations

import re
import struct
import tempfile
import time
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from fric.bagio.source import Source
from fric.figure import Figure
from fric.record import Array
from fric.shared_files import config_file

from .demo.graph import Graph, NodeSetup
from .domain import graph_domain

__all__ = ["anonymous_memory", "growth", "missing", "soaked"]

_PERIOD = 0.002  # [s] of the loop
_LOOK = 2.0  # [s] between two looks at the memory
_SHARES = 6  # of the run: the first one is warm-up
_START = 60.0  # [s] that the processes may take to start
_FLAT = "<= 2"  # % that a process may grow
_IN_STEP = ("/joint_states", "/force_command", "/reference")
_MOTION: Mapping[str, object] = {
    "multisine.duration": 20.0, "multisine.frequency_low": 0.25, "multisine.frequency_high": 1.0, "multisine.amplitude": 0.02,
    "multisine.speed": 0.1, "multisine.ramp": 0.2, "pause": 0.5, "repeat": True, "wait_for_subscribers": 3,
}  # fmt: skip


def anonymous_memory(process: int) -> float:
    """What the process with this number has in memory to itself [byte]; Linux only."""
    text = Path(f"/proc/{process}/smaps_rollup").read_text(encoding="ascii")
    found = re.search(r"^Anonymous:\s+(\d+) kB$", text, re.MULTILINE)
    assert found is not None, text
    return 1024.0 * int(found.group(1))


def growth(sizes: Array) -> float:
    """Median of the last sixth of ``sizes``, shape ``(n,)``, over that of the second one, less one [%]."""
    share = len(sizes) // _SHARES
    return float(100.0 * (np.median(sizes[-share:]) / np.median(sizes[share : 2 * share]) - 1.0))


def missing(stamps: Iterable[int], period: int) -> int:
    """How many of the samples between the first and the last of ``stamps`` [ns], ``period`` [ns] apart, are not there."""
    samples = {stamp // period for stamp in stamps if stamp % period == 0}
    return max(samples) - min(samples) + 1 - len(samples) if samples else 0


def _stamps(bag: Path, topic: str) -> list[int]:
    """Stamps [ns] in the headers of the messages of ``topic``, taken from their bytes as CDR lays them out."""
    with Source(bag) as source:
        return [
            seconds * 1_000_000_000 + rest
            for seconds, rest in (struct.unpack_from("<iI", each.data, 4) for each in source.messages([topic]))
        ]


def _nodes(lock_step: bool, bag: Path) -> list[NodeSetup]:
    loop: dict[str, object] = {"period": _PERIOD, "lock_step": lock_step}
    model = {"model_file": config_file("demo_axis.yaml")}
    pid = config_file("pid_lock_step.yaml" if lock_step else "pid.yaml")
    keeping: dict[str, object] = {
        "bag": bag, "compression": "zstd", "log_time": "stamp" if lock_step else "receive", "queue_depth": 100_000,
    }  # fmt: skip
    return [
        NodeSetup("recorder", keeping),
        NodeSetup("identifier", {}, config_file("identifier.yaml")),
        NodeSetup("monitor", model, config_file("monitor.yaml")),
        NodeSetup("compensator", loop | model, config_file("compensator.yaml")),
        NodeSetup("pid", loop, pid),
        # So many take joint states: PID, recorder, identifier and monitor, in lock-step the excitation as well.
        NodeSetup("plant", {**loop, "wait_for_subscribers": 5 if lock_step else 4}, config_file("plant.yaml")),
        NodeSetup("excitation", {**loop, **_MOTION}, config_file("excitation.yaml")),
    ]


def soaked(minutes: float, lock_step: bool) -> list[Figure]:
    """The graph for ``minutes`` [min]: growth of each process, and messages that are missing."""
    sizes: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory(prefix="fric-soak-") as folder, graph_domain() as domain:
        bag, nodes = Path(folder) / "bag", _nodes(lock_step, Path(folder) / "bag")
        with Graph(nodes, Path(folder) / "logs", domain) as graph:
            graph.wait_for_text("recorder", "recording into", timeout=_START)
            end = time.monotonic() + 60.0 * minutes
            while time.monotonic() < end:
                for name, process in graph.processes.items():
                    sizes.setdefault(name, []).append(anonymous_memory(process))
                graph.run_for(_LOOK)
            graph.stop()
            recorded = graph.text_of("recorder")
        said = re.search(r"recorded (\d+) messages, (\d+) lost", recorded)
        assert said is not None, recorded
        stamps = {topic: _stamps(bag, topic) for topic in _IN_STEP} if lock_step else {}
    how = "lock-step" if lock_step else "wall time"
    grown = {name: (growth(np.array(kept)), np.median(kept)) for name, kept in sizes.items()}
    return [
        *(
            Figure(f"{how}, {minutes:g} min: growth of {name}, {size / 1e6:.0f} MB", by, "%", _FLAT)
            for name, (by, size) in grown.items()
        ),
        Figure(f"{how}: messages in the bag", float(said.group(1)), "1", ">= 1"),
        Figure(f"{how}: messages lost, as the recorder counts", float(said.group(2)), "1", "== 0"),
        *(
            Figure(f"{how}: {topic}, missing of {len(of)}", float(missing(of, round(1e9 * _PERIOD))), "1", "== 0")
            for topic, of in stamps.items()
        ),
    ]
