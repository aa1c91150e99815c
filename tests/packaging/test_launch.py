"""Launch files, which are examples: what they name is there, and where launch is installed they start a graph."""

from __future__ import annotations

import ast
import importlib.util
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from fric_nodes.base import Described

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "fric_nodes" / "launch").glob("*.launch.py"))
INSTALLED = Path(sys.prefix) / "share" / "fric_nodes" / "launch"
_LAUNCH = importlib.util.find_spec("launch_ros") is not None


def declared(executable: str) -> set[str]:
    """Names of the parameters of a node."""
    module = importlib.import_module(f"fric_nodes.nodes.{executable}")
    kind = next(getattr(module, each) for each in module.__all__ if each.endswith("Node"))
    with pytest.raises(Described) as found:
        kind(describe=True)
    return {each.name for each in found.value.declarations}


def nodes(path: Path) -> list[dict[str, ast.expr]]:
    """Keyword arguments of every ``Node(...)`` in a launch file."""
    calls = [each for each in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(each, ast.Call)]
    return [
        {str(keyword.arg): keyword.value for keyword in call.keywords}
        for call in calls
        if isinstance(call.func, ast.Name) and call.func.id == "Node"
    ]


def test_there_is_one_for_each_use() -> None:
    assert [path.name for path in FILES] == ["bridge.launch.py", "one_axis.launch.py", "two_axes.launch.py"]


def test_they_are_installed() -> None:
    assert {path.name: path.read_bytes() for path in INSTALLED.glob("*.launch.py")} == {
        path.name: path.read_bytes() for path in FILES
    }


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_executables_parameters_and_files_that_are_named_are_there(path: Path) -> None:
    for node in nodes(path):
        executable = ast.literal_eval(node["executable"])
        assert ast.literal_eval(node["package"]) == "fric_nodes"
        known = declared(executable)
        for part in ast.walk(node["parameters"]):
            if isinstance(part, ast.Dict):
                for key in part.keys:
                    assert key is not None
                    assert ast.literal_eval(key) in known, f"{executable} has no such parameter"
    text = path.read_text(encoding="utf-8")
    for constant in [each.value for each in ast.walk(ast.parse(text)) if isinstance(each, ast.Constant)]:
        if isinstance(constant, str) and constant.endswith(".yaml") and " " not in constant and "/" not in constant:
            assert (ROOT / "config" / constant).is_file(), constant
        if isinstance(constant, str) and constant.endswith(".launch.py") and " " not in constant:
            assert path.with_name(constant).is_file()


def _are_there(log: str, axes: int, loops: int) -> bool:
    return log.count("recorder]: recording into") == axes and log.count("scheduling: ") == loops


@pytest.mark.skipif(not _LAUNCH, reason="launch_ros is not published as a Python package, and not installed here")
@pytest.mark.parametrize(("name", "axes", "loops"), [("one_axis", 1, 4), ("two_axes", 2, 8), ("bridge", 1, 3)])
def test_they_start_their_graph(name: str, axes: int, loops: int, tmp_path: Path) -> None:
    """Each recorder records, each node of a control loop says how it is scheduled, and all end cleanly."""
    from fric_nodes.cli.env import variables

    environment = {**os.environ, **variables(Path(sys.prefix), os.environ), "ROS_LOG_DIR": str(tmp_path / "log")}
    environment |= {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "PYTHONUNBUFFERED": "1"}
    log = tmp_path / "log.txt"
    command = [Path(sys.executable).with_name("ros2"), "launch", str(ROOT / "fric_nodes" / "launch" / f"{name}.launch.py")]
    with log.open("w") as out:
        process = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=out, stderr=out, start_new_session=True)
        try:
            deadline = time.monotonic() + 90.0
            while not _are_there(log.read_text(), axes, loops) and process.poll() is None:
                assert time.monotonic() < deadline, log.read_text()
                time.sleep(0.1)
            assert process.poll() is None, log.read_text()
            time.sleep(1.0)
            os.killpg(process.pid, signal.SIGINT)
            process.wait(60.0)
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
    said = log.read_text()
    assert "Traceback" not in said, said
    assert "process has died" not in said, said
    assert said.count(", 0 lost") == axes, said
