"""Recordings of a rig that measures the force at the contact, and one recording in blocks."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fric.bagio import write_record
from fric.diagnosis import DiagnosisError, diagnose
from fric.diagnosis.blocks import in_blocks
from fric.diagnosis.candidates import scales_of
from fric.diagnosis.other_laws import laws_beside
from fric.diagnosis.track import Track
from fric.errors import InputError
from fric.model import Model, build_model, term
from fric.model_file import read_model, write_model
from fric.record import Record, RecordError
from fric_nodes.cli.main import build_app
from typer.testing import CliRunner

LEVEL, STIFFNESS, VISCOUS, OFFSET = 2.4, 4e4, 80.0, 0.1
STEP = 1e-7  # of the encoder [m]


def strokes(duration: float, elastic: bool, seed: int) -> Record:
    """Slow strokes with rests, led by a rig, on a spring in series with dry friction, or on dry friction alone.

    The force of spring and friction is reckoned sample by sample in closed form: it grows with the way up to the level.
    """
    random = np.random.default_rng(seed)
    time = np.arange(0.0, duration, 0.005)
    # Strokes and speeds are drawn, so that no two are alike.
    corners, places = [0.0], [0.0]
    side = 1.0
    while corners[-1] < duration:
        place = side * random.uniform(0.8e-4, 2.4e-4)
        corners += [corners[-1] + abs(place - places[-1]) / random.uniform(1e-4, 4e-4)]
        places += [place]
        corners += [corners[-1] + random.uniform(0.2, 0.8)]
        places += [place]
        side = -side
    q = np.interp(time, corners, places)
    change = np.diff(q, prepend=q[0])
    friction = np.zeros(time.shape[0])
    for k in range(1, time.shape[0]):
        if elastic:
            friction[k] = np.clip(friction[k - 1] + STIFFNESS * change[k], -LEVEL, LEVEL)
        else:  # at rest it keeps what it had: the rig lets go of nothing
            friction[k] = LEVEL * np.sign(change[k]) if change[k] != 0.0 else friction[k - 1]
    force = friction + VISCOUS * change / 0.005 + OFFSET + 0.005 * random.standard_normal(time.shape[0])
    return Record(time, np.round(q / STEP) * STEP, force, source=f"strokes {seed}")


def nominal(plant: str = "contact", **values: float) -> Model:
    terms = [term("coulomb", force=2.0), term("viscous", coefficient=10.0), term("bias", force=0.0)]
    return build_model(plant, values, terms)


def test_what_bends_before_it_slides_is_named_with_its_law() -> None:
    found = diagnose(*in_blocks([strokes(120.0, True, 1)], 6), nominal())
    assert [each.effect for each in found.findings] == ["presliding"]
    first = found.findings[0]
    # The corner of a spring in series is sharp; no law of a gradual fall to sliding leaves as little.
    assert first.law == "elasto_plastic"
    assert first.confidence > 0.9
    assert first.parameters["presliding.stiffness"].value == pytest.approx(STIFFNESS, rel=0.03)
    assert found.model.value("coulomb.force") == pytest.approx(LEVEL, rel=0.02)
    assert found.model.value("bias.force") == pytest.approx(OFFSET, abs=0.02)
    assert found.validation.noe_augmented < 0.03 * found.validation.noe_refit
    # A rig tells nothing of what lies before the contact.
    why = {each.effect: each.why for each in found.rejected}
    assert "no room" in why["input_deadzone"]
    assert "no room" in why["backlash"]


def test_dry_friction_at_rest_and_in_motion_lacks_nothing() -> None:
    found = diagnose([strokes(60.0, False, 2)], [strokes(60.0, False, 3)], nominal())
    assert not found.mismatch, found.sentence
    assert found.model.value("coulomb.force") == pytest.approx(LEVEL, rel=0.01)
    assert found.model.value("viscous.coefficient") == pytest.approx(VISCOUS, rel=0.15)


@pytest.mark.long
def test_a_force_without_inertia_is_refused_with_the_plant_that_it_asks_for() -> None:
    with pytest.raises(DiagnosisError, match=r"strokes 4: the force doesn't hold the inertia .* plant 'contact'"):
        diagnose([strokes(30.0, True, 4)], [strokes(30.0, True, 5)], nominal("rigid", mass=5.0))


def test_blocks_share_no_sample_and_keep_the_time() -> None:
    whole = replace(strokes(20.0, True, 6), valid=np.arange(4000) % 1000 != 7)
    (learnt,), (apart,) = in_blocks([whole], 4)
    assert not np.any(learnt.mask & apart.mask)
    assert np.array_equal(learnt.mask | apart.mask, whole.mask)
    assert np.array_equal(learnt.time, whole.time)
    edges = np.flatnonzero(np.diff(learnt.mask.astype(int)))
    assert {999, 1999, 2999} <= set(edges.tolist())


@pytest.mark.parametrize(("n_blocks", "good"), [(1, 2), (21, 20), (0, 2)])
def test_blocks_that_hold_too_little_are_refused(n_blocks: int, good: int) -> None:
    with pytest.raises(RecordError, match=f"ask for {good} blocks"):
        in_blocks([strokes(20.0, True, 6)], n_blocks)


def test_blocks_in_step_with_the_motion_are_refused() -> None:
    time = np.arange(8000) * 0.005
    there_and_back = Record(time, 0.1 * np.abs((time / 10.0 + 1.0) % 2.0 - 1.0), np.sin(time), source="to and fro")
    with pytest.raises(
        RecordError, match=r"to and fro: in 4 blocks what is to learn from hardly moves backward \(0 % of its way"
    ):
        in_blocks([there_and_back], 4)
    in_blocks([there_and_back], 7)


def test_other_laws_take_over_what_means_the_same() -> None:
    scales = scales_of(Track.of([strokes(20.0, True, 6)], 140.0, build_model("rigid", {"mass": 2.0}, [])))
    laws = list(laws_beside(term("presliding", "lugre", stiffness=3.0, damping=0.5), scales))
    found = {each.effect.law: each for each in laws}
    assert set(found) == {"dahl", "elasto_plastic", "gms"}
    assert found["elasto_plastic"].values == (3.0, 0.5, 0.7)
    assert found["dahl"].values == (3.0, 1.0)
    # A shape is tried with all values that machines have.
    assert [each.by_name["exponent"] for each in laws if each.effect.law == "gms"] == [2.0, 4.0]
    stribeck = term("stribeck", "exponential", force=2.0, velocity=0.1, exponent=1.0)
    offered = [(each.effect.law, each.by_name.get("exponent")) for each in laws_beside(stribeck, scales)]
    forms = [("exponential", 2.0), ("directional", 2.0), ("directional", 1.0)]
    assert offered == [*forms, ("hess_soom", None), ("static", None)]
    # Laws that are candidates of their own aren't tried again, and a form of one law takes no other's place.
    assert not list(laws_beside(term("position_dependence", "periodic", cosine=1.0, sine=0.0, period=1.0), scales))
    (peak,) = laws_beside(term("position_dependence", "local", amplitude=0.5, position=0.1, width=0.02), scales)
    assert peak.values == (0.5, 0.1, 0.02, 1.0)


@pytest.mark.long
def test_the_command_holds_blocks_of_one_recording_back(tmp_path: Path) -> None:
    bag = write_record(strokes(60.0, True, 7), tmp_path / "bag")
    write_model(nominal(), tmp_path / "nominal.yaml")
    command = ["diagnose", str(bag), "--model", str(tmp_path / "nominal.yaml"), "--out", str(tmp_path / "out"), "--json"]
    done = CliRunner().invoke(build_app(), [*command, "--blocks", "4"])
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert report["findings"][0]["effect"] == "presliding"
    assert read_model(tmp_path / "out" / "model.yaml").plant.id == "contact"
    spans = [span for finding in report["findings"] for span in finding["where"]["time"]]
    assert all(15.0 <= first <= last <= 30.1 or 45.0 <= first <= last <= 60.1 for first, last in spans)
    for wrong in ([], ["--blocks", "4", "--validate", str(bag)]):
        refused = CliRunner().invoke(build_app(), [*command, *wrong])
        assert isinstance(refused.exception, InputError)
        assert "--blocks" in str(refused.exception) or "both fitted and validated" in str(refused.exception)
