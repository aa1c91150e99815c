"""The loop in wall time over the real middleware: tracking, watchdog, bad messages, and nodes that come and go."""

from __future__ import annotations

import math
import signal
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from fric.control.tuning import tune
from fric.model import build_model, term
from fric.model_file import write_model
from fric_nodes.nodes.compensator import CompensatorNode
from fric_nodes.nodes.excitation import ExcitationNode
from fric_nodes.nodes.pid import PidNode
from fric_nodes.nodes.plant import PlantNode
from rclpy.executors import Executor, MultiThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from fric_interfaces.msg import Reference

if TYPE_CHECKING:
    from .conftest import Graph

pytestmark = pytest.mark.alone

H = 0.02  # an executor that waits on a set takes a slow core for itself at 100 Hz, with everything in one process
DEEP = QoSProfile(depth=20_000)
MODEL = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=5.0), term("viscous", coefficient=20.0)])
_TUNED, _ = tune(2.0, 20.0, H, delay=0.5 * H, filter_time=0.2 * H)
GAINS = {"kp": _TUNED.proportional, "ki": _TUNED.integral, "kd": _TUNED.derivative, "filter_time": _TUNED.filter_time}
MOTION = {"multisine.duration": 60.0, "multisine.frequency_high": 2.0, "multisine.amplitude": 0.02, "multisine.speed": 0.1}


def _make(graph: Graph, kind: type[Any], context: Any = None, **parameters: object) -> Any:
    overrides = [Parameter(key, value=value) for key, value in {"period": H, **parameters}.items()]
    return graph.owns(kind(context=context or graph.context(), parameter_overrides=overrides))


def _model_file(folder: Path) -> str:
    write_model(MODEL, folder / "axis.yaml")
    return str(folder / "axis.yaml")


