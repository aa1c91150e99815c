"""Bags of robots as they are: commands in lists, no effort, several joints; simulated by equations written out here."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

Command = Callable[..., "subprocess.CompletedProcess[str]"]
Refusal = Callable[..., str]
START_NS = 1_700_000_000_000_000_000
STEP = 1e-3
JS, ARRAY = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64MultiArray"
STORE = get_typestore(Stores.ROS2_JAZZY)
TRUTH = {"mass": 2.0, "coulomb.force": 5.0, "viscous.coefficient": 12.0}


def force(n_samples: int, phase: float) -> np.ndarray:
    time = np.arange(n_samples) * STEP
    return 18.0 * np.sin(2.0 * np.pi * 0.7 * time + phase) + 9.0 * np.sin(2.0 * np.pi * 2.3 * time) + 4.0 * np.sin(31.0 * time)


def driven(effort: np.ndarray, mass: float, coulomb: float, viscous: float) -> np.ndarray:
    """Position at each stamp under a force that holds from one stamp to the next; the body sticks exactly."""
    parts = 20
    h, q, v = STEP / parts, 0.0, 0.0
    position = np.empty(effort.size)
    for k, u in enumerate(effort):
        position[k] = q
        for _ in range(parts):
            if v == 0.0 and abs(u) <= coulomb:
                continue
            sign = np.sign(v) if v else np.sign(u)
            # Exact for a constant force: v' = (w - v) / tau.
            w, tau = (u - coulomb * sign) / viscous, mass / viscous
            after = w + (v - w) * np.exp(-h / tau)
            if v * after < 0.0:
                after = 0.0
            q += w * h + tau * (v - after) if after else 0.5 * v * h
            v = after
    return position


def write(path: Path, joints: dict[str, np.ndarray], effort: float | None, commands: dict[str, np.ndarray]) -> Path:
    """A bag with the joints' positions, one effort for all, and topics with lists of commands, shape ``(n, width)``."""
    time, header = STORE.types["builtin_interfaces/msg/Time"], STORE.types["std_msgs/msg/Header"]
    layout = STORE.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        states = writer.add_connection("/joint_states", JS, typestore=STORE)
        topics = {name: writer.add_connection(name, ARRAY, typestore=STORE) for name in commands}
        for k in range(next(iter(joints.values())).size):
            now = START_NS + k * round(STEP * 1e9)
            for name, values in commands.items():
                message: Any = STORE.types[ARRAY](layout=layout, data=np.atleast_1d(values[k]))
                writer.write(topics[name], now, STORE.serialize_cdr(message, ARRAY))
            message = STORE.types[JS](
                header=header(stamp=time(sec=now // 10**9, nanosec=now % 10**9), frame_id=""),
                name=list(joints),
                position=np.array([position[k] for position in joints.values()]),
                velocity=np.zeros(0),
                effort=np.full(0 if effort is None else len(joints), effort if effort is not None else 0.0),
            )
            writer.write(states, now, STORE.serialize_cdr(message, JS))
    return path


@pytest.fixture(scope="module")
def axis() -> tuple[np.ndarray, np.ndarray]:
    """Force and position of an axis over 6 s."""
    effort = force(6000, 0.0)
    return effort, driven(effort, *TRUTH.values())


def right(found: dict[str, Any], truth: dict[str, float] = TRUTH) -> None:
    for name, value in truth.items():
        entry = found["parameters"][name]
        assert abs(entry["value"] - value) < max(0.01 * value, 3.0 * entry["std"]), (name, entry)


@pytest.mark.parametrize(
    ("effort", "options"),
    [(None, ("--topic", "force_command=/effort_controller/commands:axis")), (np.nan, ("--repair",)), (0.0, ())],
)
def test_a_command_takes_the_place_of_an_effort_that_is_not_there(
    axis: tuple[np.ndarray, np.ndarray], tmp_path: Path, fric: Command, effort: float | None, options: tuple[str, ...]
) -> None:
    commands = {"/effort_controller/commands": axis[0][:, None]}
    bag = write(tmp_path / "bag", {"axis": axis[1]}, effort, commands)
    done = fric("identify", bag, *options, "--out", tmp_path / "found", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    right(found)
    assert any("taken from /effort_controller/commands" in note for note in found["notes"])


@pytest.mark.parametrize(("effort", "said"), [(0.0, "the effort is 0 N throughout"), (0.25, "the effort is 0.25 N throughout")])
def test_an_effort_that_never_changes_is_refused(
    axis: tuple[np.ndarray, np.ndarray], tmp_path: Path, refusal: Refusal, fric: Command, effort: float, said: str
) -> None:
    bag = write(tmp_path / "bag", {"axis": axis[1]}, effort, {})
    for method in ("inverse-dynamics", "output-error", "static-map"):
        line = refusal("identify", bag, "--method", method, "--out", tmp_path / "found")
        assert said in line
        assert "--topic force_command=NAME" in line
    assert not (tmp_path / "found").exists()
    # A force beside it in the same bag is what the remedy names.
    with_command = write(tmp_path / "more", {"axis": axis[1]}, effort, {"/drive/target": axis[0][:, None]})
    done = fric("identify", with_command, "--topic", "force_command=/drive/target", "--out", tmp_path / "more_found", "--json")
    assert done.returncode == 0, done.stderr
    right(json.loads(done.stdout))


def test_diagnose_refuses_it_too(axis: tuple[np.ndarray, np.ndarray], tmp_path: Path, refusal: Refusal) -> None:
    bag = write(tmp_path / "bag", {"axis": axis[1]}, 0.0, {})
    model = tmp_path / "model.yaml"
    model.write_text(
        "format: fric-model/1\njoint: axis\nunits: {position: m, force: N}\nplant: {type: rigid, mass: 2.0}\n"
        "terms:\n  - {effect: coulomb, force: 5.0}\n"
    )
    assert "throughout" in refusal("diagnose", bag, "--blocks", 4, "--model", model, "--out", tmp_path / "found")


@pytest.mark.parametrize("method", ["log-decrement", "hilbert", "wavelet"])
def test_a_free_oscillation_needs_no_force(tmp_path: Path, fric: Command, method: str) -> None:
    # m = 1, damping ratio 0.01 by viscosity alone: q = exp(-z w t) cos(w_d t), released at a maximum.
    w, zeta = 2.0 * np.pi * 2.0, 0.01
    time = np.arange(0.0, 12.0, STEP)
    damped = w * np.sqrt(1.0 - zeta**2)
    position = 0.1 * np.exp(-zeta * w * time) * (np.cos(damped * time) + zeta * w / damped * np.sin(damped * time))
    position += np.random.default_rng(5).normal(0.0, 1e-5, time.size)
    bag = write(tmp_path / "bag", {"axis": position}, 0.0, {})
    options = ("--method", method, "--terms", "stiffness,viscous", "--out", tmp_path / "found", "--json")
    done = fric("identify", bag, *options)
    assert done.returncode == 0, done.stderr
    right(json.loads(done.stdout), {"stiffness.stiffness": w**2, "viscous.coefficient": 2.0 * w * zeta})


JOINTS = {"lift": (2.0, 5.0, 12.0), "arm/elbow": (0.5, 1.5, 6.0)}


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two joints that move, one that stands still, their efforts commanded by one list in another order."""
    efforts = {"lift": force(6000, 0.0), "arm/elbow": 0.5 * force(6000, 1.0), "fixed": np.zeros(6000)}
    positions = {name: driven(efforts[name], *values) for name, values in JOINTS.items()} | {"fixed": np.zeros(6000)}
    commands = np.stack([efforts[name] for name in ("fixed", "arm/elbow", "lift")], axis=1)
    return write(tmp_path_factory.mktemp("robot") / "bag", positions, np.nan, {"/effort_controller/commands": commands})


def test_every_joint_in_one_go(robot: Path, tmp_path: Path, fric: Command) -> None:
    order = ("--topic", "force_command=/effort_controller/commands:fixed,arm/elbow,lift")
    out = tmp_path / "found"
    done = fric("identify", robot, "--joint", "all", *order, "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert json.loads((out / "overview.json").read_text()) == summary
    assert (summary["identified"], summary["failed"]) == (2, 1)
    for joint, values in JOINTS.items():
        right(summary["joints"][joint], dict(zip(TRUTH, values, strict=True)))
    assert "the effort is 0 N throughout" in summary["joints"]["fixed"]["error"]
    page = (out / "overview.html").read_text()
    assert '<a href="arm_elbow/report.html">arm/elbow</a>' in page
    assert "the effort is 0 N throughout" in page
    for folder in ("lift", "arm_elbow"):
        assert {path.name for path in (out / folder).iterdir()} == {"model.yaml", "identification.json", "report.html"}
    assert not (out / "fixed").exists()
    shown = fric("identify", robot, "--joint", "all", *order, "--out", tmp_path / "again")
    assert shown.returncode == 0
    assert "2 of 3 joints identified" in shown.stdout
    assert "- not fixed:" in shown.stdout


def test_no_joint_at_all(robot: Path, tmp_path: Path, refusal: Refusal) -> None:
    line = refusal("identify", robot, "--joint", "all", "--out", tmp_path / "found")
    assert "none of 3 joint(s) could be identified" in line
    assert "/effort_controller/commands:0" in line
    assert not (tmp_path / "found").exists()


def test_a_selection_that_is_none(robot: Path, tmp_path: Path, refusal: Refusal) -> None:
    for given in ("force_command=", "force_command=:1", "nothing=/a"):
        assert "is not ROLE=NAME" in refusal("identify", robot, "--topic", given, "--out", tmp_path / "found")
