"""Quality of service: chosen by parameters, and what doesn't go together is named."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from fric_nodes.nodes.compensator import CompensatorNode
from fric_nodes.nodes.excitation import ExcitationNode
from fric_nodes.nodes.experiment import ExperimentNode
from fric_nodes.nodes.hardware_bridge import HardwareBridgeNode
from fric_nodes.nodes.identifier import IdentifierNode
from fric_nodes.nodes.monitor import MonitorNode
from fric_nodes.nodes.pid import PidNode
from fric_nodes.nodes.plant import PlantNode
from fric_nodes.qos import SAMPLE_TOPICS, SAMPLES
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import Reference

if TYPE_CHECKING:
    from .conftest import Graph

BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
SETTINGS: dict[type[Any], tuple[dict[str, object], ...]] = {
    PlantNode: ({},),
    HardwareBridgeNode: ({"serial.port": "/dev/no_such_port", "following_error": 0.1},),
    ExcitationNode: ({}, {"kinds": ["parametric_oscillation"], "output": "force"}),
    CompensatorNode: ({},),
    PidNode: ({},),
    ExperimentNode: ({"out": "first"}, {"out": "second", "controller": "pid", "proportional_low": 1.0}),
    IdentifierNode: ({},),
    MonitorNode: ({"name_component": False},),
}


def made(graph: Graph, kind: type[Any], **values: object) -> Any:
    given = [Parameter(name, value=value) for name, value in values.items()]
    return graph.owns(kind(context=graph.context(), parameter_overrides=given))


@pytest.mark.parametrize("kind", SETTINGS)
def test_a_node_has_a_parameter_for_each_topic_of_samples(
    graph: Graph, kind: type[Any], tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found: set[str] = set()
    for values in SETTINGS[kind]:
        node = made(graph, kind, **values)
        for end in (*node.publishers, *node.subscriptions):
            name = end.topic_name.lstrip("/")
            if not name.startswith(("friction/", "diagnostics", "rosout", "parameter_events")):
                found.add(name)
    listed = {"drive_states" if name == "drive/joint_states" else name for name in found}
    known = set(SAMPLE_TOPICS[node.get_name()])
    assert known - {"drive_states"} == listed - {"drive_states"}, "SAMPLE_TOPICS in fric_nodes/qos.py lists them by node"


@pytest.mark.parametrize("chosen", ["reliable", "sensor_data"])
def test_a_best_effort_encoder_is_answered_by_choice_and_named_otherwise(graph: Graph, chosen: str) -> None:
    pid = made(graph, PidNode, **{"qos.joint_states": chosen, "wait_for_subscribers": 0, "diagnostics_period": 0.1})
    encoder = graph.node("encoder")
    heard: list[Float64] = []
    said: list[DiagnosticStatus] = []
    states = encoder.create_publisher(JointState, "joint_states", BEST_EFFORT)
    references = encoder.create_publisher(Reference, "reference", SAMPLES)
    encoder.create_subscription(Float64, "force_command", heard.append, SAMPLES)
    encoder.create_subscription(DiagnosticArray, "/diagnostics", lambda message: said.extend(message.status), 10)
    graph.spin(pid, kind=EventsExecutor)
    graph.spin(encoder)

    def told() -> bool:
        stamp = encoder.get_clock().now().to_msg()
        reference, state = Reference(position=0.1), JointState(name=["axis"], position=[0.0], effort=[0.0])
        reference.header.stamp = state.header.stamp = stamp
        references.publish(reference)
        states.publish(state)
        if chosen == "sensor_data":
            return len(heard) > 3
        return any(each.level == b"\x02" and "offers best effort" in each.message for each in said)

    graph.until(told, "an answer, or a fault")
    if chosen == "sensor_data":
        graph.until(lambda: said, "a report")
        assert not any("best effort" in each.message for each in said)
        return
    graph.until(lambda: any("/encoder offers" in each.message for each in said), "the fault names the node")
    fault = next(each for each in said if "/encoder offers" in each.message)
    assert "/joint_states: /encoder offers best effort, this node asks for reliable" in fault.message
    assert "set qos.joint_states to sensor_data" in fault.message
    assert {each.key: each.value for each in fault.values}["incompatible QoS: joint_states"] == "1"
    assert not heard
    encoder.destroy_publisher(states)
    said.clear()
    graph.until(lambda: any("best effort" not in each.message for each in said), "the fault ends with its cause")


def test_a_subscriber_that_asks_for_more_is_named(graph: Graph) -> None:
    plant = made(graph, PlantNode, **{"qos.joint_states": "sensor_data", "diagnostics_period": 0.1})
    reader = graph.node("reader")
    said: list[str] = []
    reader.create_subscription(JointState, "joint_states", lambda message: None, SAMPLES)
    reader.create_subscription(DiagnosticArray, "/diagnostics", lambda m: said.extend(s.message for s in m.status), 10)
    graph.spin(plant, kind=EventsExecutor)
    graph.spin(reader)
    expected = "this node offers best effort, /reader asks for reliable"
    graph.until(lambda: any(expected in each for each in said), "the fault")
    assert any("set qos.joint_states to reliable" in each for each in said)


@pytest.mark.parametrize("chosen", ["reliable", "sensor_data"])
def test_a_node_that_takes_in_bulk_does_the_same(graph: Graph, chosen: str) -> None:
    identifier = made(graph, IdentifierNode, **{"qos.joint_states": chosen})
    encoder = graph.node("encoder")
    states = encoder.create_publisher(JointState, "joint_states", BEST_EFFORT)
    graph.until(lambda: encoder.get_subscriptions_info_by_topic("/joint_states"), "they know of each other")
    if chosen == "sensor_data":

        def arrives() -> bool:
            states.publish(JointState(name=["axis"], position=[0.0], effort=[0.0]))
            identifier.work()
            return bool(identifier.joint == "axis")

        graph.until(arrives, "a joint state")
        return
    fault = "/joint_states: /encoder offers best effort, this node asks for reliable"

    def named() -> bool:
        # The middleware may know of the publisher before it knows whose it is.
        level, text = identifier._whole_verdict([])
        return level == DiagnosticStatus.ERROR and fault in text

    graph.until(named, "the fault names the node")
