"""As beside an installed ROS 2: ``colcon build``; then every node starts from what was built, and ``fric`` is a command.

It needs what the extra ``colcon`` lists, and a compiler; ``.ci/run`` installs it and runs this file after all other tests.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NODES = (ROOT / "fric_nodes" / "resource" / "executables").read_text(encoding="utf-8").split()
COLCON = Path(sys.executable).with_name("colcon")
_OF_OTHERS = ("COLCON_PREFIX_PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")

pytestmark = [
    pytest.mark.skipif(not COLCON.exists(), reason="colcon is not installed here: pip install '.[colcon]'"),
    pytest.mark.alone,
    pytest.mark.timeout(600),
]


def shell(workspace: Path, line: str, *, check: bool = True) -> str:
    """What ``line`` prints, in a shell that knows the environment of the wheels and nothing else of ROS."""
    environment = {name: value for name, value in os.environ.items() if name not in _OF_OTHERS}
    environment |= {"AMENT_PREFIX_PATH": sys.prefix, "CMAKE_PREFIX_PATH": sys.prefix, "ROS_LOG_DIR": str(workspace / "log")}
    environment |= {"PATH": f"{COLCON.parent}{os.pathsep}{os.environ['PATH']}", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    ran = subprocess.run(["bash", "-c", line], cwd=workspace, env=environment, check=False, capture_output=True, text=True)
    assert not check or ran.returncode == 0, f"{line}\n{ran.stdout}\n{ran.stderr}"
    assert "Traceback" not in ran.stderr, ran.stderr
    return ran.stdout + ran.stderr


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The source tree as a workspace, built."""
    folder = tmp_path_factory.mktemp("workspace")
    for name in ("config", "fric_nodes", "fric_interfaces"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder / name)
    built = shell(folder, "colcon build --event-handlers console_cohesion+")
    assert "Summary: 2 packages finished" in built, built
    return folder


def test_the_library_the_shell_and_the_command_are_those_that_were_built(workspace: Path) -> None:
    ask = "import fric, fric_nodes, fric_interfaces as i; print(fric.__file__, fric_nodes.__file__, i.__file__)"
    for place in shell(workspace, f'. install/setup.sh && python3 -c "{ask}"').split():
        assert Path(place).is_relative_to(workspace / "install"), place
    found, version = shell(workspace, ". install/setup.sh && command -v fric && fric --version").splitlines()
    assert Path(found) == workspace / "install" / "fric_nodes" / "bin" / "fric"
    assert version.startswith("fric ")
    assert "configuration: found in" in shell(workspace, ". install/setup.sh && fric doctor", check=False)


def test_every_executable_starts(workspace: Path) -> None:
    """Through ``ros2 run`` where there is one; and by the paths where it looks for them."""
    run = "ros2 run fric_nodes" if shutil.which("ros2") else "install/fric_nodes/lib/fric_nodes"
    separator = " " if " " in run else "/"
    lines = " & ".join(f"{run}{separator}{name} --help >{name}.txt" for name in NODES)
    shell(workspace, f". install/setup.sh; {lines} & wait")
    for name in NODES:
        assert (workspace / f"{name}.txt").read_text(encoding="utf-8").startswith(f"usage: fric node {name} ")
    plant = f"{run}{separator}plant --ros-args -p wait_for_subscribers:=0 -p duration:=0.3"
    assert "started" in shell(workspace, f". install/setup.sh && ROS_DOMAIN_ID=101 timeout 120 {plant}")
    assert "started" in shell(
        workspace,
        ". install/setup.sh && ROS_DOMAIN_ID=101 timeout 120 fric node plant --ros-args -p wait_for_subscribers:=0 "
        "-p duration:=0.3",
    )


def test_what_belongs_to_the_package_is_installed(workspace: Path) -> None:
    share = workspace / "install" / "fric_nodes" / "share" / "fric_nodes"
    for folder, pattern in (("config", "*.yaml"), ("fric_nodes/launch", "*.launch.py")):
        sources = {path.name for path in (ROOT / folder).glob(pattern)}
        assert sources
        assert {path.name for path in (share / Path(folder).name).glob(pattern)} == sources
