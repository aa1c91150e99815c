"""The command line as a user meets it: real files in, real files out, one line when something is wrong."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from html import escape
from pathlib import Path

import numpy as np
import pytest

Command = Callable[..., "subprocess.CompletedProcess[str]"]
Refusal = Callable[..., str]
MAP = """
joint: slide
time:     {from: t, unit: ms}
position: {from: x, unit: mm}
effort:   {from: volts, scale: 2.5, unit: N}
"""
LIMITS = ("--limit", "position=-0.05,0.05", "--limit", "speed=0.3", "--limit", "force=-60,60")
MASS, COULOMB, VISCOUS, BIAS = 3.0, 6.0, 25.0, 1.5


@pytest.fixture(scope="module")
def csv(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A slide on Coulomb and viscous friction: the motion is given, the force follows from Newton's law written out here."""
    time = np.arange(0.0, 12.0, 1e-3)
    w = 2.0 * np.pi * np.array([0.3, 0.7])
    size = np.array([0.02, 0.008])
    position = (size * np.sin(np.outer(time, w))).sum(axis=1)
    velocity = (size * w * np.cos(np.outer(time, w))).sum(axis=1)
    acceleration = -(size * w**2 * np.sin(np.outer(time, w))).sum(axis=1)
    force = MASS * acceleration + VISCOUS * velocity + COULOMB * np.sign(velocity) + BIAS
    force += np.random.default_rng(3).normal(0.0, 0.2, time.shape)
    path = tmp_path_factory.mktemp("csv") / "run.csv"
    np.savetxt(path, np.c_[1e3 * time, 1e3 * position, force / 2.5], delimiter=",", header="t,x,volts", comments="")
    return path


