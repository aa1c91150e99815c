"""One list of dependencies in two forms: ``pyproject.toml`` for pip, ``package.xml`` for ROS 2; and no import beyond it."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[2]
MANIFEST = ElementTree.parse(ROOT / "fric_nodes" / "package.xml").getroot()
PYPROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
ROSDEP = {"pyserial": "python3-serial", "rosbags": "python3-rosbags-pip"}
"""rosdep keys that are not ``python3-NAME``."""

IMPORTED_AS = {
    "serial": "pyserial",
    "ruamel": "ruamel.yaml",
    "backports": "backports.zstd",
    "yaml": "ruamel.yaml",
    "dask": "distributed",
    "mcap": "mcap-ros2-support",  # brings it
    "mcap_ros2": "mcap-ros2-support",
    "sklearn": "scikit-learn",
}


def listed(head: str) -> list[str]:
    """The requirements of the list that begins with the line ``head``; Python 3.10 has no tomllib."""
    block = re.search(rf"^{re.escape(head)}.*?\n(.*?)^\]", PYPROJECT, re.M | re.S)
    assert block, head
    return re.findall(r'^\s*"([^"]+)"', block[1], re.M)


def name(requirement: str) -> str:
    return re.split(r"[\[<>=!; ]", requirement, maxsplit=1)[0].lower()


RUN = [name(each) for each in listed("dependencies = [")]
EXEC = {each.text for each in MANIFEST.findall("exec_depend")}
PYPI = {each.text for each in MANIFEST.findall("export/pypi_depend")}


def test_the_lists_are_found() -> None:
    assert {"numpy", "typer", "ros-rclpy"} <= set(RUN)
    assert {"rclpy", "python3-numpy"} <= EXEC
    assert PYPI


@pytest.mark.parametrize("dependency", RUN)
def test_package_xml_carries_every_run_dependency(dependency: str) -> None:
    if dependency.startswith("ros-"):
        assert dependency.removeprefix("ros-").replace("-", "_") in EXEC
        return
    assert (ROSDEP.get(dependency, f"python3-{dependency}") in EXEC) != (dependency in PYPI)


def test_package_xml_carries_nothing_else() -> None:
    named = {each for each in EXEC if each and each.startswith("python3-")}
    assert named | PYPI == {d if d in PYPI else ROSDEP.get(d, f"python3-{d}") for d in RUN if not d.startswith("ros-")}
    packages = {f"ros-{each}".replace("_", "-") for each in EXEC - named if each}
    # what pip's way has in another form: the interfaces are built with it, and launch is not published for it
    assert packages - set(RUN) == {"ros-fric-interfaces", "ros-launch", "ros-launch-ros", "ros-ament-index-python"}


def test_every_import_is_a_dependency() -> None:
    imported = set()
    for path in [*(ROOT / "fric_nodes" / "fric").rglob("*.py"), *(ROOT / "fric_nodes" / "fric_nodes").rglob("*.py")]:
        for each in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(each, ast.ImportFrom) and each.level == 0 and each.module:
                imported.add(each.module.split(".")[0])
            elif isinstance(each, ast.Import):
                imported |= {alias.name.split(".")[0] for alias in each.names}
    imported -= {*sys.stdlib_module_names, "fric", "fric_nodes", "fric_interfaces"}
    extras = {name(each) for head in ("batch = [", "can = [", "control = [", "peers = [") for each in listed(head)}
    known = {*RUN, *extras, *(each.removeprefix("ros-").replace("-", "_") for each in RUN)}
    missing = {each for each in imported if IMPORTED_AS.get(each, each.lower()) not in known}
    # Parts of what is listed: message generators and the index come with rclpy, apsw with rosbags, can with python-can; and of
    # the standard library from Python 3.14 on.
    assert missing <= {"rosidl_parser", "ament_index_python", "action_msgs", "apsw", "can", "compression"}, missing


def test_the_extra_colcon_has_what_the_build_requires() -> None:
    build = set(listed("requires = ["))
    assert {each for each in build if not each.startswith("scikit-build-core")} <= set(listed("colcon = ["))
