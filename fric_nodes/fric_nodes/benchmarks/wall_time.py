"""The loop in wall time: how evenly plant and controller publish, in four processes over DDS.

A moving axis: excitation, compensator and PID answer the plant. A fifth process, this one, hears both topics and takes the
times at which the middleware sent each message.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from fric.bench.benchmark import Benchmark
from fric.figure import Figure
from fric.shared_files import config_file

from fric_nodes.demo.graph import Graph, NodeSetup
from fric_nodes.domain import graph_domain

if TYPE_CHECKING:
    from fric.record import Array

__all__ = ["BENCHMARK", "figures", "sent"]

_RUNS = ((1000.0, 600.0), (500.0, 120.0))  # rate [Hz], duration [s]
_BEGUN = 5.0  # [s] physical scale: processes that start disturb the first seconds
_LOOK = 0.1  # [s] numerical: between two looks at what has come
_KEPT = 2000  # messages, ten times what comes until the next look
_MISS = 1.5  # periods, as the nodes themselves count them
_MOTION: Mapping[str, object] = {
    "multisine.duration": 4.0, "multisine.frequency_low": 0.25, "multisine.frequency_high": 1.0, "multisine.amplitude": 0.02,
    "multisine.speed": 0.1, "multisine.ramp": 0.2, "pause": 0.0, "repeat": True,
}  # fmt: skip


def sent(rate: float, duration: float) -> dict[str, Array]:
    """Times at which the messages of each topic were sent [s], at ``rate`` [Hz] for ``duration`` [s]."""
    import rclpy
    from rclpy.context import Context
    from rclpy.node import Node
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64

    period: dict[str, object] = {"period": 1.0 / rate}
    nodes = [
        NodeSetup("plant", period, config_file("plant.yaml")),
        NodeSetup("compensator", {"model_file": config_file("demo_axis.yaml")}, config_file("compensator.yaml")),
        NodeSetup("pid", period, config_file("pid.yaml")),
        NodeSetup("excitation", {**period, **_MOTION}, config_file("excitation.yaml")),
    ]
    times: dict[str, list[int]] = {"joint_states": [], "force_command": []}
    quality = QoSProfile(depth=_KEPT, reliability=ReliabilityPolicy.BEST_EFFORT)
    with tempfile.TemporaryDirectory() as folder, graph_domain() as domain:
        context = Context()
        rclpy.init(context=context, domain_id=domain)
        listener = Node("wall_time", context=context)
        kinds = {"joint_states": JointState, "force_command": Float64}
        ends = {name: listener.create_subscription(kind, name, lambda _: None, quality) for name, kind in kinds.items()}
        with Graph(nodes, Path(folder), domain) as graph:
            end = time.monotonic() + _BEGUN + duration
            while time.monotonic() < end:
                graph.run_for(_LOOK)
                for name, subscription in ends.items():
                    # Taken without an executor, which costs as much as a node of the loop.
                    with subscription.handle:
                        while (taken := subscription.handle.take_message(subscription.msg_type, True)) is not None:
                            times[name].append(taken[1]["source_timestamp"])
        listener.destroy_node()
        context.shutdown()
    return {name: 1e-9 * np.array(kept, dtype=np.float64) for name, kept in times.items()}


def figures(rate: float, topic: str, stamps: Array) -> list[Figure]:
    """Of the periods between ``stamps`` [s], shape ``(n,)``, after the start of the processes."""
    after = np.sort(stamps)
    periods = 1e3 * np.diff(after[after > after[0] + _BEGUN])
    nominal, what = 1e3 / rate, f"{rate:g} Hz, /{topic}"
    late = int(np.count_nonzero(periods > _MISS * nominal))
    return [
        Figure(f"{what}: period, median of {periods.shape[0]}", float(np.median(periods)), "ms"),
        *(Figure(f"{what}: period, {share} %", float(np.percentile(periods, share)), "ms") for share in (99, 99.9)),
        Figure(f"{what}: longest period", float(np.max(periods)), "ms"),
        Figure(f"{what}: periods longer than {_MISS:g} nominal ones", float(late), "1"),
    ]


def run() -> list[Figure]:
    """Both rates, one after the other."""
    found = [(rate, sent(rate, duration)) for rate, duration in _RUNS]
    return [figure for rate, of in found for topic, stamps in of.items() for figure in figures(rate, topic, stamps)]


BENCHMARK = Benchmark("wall-time", "periods of the loop in wall time, four processes (long: 12 minutes)", run, long=True)