@pytest.fixture(scope="module")
def bag(csv: Path, fric: Command) -> Path:
    """The same recording, imported."""
    mapping = csv.with_name("map.yaml")
    mapping.write_text(MAP)
    target = csv.with_name("bag")
    done = fric("import", csv, "--map", mapping, "--out", target, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["samples"] == 12000
    return target


def test_identify_finds_the_parameters_and_writes_three_files(bag: Path, tmp_path: Path, fric: Command) -> None:
    done = fric("identify", bag, "--out", tmp_path / "found", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    truth = {"mass": MASS, "coulomb.force": COULOMB, "viscous.coefficient": VISCOUS, "bias.force": BIAS}
    for name, value in truth.items():
        assert found["parameters"][name]["value"] == pytest.approx(value, rel=0.03), name
        assert 0 < found["parameters"][name]["std"] < 0.05 * value
    assert found["parameters"]["mass"]["unit"] == "kg"
    assert found["validation"] is None
    foreseen = found["identifiability"]
    assert set(foreseen["parameters"]) == set(truth)
    assert not any(finding["serious"] for finding in foreseen["findings"])
    assert {each["verdict"] for each in found["checks"]} <= {"ok", "warning", "unknown"}
    assert {path.name for path in (tmp_path / "found").iterdir()} == {"model.yaml", "identification.json", "report.html"}
    page = (tmp_path / "found" / "report.html").read_text()
    assert "http://" not in page.split("</script>")[-1], "the page must open without a network"
    shown = fric("model", "show", tmp_path / "found" / "model.yaml", "--json")
    assert json.loads(shown.stdout)["joint"] == "slide"


def test_a_process_of_its_own_ends_with_the_status_and_the_line(bag: Path, tmp_path: Path, fric_apart: Command) -> None:
    """As a shell starts it: the other tests call the command within this process."""
    done = fric_apart("identify", bag, "--out", tmp_path / "found", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["parameters"]["mass"]["value"] == pytest.approx(MASS, rel=0.03)
    refused = fric_apart("identify", bag, "--joint", "elbow", "--out", tmp_path / "none")
    assert refused.returncode == 2
    assert refused.stdout == ""
    (line,) = refused.stderr.splitlines()[-1:]
    assert line.startswith("fric:")
    assert "elbow" in line
    assert not (tmp_path / "none").exists()


def test_a_found_model_is_simulated_under_the_recorded_force(bag: Path, tmp_path: Path, fric: Command) -> None:
    assert fric("identify", bag, "--out", tmp_path / "found").returncode == 0
    done = fric("simulate", tmp_path / "found" / "model.yaml", "--force", bag, "--out", tmp_path / "free", "--json")
    assert done.returncode == 0, done.stderr
    # Within a few percent of the 56 mm of travel after 12 s in open loop.
    assert json.loads(done.stdout)["position_rmse"] < 0.005


def test_validation_is_scored_apart(bag: Path, tmp_path: Path, fric: Command, refusal: Refusal) -> None:
    done = fric("identify", bag, "--end", "6", "--out", tmp_path, "--json")
    assert done.returncode == 0, done.stderr
    line = refusal("identify", bag, "--validate", bag, "--out", tmp_path / "same")
    assert "both fitted and validated" in line
    assert not (tmp_path / "same").exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("identify", "nowhere.mcap"), "nowhere.mcap"),
        (("identify", "{bag}", "--joint", "elbow"), "elbow"),
        (("identify", "{bag}", "--terms", "coulomb,glue"), "glue"),
        (("identify", "{bag}", "--method", "magic"), "inverse-dynamics"),
        (("identify", "{bag}", "--cutoff", "900"), "cutoff"),
        (("identify", "{bag}", "--cutoff", "-1"), "--cutoff"),
        (("identify", "{bag}", "--hold", "weight"), "weight"),
        (("identify", "{bag}", "--bound", "weight=0,1"), "weight"),
        (("identify", "{bag}", "--bound", "mass=2,1"), "--bound"),
        (("identify", "{bag}", "--bound", "mass=-2,-1"), "leaves nothing"),
        (("identify", "{bag}", "--starts", "0"), "--starts"),
        (("identify",), "no recording"),
        (("identify", "{bag}", "--design"), "not limited"),
        (("identify", "{bag}", "--limit", "speed=1"), "--design"),
        (("identify", "--design", *LIMITS), "--model"),
        (("identify", "--design", *LIMITS, "--rig", "period=0"), "--rig"),
        (("identify", "{bag}", "--model", "nowhere.yaml"), "nowhere.yaml"),
        (("identify", "{bag}", "--topic", "joint_states"), "--topic"),
        (("model", "show", "nowhere.yaml"), "nowhere.yaml"),
        (("node", "plants"), "plant, excitation"),
        (("bench", "coffee"), "recordings"),
        (("demo", "--clock", "sundial", "--out", "{out}"), "lock-step"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(
    arguments: tuple[str, ...], says: str, bag: Path, tmp_path: Path, refusal: Refusal
) -> None:
    out = tmp_path / "out"
    filled = [argument.format(bag=bag, out=out) for argument in arguments]
    if filled[0] == "identify":
        filled += ["--out", str(out)]
    assert says in refusal(*filled)
    assert not out.exists(), "a refused command must leave nothing behind"


def test_bounds_are_kept(bag: Path, tmp_path: Path, fric: Command) -> None:
    done = fric("identify", bag, "--bound", "mass=0.5,2", "--out", tmp_path, "--json")
    assert done.returncode == 0, done.stderr
    assert 0.5 <= json.loads(done.stdout)["parameters"]["mass"]["value"] <= 2.0


def test_what_a_recording_cannot_tell_is_said_before_the_fit(csv: Path, tmp_path: Path, fric: Command) -> None:
    """The same slide going one way only: Coulomb friction and bias are one constant."""
    time = np.arange(0.0, 6.0, 1e-3)
    w = 2.0 * np.pi * 0.7
    position, velocity = 0.05 * time - 0.005 * np.cos(w * time), 0.05 + 0.005 * w * np.sin(w * time)
    force = MASS * 0.005 * w**2 * np.cos(w * time) + VISCOUS * velocity + COULOMB + BIAS
    force += np.random.default_rng(3).normal(0.0, 0.2, time.shape)
    path = tmp_path / "run.csv"
    np.savetxt(path, np.c_[1e3 * time, 1e3 * position, force / 2.5], delimiter=",", header="t,x,volts", comments="")
    (tmp_path / "map.yaml").write_text(MAP)
    assert fric("import", path, "--map", tmp_path / "map.yaml", "--out", tmp_path / "bag").returncode == 0
    done = fric("identify", tmp_path / "bag", "--out", tmp_path / "found", "--json")
    assert done.returncode == 0, done.stderr
    lines = done.stderr.splitlines()
    warned = next(k for k, line in enumerate(lines) if "coulomb.force and bias.force can't be told apart" in line)
    assert warned < next(k for k, line in enumerate(lines) if line.startswith("fitting"))
    coupled = [each for each in json.loads(done.stdout)["identifiability"]["findings"] if each["kind"] == "coupled"]
    assert coupled[0]["parameters"] == ["coulomb.force", "bias.force"]
    assert coupled[0]["experiment"]["kind"] in coupled[0]["message"]
    assert escape(coupled[0]["message"]) in (tmp_path / "found" / "report.html").read_text()


@pytest.mark.long
def test_a_design_from_a_model_alone_writes_what_the_excitation_node_takes(tmp_path: Path, fric: Command) -> None:
    model = tmp_path / "model.yaml"
    model.write_text(
        "format: fric-model/1\njoint: slide\nunits: {position: m, force: N}\nplant: {type: rigid, mass: 2.0}\n"
        "terms:\n  - {effect: coulomb, force: 10.0}\n  - {effect: viscous, coefficient: 35.0}\n"
    )
    out = tmp_path / "next"
    done = fric(
        "identify", "--design", *LIMITS, "--duration", 3, "--model", model, "--rig", "force_noise=0.3", "--out", out, "--json"
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["design"]
    assert found["worst_relative_error"]["after"] < 0.1
    assert {path.name for path in out.iterdir()} == {"design.json", "excitation.yaml", "design.html"}
    assert json.loads((out / "design.json").read_text()) == found
    written = (out / "excitation.yaml").read_text()
    assert "joint: slide" in written
    assert all(each["kind"] in written for each in found["excitation"])


def test_a_mapping_that_does_not_fit_names_the_columns(csv: Path, tmp_path: Path, refusal: Refusal) -> None:
    mapping = tmp_path / "map.yaml"
    mapping.write_text(MAP.replace("volts", "amps"))
    line = refusal("import", csv, "--map", mapping, "--out", tmp_path / "bag")
    assert "amps" in line
    assert "volts" in line
    assert not (tmp_path / "bag").exists()


def test_every_verb_explains_itself_with_an_example(fric: Command) -> None:
    listed = fric("--help").stdout
    for verb in ("demo", "node", "import", "record", "play", "simulate", "identify", "model", "bench"):
        assert verb in listed
        done = fric(verb, "--help")
        assert done.returncode == 0
        assert verb == "model" or "Example:" in done.stdout, verb


def test_the_nodes_of_the_command_are_those_that_are_installed() -> None:
    from fric_nodes.cli.node import NODES

    listed = Path(__file__).parents[2] / "fric_nodes" / "resource" / "executables"
    assert set(NODES) == set(listed.read_text().split())
