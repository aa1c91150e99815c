"""Processes held up and faults on the topics of a running graph: the axis stays where its motion is, and causes are named."""

from __future__ import annotations

import contextlib
import math
import signal
import time
from typing import TYPE_CHECKING

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from fric_nodes.loop import LoopNode
from rclpy.executors import Executor, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import Reference

if TYPE_CHECKING:
    from .conftest import Graph

pytestmark = pytest.mark.alone

_SENDINGS = 6
_WAITING = 40  # fewer than the queue of a loop in wall time holds

H = 0.004
MOTION = {
    "multisine.duration": 4.0, "multisine.frequency_low": 0.25, "multisine.frequency_high": 1.0, "multisine.amplitude": 0.02,
    "multisine.speed": 0.1, "multisine.ramp": 0.2, "start_delay": 0.2, "repeat": True,
}  # fmt: skip
"""Goes through its whole range every 4 s, without an end; the axis of a motion that rests now and then looks stuck."""
ANSWERED = 1.0
"""[s] after a stall within which the axis is commanded again; what a reliable subscription had to ask for came after 1.9 s."""
GAINS = {"kp": 8000.0, "ki": 1.5e5, "kd": 200.0, "filter_time": 0.001, "force_limit": 100.0}


class Axis:
    """A graph of plant, controller and excitation, and what is heard of it."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.node = graph.node("listener")
        self.positions: list[float] = []
        self.commanded = math.inf  # [s] when the last command came
        self.said: dict[str, set[str]] = {}
        deep = QoSProfile(depth=20_000)
        self.node.create_subscription(JointState, "joint_states", lambda m: self.positions.append(m.position[0]), deep)
        self.node.create_subscription(Float64, "force_command", self._on_command, deep)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_report, 10)
        self.references = self.node.create_publisher(Reference, "reference", deep)
        graph.spin(self.node)
        self.processes = {
            "plant": graph.start_node("plant", period=H, force_limit=100.0),
            "pid": graph.start_node(
                "pid", period=H, use_feedforward=False, reference_speed=0.5, diagnostics_period=0.1, **GAINS
            ),
            "excitation": graph.start_node("excitation", period=H, **MOTION),
        }
        self.until_moving()

    def _on_command(self, _message: Float64) -> None:
        self.commanded = time.monotonic()

    def _on_report(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.said.setdefault(status.name, set()).update(pair.key for pair in status.values)

    def until_moving(self) -> None:
        begin = len(self.positions)
        self.graph.until(lambda: np.ptp(self.positions[begin:] or [0.0]) > 0.015, "the axis moves")


def stalled(axis: Axis, name: str, seconds: float, random: np.random.Generator) -> float:
    """Hold a process up in motion; the largest position afterwards [m], less what the axis had when it went on."""
    time.sleep(0.3 + 0.7 * random.random())
    axis.processes[name].send_signal(signal.SIGSTOP)
    time.sleep(seconds)
    at = abs(axis.positions[-1])
    goes_on = time.monotonic()
    axis.processes[name].send_signal(signal.SIGCONT)
    begin = len(axis.positions)
    if name == "pid":
        axis.graph.until(lambda: axis.commanded > goes_on, "a command", ANSWERED)
    axis.until_moving()
    return max(abs(position) for position in axis.positions[begin:]) - max(at, 0.021)


@pytest.mark.timeout(300)
def test_a_controller_that_was_held_up_makes_no_excursion(graph: Graph) -> None:
    axis, random = Axis(graph), np.random.default_rng(1)
    excursions = [stalled(axis, "pid", seconds, random) for seconds in (0.5, 2.5, 0.5)]
    assert max(excursions) < 1e-3, excursions
    graph.until(lambda: "refused joint state: too old" in axis.said.get("pid", set()), "the stale states are named")


@pytest.mark.timeout(300)
def test_bad_references_are_named_and_change_nothing(graph: Graph) -> None:
    axis = Axis(graph)

    def named() -> bool:
        return len([name for name in axis.said.get("pid", set()) if name.startswith("refused reference")]) > 2

    for _ in range(_SENDINGS):  # with best effort one may be lost
        for position, offset in ((1e308, 0), (1e300, 0), (math.nan, 0), (0.0, 10), (0.0, -10)):
            message = Reference(position=position)
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(time.time_ns() + offset * 10**9, 10**9)
            axis.references.publish(message)
        with contextlib.suppress(pytest.fail.Exception):
            graph.until(named, "named", 10.0)
            break
    assert named(), axis.said
    begin = len(axis.positions)
    axis.until_moving()
    assert max(map(abs, axis.positions[begin:])) < 0.023


@pytest.mark.parametrize("kind", [SingleThreadedExecutor, MultiThreadedExecutor, EventsExecutor])
def test_messages_that_waited_are_taken_in_order_and_at_once(graph: Graph, kind: type[Executor]) -> None:
    """An executor that hands over one message a round lets a node that fell behind stay behind."""
    heard: list[float] = []
    rounds: list[int] = []  # how many had been heard, after each round that brought some
    node = graph.owns(LoopNode("late", (), context=graph.context()))
    node.take_in(Float64, "numbers", lambda message: heard.append(message.data))
    sender = graph.node("sender")
    numbers = sender.create_publisher(Float64, "numbers", 100)
    graph.meet(node, sender)
    for k in range(_WAITING):
        numbers.publish(Float64(data=float(k)))
    time.sleep(0.5)  # a subscription with best effort acknowledges nothing
    executor = kind(context=node.context)
    executor.add_node(node)

    def all_heard() -> bool:
        executor.spin_once(timeout_sec=0.1)
        if len(heard) > (rounds or [0])[-1]:
            rounds.append(len(heard))
        return len(heard) >= _WAITING

    graph.until(all_heard, "all numbers")
    executor.shutdown()
    assert heard == [float(k) for k in range(_WAITING)]
    assert len(rounds) < _WAITING / 4


@pytest.mark.long
@pytest.mark.timeout(1200)
def test_fifty_stalls(graph: Graph) -> None:
    axis, random = Axis(graph), np.random.default_rng(2)
    excursions = [stalled(axis, "pid", float(random.choice([0.05, 0.5, 2.0])), random) for _ in range(50)]
    assert max(excursions) < 1e-3, excursions


@pytest.mark.long
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", ["plant", "excitation"])
def test_other_processes_held_up(graph: Graph, name: str) -> None:
    axis, random = Axis(graph), np.random.default_rng(3)
    excursions = [stalled(axis, name, float(random.choice([0.05, 0.5, 2.0])), random) for _ in range(20)]
    assert max(excursions) < 1e-3, excursions
