"""Every command that README.md and docs/ print is run as it is printed.

A printed command is a line of a ``sh`` block, or inline code that begins with ``fric`` and an argument, ``ros2`` or ``colcon``.
Each must be known here, with what it needs in the folder that it runs in; one that isn't known fails, so that a new line of the
README comes with its case. Inline code that names a verb or an option without what it works on (``fric diagnose``,
``fric identify --gain``) must name one that there is. Nodes run until they are in the graph and some seconds more, and end with
status 0 on SIGINT.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import fric
import numpy as np
import pytest
from fric.bagio.read import read_record
from fric.bagio.write import write_record

if TYPE_CHECKING:
    from .conftest import Graph

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", *sorted(page for page in (ROOT / "docs").rglob("*.md") if "_build" not in page.parts))
_RUNNING = 2.0  # [s] that a node goes on once it is in the graph
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.M | re.S)
_PLANT = "fric node plant --ros-args"

Setup = Callable[[Path], None]


def _lines(block: str) -> list[str]:
    joined = re.sub(r"\\\n\s*", "", block)
    # A comment: what follows # and a space behind at least two spaces, or at the beginning of a line.
    found = (re.sub(r"(^|\s\s+)#\s.*$", "", line).strip() for line in joined.splitlines())
    return [line for line in found if line]


def _inline(text: str) -> list[str]:
    spans = re.findall(r"`([^`\n]+)`", _BLOCK.sub("", text))
    # In the table of plants "…" stands for the beginning of the command in its first row.
    spans = [re.sub(r"^… (?=-p )", f"{_PLANT} ", span) for span in spans]
    spans = [re.sub(r"^… (?=config/)", f"{_PLANT} --params-file ", span) for span in spans]
    spans = [re.sub(r"^(?=\w+_plant\.yaml$)", f"{_PLANT} --params-file config/", span) for span in spans]
    return [span for span in spans if re.match(r"(fric|ros2|colcon) ", span)]


def _printed() -> list[str]:
    found: dict[str, None] = {}
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for language, block in _BLOCK.findall(text):
            found |= dict.fromkeys(_lines(block) if language == "sh" else ())
        found |= dict.fromkeys(_inline(text))
    return list(found)


_ON_FILES = {"diagnose", "import", "identify", "compare", "simulate"}  # verbs that name first what they work on


def _is_name(command: str) -> bool:
    """True when it names a verb, or options of one, without what it works on; or holds a placeholder."""
    if not (words := command.split()) or words[0] != "fric":
        return False
    if words[-1] in {"…", "NAME", "--help"} or command in {"fric verify", "fric prove"}:
        return True
    if words[1] == "batch":
        return len(words) <= 3 and words[-1] in {"batch", "diagnose", "doctor", "identify"}
    return words[1] in _ON_FILES and (len(words) == 2 or words[2].startswith("--"))


# What commands need


def _map(folder: Path) -> None:
    """``run.csv`` of an axis with friction in the columns of the README's mapping, and that mapping as ``map.yaml``."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    mapping = next(block for language, block in _BLOCK.findall(text) if language == "yaml" and "# map.yaml" in block)
    (folder / "map.yaml").write_text(mapping, encoding="utf-8")
    gain = float(re.findall(r"scale: ([-+.\deE]+)", mapping)[0])
    t = 1e-3 * np.arange(12_000)
    force = 60.0 * np.sin(2.0 * np.pi * (0.3 + 0.1 * t) * t)
    axis = fric.build_model("rigid", {"mass": 5.0}, [fric.term("coulomb", force=12.0), fric.term("viscous", coefficient=30.0)])
    position = fric.simulate(axis, force, 1e-3).position
    table = np.column_stack([t, position.round(6), force / gain])
    np.savetxt(folder / "run.csv", table, ["%.3f", "%.6f", "%.9g"], ",", header="t,qm,vir", comments="")


def _found(folder: Path) -> None:
    """What ``fric identify --out found`` leaves, with and without ``--design``: a model and an excitation."""
    (folder / "found").mkdir()
    shutil.copy(ROOT / "config" / "nominal_model.yaml", folder / "found" / "model.yaml")
    shutil.copy(ROOT / "config" / "excitation.yaml", folder / "found" / "excitation.yaml")


