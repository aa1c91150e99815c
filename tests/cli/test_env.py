"""``fric env``: a shell that evaluates it finds the installed package as the tools of ROS 2 do."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from fric_nodes.cli.env import variables

PREFIX = Path(sys.prefix)
FRIC = f'"{sys.executable}" -c "from fric_nodes.cli.main import main; main()"'
_UNSET = ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "COLCON_PREFIX_PATH", "ROS_DISTRO", "ROS_VERSION", "ROS_PYTHON_VERSION")


def shell(line: str, **environment: str) -> str:
    """What ``line`` prints in a shell that knows nothing of ROS."""
    bare = {name: value for name, value in os.environ.items() if name not in _UNSET}
    with_it = {**bare, **environment}
    run = subprocess.run(["bash", "-c", line], env=with_it, check=False, capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_the_package_index_finds_the_package_and_its_executables() -> None:
    """The two things that ``ros2 run`` looks for: the prefix of the package, and the executable below it."""
    ask = "from ament_index_python.packages import get_package_prefix as p; print(p('fric_nodes'), p('fric_interfaces'))"
    found = shell(f'eval "$({FRIC} env)" && "{sys.executable}" -c "{ask}" && command -v fric').split()
    assert found == [str(PREFIX), str(PREFIX), str(PREFIX / "bin" / "fric")]
    assert os.access(PREFIX / "lib" / "fric_nodes" / "plant", os.X_OK)


def test_the_tools_of_ros_find_it() -> None:
    if shutil.which("ros2") is None:
        pytest.skip("ros2 is not installed here")
    out = shell(f'eval "$({FRIC} env)" && ros2 pkg executables fric_nodes')
    assert "fric_nodes plant" in out.splitlines()
    assert "kp (double)" in shell(f'eval "$({FRIC} env)" && ros2 run fric_nodes pid --help')


def test_what_is_there_already_stays_and_comes_first() -> None:
    present = {"AMENT_PREFIX_PATH": "/opt/ros/some", "PATH": "/usr/bin", "ROS_DISTRO": "some"}
    found = variables(Path("/env"), present)
    assert found["AMENT_PREFIX_PATH"] == "/opt/ros/some:/env"
    assert found["CMAKE_PREFIX_PATH"] == "/env"
    assert found["PATH"] == "/env/bin:/usr/bin"
    assert "ROS_DISTRO" not in found
    assert found["ROS_VERSION"] == "2"
    assert variables(Path("/env"), {**present, **found}) == {}, "evaluating it twice changes nothing"


def test_a_path_with_a_blank_and_a_quote_survives_the_shell(tmp_path: Path) -> None:
    prefix = tmp_path / "it's an environment"
    marker = prefix / "share" / "ament_index" / "resource_index" / "packages" / "fric_nodes"
    marker.parent.mkdir(parents=True)
    marker.touch()
    out = shell(f'eval "$({FRIC} env)" && echo "$AMENT_PREFIX_PATH"', AMENT_PREFIX_PATH=str(prefix))
    assert out.strip() == str(prefix)
    assert shell(f'eval "$({FRIC} env)" && echo "$CMAKE_PREFIX_PATH"', AMENT_PREFIX_PATH=str(prefix)).strip() == str(prefix)
