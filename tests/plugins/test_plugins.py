"""A package outside fric adds a member to every catalogue by its entry point, and users meet it where they meet fric's own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent / "package"

SCRIPT = """
import numpy as np
import fric
from fric.bench import BENCHMARKS
from fric.control.feedbacks import CONTROLLERS
from fric.control.feedforwards import FEEDFORWARDS
from fric.effects import EFFECTS
from fric.excitation import EXCITATIONS
from fric.identification import METHODS
from fric.importers import suffixes
from fric.instrument import CHECKS, inspect
from fric.model import build_model, term
from fric.plants import PLANTS
from fric.report.kind import page_of
from other_axis.report import Own

assert {"cubic_drag"} <= set(EFFECTS) and {"loaded_table"} <= set(PLANTS) and {"bump"} <= set(EXCITATIONS)
assert {"as-given"} <= set(METHODS) and {"named"} <= set(CHECKS) and {"proportional"} <= set(CONTROLLERS)
assert {"constant"} <= set(FEEDFORWARDS)
assert {"nothing"} <= set(BENCHMARKS) and ".axislog" in suffixes()
assert page_of(Own()) == "<html>its own page</html>"

# Its plant and its effect are simulated and fitted like any other: 2 kg and 1 kg under 3 N, against F_3 v^3.
axis = build_model("loaded_table", {"table": 2.0, "load": 1.0}, [term("cubic_drag", coefficient=24.0)])
motion = fric.simulate(axis, np.full(20001, 3.0), 1e-3)
assert abs(motion.velocity[-1] - 0.5) < 1e-9
h = 1e-3
t = np.arange(12000) * h
u = 4.0 * np.sin(2 * np.pi * 0.5 * t) + 3.0 * np.sin(2 * np.pi * 1.7 * t)
run = fric.simulate(build_model("rigid", {"mass": 3.0}, [term("cubic_drag", coefficient=24.0)]), u, h)
found = fric.identify(run, "cubic_drag")
assert abs(found["cubic_drag.coefficient"] - 24.0) < 0.05, found.summary()
taken = fric.identify(run, found.model, method="as-given")
assert taken.result.status == "taken as given" and "its own" not in taken.report()
assert any(each.check == "named" for each in inspect([run]))
np.savetxt("run.axislog", np.column_stack([run.time, run.position, run.effort]))
mapping = {"time": {"from": "t", "unit": "s"}, "position": {"from": "q", "unit": "m"}, "effort": {"from": "u", "unit": "N"}}
assert fric.read("run.axislog", mapping=mapping).n_samples == 12000
open("c.yaml", "w").write(
    "format: fric-controller/1\\nunits: {position: m, force: N}\\nperiod: 0.001\\n"
    "controller: {type: proportional, gain: 2000.0}\\nfeedforward: {type: constant, force: 0.5}\\n"
)
from dataclasses import replace
followed = fric.simulate("coulomb,viscous", reference=replace(run, reference=run.position), controller="c.yaml")
assert followed.n_samples == 12000
print("all there")
"""


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """With the package as if it were installed: its folder and its entry point."""
    site = tmp_path_factory.mktemp("site")
    held = site / "other_axis-1.0.dist-info"
    held.mkdir()
    (held / "METADATA").write_text("Metadata-Version: 2.1\nName: other-axis\nVersion: 1.0\n", encoding="utf-8")
    (held / "entry_points.txt").write_text("[fric.plugins]\nother_axis = other_axis\n", encoding="utf-8")
    path = os.pathsep.join([str(site), str(PACKAGE), *os.environ.get("PYTHONPATH", "").split(os.pathsep)])
    return {**os.environ, "PYTHONPATH": path.rstrip(os.pathsep)}


def test_one_of_each_kind_from_outside(environment: dict[str, str], tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=200, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "all there"


@pytest.mark.parametrize(
    ("command", "shown"),
    [
        ("model effects", "cubic_drag"),
        ("model plants", "loaded_table"),
        ("model excitations", "bump"),
        ("model methods", "as-given"),
        ("model schema", "cubic_drag"),
        ("bench --help", "nothing"),
        ("--help", "Say hello to an axis."),
        ("greet --help", "Say hello to an axis."),
        ("greet Anna", "hello, Anna"),
        ("play --help", "Publish a recording"),
    ],
)
def test_the_command_shows_it(environment: dict[str, str], command: str, shown: str) -> None:
    code = f"import sys; from fric_nodes.cli.main import main; sys.argv = ['fric', *{command.split()!r}]; main()"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=100, check=False
    )
    assert shown in done.stdout, done.stderr


def test_a_verb_that_can_not_be_imported_is_one_line(environment: dict[str, str]) -> None:
    done = _python(environment, "-c", "from fric_nodes.cli.main import main; main()", "broken")
    said = "fric: fric broken: other_axis.cli.broken can't be imported: No module named 'there_is_none'; mend the plugin"
    assert done.returncode == 2
    assert done.stderr.startswith(said), done.stderr
    assert len(done.stderr.splitlines()) == 1


NODE = """
import rclpy
from fric_nodes.nodes.identifier import IdentifierNode
from rclpy.parameter import Parameter

rclpy.init()
given = {"estimator": "hasty", "hasty.hurry": 4.0, "forgetting_time": 20.0}
node = IdentifierNode(parameter_overrides=[Parameter(name, value=value) for name, value in given.items()])
described = node.describe_parameter("hasty.hurry")
print(described.description, described.floating_point_range[0].from_value > 0.0)
print(node._session.estimator.forgetting_time)
node.destroy_node()
rclpy.try_shutdown()
"""


def _python(environment: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], env=environment, capture_output=True, text=True, timeout=100, check=False
    )


def test_the_settings_of_an_estimator_are_parameters_of_the_node(environment: dict[str, str]) -> None:
    done = _python(environment, "-c", NODE)
    assert done.stdout.splitlines() == ["factor by which it forgets faster True", "5.0"], done.stderr
    told = _python(environment, "-m", "fric_nodes.nodes.identifier", "--help").stdout
    assert "hasty: hasty least squares" in told
    assert "hasty.hurry (double) = 2.0" in told


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("hasty.hurry:=3.0",), "parameter 'hasty.hurry': is not used by the estimator rls; leave it out, or use hasty"),
        (("estimator:=hasty", "cutoff:=50.0"), "parameter 'cutoff': is not used by the estimator hasty"),
    ],
)
def test_a_setting_of_another_estimator_is_refused(environment: dict[str, str], given: tuple[str, ...], said: str) -> None:
    parameters = [word for each in given for word in ("-p", each)]
    done = _python(environment, "-m", "fric_nodes.nodes.identifier", "--ros-args", *parameters)
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_plugin_that_can_not_be_imported_is_named(environment: dict[str, str], tmp_path: Path) -> None:
    broken = tmp_path / "broken_axis"
    broken.mkdir()
    (broken / "__init__.py").write_text("", encoding="utf-8")
    (broken / "effects.py").write_text("import there_is_none\n", encoding="utf-8")
    held = tmp_path / "broken_axis-1.0.dist-info"
    held.mkdir()
    (held / "METADATA").write_text("Metadata-Version: 2.1\nName: broken-axis\nVersion: 1.0\n", encoding="utf-8")
    (held / "entry_points.txt").write_text("[fric.plugins]\nbroken = broken_axis\n", encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), environment["PYTHONPATH"]])
    done = subprocess.run(
        [sys.executable, "-c", "import fric.effects"],
        env={**environment, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert "plugin 'broken' (broken_axis) can't be imported: No module named 'there_is_none'" in done.stderr
