"""Recorded motions: from bags and tables, joined to rest at both ends, and refused where there is nothing to play."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fric.bagio.write import write_record
from fric.errors import InputError
from fric.excitation import EXCITATIONS
from fric.excitation_kind import Trajectory
from fric.record import Record

TIME = np.arange(0.0, 4.0, 0.002)


def _plan(file: Path | str, signal: str = "reference", **changes: float) -> Trajectory:
    kind = EXCITATIONS["recorded"]
    values = {parameter.name: parameter.default for parameter in kind.parameters}
    assert set(changes) <= set(values)
    texts = {"file": str(file), "signal": signal, "joint": ""}
    return kind.part({**values, **changes}, texts, np.random.default_rng(0))  # type: ignore[return-value, dict-item]


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    force = np.where(np.sin(5.0 * TIME) > 0.0, 3.0, -3.0)
    record = Record(TIME, 0.03 * np.sin(2.0 * TIME) + 1e-3, force, reference=0.03 * np.sin(2.0 * TIME))
    write_record(record, tmp_path / "bag")
    return tmp_path / "bag"


def test_a_bag_s_reference_comes_back(bag: Path) -> None:
    motion = _plan(bag, lead_time=0.5)
    t = np.linspace(0.0, TIME[-1], 1234)
    q, v, a = motion.at(0.5 + t)
    assert q == pytest.approx(0.03 * np.sin(2.0 * t), abs=1e-8)
    assert v == pytest.approx(0.06 * np.cos(2.0 * t), abs=1e-5)
    assert a[5:-5] == pytest.approx(-0.12 * np.sin(2.0 * t)[5:-5], abs=2e-3)
    assert motion.duration == pytest.approx(TIME[-1] + 1.0)


def test_position_scale_offset_rate_and_part(bag: Path) -> None:
    motion = _plan(bag, "position", start=1.0, end=3.0, rate=2.0, scale=10.0, offset=-0.01, lead_time=0.25)
    assert motion.duration == pytest.approx(1.0 + 0.5)
    t = np.linspace(0.0, 1.0, 100)
    q, v, _ = motion.at(0.25 + t)
    assert q == pytest.approx(0.3 * np.sin(2.0 * (1.0 + 2.0 * t)), abs=1e-6)
    assert v == pytest.approx(1.2 * np.cos(2.0 * (1.0 + 2.0 * t)), abs=1e-2)


def test_a_force_that_jumps_doesn_t_overshoot(bag: Path) -> None:
    force, _, _ = _plan(bag, "effort", lead_time=0.0).at(np.linspace(0.0, TIME[-1], 100_000))
    assert force.max() == pytest.approx(3.0, abs=1e-12)
    assert force.min() == pytest.approx(-3.0, abs=1e-12)


def test_smoothing_takes_noise_away_and_leaves_the_motion(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    clean = 0.03 * np.sin(2.0 * TIME)
    np.savez(tmp_path / "noisy.npz", time=TIME, position=clean + 1e-5 * random.standard_normal(TIME.size))
    rough, smooth = (_plan(tmp_path / "noisy.npz", "position", smoothing_time=s, lead_time=0.0) for s in (0.0, 0.02))
    t = TIME[200:-200]
    assert np.abs(smooth.at(t).acceleration + 0.12 * np.sin(2.0 * t)).max() < 0.05
    assert np.abs(rough.at(t).acceleration).max() > 5.0
    assert smooth.at(t).position == pytest.approx(0.03 * np.sin(2.0 * t), abs=5e-5)


def test_what_cannot_be_played_is_refused_in_one_line(bag: Path, tmp_path: Path) -> None:
    (tmp_path / "short.csv").write_text("time,reference\n0,0\n1,1\n", encoding="utf-8")
    (tmp_path / "other.csv").write_text("t,x\n0,0\n1,1\n2,1\n3,1\n", encoding="utf-8")
    no_reference = tmp_path / "plain"
    write_record(Record(TIME, np.sin(TIME), np.cos(TIME)), no_reference)
    for file, change, said in (
        ("", {}, "recorded.file"),
        (tmp_path / "short.csv", {}, "at least 4 samples"),
        (tmp_path / "other.csv", {}, "no column 'time'"),
        (tmp_path / "missing.csv", {}, "is not there"),
        (tmp_path / "missing", {}, "missing"),
        (no_reference, {}, "holds no reference.*position, effort"),
        (bag, {"start": 10.0}, "fewer than 4 samples"),
    ):
        with pytest.raises(InputError, match=said) as refusal:
            _plan(file, **change)
        assert "\n" not in str(refusal.value)
