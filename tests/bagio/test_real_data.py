"""Real recordings, published by others, which stay outside this repository: imported, written as bags and read again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fric.bagio import BagError, import_recording, read_record, write_record
from scipy.io import loadmat

pytestmark = pytest.mark.real_data

EMPS: dict[str, Any] = {
    "time": {"from": "t", "unit": "s"},
    "position": {"from": "qm", "unit": "m"},
    "reference": {"from": "qg", "unit": "m"},
    "effort": {"from": "vir", "scale": "gtau", "unit": "N"},
}
PNEUMATIC: dict[str, Any] = {
    "time": {"from": 0, "unit": "ms"},
    "position": {"from": 4, "unit": "mm"},
    "effort": {"from": 6, "unit": "N"},
    "extra": {"pressure": {"from": 5, "unit": "bar"}},
    "skip_rows": 15,
}
SCREW: dict[str, Any] = {
    "time": {"from": 0, "unit": "ms"},
    "velocity": {"from": "Velocity actual value averaged", "scale": -1, "unit": "rpm"},
    "effort": {"from": "Torque actual value averaged", "scale": -0.0984, "unit": "mN m"},
}


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_positioning_axis(data_folder: Path, tmp_path: Path, storage: Any) -> None:
    file = data_folder / "emps" / "DATA_EMPS.mat"
    record = read_record(write_record(import_recording(file, EMPS), tmp_path / "emps", storage=storage))
    raw = loadmat(file)
    assert record.n_samples == 24841
    assert record.duration == pytest.approx(24.84)
    np.testing.assert_array_equal(record.position, raw["qm"][:, 0])
    np.testing.assert_allclose(record.effort, raw["vir"][:, 0] * raw["gtau"].item(), rtol=1e-14)
    np.testing.assert_allclose(record.reference, raw["qg"][:, 0], atol=1e-15)  # type: ignore[arg-type]


def test_robot_torso_from_three_files(data_folder: Path) -> None:
    mapping = {
        "joint": "torso_lift_joint",
        "time": {"from": "t", "unit": "s"},
        "position": {"from": "- torso_lift_joint_position", "unit": "m"},
        "velocity": {"from": "- torso_lift_joint_velocity", "unit": "m/s", "file": "tiago_velocity.csv"},
        "effort": {"from": "- torso_lift_joint_effort", "unit": "A", "file": "tiago_effort.csv"},
    }
    record = import_recording(data_folder / "tiago_torso" / "tiago_position.csv", mapping)
    assert record.n_samples == 8022
    assert record.units.force == "A"
    # Position and velocity come from different files and must belong together.
    slope = np.gradient(record.position, record.time)
    assert np.corrcoef(slope, record.velocity)[0, 1] > 0.9  # type: ignore[arg-type]


def test_pneumatic_cylinders(data_folder: Path) -> None:
    gaps = 0
    for file in sorted((data_folder / "pneumatic_friction").glob("*.csv")):
        record = import_recording(file, PNEUMATIC, repair=True)
        if record.valid is not None:
            gaps += 1
            with pytest.raises(BagError, match=r"gap\(s\) in the samples"):
                import_recording(file, PNEUMATIC)
        assert 50 < record.duration < 110
        assert 0.035 < np.ptp(record.position) < 0.06
    assert gaps == 3  # three of these recordings do have gaps of 0.3 s


def test_screw_drives(data_folder: Path) -> None:
    files = sorted((data_folder / "screw_drives").rglob("steady_state/**/*.csv"))
    assert len(files) > 50
    for file in files:
        record = import_recording(file, SCREW)
        assert record.n_samples == 500
        rpm = float(file.stem.replace("n", "-"))
        assert record.velocity is not None
        assert np.median(record.velocity) * 60 / (2 * np.pi) == pytest.approx(rpm, rel=0.1, abs=1.0)


def test_tribometer(data_folder: Path) -> None:
    mapping = {
        "time": {"from": "Time [s]", "unit": "s"},
        "position": {"from": "Position [mm]", "unit": "mm"},
        "effort": {"from": "Friction [uN]", "scale": -1, "unit": "uN"},
        "normal_load": {"from": "Normal [uN]", "unit": "uN"},
    }
    record = import_recording(data_folder / "tribometer_loops" / "test_data_2.txt", mapping)
    assert record.sample_time == pytest.approx(0.005)
    assert np.median(record.extra["normal_load"]) == pytest.approx(5.0, rel=0.02)
