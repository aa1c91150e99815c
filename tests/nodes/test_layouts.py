"""The layouts of docs/layouts against a running graph: every topic is there, and every field that is plotted holds a value."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from fric_nodes.bulk import message_class
from fric_nodes.nodes.compensator import CompensatorNode
from fric_nodes.nodes.excitation import ExcitationNode
from fric_nodes.nodes.identifier import IdentifierNode
from fric_nodes.nodes.monitor import MonitorNode
from fric_nodes.nodes.pid import PidNode
from fric_nodes.nodes.plant import PlantNode
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

if TYPE_CHECKING:
    from .conftest import Graph

ROOT = Path(__file__).resolve().parents[2]
LAYOUTS = ROOT / "docs" / "layouts"
JOINT = "axis"
_LATE = {"/friction/mismatch"}
"""Published only when something has changed: the field's type is all that can be looked at."""

_FOXGLOVE = json.loads((LAYOUTS / "foxglove.json").read_text(encoding="utf-8"))
_PLOTJUGGLER = ElementTree.parse(LAYOUTS / "plotjuggler.xml").getroot()
_AGGREGATOR = yaml.safe_load((LAYOUTS / "diagnostic_aggregator.yaml").read_text(encoding="utf-8"))["/**"]["ros__parameters"]


def foxglove_paths() -> set[str]:
    """Every message path of the layout: ``/topic/name.field[0].field``."""
    found = set()
    for panel in _FOXGLOVE["configById"].values():
        found |= {path["value"] for path in panel.get("paths", [])}
        found |= {panel[key] for key in ("topicPath", "topicToRender") if key in panel}
    return found


def plotjuggler_series() -> set[str]:
    """Every series of the layout that PlotJuggler doesn't compute itself."""
    computed = {each.attrib["name"] for each in _PLOTJUGGLER.iter("snippet")}
    found = {each.attrib["name"] for each in _PLOTJUGGLER.iter("curve")}
    for snippet in _PLOTJUGGLER.iter("snippet"):
        found |= {
            snippet.findtext("linked_source") or "",
            *(each.text or "" for each in snippet.find("additional_sources") or ()),
        }
    return found - computed


def split(series: str, topics: dict[str, str]) -> tuple[str, str]:
    """Topic, and the field in the form of Foxglove, of one of PlotJuggler's series."""
    topic = max((each for each in topics if series.startswith(f"{each}/")), key=len, default="")
    assert topic, f"{series}: no such topic among {sorted(topics)}"
    field = series[len(topic) + 1 :]
    if topics[topic] == "sensor_msgs/msg/JointState":  # PlotJuggler sorts these by joint
        joint, name = field.split("/")
        assert joint == JOINT
        return topic, f"{name}[0]"
    return topic, field.replace("/", ".")


def value(message: Any, field: str) -> Any:
    """What ``field`` of ``message`` holds; raises where it has no such field or element."""
    for name, index in re.findall(r"(\w+)(?:\[(\d+|:)\])?", field):
        message = getattr(message, name)
        if index:
            message = message[:] if index == ":" else message[int(index)]
    return message


