"""Closed loops: against a loop written here in plain Python, which shares nothing with fric's."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fric.bagio.write import write_record
from fric.control.closed_loop import ClosedLoopError, closed_loop
from fric.control.controller_file import ControllerError, read_controller
from fric.model import Model, build_model, term
from fric.model_file import write_model
from fric.record import Record, Units
from fric_nodes.cli.main import build_app
from numpy.typing import NDArray
from typer.testing import CliRunner

Array = NDArray[np.float64]
MASS, COULOMB, VISCOUS = 2.0, 6.0, 20.0
H, FINE, STEP = 1e-3, 50, 1e-6
PID = """format: fric-controller/1
units: {position: m, force: N}
period: 0.001
resolution: 1.0e-6
controller: {type: pid, proportional: 2.0e+4, integral: 2.0e+5, derivative: 250.0, filter_time: 0.001}
"""
CASCADE = """format: fric-controller/1
units: {position: m, force: N}
period: 0.002
resolution: 1.0e-6
delay: 0.0015
force_limit: 30.0
controller: {type: cascade, position_gain: 60.0, velocity_gain: 150.0, velocity_integral: 1000.0, velocity_weight: 1.0}
"""


def model(mass: float = MASS) -> Model:
    return build_model("rigid", {"mass": mass}, [term("coulomb", force=COULOMB), term("viscous", coefficient=VISCOUS)])


def wanted(t: float) -> tuple[float, float]:
    """Position and velocity; the motion has begun long ago."""
    w, x = 2.0 * math.pi * 0.8, t + 0.3
    return 0.04 * math.sin(w * x) + 0.01 * math.sin(3.1 * w * x), 0.04 * w * math.cos(w * x) + 0.031 * w * math.cos(3.1 * w * x)


def machine(control: Callable[[float, float], float], period: int, delay: int, duration: float, begin: float) -> Record:
    """Coulomb and viscous friction by Moreau's time stepping; ``period`` and ``delay`` in steps of 20 us."""
    h = H / FINE
    q, v = wanted(begin)
    u = force = 0.0
    due: list[tuple[int, float]] = []
    position, effort = [], []
    for k in range(round(duration / h)):
        if k % period == 0:
            due.append((k + delay, control(begin + k * h, STEP * round(q / STEP))))
        while due and due[0][0] <= k:
            u = due.pop(0)[1]
        force = u
        if k % FINE == 0:
            position.append(STEP * round(q / STEP))
            effort.append(force)
        free = v + h / MASS * (force - VISCOUS * v)
        v = math.copysign(max(abs(free) - h / MASS * COULOMB, 0.0), free)
        q += h * v
    time = H * np.arange(len(position))
    reference = np.array([wanted(begin + t)[0] for t in time])
    return Record(time, np.array(position), np.array(effort), reference=reference, effort_hold="following", source="machine")


def pid() -> Callable[[float, float], float]:
    integral = derivative = 0.0
    before: float | None = None

    def control(t: float, y: float) -> float:
        nonlocal integral, derivative, before
        error = wanted(t)[0] - y
        integral += 2.0e5 * H * error
        change = 0.0 if before is None else error - before
        derivative = (0.001 * derivative + 250.0 * change) / (0.001 + H)
        before = error
        return 2.0e4 * error + integral + derivative

    return control


def cascade() -> Callable[[float, float], float]:
    integral, before = 0.0, None

    def control(t: float, y: float) -> float:
        nonlocal integral, before
        r, w = wanted(t)
        v = w if before is None else (y - before) / 0.002
        before = y
        error = 60.0 * (r - y) + w - v
        after = integral + 1000.0 * 0.002 * error
        free = 150.0 * error + after
        u = min(max(free, -30.0), 30.0)
        if (free - u) * error <= 0.0:
            integral = after
        return u

    return control


CASES = {"pid": (PID, pid, FINE, 0), "cascade": (CASCADE, cascade, 2 * FINE, 75)}


def recorded(name: str, first: float) -> Record:
    """From ``first`` [s] on, when the controller has long been at work and the axis is in motion."""
    _, law, period, delay = CASES[name]
    return machine(law(), period, delay, 4.0, 0.0).between(first, None)


