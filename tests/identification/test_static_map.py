"""Static maps: recordings made from closed forms, none of which comes from the package."""

from __future__ import annotations

import csv
import io
import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.methods.static_map import static_map
from fric.identification.result import IdentificationError, Options
from fric.identification.start import start_model
from fric.identification.static_maps.curve import Points, choose
from fric.identification.static_maps.parts import find_parts, knee, mean_and_error, motion_of
from fric.identification.static_maps.result import StaticMap, map_table
from fric.record import Record, Units
from fric.report.static_map import static_map_report
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 0.002


def mapped(*records: Record, mass: float = 1.0) -> StaticMap:
    start = start_model(["coulomb", "viscous", "bias"], "axis", Units()).with_value("mass", mass)
    return static_map(start, records, Options())


def friction(v: Array, surplus: float) -> Array:
    return np.asarray(np.sign(v) * (4.0 + surplus * np.exp(-((v / 0.02) ** 2))) + 9.0 * v - 0.5, dtype=np.float64)


def ladder(surplus: float, seed: int = 3, backward: bool = True, noise: float = 0.1, limit: float = math.inf) -> Record:
    """One recording: every speed held for two seconds, forward and then backward, with ramps between; white noise."""
    rng = np.random.default_rng(seed)
    speeds = np.geomspace(0.004, 0.3, 9)
    held = np.concatenate([speeds, -speeds] if backward else [speeds])
    velocity, now = [], 0.0
    for v in held:
        velocity += [np.linspace(now, v, 100), np.full(1000, v)]
        now = float(v)
    v = np.concatenate(velocity)
    force = friction(v, surplus) + 1.5 * np.gradient(v, STEP) + noise * rng.standard_normal(v.shape[0])
    return Record(STEP * np.arange(v.shape[0]), STEP * np.cumsum(v), np.clip(force, -limit, limit), source="ladder")


def strokes(level: float, load: float, rig: float = math.inf, distance: float = 30e-6, n: int = 16) -> Record:
    """Triangular strokes of a contact F = g (1 - 2 exp(-ln(10) d/L)) behind a spring ``rig``; noise of a thousandth."""
    rng = np.random.default_rng(11)
    contact = np.concatenate([[0.0], np.geomspace(1e-9, 1e-3, 6000)])
    change = 2.0 * level * -np.expm1(-math.log(10.0) * contact / distance)
    whole = contact + change / rig
    d = np.arange(0.0, 400e-6, 0.2e-6)
    turn = np.interp(d, whole, change) - level
    way = np.concatenate([d if k % 2 == 0 else d[-1] - d for k in range(n)])
    force = np.concatenate([turn if k % 2 == 0 else -turn for k in range(n)])
    force = force + 1e-3 * level * rng.standard_normal(force.shape[0])
    extra = {"normal_load": np.full(force.shape[0], load)}
    return Record(STEP * np.arange(force.shape[0]), way, force, extra=extra, source=f"load {load:g}")


def test_settled_parts_are_where_the_velocity_is_held() -> None:
    record = ladder(0.0)
    parts, _ = find_parts(record, motion_of(record), None)
    assert len(parts) == 18
    for k, part in enumerate(parts):
        assert 1100 * k + 100 <= part.first < 1100 * k + 500
        assert part.last <= 1100 * (k + 1) + 60
        assert part.force == pytest.approx(float(friction(np.array([part.velocity]), 0.0)[0]), abs=0.03)


def test_the_transient_after_a_reversal_is_left_out() -> None:
    record = strokes(5.0, 100.0, distance=60e-6)
    parts, _ = find_parts(record, motion_of(record), None)
    assert len(parts) >= 14
    for part in parts[1:]:
        # Half of the way through the transient would show as a tenth; a thirtieth of 2 g fades within what is left.
        assert abs(part.force) == pytest.approx(5.0, abs=0.05)