@pytest.fixture
def running(graph: Graph) -> dict[str, tuple[str, Any]]:
    """Type and last message of every topic of a loop that runs in wall time, by topic; and ``/diagnostics`` by node."""
    kinds: dict[type[Any], dict[str, object]] = {
        PlantNode: {"diagnostics_period": 0.2},
        CompensatorNode: {"model_file": str(ROOT / "config" / "nominal_model.yaml")},
        PidNode: {"kp": 2000.0, "kd": 100.0},
        ExcitationNode: {"start_delay": 0.0, "wait_for_subscribers": 2},
        IdentifierNode: {"publish_period": 0.1},
        MonitorNode: {"name_component": False},
    }
    context, period = graph.context(), {"period": 0.01}
    for kind, values in kinds.items():
        more = {} if kind in (IdentifierNode, MonitorNode) else period
        given = [Parameter(name, value=each) for name, each in {**values, **more}.items()]
        node = graph.owns(kind(context=context, parameter_overrides=given))
        graph.spin(node, kind=EventsExecutor)
    reader = graph.node("reader")
    found: dict[str, tuple[str, Any]] = {}
    known = _named_topics()
    graph.until(lambda: known <= {name for name, _ in reader.get_topic_names_and_types()}, f"the topics {known}")
    named = known - _LATE
    for topic, types in reader.get_topic_names_and_types():
        found[topic] = (types[0], None)

    def keep(topic: str) -> Any:
        def on_message(message: Any) -> None:
            if topic == "/friction/estimate" and len(message.values) < 3:
                return
            found[topic] = (found[topic][0], message)
            if topic == "/diagnostics":
                names.update(each.name for each in message.status)

        return on_message

    names: set[str] = set()
    for topic in named:
        reader.create_subscription(message_class(found[topic][0]), topic, keep(topic), QoSProfile(depth=10))
    graph.spin(reader)
    graph.until(lambda: all(found[topic][1] is not None for topic in named) and len(names) >= len(kinds), "a message of each")
    found["statuses"] = ("", names)
    return found


def _named_topics() -> set[str]:
    """The topics that the layouts speak of, as far as their own form tells."""
    foxglove = {re.split(r"[.]", path, maxsplit=1)[0] for path in foxglove_paths()}
    return foxglove | {each.attrib["name"] for each in _PLOTJUGGLER.iter("topic")}


def test_every_topic_and_field_is_in_the_running_graph(running: dict[str, tuple[str, Any]]) -> None:
    topics = {topic: kind for topic, (kind, _) in running.items() if topic.startswith("/")}
    assert foxglove_paths()
    for path in foxglove_paths():
        topic, _, field = path.partition(".")
        assert topic in topics, f"foxglove.json: no topic {topic}"
        message = running[topic][1] if topic not in _LATE else message_class(topics[topic])()
        value(message, field)
    assert plotjuggler_series()
    subscribed = {each.attrib["name"] for each in _PLOTJUGGLER.iter("topic")}
    for series in plotjuggler_series():
        topic, field = split(series, topics)
        assert topic in subscribed, f"plotjuggler.xml plots {series} and does not subscribe to {topic}"
        assert isinstance(value(running[topic][1], field), (int, float)), series
    assert running["/joint_states"][0] == "sensor_msgs/msg/JointState"
    assert list(running["/joint_states"][1].name) == [JOINT]
    groups = [each for each in _AGGREGATOR.values() if isinstance(each, dict)]
    for name in (*running["statuses"][1], "left/plant", "recorder", "hardware_bridge", "experiment"):
        matching = [group["path"] for group in groups if any(re.fullmatch(each, name) for each in group["regex"])]
        assert len(matching) == 1, f"diagnostic_aggregator.yaml: {name} is in {matching}"


def test_a_wrong_name_is_found() -> None:
    topics = {"/joint_states": "sensor_msgs/msg/JointState", "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray"}
    assert split("/joint_states/axis/effort", topics) == ("/joint_states", "effort[0]")
    assert value(JointState(position=[1.0, 2.0]), "position[1]") == 2.0
    with pytest.raises(AssertionError, match="no such topic"):
        split("/jointstates/axis/effort", topics)
    for message, field in ((JointState(), "torque[0]"), (JointState(), "effort[0]"), (DiagnosticArray(), "header.time")):
        with pytest.raises((AttributeError, IndexError)):
            value(message, field)


def test_the_panels_of_foxglove_are_those_that_are_laid_out() -> None:
    def leaves(part: Any) -> list[str]:
        return [part] if isinstance(part, str) else leaves(part["first"]) + leaves(part["second"])

    assert sorted(leaves(_FOXGLOVE["layout"])) == sorted(_FOXGLOVE["configById"])