class Listener:
    """Keeps joint states, references and reports."""

    def __init__(self, graph: Graph) -> None:
        self.node: Node = graph.node("listener")
        self.states: list[tuple[float, float, float]] = []
        self.references: list[tuple[float, float]] = []
        self.commands: list[float] = []
        self.reports: dict[str, dict[str, str]] = {}
        subscribe = self.node.create_subscription
        subscribe(JointState, "joint_states", self._on_state, DEEP)
        subscribe(Reference, "reference", lambda m: self.references.append((_seconds(m), m.position)), DEEP)
        subscribe(Float64, "force_command", lambda m: self.commands.append(m.data), DEEP)
        subscribe(DiagnosticArray, "/diagnostics", self._on_report, 10)
        self.forces = self.node.create_publisher(Float64, "force_command", 10)
        graph.spin(self.node, kind=EventsExecutor)

    def _on_state(self, message: JointState) -> None:
        if message.position and message.effort:
            self.states.append((_seconds(message), message.position[0], message.effort[0]))

    def _on_report(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.reports[status.name] = {pair.key: pair.value for pair in status.values}

    def follows(self, limit: float, seconds: float = 0.5) -> bool:
        """True when the newest ``seconds`` [s] of states keep within ``limit`` [m] (root mean square) of the reference."""
        if not self.states or not self.references:
            return False
        states, references = np.array(self.states), np.array(self.references)
        end = min(states[-1, 0], references[-1, 0])
        states = states[(states[:, 0] > end - seconds) & (states[:, 0] < end)]
        # Half of the states that there should be: a busy machine may hold some up.
        if len(states) < 0.5 * seconds / H or np.ptp(references[references[:, 0] > end - seconds, 1]) < 2.0 * limit:
            return False
        wanted = np.interp(states[:, 0], references[:, 0], references[:, 1])
        return bool(np.sqrt(np.mean((wanted - states[:, 1]) ** 2)) < limit)


def _seconds(message: Any) -> float:
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


@pytest.mark.usefixtures("quick_switches")
@pytest.mark.parametrize("kind", [MultiThreadedExecutor, EventsExecutor])
def test_loop_follows_the_reference_in_one_process(graph: Graph, kind: type[Executor]) -> None:
    listener = Listener(graph)
    context = graph.context()
    file = _model_file(graph.folder)
    nodes = [
        _make(graph, PlantNode, context, model_file=file),
        _make(graph, PidNode, context, **GAINS),
        _make(graph, CompensatorNode, context, model_file=file),
        _make(graph, ExcitationNode, context, start_delay=0.2, **MOTION),
    ]
    graph.spin(*nodes, kind=kind)
    graph.until(lambda: listener.follows(5e-4), "the axis follows a reference that moves")


@pytest.mark.long
def test_processes_come_and_go(graph: Graph) -> None:
    listener = Listener(graph)
    parameters = {
        "plant": {"period": H, "model_file": _model_file(graph.folder)},
        "pid": {"period": H, **GAINS, "use_feedforward": False},
        "excitation": {"period": H, "start_delay": 0.2, "multisine.ramp": 0.2, **MOTION},
    }
    running = {name: graph.start_node(name, **values) for name, values in parameters.items()}
    graph.until(lambda: listener.follows(1e-3), "the axis follows")
    for name in ("pid", "plant"):
        running[name].kill()
        running[name].wait()
        running[name] = graph.start_node(name, **parameters[name])
        count = len(listener.commands)
        graph.until(lambda at=count: len(listener.commands) > at + 100, f"commands go on with a new {name}")
        listener.states.clear()
        graph.until(lambda: listener.follows(1e-3), f"the axis follows with a new {name}")
    for process in running.values():
        status, _, error = graph.finish(process, signal.SIGINT)
        assert status == 0, error


def test_without_commands_the_force_is_zero_within_the_watchdog_time(graph: Graph) -> None:
    listener = Listener(graph)
    plant = _make(graph, PlantNode, model_file=_model_file(graph.folder), watchdog_time=0.1, diagnostics_period=0.1)
    graph.spin(plant, kind=EventsExecutor)
    graph.meet(listener.node, plant)
    graph.until(lambda: listener.states, "the plant is there")
    listener.forces.publish(Float64(data=3.0))
    graph.until(lambda: plant.counters["watchdog"] == 1, "the watchdog")
    count = len(listener.states)
    graph.until(lambda: len(listener.states) > count + 5, "states after it")
    acting = [(t, effort) for t, _, effort in listener.states if effort != 0.0]
    assert listener.states[-1][2] == 0.0
    # Whatever the timers did, the drive has given 3 N for 0.1 s, no longer.
    t, _, effort = np.array(listener.states).T
    assert float(np.sum(effort[1:] * np.diff(t))) == pytest.approx(0.3, rel=0.02)
    assert max(effort for _, effort in acting) <= 3.0 + 1e-9
    graph.until(lambda: listener.reports.get("plant", {}).get("watchdog") == "1", "the report")


def test_commands_that_are_not_finite_are_refused_counted_and_reported(graph: Graph) -> None:
    listener = Listener(graph)
    plant = _make(graph, PlantNode, model_file=_model_file(graph.folder), diagnostics_period=0.1)
    graph.spin(plant, kind=EventsExecutor)
    graph.meet(listener.node, plant)
    for force in (math.nan, math.inf, -math.inf):
        listener.forces.publish(Float64(data=force))
    graph.until(
        lambda: listener.reports.get("plant", {}).get("refused command: not finite") == "3", "three refusals in the report"
    )
    count = len(listener.states)
    graph.until(lambda: len(listener.states) > count + 5, "states after it")
    assert all(effort == 0.0 and position == 0.0 for _, position, effort in listener.states)


def test_controller_refuses_bad_states_and_stops_with_them(graph: Graph) -> None:
    listener = Listener(graph)
    pid = _make(graph, PidNode, **GAINS)
    graph.spin(pid, kind=EventsExecutor)
    states = listener.node.create_publisher(JointState, "joint_states", 100)
    graph.meet(listener.node, pid)

    def send(**fields: object) -> None:
        message = JointState(**{"name": ["axis"], "position": [0.0], **fields})
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(time.time_ns(), 1_000_000_000)
        states.publish(message)
        time.sleep(0.005)

    # The first state has no velocity yet, and isn't answered.
    graph.until(lambda: send() or len(listener.commands) > 0, "an answer")
    answers = len(listener.commands)
    send(position=[math.nan])
    send(name=["other"])
    send(position=[])
    graph.until(lambda: pid.counters["refused joint state"] == 3, "three refusals")
    graph.until(lambda: send() or len(listener.commands) > answers, "an answer again")
    answers = len(listener.commands)
    send(name=["other", "axis"], position=[5.0, -0.001])
    graph.until(lambda: len(listener.commands) > answers, "an answer to the good part of two joints")
    assert listener.commands[-1] > 0.0
    answers = len(listener.commands)
    graph.until(lambda: len(listener.commands) > answers, "a last command when the states stay away")
    time.sleep(0.2)
    assert listener.commands[answers:] == [0.0]


def test_a_second_publisher_gets_no_force_and_is_named(graph: Graph) -> None:
    listener = Listener(graph)
    plant = _make(graph, PlantNode, model_file=_model_file(graph.folder), diagnostics_period=0.1)
    other = graph.node("intruder")
    second = other.create_publisher(Float64, "force_command", 10)
    graph.spin(plant, kind=EventsExecutor)
    graph.meet(listener.node, plant, other)

    def push() -> bool:
        """Both command, more often than there are samples."""
        for _ in range(3):
            listener.forces.publish(Float64(data=1.0))
            second.publish(Float64(data=40.0))
        return False

    named = "fault: second command source"
    graph.until(lambda: push() or named in listener.reports.get("plant", {}), "the second source is named")
    assert "2 publishers" in listener.reports["plant"]["faults"]
    count = len(listener.states)
    graph.until(lambda: push() or len(listener.states) > count + 20, "states after it")
    assert all(effort == 0.0 for _, _, effort in listener.states[-5:])
    # The fault stays until it is reset, and the axis until it is enabled; then one publisher alone moves it.
    graph.owns(other).destroy_publisher(second)
    clients = {name: listener.node.create_client(Trigger, f"plant/{name}") for name in ("enable", "reset_fault")}
    assert "second command source" in graph.ask(clients["enable"], Trigger.Request(), "the plant").message
    assert graph.ask(clients["reset_fault"], Trigger.Request(), "the plant").success
    graph.until(lambda: graph.ask(clients["enable"], Trigger.Request(), "the plant").success, "enabled with new readings")
    graph.until(lambda: listener.forces.publish(Float64(data=1.0)) or listener.states[-1][2] > 0.9, "it is moved again")