def _simulated(folder: Path) -> None:
    """``bags/simulated``: the recording with a little less force."""
    record = read_record(folder / "bags" / "slide")
    write_record(replace(record, effort=0.98 * record.effort), folder / "bags" / "simulated")


def _followed(folder: Path) -> None:
    """``bags/my_run``: a recording with its reference."""
    record = read_record(folder / "bags" / "contour", end=4.0)
    write_record(replace(record, reference=record.position), folder / "bags" / "my_run")


def _published(*names: str, under: str = "") -> Setup:
    """Files of published recordings, from the folder FRIC_DATA; ``under``: part of the path to them."""

    def link(folder: Path) -> None:
        for name in names:
            held = [path for path in sorted(Path(os.environ["FRIC_DATA"]).rglob(name)) if under in str(path)]
            assert held, f"{name} is not in FRIC_DATA"
            shutil.copy(held[0], folder / name)

    return link


def _after(*commands: str) -> Setup:
    """What these commands leave."""

    def run(folder: Path) -> None:
        for command in commands:
            for prepare in KNOWN[command].needs:
                prepare(folder)
            status = os.waitstatus_to_exitcode(os.system(f"cd {folder} && {{ {command} ; }} >/dev/null 2>&1"))
            assert status == 0, command

    return run


@dataclass(frozen=True)
class Case:
    """How a printed command is run.

    Attributes:
        needs: what makes the files that it reads.
        node: name of the node that it starts; it is stopped.
        long: it takes more than some seconds.
        data: it reads published recordings.
        status: with which it may end; 1 says that what was asked for was found, or a goal was missed.
        tool: that has to be there.
        checked: for what can't run within a test: true when it is checked elsewhere.
        limit: time that it may take [s].
    """

    needs: tuple[Setup, ...] = ()
    node: str = ""
    long: bool = False
    data: bool = False
    status: tuple[int, ...] = (0,)
    tool: str = ""
    checked: Callable[[], bool] | None = None
    limit: float = 300.0


def _in_ci(*texts: str) -> Callable[[], bool]:
    """True when ``.ci/run`` runs all of this."""
    return lambda: all(text in (ROOT / ".ci" / "run").read_text(encoding="utf-8") for text in texts)


def _by_tutorial() -> bool:
    """True when the test of the examples walks through the tutorial, whose commands need each other in their order."""
    return '_walk("docs/tutorial.md"' in (ROOT / "tests" / "docs" / "test_examples.py").read_text(encoding="utf-8")


def _long(limit: float = 3600.0, **rest: object) -> Case:
    return Case(long=True, limit=limit, **rest)  # type: ignore[arg-type]