@pytest.fixture
def controller(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        path = tmp_path / "controller.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("first", [0.0, 1.2])
@pytest.mark.parametrize("name", CASES)
def test_it_does_what_the_machine_did(name: str, first: float, controller: Callable[[str], Path]) -> None:
    record = recorded(name, first)
    found = closed_loop(model(), read_controller(controller(CASES[name][0])), record)
    # A limit cycle of a step of the encoder has no phase to agree in; the recorded tracking error is some 100 times larger.
    assert found.recorded_tracking_rms > 5e-5
    assert found.position_rmse < 0.05 * found.recorded_tracking_rms
    assert found.tracking_rms == pytest.approx(found.recorded_tracking_rms, rel=0.03)
    assert found.relative_force_error_percent < 5.0
    assert found.record.reference is not None


def test_another_mass_shows(controller: Callable[[str], Path]) -> None:
    record = recorded("pid", 1.2)
    settings = read_controller(controller(PID))
    right, wrong = (closed_loop(model(mass), settings, record) for mass in (MASS, 1.5 * MASS))
    assert wrong.position_rmse > 5.0 * right.position_rmse
    assert wrong.relative_force_error_percent > 3.0 * right.relative_force_error_percent


def test_a_feedforward_of_the_model_takes_most_of_the_error_away(controller: Callable[[str], Path]) -> None:
    record = recorded("pid", 1.2)
    settings = read_controller(controller(PID))
    write_model(model(), controller(PID).parent / "model.yaml")
    ahead = read_controller(controller(PID + "feedforward: {model: model.yaml}\n"))
    plain, fed = (closed_loop(model(), each, record).tracking_rms for each in (settings, ahead))
    assert fed < 0.2 * plain


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("period: 0.001", "period: .nan"), "period"),
        (("period: 0.001", "period: 0.0"), "period"),
        (("resolution", "resolutoin"), "unknown key 'resolutoin'"),
        (("type: pid", "type: pdi"), "type 'pdi' is not known"),
        (("type: pid, ", ""), "type is missing"),
        (("integral: 2.0e+5", "integral: -1.0"), "controller.integral"),
        (("integral: 2.0e+5", "integral: .inf"), "controller.integral"),
        (("integral: 2.0e+5", "integrale: 1.0"), "unknown key 'controller.integrale'"),
        (("proportional: 2.0e+4", "proportional: high"), "controller.proportional"),
        (("fric-controller/1", "fric-model/1"), "format"),
        (("controller: {", "controller: ["), "YAML"),
        (("resolution: 1.0e-6", "feedforward: {model: nowhere.yaml}"), "no such file"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(change: tuple[str, str], said: str, controller: Callable[[str], Path]) -> None:
    text = PID.replace(*change)
    assert text != PID
    with pytest.raises(Exception, match=r"\S") as refused:
        read_controller(controller(text))
    assert "InputError" in {kind.__name__ for kind in type(refused.value).__mro__}
    assert said in str(refused.value) or said == "YAML"
    assert "\n" not in str(refused.value)


def test_what_can_not_be_simulated_is_refused(controller: Callable[[str], Path]) -> None:
    record = recorded("pid", 3.5)
    settings = read_controller(controller(PID))
    with pytest.raises(ClosedLoopError, match="no reference"):
        closed_loop(model(), settings, Record(record.time, record.position, record.effort))
    turning = build_model("rigid", {"mass": 1.0}, [], units=Units("rad", "N m"))
    with pytest.raises(ClosedLoopError, match="units"):
        closed_loop(turning, settings, record)
    with pytest.raises(ClosedLoopError, match="unstable"):
        closed_loop(model(), read_controller(controller(PID.replace("2.0e+4", "2.0e+7"))), record)
    with pytest.raises(ControllerError, match="no such file"):
        read_controller("nowhere.yaml")


def test_the_command(tmp_path: Path, controller: Callable[[str], Path]) -> None:
    write_record(recorded("pid", 1.2), tmp_path / "recorded")
    write_model(model(), tmp_path / "model.yaml")
    common = ["simulate", str(tmp_path / "model.yaml"), "--closed-loop", str(controller(PID)), "--json"]
    app = build_app()
    done = CliRunner().invoke(app, [*common, "--reference", str(tmp_path / "recorded"), "--out", str(tmp_path / "closed")])
    assert done.exit_code == 0, done.output
    answer = json.loads(done.output)
    assert answer["position_rmse"] < 0.05 * answer["recorded_tracking_rms"]
    again = CliRunner().invoke(app, [*common, "--reference", str(tmp_path / "closed"), "--out", str(tmp_path / "again")])
    # What was simulated is a recording like any other, and simulated again comes out the same but for its first state.
    assert json.loads(again.output)["position_rmse"] < 1e-6
    free = CliRunner().invoke(
        app, [*common[:2], "--force", str(tmp_path / "closed"), "--out", str(tmp_path / "free"), "--json"]
    )
    answer = json.loads(free.output)
    assert 0.0 < answer["start_velocity"]["std"] < 0.01
    assert answer["position_rmse"] < 1e-3


@pytest.mark.real_data
def test_emps_in_closed_loop(data_folder: Path, controller: Callable[[str], Path]) -> None:
    from scipy.io import loadmat

    held = loadmat(data_folder / "emps" / "DATA_EMPS.mat", squeeze_me=True)
    gain = float(held["gtau"])
    columns = (np.ascontiguousarray(held[name], dtype=np.float64) for name in ("t", "qm", "vir", "qg"))
    time, position, volts, reference = columns
    record = Record(time - time[0], position, gain * volts, reference=reference, effort_hold="following", source="EMPS")
    axis = build_model(
        "rigid",
        {"mass": 95.11},
        [term("coulomb", force=20.39), term("viscous", coefficient=203.5), term("bias", force=-3.16)],
    )
    text = f"""format: fric-controller/1
units: {{position: m, force: N}}
period: 0.001
controller: {{type: cascade, position_gain: {float(held["kp"])!r}, velocity_gain: {gain * float(held["kv"])!r}}}
"""
    found = closed_loop(axis, read_controller(controller(text)), record.uniform())
    assert found.tracking_rms == pytest.approx(found.recorded_tracking_rms, rel=0.01)
    assert found.position_rmse < 1e-5
    # The equations of a fit leave 4.1 %.
    assert found.relative_force_error_percent < 6.0
