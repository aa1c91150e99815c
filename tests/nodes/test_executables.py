"""Every executable starts, answers for its parameters, and ends cleanly on SIGINT."""

from __future__ import annotations

import importlib.util
import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from rcl_interfaces.srv import ListParameters

import fric_nodes

if TYPE_CHECKING:
    from .conftest import Graph

LISTED = Path(__file__).resolve().parents[2] / "fric_nodes" / "resource" / "executables"
NODES = LISTED.read_text(encoding="utf-8").split()
INSTALLED = Path(sys.prefix) / "lib" / "fric_nodes"


def _start(graph: Graph, name: str) -> subprocess.Popen[str]:
    needed = {"recorder": f"bag:={graph.folder / 'bag'}", "hardware_bridge": "serial.port:=/dev/no_such_port"}
    extra = ["-p", needed[name]] if name in needed else []
    # The installed executables run the installed package; from a source tree the modules stand in for them.
    under_test = Path(fric_nodes.__file__).resolve().is_relative_to(Path(sys.prefix).resolve())
    command = [str(INSTALLED / name)] if under_test else [sys.executable, "-m", f"fric_nodes.nodes.{name}"]
    return graph.execute(*command, "--ros-args", *extra)


def test_list_is_complete() -> None:
    assert set(NODES) >= {"plant", "excitation", "compensator", "pid", "recorder", "player", "identifier"}
    for name in NODES:
        assert importlib.util.find_spec(f"fric_nodes.nodes.{name}"), name


# The player plays a bag and ends; it has its own tests. One at a time: all together are a graph that two slow cores can't keep
# up with, and what is asked of it then waits for minutes.
@pytest.mark.parametrize("name", [name for name in NODES if name != "player"])
def test_starts_answers_and_stops_on_sigint(graph: Graph, name: str) -> None:
    process = _start(graph, name)
    node = graph.node("asker")
    graph.spin(node)
    client = node.create_client(ListParameters, f"{name}/list_parameters")
    # It compiles what is in no cache yet.
    graph.until(lambda: client.service_is_ready() or process.poll() is not None, f"{name} is there", limit=120.0)
    assert process.poll() is None, graph.finish(process)
    answer = graph.ask(client, ListParameters.Request(), name, process)
    assert len(answer.result.names) > 3
    status, out, error = graph.finish(process, signal.SIGINT)
    assert status == 0, f"{name}: {out}{error}"
    assert "Traceback" not in error, f"{name}: {error}"


@pytest.mark.parametrize("name", ["plant", "pid"])
def test_sigint_while_it_starts_is_no_fault(graph: Graph, name: str) -> None:
    process = _start(graph, name)
    node = graph.node("watcher")
    graph.until(lambda: node.count_publishers("/rosout") > 1, "the node appears")
    status, _, error = graph.finish(process, signal.SIGINT)
    assert "Traceback" not in error
    assert status in (0, -signal.SIGINT), error
