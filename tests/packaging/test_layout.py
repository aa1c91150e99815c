"""What the installation puts under its prefix: that which `ros2 run fric_nodes NODE` looks for, once and consistently."""

from __future__ import annotations

import ast
import importlib.metadata
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[2]
PREFIX = Path(sys.prefix)
# written out here, not read from the list that the build reads
NODES = {"plant", "excitation", "identifier", "compensator", "pid", "recorder", "player", "experiment", "monitor"} | {
    "hardware_bridge"
}


def version_in(package_xml: Path) -> str | None:
    return ElementTree.parse(package_xml).getroot().findtext("version")


@pytest.mark.parametrize("package", ["fric_nodes", "fric_interfaces"])
def test_the_ament_index_knows_both_packages(package: str) -> None:
    assert (PREFIX / "share/ament_index/resource_index/packages" / package).is_file()
    installed = PREFIX / "share" / package / "package.xml"
    assert installed.read_bytes() == (ROOT / package / "package.xml").read_bytes()


@pytest.mark.parametrize("package", ["fric_nodes", "fric_interfaces"])
def test_versions_are_equal(package: str) -> None:
    import fric_nodes

    assert version_in(ROOT / package / "package.xml") == importlib.metadata.version("fric") == fric_nodes.__version__


def test_every_configuration_is_installed() -> None:
    sources = {path.name: path.read_bytes() for path in (ROOT / "config").glob("*.yaml")}
    installed = {path.name: path.read_bytes() for path in (PREFIX / "share/fric_nodes/config").glob("*.yaml")}
    assert sources, "config/ holds no YAML file"
    assert installed == sources


def test_every_node_has_an_executable() -> None:
    executables = {path.name for path in (PREFIX / "lib/fric_nodes").iterdir() if path.is_file()}
    assert executables == NODES
    assert all(os.access(PREFIX / "lib/fric_nodes" / name, os.X_OK) for name in executables)


@pytest.mark.parametrize("node", sorted(NODES))
def test_an_executable_starts_its_own_node(node: str) -> None:
    path = PREFIX / "lib/fric_nodes" / node
    text = path.read_text(encoding="utf-8")
    assert text.startswith("#!/bin/sh\n")
    imports = [each for each in ast.walk(ast.parse(text)) if isinstance(each, ast.ImportFrom)]
    assert [(each.module, [alias.name for alias in each.names]) for each in imports] == [(f"fric_nodes.nodes.{node}", ["main"])]
    assert str(PREFIX) not in text, "the environment could not be moved or linked to"


def test_an_executable_runs_the_python_of_its_own_environment(tmp_path: Path) -> None:
    """Through a link from outside, with another python3 first on the path."""
    prefix = tmp_path / "environment"
    (prefix / "bin").mkdir(parents=True)
    (prefix / "lib/fric_nodes").mkdir(parents=True)
    (prefix / "bin/python3").write_text('#!/bin/sh\necho own "$@"\n')
    other = tmp_path / "other"
    other.mkdir()
    (other / "python3").write_text('#!/bin/sh\necho other "$@"\n')
    for stand_in in (prefix / "bin/python3", other / "python3"):
        stand_in.chmod(0o755)
    script = prefix / "lib/fric_nodes/plant"
    script.write_bytes((PREFIX / "lib/fric_nodes/plant").read_bytes())
    script.chmod(0o755)
    link = tmp_path / "link with a blank"
    link.symlink_to(script)
    environment = {**os.environ, "PATH": f"{other}:{os.environ['PATH']}"}

    def run() -> str:
        ran = subprocess.run([link, "--ros-args", "-r", "a b"], env=environment, check=True, capture_output=True, text=True)
        return ran.stdout.strip()

    assert run() == f"own {script} --ros-args -r a b"
    (prefix / "bin/python3").unlink()
    assert run() == f"other {script} --ros-args -r a b"


