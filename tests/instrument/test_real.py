"""Published recordings: nothing is called a fault that is none, and what is one is found."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fric.bagio.importing import import_recording
from fric.instrument import Finding, faults, inspect
from fric.record import Record
from fric.signals.stamps import grid_of, jitter_of
from scipy.io import loadmat

pytestmark = pytest.mark.real_data

MAPS: dict[str, dict[str, Any]] = {
    "cylinder": {
        "joint": "cylinder",
        "header": False,
        "skip_rows": 15,
        "time": {"from": 0, "unit": "ms"},
        "position": {"from": 4, "unit": "mm"},
        "effort": {"from": 6, "unit": "N"},
    },
    "tribometer": {
        "joint": "tribometer",
        "time": {"from": "Time [s]", "unit": "s"},
        "position": {"from": "Position [mm]", "unit": "mm"},
        "effort": {"from": "Friction [uN]", "unit": "uN", "scale": -1},
    },
    "screw": {
        "joint": "screw",
        "time": {"from": 0, "unit": "ms"},
        "velocity": {"from": "Velocity actual value averaged", "unit": "rpm", "scale": -1},
        "effort": {"from": "Torque actual value averaged", "unit": "mNm", "scale": -0.0984},
    },
}


def verdicts(findings: tuple[Finding, ...]) -> dict[str, str]:
    return {finding.check: finding.verdict for finding in findings}


def test_emps_is_clean(data_folder: Path) -> None:
    signals = loadmat(data_folder / "emps" / "DATA_EMPS.mat")
    record = Record(signals["t"].ravel(), signals["qm"].ravel(), (signals["gtau"] * signals["vir"]).ravel())
    found = inspect([record])
    assert faults(found) == ()
    assert verdicts(found)["delay"] == "ok"
    turned = Record(record.time, record.position, -record.effort)
    assert "effort_sign" in {finding.check for finding in faults(inspect([turned]))}


def test_cylinders(data_folder: Path) -> None:
    for file in sorted((data_folder / "pneumatic_friction").glob("*.csv")):
        record = import_recording(file, MAPS["cylinder"], repair=True)
        # The rate wanders by a tenth, and the piston, which is pushed at one speed, follows the stamps.
        assert jitter_of(record, grid_of(record.time)).follows, file.name
        found = inspect([record])
        assert faults(found) == (), file.name
        # Its force is that of the piston: friction and what moves the load.
        assert verdicts(found)["offset"] == "warning"


def test_tribometer(data_folder: Path) -> None:
    file = data_folder / "tribometer_loops" / "test_data_2.txt"
    record = import_recording(file, MAPS["tribometer"], repair=True)
    assert faults(inspect([record])) == ()
    against = import_recording(file, {**MAPS["tribometer"], "effort": {"from": "Friction [uN]", "unit": "uN"}}, repair=True)
    assert {finding.check for finding in faults(inspect([against]))} == {"effort_sign"}


@pytest.mark.parametrize("number", [1, 2])
def test_screw_drives(data_folder: Path, number: int) -> None:
    files = sorted((data_folder / "screw_drives" / f"driveNo{number}" / "steady_state" / "0.096kg").glob("*.csv"))
    assert faults(inspect([import_recording(file, MAPS["screw"], repair=True) for file in files])) == ()


def test_tiago_stands_at_its_lower_end_stop(data_folder: Path) -> None:
    tables = [
        np.loadtxt(data_folder / "tiago_torso" / f"tiago_{name}.csv", delimiter=",", skiprows=1, usecols=(0, 1))
        for name in ("position", "effort")
    ]
    record = Record(tables[0][:, 0] - tables[0][0, 0], tables[0][:, 1], tables[1][:, 1])
    found = faults(inspect([record]))
    assert [finding.check for finding in found] == ["end_stop"]
    assert found[0].time[0][0] == pytest.approx(7.9, abs=0.1)
