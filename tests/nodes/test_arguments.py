"""Command lines of nodes: what is misspelt or missing is refused in one line, and ``--help`` lists every parameter."""

from __future__ import annotations

import importlib
import re
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import yaml
from fric_nodes.arguments import ArgumentError, check_arguments, help_text
from fric_nodes.base import Described
from fric_nodes.nodes.plant import PlantNode
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import ListParameters, SetParameters

if TYPE_CHECKING:
    from .conftest import Graph

ROOT = Path(__file__).resolve().parents[2]
NODES = (ROOT / "fric_nodes" / "resource" / "executables").read_text(encoding="utf-8").split()


def declared(name: str) -> dict[str, Any]:
    """What the node declares, by name."""
    module = importlib.import_module(f"fric_nodes.nodes.{name}")
    kind = next(getattr(module, each) for each in module.__all__ if each.endswith("Node"))
    with pytest.raises(Described) as found:
        kind(describe=True)
    return {each.name: each for each in found.value.declarations}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--ros-args", "--params-file", "no_such.yaml"], "no_such.yaml: there is no such file"),
        (["--ros-args", "-p", "kp"], "Couldn't parse parameter override rule: '-p kp'"),
        (["--ros-args", "-p"], "trailing -p"),
        (["--ros-args", "--nonsense"], "--nonsense"),
        (["-p", "kp:=1.0"], "argument -p: is not known; ROS arguments follow --ros-args"),
    ],
)
def test_a_command_line_that_means_nothing_is_one_line(arguments: list[str], said: str) -> None:
    with pytest.raises(ArgumentError, match=re.escape(said)) as refusal:
        check_arguments(["plant", *arguments])
    assert "\n" not in str(refusal.value)
    assert "/src/" not in str(refusal.value), "where in rcl's source the fault was found helps nobody"


def test_a_command_line_that_means_something_passes(tmp_path: Path) -> None:
    path = tmp_path / "file.yaml"
    path.write_text("/**:\n  ros__parameters:\n    kp: 1.0\n", encoding="utf-8")
    good = ["pid", "--ros-args", "-p", "kp:=1.0", "-r", "__node:=left", "--params-file", str(path)]
    assert not check_arguments(good)
    assert not check_arguments(["pid"])
    assert check_arguments(["pid", "--help"])
    assert check_arguments(["pid", "-h"])


def test_a_broken_parameter_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text("/**:\n  ros__parameters:\n    a: [1,\n", encoding="utf-8")
    with pytest.raises(ArgumentError, match=r"broken\.yaml"):
        check_arguments(["pid", "--ros-args", "--params-file", str(path)])


@pytest.mark.parametrize("name", NODES)
def test_help_lists_every_parameter_with_its_unit_and_default(name: str) -> None:
    found = declared(name)
    assert len(found) > 3
    text = help_text(name, "about", list(found.values()))
    for parameter in found.values():
        line = next(line for line in text.splitlines() if line[2:].startswith(f"{parameter.name} ("))
        assert line.startswith("*") == parameter.settable
        assert parameter.default_text in line
        assert line.endswith(f" {parameter.unit}") or not parameter.unit
    assert max(len(line) for line in text.splitlines() if line.startswith("      ")) <= 100


def test_help_and_refusals_of_real_processes(graph: Graph, tmp_path: Path) -> None:
    started = {
        "--help": graph.start("-m", "fric_nodes.nodes.pid", "--help"),
        "fric node": graph.start("-c", "from fric_nodes.cli.main import main; main()", "node", "pid", "--help"),
        "misspelt": graph.start_node("pid", perid=0.002),
        "missing": graph.start("-m", "fric_nodes.nodes.pid", "--ros-args", "--params-file", str(tmp_path / "none.yaml")),
    }
    ended = {what: graph.finish(process) for what, process in started.items()}
    assert ended["--help"] == ended["fric node"]
    status, out, error = ended["--help"]
    assert (status, error) == (0, "")
    assert "kp (double) = 100000.0 N/m or N m/rad" in out
    for what, said in (
        ("misspelt", "parameter 'perid' of /pid: is not known; did you mean 'period'?"),
        ("missing", "none.yaml"),
    ):
        status, out, error = ended[what]
        assert (status, out) == (2, ""), what
        assert said in error
        assert len(error.strip().splitlines()) == 1, what


def test_a_parameter_file_for_another_node_is_named(graph: Graph, tmp_path: Path) -> None:
    path = tmp_path / "left.yaml"
    path.write_text("/left/plant:\n  ros__parameters:\n    period: 0.01\n", encoding="utf-8")
    started = {
        name: graph.start("-m", "fric_nodes.nodes.plant", "--ros-args", "--params-file", str(path), "-r", f"__ns:={name}")
        for name in ("/left", "/right")
    }
    asker = graph.node("asker")
    graph.spin(asker)
    for name, process in started.items():  # a node that answers has said what it had to say
        client = asker.create_client(ListParameters, f"{name}/plant/list_parameters")
        graph.until(client.service_is_ready, f"{name}/plant is there")
        graph.ask(client, ListParameters.Request(), name, process)
    status, _, error = graph.finish(started["/right"], signal.SIGINT)
    assert status == 0
    assert f"nothing in {path} is for /right/plant" in error
    status, _, error = graph.finish(started["/left"], signal.SIGINT)
    assert (status, "nothing in" in error) == (0, False)


@pytest.mark.parametrize("path", sorted((ROOT / "config").glob("*.yaml")), ids=lambda path: path.name)
def test_every_parameter_of_a_configuration_is_one_of_its_node(path: Path) -> None:
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    if "/**" not in content:
        assert str(content.get("format", "")).startswith("fric-"), "neither parameters of a node nor a file of fric"
        return
    given = set(_flat(content["/**"]["ros__parameters"]))
    takers = [name for name in NODES if given <= set(declared(name))]
    assert takers, f"no node takes all of {sorted(given)}"
    named = [name for name in NODES if name in path.stem]
    assert not named or any(name in takers for name in named)


def _flat(values: dict[str, Any], prefix: str = "") -> list[str]:
    names = []
    for key, value in values.items():
        names += _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else [f"{prefix}{key}"]
    return names


def test_setting_a_model_file_that_cannot_be_used_fails(graph: Graph, tmp_path: Path) -> None:
    plant = graph.owns(PlantNode(context=graph.context()))
    asker = graph.node("asker")
    graph.spin(plant)
    graph.spin(asker)
    client = asker.create_client(SetParameters, "plant/set_parameters")
    assert client.wait_for_service(timeout_sec=30.0)
    (tmp_path / "text.yaml").write_text("no model\n", encoding="utf-8")
    before = plant.get_parameter("model_file").value
    for given, said in (
        (tmp_path / "none.yaml", "none.yaml"),
        (tmp_path / "text.yaml", "text.yaml"),
        (ROOT / "config" / "pendulum_model.yaml", "another plant"),
    ):
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=str(given))
        answer = graph.ask(client, SetParameters.Request(parameters=[Parameter(name="model_file", value=value)]), "the plant")
        assert not answer.results[0].successful
        assert said in answer.results[0].reason
        assert "\n" not in answer.results[0].reason
        assert plant.get_parameter("model_file").value == before
    assert plant.counters["models"] == 0
