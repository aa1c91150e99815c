"""Nodes through their life cycle by the services of ROS 2, and parameters that are refused while they run."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from fric.errors import InputError
from fric_nodes.nodes.compensator import CompensatorNode
from fric_nodes.nodes.hardware_bridge import HardwareBridgeNode
from fric_nodes.nodes.pid import PidNode
from fric_nodes.nodes.plant import PlantNode
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from fric_interfaces.msg import Reference

if TYPE_CHECKING:
    from .conftest import Graph

H = 0.01
DEEP = QoSProfile(depth=1000)


class Partner:
    """Asks the node ``name``, and hears what it says."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph, self.name, self.met = graph, name, False
        self.node = graph.node("partner")
        self.states: list[JointState] = []
        self.commands: list[float] = []
        self.report = DiagnosticStatus()
        self.node.create_subscription(JointState, "joint_states", self.states.append, DEEP)
        self.node.create_subscription(Float64, "force_command", lambda m: self.commands.append(m.data), DEEP)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_report, 10)
        self.forces = self.node.create_publisher(Float64, "force_command", DEEP)
        self.change = self.node.create_client(ChangeState, f"{name}/change_state")
        self.stage = self.node.create_client(GetState, f"{name}/get_state")
        self.setting = self.node.create_client(SetParameters, f"{name}/set_parameters")
        graph.spin(self.node, kind=EventsExecutor)

    def _on_report(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == self.name:
                self.report = status

    def value(self, key: str) -> str:
        return {pair.key: pair.value for pair in self.report.values}.get(key, "")

    def ask(self, client: Any, request: Any) -> Any:
        """As the graph does; first the node's services and this one must know each other, or an answer is lost."""
        if not self.met:
            self.graph.until(client.service_is_ready, "the service")
            time.sleep(0.5)
            self.met = True
        return self.graph.ask(client, request, self.name)

    def go(self, transition: int) -> bool:
        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(self.ask(self.change, request).success)

    def where(self) -> str:
        return str(self.ask(self.stage, GetState.Request()).current_state.label)

    def set(self, name: str, value: float) -> Any:
        given = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
        request = SetParameters.Request(parameters=[ParameterMessage(name=name, value=given)])
        return self.ask(self.setting, request).results[0]


def made(graph: Graph, kind: type[Any], **parameters: object) -> Any:
    overrides = [Parameter(key, value=value) for key, value in {"diagnostics_period": 0.05, **parameters}.items()]
    node = graph.owns(kind(context=graph.context(), parameter_overrides=overrides))
    graph.spin(node, kind=EventsExecutor)
    return node


def test_a_plant_through_its_life(graph: Graph) -> None:
    partner = Partner(graph, "plant")
    plant = made(graph, PlantNode, autostart=False, period=H, wait_for_subscribers=0)
    assert partner.where() == "unconfigured"
    graph.until(lambda: partner.value("lifecycle") == "unconfigured", "the report")
    assert not partner.states
    assert partner.go(Transition.TRANSITION_CONFIGURE)
    time.sleep(0.1)
    assert partner.where() == "inactive"
    assert not partner.states
    assert partner.go(Transition.TRANSITION_ACTIVATE)
    graph.until(lambda: partner.states, "joint states")
    graph.until(lambda: partner.forces.publish(Float64(data=30.0)) or partner.states[-1].position[0] > 1e-3, "it moves")
    assert partner.go(Transition.TRANSITION_DEACTIVATE)
    graph.until(lambda: partner.value("lifecycle") == "inactive" and partner.value("safety state") == "disabled", "stopped")
    time.sleep(0.05)
    count = len(partner.states)
    time.sleep(0.1)
    assert len(partner.states) == count
    assert partner.go(Transition.TRANSITION_ACTIVATE)
    graph.until(lambda: len(partner.states) > count, "joint states again")
    assert partner.states[-1].position[0] > 1e-3  # it is where it was
    assert partner.go(Transition.TRANSITION_DEACTIVATE)
    assert partner.go(Transition.TRANSITION_CLEANUP)
    assert partner.where() == "unconfigured"
    graph.until(lambda: partner.value("lifecycle") == "unconfigured", "the report")
    count = len(partner.states)
    assert partner.go(Transition.TRANSITION_CONFIGURE)
    assert partner.go(Transition.TRANSITION_ACTIVATE)
    graph.until(lambda: len(partner.states) > count, "joint states of a new axis")
    assert abs(partner.states[-1].position[0]) < 1e-4
    graph.until(lambda: partner.forces.publish(Float64(data=30.0)) or partner.states[-1].position[0] > 1e-3, "it moves")
    assert partner.go(Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert plant.done
    assert partner.where() == "finalized"


@pytest.mark.parametrize(
    ("kind", "name", "parameters"),
    [
        (PidNode, "pid", {}),
        (CompensatorNode, "compensator", {"model_file": "config/demo_axis.yaml"}),
        (HardwareBridgeNode, "hardware_bridge", {"serial.port": "/nowhere"}),
    ],
)
def test_every_node_is_made_and_taken_away_again(
    graph: Graph, kind: type[Any], name: str, parameters: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(__file__[: __file__.index("tests/nodes")])
    partner = Partner(graph, name)
    node = made(graph, kind, **parameters)
    assert partner.where() == "active"
    topics = {each.topic_name for each in (*node.publishers, *node.subscriptions)}
    for _ in range(2):
        for step in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP):
            assert partner.go(step)
        kept = {each.topic_name for each in (*node.publishers, *node.subscriptions)}
        assert kept < topics
        assert {"/joint_states", "/reference", "/force_command"}.isdisjoint(kept)
        for step in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
            assert partner.go(step)
        assert {each.topic_name for each in (*node.publishers, *node.subscriptions)} == topics
    assert partner.go(Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert node.done


def test_a_controller_that_is_deactivated_brings_its_force_to_zero(graph: Graph) -> None:
    partner = Partner(graph, "pid")
    made(graph, PidNode, period=H, force_rate=1000.0, kp=2e4, use_feedforward=False, state_timeout=1.0, bridge_time=1.0)
    states = partner.node.create_publisher(JointState, "joint_states", DEEP)
    references = partner.node.create_publisher(Reference, "reference", DEEP)

    def send() -> None:
        """The axis falls behind, and the reference rests."""
        reference, state = Reference(), JointState(name=["axis"], position=[-1e-3])
        for message in (reference, state):
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(time.time_ns(), 1_000_000_000)
        references.publish(reference)
        states.publish(state)
        time.sleep(0.005)

    graph.until(lambda: send() or (partner.commands and partner.commands[-1] > 5.0), "a force")
    assert partner.go(Transition.TRANSITION_DEACTIVATE)
    graph.until(lambda: send() or partner.commands[-1] == 0.0, "none")
    assert max(abs(b - a) for a, b in zip(partner.commands, partner.commands[1:], strict=False)) <= 1000.0 * 2.0 * H + 1e-9
    count = len(partner.commands)
    refused = graph.ask(partner.node.create_client(Trigger, "pid/enable"), Trigger.Request(), "the pid")
    assert "inactive" in refused.message
    for _ in range(20):
        send()
    assert len(partner.commands) == count
    assert partner.go(Transition.TRANSITION_ACTIVATE)
    graph.until(lambda: send() or len(partner.commands) > count, "it goes on")


def test_a_parameter_that_cannot_be_used_makes_configure_fail(graph: Graph) -> None:
    with pytest.raises(InputError, match="load"):
        made(graph, PidNode, load=1e9)
    partner = Partner(graph, "pid")
    made(graph, PidNode, load=1e9, autostart=False)
    assert not partner.go(Transition.TRANSITION_CONFIGURE)
    assert partner.where() == "unconfigured"


def test_nonsense_is_refused_in_one_line(graph: Graph) -> None:
    partner = Partner(graph, "pid")
    node = made(graph, PidNode)
    for name, value, said in (
        ("ki", 1e12, "integral time"),
        ("kd", 1e12, "derivative time"),
        ("kp", math.nan, "range"),
        ("kp", -1.0, "range"),
        ("force_limit", -5.0, "range"),
        ("force_limit", math.inf, "range"),
    ):
        before = node.settings.number(name)
        result = partner.set(name, value)
        assert not result.successful
        assert said in result.reason.lower(), result.reason
        assert "\n" not in result.reason
        assert node.settings.number(name) == before
    assert partner.set("kp", 2e5).successful