@pytest.mark.parametrize("rho", [0.0, 0.6, 0.9])
def test_the_standard_error_of_a_mean_is_that_of_correlated_noise(rho: float) -> None:
    n, found, means = 1500, [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        x = np.empty(n)
        x[0] = rng.standard_normal() / math.sqrt(1.0 - rho**2)
        for k, white in enumerate(rng.standard_normal(n - 1), start=1):
            x[k] = rho * x[k - 1] + white
        mean, error = mean_and_error(x)
        means.append(mean)
        found.append(error)
    exact = 1.0 / (1.0 - rho) / math.sqrt(n)  # spectral density of AR(1) at frequency zero
    assert np.median(found) == pytest.approx(exact, rel=0.15)
    assert np.std(means) == pytest.approx(exact, rel=0.25)


def test_a_stribeck_effect_is_found_where_it_is() -> None:
    found = mapped(ladder(1.5))
    assert found.choice is not None
    assert found.choice.best.candidate.stribeck == "exponential"
    assert found.choice.p_value <= 0.001
    for name, expected in {
        "coulomb.force": 4.0,
        "stribeck.force": 1.5,
        "stribeck.velocity": 0.02,
        "viscous.coefficient": 9.0,
        "bias.force": -0.5,
    }.items():
        error = found.model.standard_errors[name]
        assert found.model.value(name) == pytest.approx(expected, abs=4.0 * error + 1e-9), name
        assert error < 0.15 * abs(expected), name


def test_no_stribeck_effect_is_found_where_there_is_none() -> None:
    found = mapped(ladder(0.0))
    assert found.choice is not None
    assert not found.choice.best.candidate.stribeck
    assert "stribeck.force" not in found.model.names
    assert any("No Stribeck effect" in warning for warning in found.warnings)


def points(rng: np.random.Generator, surplus: float, scatter: float) -> Points:
    speeds = np.geomspace(0.004, 0.3, 10)
    v = np.concatenate([speeds, -speeds])
    error = np.full(v.shape[0], 0.03)
    return Points(v, friction(v, surplus) + math.hypot(0.03, scatter) * rng.standard_normal(v.shape[0]), error)


def test_scatter_from_run_to_run_is_no_stribeck_effect() -> None:
    # Errors of the points alone would make any wiggle significant: the scatter here is five times as large.
    rng = np.random.default_rng(2)
    found = [choose(points(rng, 0.0, 0.15)) for _ in range(60)]
    assert sum(bool(each.best.candidate.stribeck) for each in found) <= 2
    assert np.mean([each.p_value < 0.1 for each in found]) <= 0.25
    assert np.median([each.best.scatter for each in found]) == pytest.approx(0.15, rel=0.4)


def test_intervals_of_the_curve_cover_the_truth() -> None:
    rng = np.random.default_rng(4)
    at = np.array([0.03, 0.1, 0.25, -0.03, -0.1, -0.25])
    inside = []
    for _ in range(60):
        best = choose(points(rng, 0.0, 0.1)).best
        inside.append(np.abs(best.force(at) - friction(at, 0.0)) <= best.half_width(at, 0.9))
    assert 0.82 <= np.mean(inside) <= 0.97


@pytest.mark.parametrize(("law", "falls"), [("exponential", True), ("straight", True), ("rising", False)])
def test_the_knee_of_a_turning_friction(law: str, falls: bool) -> None:
    d = np.linspace(0.0, 1.0, 2000)
    force = {"exponential": 1.0 - np.exp(-d / 0.1), "straight": np.minimum(d / 0.2, 1.0), "rising": d}[law]
    distance, change = knee(d, force)
    if not falls:
        assert math.isnan(distance)
    elif law == "exponential":
        assert distance == pytest.approx(0.1 * math.log(10.0), rel=0.03)
        assert change == pytest.approx(0.9, rel=0.02)
    else:
        assert distance == pytest.approx(0.2, rel=0.2)
        assert change == pytest.approx(1.0, rel=0.05)


def test_pre_sliding_distance_of_a_stiff_rig() -> None:
    found = mapped(strokes(5.0, 100.0))
    assert {each.direction for each in found.presliding} == {1.0, -1.0}
    for each in found.presliding:
        assert each.distance[0] == pytest.approx(30e-6, rel=0.06)
        assert each.half[0] == pytest.approx(30e-6 * math.log10(2.0), rel=0.06)
        assert each.change[0] == pytest.approx(10.0, rel=0.03)
        # The steepest slope is that of the start: 2 g ln(10)/L, averaged over the first 28 % of dF.
        assert each.stiffness[0] == pytest.approx(0.84 * 10.0 * math.log(10.0) / 30e-6, rel=0.06)
    assert found.model.value("presliding.stiffness") == pytest.approx(math.log(10.0) * 5.0 / 30e-6, rel=0.08)


def test_one_load_leaves_rig_and_contact_together_and_says_so() -> None:
    found = mapped(strokes(5.0, 100.0, rig=3e5))
    assert found.compliance is not None
    assert not found.compliance.told_apart
    assert "can't be told" in found.compliance.text
    assert "two more loads" in found.status
    assert any("contact and rig in series" in warning for warning in found.warnings)
    assert found.model.nominal["normal_load"] == pytest.approx(100.0)
    steepest = max(each.steepest for each in found.presliding)
    for each in found.presliding:
        assert each.distance[0] > 45e-6  # the rig is in it
        assert each.least(steepest) <= 30e-6 <= each.distance[0]  # and the bounds hold the truth


def test_three_loads_tell_the_rig_from_the_contact() -> None:
    found = mapped(*(strokes(g, 20.0 * g, rig=3e5) for g in (3.0, 6.0, 9.0)))
    assert found.compliance is not None
    assert found.compliance.told_apart
    low, high = found.compliance.interval(found.compliance.compliance)
    assert low <= 1.0 / 3e5 <= high
    assert found.compliance.compliance[0] == pytest.approx(1.0 / 3e5, rel=0.1)
    assert found.compliance.distance[0] == pytest.approx(30e-6, rel=0.1)
    assert found.loads is not None
    assert found.loads.line is not None
    assert found.loads.line.slope[0] == pytest.approx(0.05, rel=0.02)
    assert found.model.value("load_dependence.coefficient") == pytest.approx(1.0, abs=0.03)
    assert found.model.nominal["normal_load"] == pytest.approx(120.0)


def test_a_pressure_that_differs_by_direction_is_taken_off() -> None:
    records = []
    for pressure in (1e5, 3e5, 5e5):
        record = strokes(2.0 + pressure * 1e-5, 0.0)
        v = np.gradient(record.position, STEP)
        acting = pressure + 0.05e5 * np.sign(v)
        records.append(
            replace(record, effort=record.effort + 4e-4 * acting + 1.0, extra={"pressure": acting}, source=f"{pressure:g} Pa")
        )
    found = mapped(*records)
    assert found.loads is not None
    assert found.loads.area[0] == pytest.approx(4e-4, rel=0.005)
    for point, expected in zip(found.loads.points, (3.0, 5.0, 7.0), strict=True):
        assert point.friction[0] == pytest.approx(expected, abs=0.1)  # 2 N more or less with the pressure's part in it
        assert point.bias[0] == pytest.approx(1.0, abs=0.7)


def test_break_away_forces_of_slow_ramps() -> None:
    """A force rises by 2 N/s from 0; at 6 N forward and 5 N backward the joint goes, and the force falls to 4 N."""
    position, force, at = [], [], 0.0
    for k in range(8):
        sign, level = (1.0, 6.0) if k % 2 == 0 else (-1.0, 5.0)
        n = round(level / 2.0 / STEP)
        moved = np.linspace(0.0, 0.05, 500)
        position += [np.full(n, at), at + sign * moved, np.full(300, at + sign * moved[-1])]
        force += [sign * np.linspace(0.0, level, n), np.full(500, sign * 4.0), np.zeros(300)]
        at += sign * float(moved[-1])
    q, u = np.concatenate(position), np.concatenate(force)
    q = q + 1e-6 * np.random.default_rng(5).standard_normal(q.shape[0])
    found = mapped(Record(STEP * np.arange(q.shape[0]), q, u, source="ramps"))
    forward, backward = sorted(found.break_away, key=lambda each: -each.direction)
    assert forward.n == 4
    assert forward.force[0] == pytest.approx(6.0, abs=0.05)
    assert backward.force[0] == pytest.approx(-5.0, abs=0.05)
    assert forward.rest == pytest.approx(3.6, abs=0.3)


def test_stick_slip_has_two_branches() -> None:
    step, top, slip = 2e-4, 0.1, 0.08
    t = step * np.arange(round(slip / step))
    v = top * np.sin(math.pi * t / slip) ** 2
    a = top * math.pi / slip * np.sin(2.0 * math.pi * t / slip)
    f = np.where(a >= 0.0, 5.0 - 8.0 * v, 4.0 - 8.0 * v)
    rest = np.zeros(1000)
    velocity = np.tile(np.concatenate([rest, v]), 12)
    rng = np.random.default_rng(6)
    acceleration = np.tile(np.concatenate([rest, a]), 12) - 0.2 + 0.02 * rng.standard_normal(velocity.shape[0])
    force = np.tile(np.concatenate([np.linspace(4.0, 5.0, 1000), f + 0.7 * a]), 12)
    record = Record(
        step * np.arange(force.shape[0]),
        step * np.cumsum(velocity),
        force,
        extra={"acceleration": acceleration},
        source="slips",
    )
    found = mapped(record, mass=0.7)
    assert len(found.slips) == 1
    branches = found.slips[0]
    assert branches.n == 11  # the last one ends with the recording
    np.testing.assert_allclose(branches.rising, 5.0 - 8.0 * branches.speed, atol=0.08)
    np.testing.assert_allclose(branches.falling, 4.0 - 8.0 * branches.speed, atol=0.08)
    assert branches.loop[0] == pytest.approx(1.0, abs=0.05)
    assert "stick-slip" in static_map_report(found).lower()


def test_sticking_and_slipping_is_no_settled_velocity() -> None:
    v = 0.01 + np.where(np.arange(4000) % 100 < 70, -0.009, 0.021)
    record = Record(STEP * np.arange(4000), STEP * np.cumsum(v), np.sin(np.arange(4000.0)), velocity=v, source="creeping")
    with pytest.raises(IdentificationError, match="sticks and slips"):
        mapped(record)


def test_what_is_no_use_is_named_before_the_fit() -> None:
    whole = ladder(0.0)
    with pytest.raises(IdentificationError, match=r"only 40 samples: too short"):
        mapped(whole.slice(0, 40))
    with pytest.raises(IdentificationError, match=r"forward only.*bias.*other direction"):
        mapped(ladder(0.0, backward=False))
    with pytest.raises(IdentificationError, match="saturated"):
        mapped(replace(whole, effort=np.full(whole.n_samples, 3.0)))
    with pytest.raises(IdentificationError, match="saturated"):
        mapped(ladder(0.0, limit=3.0))
    with pytest.raises(IdentificationError, match="doesn't move"):
        mapped(replace(whole, position=np.zeros(whole.n_samples)))
    with pytest.raises(IdentificationError, match=r"--hold.*chooses the terms"):
        static_map(start_model(["coulomb"], "axis", Units()), [whole], Options(held=("coulomb.force",)))
    with pytest.raises(IdentificationError, match="not three of them"):
        mapped(strokes(3.0, 60.0), strokes(6.0, 120.0))
    t = STEP * np.arange(4000)
    with pytest.raises(IdentificationError, match="no settled part"):
        mapped(Record(t, 0.1 * np.sin(20.0 * t), np.cos(20.0 * t), source="shaken"))


def test_the_table_and_the_page_hold_the_maps() -> None:
    found = mapped(ladder(1.5))
    rows = list(csv.DictReader(io.StringIO(map_table(found))))
    settled = [row for row in rows if row["kind"] == "settled"]
    assert len(settled) == 18
    assert all(float(row["low"]) < float(row["value"]) < float(row["high"]) for row in settled)
    assert {"curve", "rival"} <= {row["kind"] for row in rows}
    page = static_map_report(found)
    assert "chosen: Coulomb + viscous + Stribeck" in page
    assert "rival: " in page


def test_the_command_writes_map_model_and_page(tmp_path: Path) -> None:
    from fric.bagio.write import write_record
    from fric.model_file import read_model

    assert "static-map" in METHODS
    write_record(ladder(1.5), tmp_path / "bag")
    arguments = ["identify", str(tmp_path / "bag"), "--method", "static-map", "--out", str(tmp_path / "found"), "--json"]
    code = "from fric_nodes.cli.main import main; main()"
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=110, check=False)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["parameters"]["coulomb.force"]["value"] == pytest.approx(4.0, abs=0.1)
    assert summary["train"]["position_rmse"] is None
    assert read_model(tmp_path / "found" / "model.yaml").value("stribeck.force") > 1.0
    assert (tmp_path / "found" / "maps.csv").read_text(encoding="utf-8").startswith("kind,quantity,unit")
    assert "Friction over velocity" in (tmp_path / "found" / "report.html").read_text(encoding="utf-8")
