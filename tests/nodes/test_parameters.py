"""Parameters of nodes: what they tell about themselves, and what they refuse."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import pytest
from fric.errors import InputError
from fric.excitation import EXCITATIONS
from fric.method_settings import Options, Setting
from fric_nodes.nodes.compensator import CompensatorNode
from fric_nodes.nodes.excitation import ExcitationNode
from fric_nodes.nodes.pid import PidNode
from fric_nodes.nodes.plant import PlantNode
from fric_nodes.parameters import NodeParameter, NodeParameterError, Settings
from fric_nodes.setting_parameters import of_setting, setting_in
from rclpy.node import Node
from rclpy.parameter import Parameter

if TYPE_CHECKING:
    from .conftest import Graph

DECLARED = (
    NodeParameter("rate", 2.0, "a rate", "1/s", 0.5, 10.0, settable=True),
    NodeParameter("count", 3, "a number", "", 0, 5),
    NodeParameter("mode", "slow", "a choice", choices=("slow", "fast"), settable=True),
    NodeParameter("kinds", ["slow"], "some choices", choices=("slow", "fast")),
)


def _node(graph: Graph, **values: object) -> tuple[Node, Settings]:
    node = graph.node("host", parameter_overrides=[Parameter(key, value=value) for key, value in values.items()])
    return node, Settings(node, DECLARED)


def test_values_and_descriptors(graph: Graph) -> None:
    node, settings = _node(graph, rate=4.0, kinds=["fast", "slow"])
    assert (settings.number("rate"), settings.integer("count"), settings.text("mode")) == (4.0, 3, "slow")
    assert settings.texts("kinds") == ["fast", "slow"]
    described = node.describe_parameter("rate")
    assert described.description == "a rate [1/s]"
    assert not described.read_only
    assert (described.floating_point_range[0].from_value, described.floating_point_range[0].to_value) == (0.5, 10.0)
    assert node.describe_parameter("count").read_only
    assert "slow, fast" in node.describe_parameter("mode").additional_constraints


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"rate": 11.0}, r"rate.*\[0.5, 10\] 1/s"),
        ({"rate": math.nan}, "rate"),
        ({"rate": "quick"}, "rate.*double"),
        ({"count": 6}, r"count.*\[0, 5\]"),
        ({"mode": "medium"}, "'medium'.*slow, fast"),
        ({"kinds": ["slow", "medium"]}, "'medium'.*slow, fast"),
    ],
)
def test_bad_values_at_the_start_are_one_line(graph: Graph, values: dict[str, object], said: str) -> None:
    with pytest.raises(NodeParameterError, match=said) as refusal:
        _node(graph, **values)
    assert "\n" not in str(refusal.value)


def test_changes_are_checked_and_told(graph: Graph) -> None:
    node, settings = _node(graph)
    told: list[set[str]] = []
    settings.when_changed(told.append)
    assert node.set_parameters([Parameter("rate", value=5.0)])[0].successful
    assert settings.number("rate") == 5.0
    for name, value in (("rate", 50.0), ("rate", math.nan), ("mode", "medium"), ("count", 4)):
        assert not node.set_parameters([Parameter(name, value=value)])[0].successful
    assert "slow, fast" in node.set_parameters([Parameter("mode", value="medium")])[0].reason
    assert told == [{"rate"}]
    assert (settings.number("rate"), settings.integer("count")) == (5.0, 3)


@pytest.mark.parametrize("kind", [PlantNode, ExcitationNode, CompensatorNode, PidNode])
def test_every_parameter_of_every_node_is_described(graph: Graph, kind: type[Any]) -> None:
    node = graph.owns(kind(context=graph.context()))
    names = [
        name for name in node.get_parameters_by_prefix("") if name not in ("use_sim_time", "start_type_description_service")
    ]
    assert len(names) > 8
    for name in names:
        described = node.describe_parameter(name)
        assert described.description, name
        if isinstance(node.get_parameter(name).value, float):
            assert described.floating_point_range, name


def test_every_excitation_is_set_by_parameters_of_its_own(graph: Graph) -> None:
    node = graph.owns(ExcitationNode(context=graph.context()))
    for kind in EXCITATIONS.values():
        for parameter in kind.parameters:
            assert node.get_parameter(f"{kind.id}.{parameter.name}").value == parameter.default


@dataclass(frozen=True)
class Declared(Options):
    rule: Annotated[str, Setting("Which rule", choices=("plain", "fuzzy"))] = "plain"
    offset: Annotated[float | None, Setting("An offset", "N", "none")] = None


@pytest.mark.parametrize(
    ("name", "default", "lower", "given", "held"),
    [
        ("cutoff", 0.0, 0.0, 0.0, None),
        ("cutoff", 0.0, 0.0, 50.0, 50.0),
        ("decimation", 0, 0, 3, 3),
        ("rest_velocity", -1.0, -1.0, -1.0, None),
        ("rest_velocity", -1.0, -1.0, 0.0, 0.0),
        ("robust", False, -math.inf, True, True),
        ("starts", 1, 1, 4, 4),
        ("rule", "plain", -math.inf, "fuzzy", "fuzzy"),
        ("offset", "", -math.inf, "-2.5", -2.5),
        ("offset", "", -math.inf, "", None),
        ("held", [""], -math.inf, ["mass"], ("mass",)),
        ("bounds", [""], -math.inf, ["mass=1,2"], (("mass", 1.0, 2.0),)),
    ],
)
def test_a_setting_of_a_method_is_a_parameter(
    graph: Graph, name: str, default: object, lower: float, given: object, held: object
) -> None:
    parameter = of_setting(name, Declared, "own.")
    assert (parameter.name, parameter.default, type(parameter.default)) == (f"own.{name}", default, type(default))
    assert parameter.lower == lower
    unset = graph.node("unset")
    assert setting_in(Settings(unset, [parameter]), name, Declared, "own.") == getattr(Declared(), name)
    node = graph.node("host", parameter_overrides=[Parameter(f"own.{name}", value=given)])
    assert setting_in(Settings(node, [parameter]), name, Declared, "own.") == held


@pytest.mark.parametrize(("name", "given"), [("rest_velocity", -0.5), ("bounds", ["mass=2,1"])])
def test_a_setting_outside_what_it_declares_is_refused(graph: Graph, name: str, given: object) -> None:
    node = graph.node("host", parameter_overrides=[Parameter(name, value=given)])
    settings = Settings(node, [of_setting(name, Declared)])
    with pytest.raises(InputError, match=f"parameter '{name}'"):
        setting_in(settings, name, Declared)


def test_a_process_with_a_bad_parameter_ends_with_one_line_and_status_2(graph: Graph) -> None:
    started = [graph.start_node("plant", period=-1.0), graph.start_node("plant", model_file="no_such_file.yaml")]
    for process, said in zip(started, ("period", "no_such_file.yaml"), strict=True):
        status, _, error = graph.finish(process)
        assert status == 2
        assert said in error
        assert len(error.strip().splitlines()) == 1