_TUTORIAL = [
    line
    for language, block in _BLOCK.findall((ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8"))
    if language == "sh"
    for line in _lines(block)
]
_IMPORT = "fric import run.csv --map map.yaml --out bags/run"
_DESIGN = (
    "fric identify bags/slide --model config/start_model.yaml --method prediction-error --design --out found "
    "--limit position=-0.05,0.05 --limit speed=0.3 --limit force=-60,60 --duration 10"
)
_TRIBOMETER = "fric import test_data_2.txt --map config/published/tribometer.yaml --out bags/tribometer"
_CYLINDERS = (
    "for bar in 1 3 5 7; do fric import O-ring257_${bar}bar.csv --map config/published/cylinder.yaml --repair "
    "--out bags/cylinder_$bar; done"
)
_EMPS = "fric import DATA_EMPS.mat --map config/published/emps.yaml --out bags/emps"
_SPEEDS = (2, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 120, 140, 160, 180, 200)
_SCREWS = (
    f"for n in {' '.join(map(str, _SPEEDS))}; do for v in $n n$n; do fric import $v.csv "
    "--map config/published/screw.yaml --repair --out bags/screw_$v; done; done"
)
_TIAGO = "fric import tiago_effort.csv --map config/published/torso.yaml --repair --out bags/torso"

_BRIDGE = "fric node hardware_bridge --ros-args --params-file config/hardware_bridge.yaml"
_LONGEST, _JUDGED = _long(4 * 3600.0), _long(4 * 3600.0, status=(0, 1))
_SERVICES = ("hardware_bridge/enable", "pid/reset_fault", "pid/enable")
_ASKED = Case(checked=(ROOT / "tests" / "nodes" / "test_managed.py").is_file)  # of running nodes

KNOWN: dict[str, Case] = {
    **dict.fromkeys(_TUTORIAL, Case(checked=_by_tutorial)),
    "python3 -m venv env && . env/bin/activate && pip install . && fric demo --out demo": Case(
        checked=_in_ci('-m venv "$work/env"', "pip install --quiet '.[test,docs]'")
    ),
    "pip install '.[test]' && python -m pytest -n auto --dist worksteal": Case(
        checked=_in_ci("pip install --quiet '.[test,docs]'", "python -m pytest -n auto --dist worksteal")
    ),
    "sphinx-build -W --keep-going docs docs/_build": Case(checked=_in_ci("sphinx-build -q -W --keep-going docs")),
    "fric record bags/my_run --topic /joint_states --topic /effort_controller/commands": Case(node="recorder"),
    "fric doctor bags/my_run": Case((_followed,)),
    "colcon build && . install/setup.sh && ros2 run fric_nodes plant": Case(
        checked=_in_ci("pip install --quiet 'fric[colcon]'", "pytest tests/packaging/test_colcon.py")
    ),
    _IMPORT: Case((_map,)),
    "fric identify bags/run --terms coulomb,viscous,bias,asymmetry --out found": Case((_after(_IMPORT),)),
    "fric identify bags/slide --model config/start_model.yaml --out found": _long(1200.0),
    _DESIGN: _long(),
    "fric node excitation --ros-args --params-file found/excitation.yaml": Case((_found,), node="excitation"),
    "fric diagnose bags/slide --validate bags/contour --model config/nominal_model.yaml --out diagnosis": _long(),
    "fric diagnose bags/slide --validate bags/contour --model config/nominal_model.yaml": _long(),
    "fric diagnose bags/slide --blocks 8 --model config/nominal_model.yaml --out diagnosis": _long(),
    **{f"fric {it}": Case() for it in ("--version", "env", "doctor", "doctor bags/slide", "identify bags/slide --pieces 20")},
    "fric compare bags/simulated bags/slide --out comparison": Case((_simulated,)),
    "fric model show found/model.yaml": Case((_found,)),
    "fric simulate found/model.yaml --force bags/slide --out bags/simulated": Case((_found,)),
    "fric simulate found/model.yaml --closed-loop config/controller.yaml --reference bags/my_run --out bags/closed": Case(
        (_found, _followed)
    ),
    "fric node recorder --ros-args -p bag:=bags/my_run": Case(node="recorder"),
    "fric node player --ros-args -p bag:=bags/slide -p rate:=4.0": Case(node="player"),
    "fric node compensator --ros-args --params-file config/compensator.yaml -p model_file:=found/model.yaml": Case(
        (_found,), node="compensator"
    ),
    **dict.fromkeys(
        (
            "ros2 launch fric_nodes one_axis.launch.py model_file:=found/model.yaml bag:=bags/my_run",
            "ros2 launch fric_nodes two_axes.launch.py bags:=bags/my_run",
            "ros2 launch fric_nodes bridge.launch.py port:=/dev/ttyACM0",
        ),
        Case(checked=(ROOT / "tests" / "packaging" / "test_launch.py").is_file),
    ),
    **dict.fromkeys(("ros2 run fric_nodes plant", 'eval "$(fric env)" && ros2 run fric_nodes plant'), Case(node="plant")),
    'fric node excitation --ros-args --params-file config/excitation.yaml -p "wait_for_nodes:=[recorder]"': Case(
        node="excitation"
    ),
    **{
        f"fric node {name} --ros-args --params-file config/{name}.yaml": Case((_found,), node=name)
        for name in ("excitation", "pid", "identifier", "experiment", "monitor")
    },
    f"{_PLANT} -p model_file:=config/contact_model.yaml": Case(node="plant"),
    **{
        f"{_PLANT} --params-file config/{of}plant.yaml": Case(node="plant", long=of != "")
        for of in ("", "guideway_", "pneumatic_", "quarter_car_", "test_bed_", "pendulum_", "cart_pendulum_")
    },
    **{
        f"fric model {what}": Case()
        for what in ("effects", "effects dwell_time", "effects presliding", "plants", "excitations", "methods", "schema")
    },
    **{f"fric verify {it}": _LONGEST for it in ("--out verification.html", "compensation-guideway", "compensation-robust")},
    **{f"fric compete{how}": _LONGEST for how in ("", " --out competition.html", " --quick --out competition.html")},
    **dict.fromkeys(("fric demo", "fric demo --clock wall", "fric bench sparse-regression"), _LONGEST),
    "fric batch identify bags --terms coulomb,viscous,bias --out fleet": Case(),
    **{
        f"fric {name}": _JUDGED
        for name in (
            *(f"prove {each}" for each in ("--variant mixed --out mixed", "--calibrate proof --calibrate mixed --out learnt")),
            *(f"prove --cases {each} --out proof" for each in ("300 --seed 110", "100 --seed 20261126")),
            *("prove --inject bags/slide --model config/nominal_model.yaml --out proof", "bench long-recordings", "compile"),
            *(f"bench {each}" for each in ("lock-step", "recordings", "fitting", "laws", "online", "faults", "faults --graph")),
            *(f"bench {each}" for each in ("batch", "wall-time", "tensor-product-control", "compensation", "circle", "peers")),
            *("bench soak", "bench soak-wall"),
            *(f"bench calibration{it}" for it in ("", "-oscillation", "-forced", "-static", "-two-stage", "-tensor-product")),
        )
    },
    **{
        f"pip install 'fric[{name}]'": Case(checked=lambda name=name: f"\n{name} = [" in (ROOT / "pyproject.toml").read_text())
        for name in ("batch", "can")
    },
    f"{_BRIDGE} -p driver:=serial -p serial.port:=/dev/ttyACM0": Case(node="hardware_bridge"),
    **{f"ros2 lifecycle set /pid {step}": _ASKED for step in ("configure", "activate")},
    **{f"ros2 service call /{of} std_srvs/srv/Trigger": _ASKED for of in _SERVICES},
    "fric node pid --ros-args --params-file config/pid.yaml -p autostart:=false": Case(node="pid"),
    _TRIBOMETER: Case((_published("test_data_2.txt"),), data=True),
    "fric diagnose bags/tribometer --blocks 6 --start 8.5 --end 204 --model config/published/tribometer_nominal.yaml "
    "--out diagnosis": _long(needs=(_after(_TRIBOMETER),), data=True),
    _CYLINDERS: Case((_published(*(f"O-ring257_{bar}bar.csv" for bar in (1, 3, 5, 7))),), data=True),
    "fric diagnose bags/cylinder_1 bags/cylinder_3 bags/cylinder_5 bags/cylinder_7 --blocks 6 "
    "--model config/published/cylinder_nominal.yaml --out diagnosis": _long(needs=(_after(_CYLINDERS),), data=True),
    _EMPS: Case((_published("DATA_EMPS.mat"),), data=True),
    "fric diagnose bags/emps --blocks 10 --model config/published/emps_nominal.yaml --out diagnosis": _long(
        needs=(_after(_EMPS),), data=True
    ),
    _SCREWS: _long(
        needs=(_published(*(f"{sign}{n}.csv" for n in _SPEEDS for sign in ("", "n")), under="driveNo1/steady_state"),),
        data=True,
    ),
    "fric diagnose bags/screw_{2,20,40,60,80,100,140,180,n2,n20,n40,n60,n80,n100,n140,n180} --repair "
    "--model config/published/screw_nominal.yaml --out diagnosis "
    "$(printf -- '--validate bags/screw_%s ' 10 30 50 70 90 120 160 200 n10 n30 n50 n70 n90 n120 n160 n200)": _long(
        needs=(_after(_SCREWS),), data=True
    ),
    _TIAGO: Case((_published("tiago_effort.csv", "tiago_position.csv", "tiago_velocity.csv"),), data=True),
    "fric diagnose bags/torso --blocks 6 --repair --model config/published/torso_nominal.yaml --out diagnosis": _long(
        needs=(_after(_TIAGO),), data=True
    ),
    "fric prove --inject bags/torso --blocks 6 --repair --model config/published/torso_nominal.yaml --at-most 60 "
    "--out injected": _long(needs=(_after(_TIAGO),), data=True),
}


def _spaced(command: str) -> str:
    """With single blanks: columns are aligned in print."""
    return re.sub(r"\s+", " ", command)


COMMANDS = [command for command in map(_spaced, _printed()) if not _is_name(command)]
NAMES = [command for command in map(_spaced, _printed()) if _is_name(command)]


def _parameter(command: str) -> object:
    case = KNOWN.get(command, Case())
    marks = [pytest.mark.timeout(case.limit)]
    marks += [pytest.mark.long] if case.long else []
    marks += [pytest.mark.real_data] if case.data else []
    return pytest.param(command, marks=marks)


def test_commands_are_found_at_all() -> None:
    assert len(COMMANDS) > 30
    assert "fric verify --out verification.html" in COMMANDS
    assert "fric diagnose" in NAMES


@pytest.mark.parametrize("command", COMMANDS)
def test_every_printed_command_is_known(command: str) -> None:
    assert command in KNOWN, f"'{command}' is printed: say in KNOWN what it needs, so that it is run"


def test_an_unknown_command_is_found() -> None:
    assert "fric identify x --out y" in _lines("fric identify x \\\n    --out y    # a comment\n\n# another\n")
    assert _inline("as `fric identify x --out y` does, `… config/a_plant.yaml` and `map.yaml`") == [
        "fric identify x --out y",
        "fric node plant --ros-args --params-file config/a_plant.yaml",
    ]
    assert not _is_name("fric identify x --out y")
    assert not _is_name("fric model plants")


@pytest.mark.parametrize("name", NAMES)
def test_every_verb_and_option_that_is_named_is_there(name: str, graph: Graph, path_of_shell: None) -> None:
    verb, options = name.split()[1], [word for word in name.split() if word.startswith("--")]
    status, out, error = graph.finish(graph.execute("fric", verb, "--help", env={**os.environ, "COLUMNS": "200"}))
    assert status == 0, error
    assert all(option in out for option in options), f"fric {verb} has no {options}"


@pytest.mark.parametrize("command", [_parameter(command) for command in COMMANDS])
def test_it_runs_as_printed(command: str, graph: Graph, place: Path, path_of_shell: None) -> None:
    case = KNOWN[command]
    if case.checked is not None:
        assert case.checked()
        return
    if case.tool and shutil.which(case.tool) is None:
        pytest.skip(f"{case.tool} is not installed here")
    for prepare in case.needs:
        prepare(place)
    environment = {**os.environ, "ROS_DOMAIN_ID": str(graph.domain), "ROS_LOG_DIR": str(place / "log")}
    process = graph.execute("bash", "-c", command, cwd=place, env=environment)
    if case.node:
        _in_the_graph(graph, case.node, process)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C in a terminal: ros2 run leaves the signal to the node
        status, out, error = graph.finish(process)
    else:
        status, out, error = graph.finish(process, limit=case.limit)
    assert status in case.status, f"{command}\n{out}\n{error}"
    assert "Traceback" not in error, error


def _in_the_graph(graph: Graph, name: str, process: object) -> None:
    watcher = graph.node("watcher")
    poll = process.poll  # type: ignore[attr-defined]
    graph.until(lambda: name in watcher.get_node_names() or poll() is not None, f"{name} is there", limit=240.0)
    until = time.monotonic() + _RUNNING
    while poll() is None and time.monotonic() < until:
        time.sleep(0.05)