def test_no_address_is_made_up() -> None:
    """A package.xml must have one; what it has there can't be anybody's (RFC 2606). Nothing else names any."""
    for package in ("fric_nodes", "fric_interfaces"):
        maintainer = ElementTree.parse(ROOT / package / "package.xml").getroot().find("maintainer")
        assert maintainer is not None
        assert maintainer.get("email", "").endswith(".invalid")
    for file in ("pyproject.toml", "fric_nodes/setup.py", "docs/SECURITY.md", "docs/CITATION.cff", "README.md"):
        text = (ROOT / file).read_text(encoding="utf-8")
        assert not re.findall(r"[\w.]+@[\w-]+\.\w+|email", text), file
    assert importlib.metadata.metadata("fric").get("Author-email") is None


def test_the_build_has_one_list_of_nodes() -> None:
    listed = (ROOT / "fric_nodes/resource/executables").read_text(encoding="utf-8").split()
    assert sorted(listed) == sorted(NODES)
    for builder in ("fric_nodes/setup.py", "fric_interfaces/cmake/install_fric_nodes.cmake"):
        text = (ROOT / builder).read_text(encoding="utf-8")
        assert "executables" in text, builder
        assert not re.findall(rf"\b({'|'.join(NODES)})\b", text), f"{builder} names a node itself"


def test_every_node_is_a_module_with_a_main() -> None:
    for node in NODES:
        tree = ast.parse((ROOT / f"fric_nodes/fric_nodes/nodes/{node}.py").read_text(encoding="utf-8"))
        defined = {each.name for each in tree.body if isinstance(each, ast.FunctionDef)}
        defined |= {ast.unparse(target) for each in tree.body if isinstance(each, ast.Assign) for target in each.targets}
        assert "main" in defined, node


def test_colcon_scripts_go_where_ros2_run_looks() -> None:
    """The entry points that setup.py declares, as setuptools reads them."""
    code = (
        "import json, setuptools\n"
        "setuptools.setup = lambda **given: print(json.dumps([given['entry_points'], given['data_files'], given['version']]))\n"
        "exec(compile(open('setup.py').read(), 'setup.py', 'exec'), {'__file__': 'setup.py', '__name__': '__main__'})\n"
    )
    pytest.importorskip("setuptools", reason="colcon's build needs setuptools, the installed package does not")
    ran = subprocess.run([sys.executable, "-c", code], cwd=ROOT / "fric_nodes", check=True, capture_output=True, text=True)
    entry_points, data_files, version = json.loads(ran.stdout)
    scripts = dict(each.split(" = ") for each in entry_points["console_scripts"])
    assert scripts == {"fric": "fric_nodes.cli.main:main"} | {node: f"fric_nodes.nodes.{node}:main" for node in NODES}
    files = {target: {Path(name).name for name in names} for target, names in data_files}
    assert files["share/fric_nodes/config"] == {path.name for path in (ROOT / "config").glob("*.yaml")}
    assert files["share/fric_nodes"] == {"package.xml"}
    assert files["share/fric_nodes/launch"] == {path.name for path in (ROOT / "fric_nodes/launch").glob("*.launch.py")}
    assert files["bin"] == {"fric"}
    assert os.access(ROOT / "fric_nodes/resource/bin/fric", os.X_OK)
    assert files["share/ament_index/resource_index/packages"] == {"fric_nodes"}
    assert version == importlib.metadata.version("fric")
    assert (ROOT / "fric_nodes/setup.cfg").read_text(encoding="utf-8").count("$base/lib/fric_nodes") == 2


def test_the_installed_package_is_the_one_under_test() -> None:
    """`python -m pytest` puts the clone first on the path, where folders have the names of the packages."""
    import fric_interfaces
    import fric_nodes

    for package in (fric_nodes, fric_interfaces):
        assert package.__file__ is not None, f"{package.__name__} is a bare folder, not the installed package"
    assert not (ROOT / "setup.py").exists(), "a setup.py in the root hides both packages from colcon"


def test_fric_is_a_console_command() -> None:
    found = {each.name: each.value for each in importlib.metadata.distribution("fric").entry_points}
    assert found["fric"] == "fric_nodes.cli.main:main"
    assert (PREFIX / "bin/fric").is_file()
