"""Static maps of published recordings: screw drives, a tribometer, pneumatic cylinders."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from fric.bagio.importing import import_recording
from fric.identification.methods.static_map import static_map
from fric.identification.result import Options
from fric.identification.start import start_model
from fric.identification.static_maps.result import StaticMap
from fric.record import Record

pytestmark = pytest.mark.real_data

SCREW = {
    "joint": "screw",
    "time": {"from": 0, "unit": "ms"},
    "velocity": {"from": "Velocity actual value averaged", "unit": "rpm", "scale": -1},
    "effort": {"from": "Torque actual value averaged", "unit": "mNm", "scale": -0.0984},
}
CYLINDER = {
    "joint": "cylinder",
    "header": False,
    "skip_rows": 15,
    "time": {"from": 0, "unit": "ms"},
    "position": {"from": 4, "unit": "mm"},
    "effort": {"from": 6, "unit": "N"},
    "extra": {"pressure": {"from": 5, "unit": "Pa", "scale": 1e5}},
}
TRIBOMETER = {
    "joint": "tribometer",
    "time": {"from": "Time [s]", "unit": "s"},
    "position": {"from": "Position [mm]", "unit": "mm"},
    "effort": {"from": "Friction [uN]", "unit": "uN", "scale": -1},
    "normal_load": {"from": "Normal [uN]", "unit": "uN"},
}


def mapped(records: list[Record]) -> StaticMap:
    return static_map(start_model(["coulomb"], records[0].joint, records[0].units), records, Options())


def drive(folder: Path, number: int) -> StaticMap:
    files = sorted((folder / "screw_drives" / f"driveNo{number}" / "steady_state" / "0.096kg").glob("*.csv"))
    return mapped([import_recording(file, SCREW) for file in files])


def test_the_lead_screw_has_a_stribeck_effect(data_folder: Path) -> None:
    found = drive(data_folder, 1)
    assert found.choice is not None
    assert found.choice.best.candidate.stribeck
    assert found.choice.p_value < 0.01
    # Read from the recordings: near 28 % and 35 % of 9.84 mN m at 10 rpm, 26 % and 33 % at 50 rpm.
    slow, fast = found.choice.best.force(np.array([10.0, 50.0]) * math.pi / 30.0)
    assert 0.00015 < slow - fast < 0.0004
    # At 2 rpm the drive sticks and slips, which has no mean force at a velocity.
    assert len(found.means) == 30
    assert sum("sticks and slips" in note for note in found.notes) >= 2


def test_the_anti_backlash_screw_has_none(data_folder: Path) -> None:
    found = drive(data_folder, 2)
    assert found.choice is not None
    assert not found.choice.best.candidate.stribeck
    assert found.choice.p_value > 0.05
    assert found.model.value("coulomb.force") == pytest.approx(0.0048, rel=0.05)


def test_the_tribometer_cannot_tell_its_rig_from_the_contact(data_folder: Path) -> None:
    found = mapped([import_recording(data_folder / "tribometer_loops" / "test_data_2.txt", TRIBOMETER)])
    assert found.model.value("coulomb.force") == pytest.approx(2.33, abs=0.05)
    assert [each.n for each in found.presliding] == pytest.approx([49, 45], abs=5)
    for each in found.presliding:
        assert 0.09e-3 < each.distance[0] < 0.12e-3
        low, high = each.interval(each.distance)
        assert 0.0 < high - low < 0.01e-3
    assert found.compliance is not None
    assert not found.compliance.told_apart
    assert "two more loads" in found.status


@pytest.mark.parametrize("seal", ["O", "X"])
def test_seal_friction_grows_with_pressure(data_folder: Path, seal: str) -> None:
    folder = data_folder / "pneumatic_friction"
    found = mapped([import_recording(folder / f"{seal}-ring257_{bar}bar.csv", CYLINDER, repair=True) for bar in (1, 3, 5, 7)])
    assert found.loads is not None
    assert found.loads.line is not None
    # The area comes from the forces alone; the bore is 25.7 mm.
    assert found.loads.area[0] == pytest.approx(math.pi / 4.0 * 0.0257**2, rel=0.01)
    friction = [point.friction[0] for point in found.loads.points]
    assert friction == sorted(friction)
    assert 4.0 < friction[0] < 5.5
    assert found.loads.line.interval(found.loads.line.slope, 0.9)[0] > 0.0
    for each in found.presliding:
        assert 0.1e-3 < each.distance[0] < 0.7e-3
        assert each.coarse
    assert found.compliance is not None
    # Neither shows a rig; the distances, ten samples a reversal, scatter by more than their errors.
    assert found.compliance.interval(found.compliance.compliance)[0] < 0.0
    assert found.compliance.interval(found.compliance.compliance)[1] < 1.5e-4
    low, high = found.compliance.interval(found.compliance.distance)
    assert low < 0.4e-3 < high < 1e-3
    if found.compliance.told_apart:
        assert low > 0.0
        assert "free of it" in found.compliance.text
    else:  # four loads, but ten samples a reversal
        assert "can't be told apart" in found.compliance.text
        assert "at least" in found.compliance.text
    assert any("speed forward" in warning for warning in found.warnings)
