"""Diagnoses of published recordings from nominal models that leave physics out, judged on parts that nothing is learnt from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fric.bagio.importing import import_recording
from fric.diagnosis import Diagnosis, diagnose
from fric.diagnosis.blocks import in_blocks
from fric.model import Model, build_model, term
from fric.model_file import read_model
from fric.record import Record, Units
from scipy.io import loadmat

pytestmark = [pytest.mark.real_data, pytest.mark.timeout(900)]  # a slow machine takes minutes for the longest
PUBLISHED = Path(__file__).parents[2] / "config" / "published"


def symmetric(mass: float, level: float, viscous: float, bias: float, units: Units | None = None) -> Model:
    """Coulomb friction, viscous friction and an offset: what every axis is assumed to have at first."""
    terms = [term("coulomb", force=level), term("viscous", coefficient=viscous), term("bias", force=bias)]
    return build_model("rigid", {"mass": mass}, terms, units=units or Units())


def error(found: Diagnosis, which: str) -> float:
    """RMS of the force error on what was held back [F]; ``which``: nominal, refit or augmented."""
    off = [getattr(each, f"force_{which}") - each.force_measured for each in found.prediction]
    return float(np.sqrt(np.mean(np.concatenate(off) ** 2)))


def named(found: Diagnosis) -> list[str]:
    return [finding.effect for finding in found.findings if finding.effect != "unknown"]


@pytest.fixture(scope="module")
def emps() -> Diagnosis:
    import os

    signals = loadmat(Path(os.environ["FRIC_DATA"]) / "emps" / "DATA_EMPS.mat")
    effort = (signals["gtau"] * signals["vir"]).ravel()
    record = Record(signals["t"].ravel(), signals["qm"].ravel(), effort, source="EMPS")
    return diagnose(*in_blocks([record], 10), symmetric(95.0, 20.0, 200.0, -3.0))


def test_the_axis_has_direction_dependent_friction_that_survives_on_blocks_held_back(emps: Diagnosis) -> None:
    assert emps.mismatch
    found = next(each for each in emps.findings if each.effect == "asymmetry")
    # As inverse dynamics finds it, too: less viscous friction forward than backward.
    assert -50.0 < found.parameters["asymmetry.coefficient"].value < -25.0


def test_what_helps_on_the_axis_survives_on_blocks_held_back(emps: Diagnosis) -> None:
    """More is missing than its friction, and no effect alone is an explanation."""
    assert emps.findings[0].effect == "unknown"
    helping = {each.effect: each for each in emps.findings[1:]}
    assert len(helping) >= 3
    # Without it, the slow motion around reversals hides that the drive is late.
    assert 0.005 < helping["shear_thinning"].parameters["shear_thinning.velocity"].value < 0.03
    assert error(emps, "augmented") < 0.55 * error(emps, "refit")
    # Between the periods of every grid: found by its line over the position.
    assert helping["ripple"].parameters["ripple.period"].value == pytest.approx(2.5e-3, rel=2e-3)


def test_a_tribometer_bends_before_it_slides(data_folder: Path) -> None:
    whole = import_recording(data_folder / "tribometer_loops" / "test_data_2.txt", PUBLISHED / "tribometer.yaml")
    # Before and after the load is put on and taken off.
    record = whole.slice(*np.searchsorted(whole.time, (8.5, 204.0)))
    found = diagnose(*in_blocks([record], 6), read_model(PUBLISHED / "tribometer_nominal.yaml"))
    first = found.findings[0]
    assert (first.effect, first.law) == ("presliding", "elasto_plastic")
    assert first.confidence > 0.8  # unknown physics looks like pre-sliding more often than like other effects
    # The slope of the loops by eye: from -2.2 to 2.1 N over 0.105 mm.
    assert first.parameters["presliding.stiffness"].value == pytest.approx(4.1e4, rel=0.05)
    assert error(found, "augmented") < 0.15 * error(found, "refit")


@pytest.mark.parametrize("seal", ["O", "X"])
def test_a_seal_rubs_more_under_pressure(data_folder: Path, seal: str) -> None:
    folder = data_folder / "pneumatic_friction"
    files = [folder / f"{seal}-ring257_{bar}bar.csv" for bar in (1, 3, 5, 7)]
    records = [import_recording(file, PUBLISHED / "cylinder.yaml", repair=True) for file in files]
    found = diagnose(*in_blocks(records, 6), read_model(PUBLISHED / "cylinder_nominal.yaml"))
    # More than one thing is missing, and not all of it is known; of what is, the pressure does most.
    assert found.mismatch
    assert named(found)[0] == "load_dependence"
    most = next(each for each in found.findings if each.effect == "load_dependence")
    assert most.share > 0.5
    # By which the level grows near the nominal pressure, in proportion or by a power.
    (rate,) = most.parameters.values()
    assert rate.value > 0.25
    assert error(found, "augmented") < 0.5 * error(found, "refit")


def test_the_lift_of_a_robot_whose_arm_moves_gets_no_sure_cause(data_folder: Path) -> None:
    record = import_recording(data_folder / "tiago_torso" / "tiago_effort.csv", PUBLISHED / "torso.yaml", repair=True)
    found = diagnose(*in_blocks([record], 6), read_model(PUBLISHED / "torso_nominal.yaml"))
    assert found.mismatch
    # Its arm moves meanwhile: what its lift lacks belongs to no law, and hardly stands out from the floor.
    assert all(each.confidence < 0.7 for each in found.findings if each.effect != "unknown")
    assert any(check.check == "end_stop" and check.verdict == "fault" for check in found.checks)


@pytest.mark.parametrize(("number", "expected"), [(1, ["stribeck"]), (2, [])])
def test_a_lead_screw_has_a_stribeck_effect_and_an_anti_backlash_screw_none(
    data_folder: Path, number: int, expected: list[str]
) -> None:
    folder = data_folder / "screw_drives" / f"driveNo{number}" / "steady_state" / "0.096kg"
    runs = [import_recording(file, PUBLISHED / "screw.yaml") for file in sorted(folder.glob("*.csv"))]
    # Every other speed is held back, in both directions.
    runs.sort(key=lambda run: (round(float(np.median(np.abs(np.diff(run.position) / np.diff(run.time)))), 2), run.source))
    learnt, kept_apart = ([run for k, run in enumerate(runs) if (k // 2) % 2 == side] for side in (0, 1))
    found = diagnose(learnt, kept_apart, read_model(PUBLISHED / "screw_nominal.yaml"))
    assert [each.effect for each in found.findings] == expected
    if expected:
        assert found.findings[0].confidence > 0.9
        assert found.validation.noe_augmented < 0.3 * found.validation.noe_refit
    else:
        assert not found.mismatch
