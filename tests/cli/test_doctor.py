"""``fric doctor`` on the installation, and on recordings good and bad."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fric.bagio.write import write_record
from fric.model import build_model, term
from fric.model_file import write_model
from fric.record import Record
from fric_nodes.installation import round_trip_item

Command = Callable[..., "subprocess.CompletedProcess[str]"]


def recording(sign: float = 1.0, scale: float = 1.0) -> Record:
    time = np.arange(0.0, 12.0, 2e-3)
    w = 2.0 * np.pi * np.array([0.3, 0.7, 1.9])
    size = np.array([0.02, 0.015, 0.01])
    position = (size * np.sin(np.outer(time, w))).sum(axis=1)
    velocity = (size * w * np.cos(np.outer(time, w))).sum(axis=1)
    acceleration = -(size * w**2 * np.sin(np.outer(time, w))).sum(axis=1)
    force = 3.0 * acceleration + 20.0 * velocity + 6.0 * np.sign(velocity)
    force += np.random.default_rng(3).normal(0.0, 0.1, time.shape)
    return Record(time, np.round(position / 1e-6) * 1e-6, sign * scale * force)


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("bags")
    made = {"good": recording(), "turned": recording(sign=-1.0), "kilo": recording(scale=1e-3)}
    for name, record in made.items():
        write_record(record, folder / name)
    model = build_model("rigid", {"mass": 3.0}, [term("coulomb", force=6.0), term("viscous", coefficient=20.0)])
    write_model(model, folder / "model.yaml")
    return {name: folder / name for name in (*made, "model.yaml")}


def test_a_good_recording(bags: dict[str, Path], fric: Command) -> None:
    done = fric("doctor", bags["good"], "--model", bags["model.yaml"])
    assert done.returncode == 0, done.stdout + done.stderr
    assert "No fault of the recordings was found." in done.stdout


def test_a_wrong_sign_and_a_wrong_unit(bags: dict[str, Path], fric: Command) -> None:
    done = fric("doctor", bags["turned"], "--json")
    assert done.returncode == 1, done.stderr
    told = json.loads(done.stdout)
    assert told["faults"] is True
    assert [c["check"] for c in told["checks"] if c["verdict"] == "fault"] == ["effort_sign"]
    assert all({"check", "verdict", "value", "detail"} <= set(check) for check in told["checks"])
    unit = fric("doctor", bags["kilo"], "--model", bags["model.yaml"])
    assert unit.returncode == 1
    assert "kilo" in unit.stdout


def test_what_cannot_be_read(tmp_path: Path, fric: Command) -> None:
    done = fric("doctor", tmp_path / "nowhere")
    assert done.returncode == 2
    assert len([line for line in done.stderr.splitlines() if line.startswith("fric:")]) == 1


def test_the_installation(fric: Command) -> None:
    done = fric("doctor", "--json")
    told = json.loads(done.stdout)
    states = {item["check"]: (item["verdict"], item["detail"]) for item in told["checks"]}
    assert {"versions", "cache", "compiler", "configuration", "ROS 2", "interfaces", "middleware"} == set(states)
    assert done.returncode == 0, states
    assert round_trip_item(None).state == "fault"
