"""The diagnosis on recordings of an integrator that shares nothing with it, and what it refuses."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace

import fric
import numpy as np
import pytest
from fric.diagnosis import Diagnosis, DiagnosisError, diagnose
from fric.diagnosis.fitting import State, refit
from fric.diagnosis.growth import Growth, without_nothings
from fric.diagnosis.held_back import only_there
from fric.diagnosis.prove import draw
from fric.diagnosis.prove.cases import make, plan
from fric.diagnosis.settle import Step
from fric.diagnosis.track import Track
from fric.model import build_model, term
from fric.model_file import model_from_text, model_to_text
from fric.report.diagnosis import diagnosis_report

pytestmark = pytest.mark.timeout(600)  # the first of them compiles what all share


@pytest.fixture(scope="module")
def presliding() -> tuple[object, Diagnosis]:
    case = draw(0, "moderate", "presliding")
    return case, diagnose(case.train, case.validation, case.nominal)


def test_nothing_is_found_where_nothing_is_missing() -> None:
    case = draw(3, "nothing")
    found = diagnose(case.train, case.validation, case.nominal)
    assert not found.mismatch
    assert found.findings == ()
    assert "Nothing is missing" in found.sentence
    # What it leaves is what its own twin says that the instruments leave.
    assert found.validation.noe_refit == pytest.approx(found.validation.noise_floor, rel=0.3)


@pytest.mark.parametrize("effect", ["asymmetry", "accel_hysteresis"])
def test_a_concealed_effect_is_named(effect: str) -> None:
    case = draw(2, "moderate", effect)
    found = diagnose(case.train, case.validation, case.nominal)
    assert [each.effect for each in found.findings][:1] == [effect]
    assert found.findings[0].confidence > 0.5
    v = found.validation
    assert v.noe_augmented - v.noise_floor < 0.1 * (v.noe_refit - v.noise_floor)


@pytest.mark.parametrize(
    ("effect", "seed"),
    [
        # Friction of the refitted model has taken the place of a dead zone three times as large: at first order it is no help.
        ("input_deadzone", 1686316233),
        # At 2 kHz, so that an excerpt is looked at; and it leaves its own trace only where a rest is known from its beginning.
        pytest.param("dwell_time", 2122819194, marks=pytest.mark.long),
        # Hard stops explain four fifths, and what gives would be told beside them. Rounding decides in one of six runs or so.
        pytest.param("impact_backlash", 1221886810, marks=pytest.mark.long),
        # Fits end at half the gap.
        pytest.param("backlash", 1602495805, marks=pytest.mark.long),
    ],
)
def test_what_other_effects_stand_in_for_is_named_alone(effect: str, seed: int) -> None:
    case = draw(seed, "moderate", effect)
    found = diagnose(case.train, case.validation, case.nominal)
    assert [finding.effect for finding in found.findings] == [effect]
    v = found.validation
    assert v.noe_augmented - v.noise_floor < 0.1 * (v.noe_refit - v.noise_floor)


@pytest.mark.long
def test_where_the_first_effects_leave_something_others_are_begun_with() -> None:
    # Saturation and a hysteresis explain nine tenths, and so does saturation alone: the third beginning is the right one.
    case = draw(1423582479, "pair", ("quadratic_drag", "asymmetry"), "form")
    found = diagnose(case.train, case.validation, case.nominal)
    assert {each.effect for each in found.findings} == {"quadratic_drag", "asymmetry"}
    assert found.validation.noe_augmented < 0.1 * found.validation.noe_refit


@pytest.mark.long
def test_beside_an_actuator_far_beyond_its_limit_the_other_effect_is_found() -> None:
    # The command goes to five times the limit: what the drag takes is a thousandth of what the limit does.
    case = draw(521420051, "pair", ("quadratic_drag", "saturation"))
    found = diagnose(case.train, case.validation, case.nominal)
    assert [each.effect for each in found.findings] == ["saturation", "quadratic_drag"]
    limit = found.findings[0].parameters["saturation.limit"]
    assert limit.value == pytest.approx(5.94243, rel=0.02)
    assert max(float(np.max(np.abs(record.effort))) for record in case.train) > 4.0 * limit.value


@pytest.mark.long
def test_a_shaft_that_hardens_is_no_gap_with_soft_stops() -> None:
    case = draw(668952436, "moderate", "compliance", "form")
    found = diagnose(case.train, case.validation, case.nominal)
    assert [each.effect for each in found.findings] == ["compliance"]
    assert found.findings[0].law == "hardening"
    assert found.findings[0].parameters["compliance.stiffness"].value == pytest.approx(18540.8, rel=0.1)
    assert found.findings[0].parameters["compliance.hardening"].value == pytest.approx(1.0359e10, rel=0.1)


@pytest.mark.parametrize(
    ("effect", "law", "seed", "name", "true"),
    [
        # A lag of the first order leaves a hundredth, which a delay beside it would nearly explain; two lags of 3.5 ms.
        ("actuator_lag", "second_order", 1194745386, "actuator_lag.time", 3.4765e-3),
        # A square leaves a hundredth, which a Stribeck effect beside it would.
        ("quadratic_drag", "power", 843366905, "quadratic_drag.exponent", 1.75),
    ],
)
@pytest.mark.long
def test_what_a_usual_law_leaves_is_no_other_effect(effect: str, law: str, seed: int, name: str, true: float) -> None:
    case = draw(seed, "moderate", effect, "form")
    found = diagnose(case.train, case.validation, case.nominal)
    assert [(each.effect, each.law) for each in found.findings] == [(effect, law)]
    assert found.findings[0].parameters[name].value == pytest.approx(true, rel=0.03)


@pytest.mark.long
def test_where_twins_stick_and_slip_far_apart_what_is_left_says_which_rival_is_right() -> None:
    # Twins leave five times as much as the hysteresis does, the Stribeck effect a third of that.
    case = draw(326562437, "pair", ("stribeck", "load_dependence"))
    found = diagnose(case.train, case.validation, case.nominal)
    assert {each.effect for each in found.findings} == {"stribeck", "load_dependence"}


@pytest.mark.long
def test_what_a_slow_observer_does_not_see_is_found_by_a_faster_one() -> None:
    # Beside a ripple, which a slow observer sees best, it takes what dwell time leaves for a knee of the actuator.
    case = draw(118080465, "pair", ("dwell_time", "ripple"))
    found = diagnose(case.train, case.validation, case.nominal)
    assert {each.effect for each in found.findings} == {"dwell_time", "ripple"}
    assert found.unexplained.share < 0.02


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "seed", "name", "true"),
    [
        # A hysteresis explains nearly as much; the fit of a Stribeck curve half as wide and twice as high goes no further.
        ("stribeck", 804727988, "stribeck.velocity", 3.116e-3),
        # Stops without play between them were fitted, and no spring beside them.
        ("compliance", 1470810947, "compliance.stiffness", 10576.0),
    ],
)
def test_what_comes_near_is_told_from_what_is_missing(effect: str, seed: int, name: str, true: float) -> None:
    case = draw(seed, "moderate", effect)
    found = diagnose(case.train, case.validation, case.nominal)
    assert [finding.effect for finding in found.findings] == [effect]
    assert found.findings[0].parameters[name].value == pytest.approx(true, rel=0.1)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1919695273, 798229259])
def test_one_simple_cause_is_believed_rather_than_effects_that_share_its_work(seed: int) -> None:
    # The floor shakes at one frequency: a delay and an appendage, with or without bristles, do as the motion does there.
    case = draw(seed, "unknown", "floor_vibration")
    found = diagnose(case.train, case.validation, case.nominal)
    assert found.findings[0].effect == "unknown"
    assert found.findings[0].component == "load"


@pytest.mark.long
def test_what_explains_all_on_an_axis_of_another_mass_is_no_explanation() -> None:
    # Friction that falls while slowing down explains it to a thousandth, on an axis of a quarter of the mass.
    case = draw(2114983913, "pair", ("viscous", "saturation"), "form")
    found = diagnose(case.train, case.validation, case.nominal)
    assert found.findings[0].effect == "unknown"
    assert all(each.confidence < 0.2 for each in found.findings[1:])


@pytest.mark.long
def test_what_an_axis_of_half_the_mass_would_explain_too_is_found_by_its_own_law() -> None:
    # An appendage and friction that falls while slowing down together come as near, with less than half the mass.
    case = draw(1816859273, "pair", ("temperature", "stiffness"), "form")
    found = diagnose(case.train, case.validation, case.nominal)
    assert {each.effect: each.law for each in found.findings} == {"temperature": "quadratic", "stiffness": ""}


def test_concealed_bristles_are_named_and_located(presliding: tuple[object, Diagnosis]) -> None:
    _, found = presliding
    assert [each.effect for each in found.findings] == ["presliding"]
    assert found.findings[0].component == "guideway friction"
    where = found.findings[0].where
    assert where.quantity in {"speed", "time since reversal", "distance since reversal"}
    assert where.range[0] < 0.1 * where.range[1]  # slow, or soon after a reversal
    assert where.time_share < 0.4
    assert where.share >= 0.8
    assert found.validation.noe_augmented < 0.1 * found.validation.noe_refit
    assert found.unexplained.share < 0.05


@pytest.mark.long
def test_physics_that_no_effect_describes_is_said_to_be_unknown() -> None:
    case = draw(0, "unknown", "payload_step")
    found = diagnose(case.train, case.validation, case.nominal)
    assert found.mismatch
    assert found.findings[0].effect == "unknown"
    # A mass that changes with time has the signature of a load, whatever the reason.
    assert found.findings[0].component == "load"


@pytest.mark.long
def test_three_unsure_effects_that_leave_something_are_no_explanation() -> None:
    # A floor that shakes was told as a lag, bristles and a mode, 55, 46 and 43 % sure, of which 7 % was left.
    case = draw(621410738, "unknown", "floor_vibration", "double-rate")
    found = diagnose(case.train, case.validation, case.nominal)
    assert found.findings[0].effect == "unknown"
    assert found.findings[0].confidence > 0.5
    assert len(found.findings) > 2


@pytest.mark.long
def test_beside_something_faint_and_unknown_nothing_is_told_as_likely() -> None:
    # Nothing is missing; dwell time was told 65 % sure.
    case = draw(1627897166, "nothing")
    found = diagnose(case.train, case.validation, case.nominal)
    assert all(each.confidence < 0.5 for each in found.findings)


@pytest.mark.long
def test_what_only_the_recording_held_back_shows_is_unknown_and_located() -> None:
    # A cable that pulls from a place on to which the other recordings never went.
    case = draw(509008653, "unknown", "cable_chain")
    found = diagnose(case.train, case.validation, case.nominal)
    assert found.mismatch
    assert [each.effect for each in found.findings] == ["unknown"]
    (missing,) = found.findings
    assert missing.component == "load"
    assert "only the recording held back" in found.sentence
    assert "learn from the recording held back" in found.next_experiment
    assert missing.where.quantity == "position"
    physics = case.key["physics"]
    assert missing.where.range[0] == pytest.approx(physics["cable_position"] + physics["cable_play"], rel=0.3)
    went = max(float(np.max(record.position)) for record in case.train)
    assert max(float(np.max(record.position)) for record in case.validation) > went + 0.01
    assert "e+" not in " ".join(each.why for each in found.rejected)
    # What was learnt stays what it was: nothing is fitted to what is held back.
    assert found.model == found.refit
    # The other way round it is learnt from.
    other = diagnose(case.validation, case.train, case.nominal)
    assert [(each.effect, each.component) for each in other.findings] == [("unknown", "load")]
    assert "only the recording held back" not in other.sentence


def test_a_value_that_the_recordings_learnt_from_hardly_told_is_no_missing_physics() -> None:
    case = draw(3, "nothing")
    off = case.nominal.with_value("coulomb.force", 1.5 * case.nominal.values[case.nominal.names.index("coulomb.force")])
    held = Track.of(case.validation, 140.0, off)
    lacks = held.residual(off)
    told = held.residual(refit(held, off).fit.model)
    assert float(lacks @ lacks) > 5.0 * float(told @ told)
    assert only_there(case.train, case.validation, held, off) is None


def test_the_report_is_plain_data_and_the_grown_model_reads_back(presliding: tuple[object, Diagnosis]) -> None:
    _, found = presliding
    report = json.loads(json.dumps(found.report(), allow_nan=False))
    assert report["format"] == "fric-report/1"
    for key in ("where", "checks", "nominal", "findings", "rejected", "validation", "unexplained", "next_experiment"):
        assert key in report
    # One effect explains it all: where the whole mismatch shows is where that effect acts.
    assert report["where"]["time"]
    assert report["where"]["time"] == report["findings"][0]["where"]["time"]
    assert {each["effect"] for each in report["rejected"]}.isdisjoint({each["effect"] for each in report["findings"]})
    scored = report["validation"]
    # The one is a force, the other its square over the spread of the force.
    less = scored["force_error_augmented"] / scored["force_error_refit"]
    assert less == pytest.approx(math.sqrt(scored["noe_augmented"] / scored["noe_refit"]), rel=1e-3)
    again = model_from_text(model_to_text(found.model), "grown")
    assert again.names == found.model.names
    np.testing.assert_allclose(again.values, found.model.values, rtol=1e-12)


def test_predictions_are_of_the_validation_recording(presliding: tuple[object, Diagnosis]) -> None:
    case, found = presliding
    record = case.validation[0]  # type: ignore[attr-defined]
    p = found.prediction[0]
    measured = np.interp(p.time - 0.5 * record.sample_time, record.time, record.effort)
    assert np.corrcoef(p.force_measured, measured)[0, 1] > 0.97
    error = p.force_measured - p.force_refit
    spread = p.force_measured - np.mean(p.force_measured)
    assert 100.0 * error @ error / (spread @ spread) == pytest.approx(found.validation.noe_refit, rel=0.01)


def test_a_prediction_repeats_nothing_of_the_recorded_force() -> None:
    """Noise of the recorded force, as much as two thirds of its friction, is nowhere in what the model predicts."""
    predictions = sys.modules["fric.diagnosis.judging"].predictions_of
    axis = build_model("rigid", {"mass": 5.0}, [term("coulomb", force=8.0), term("viscous", coefficient=30.0)])
    t = 2e-3 * np.arange(4000)
    moved = fric.simulate(axis, 30.0 * np.sin(2.0 * np.pi * (0.3 + 0.06 * t) * t), period=2e-3)
    noise = 5.0 * np.random.default_rng(3).standard_normal(t.shape[0])
    clean, noisy = (
        predictions([record], held, {name: held.residual(axis) for name in ("nominal", "refit", "augmented")})[0]
        for record in (moved, replace(moved, effort=moved.effort + noise))
        for held in (Track.of([record], 140.0, axis),)
    )
    added = noisy.force_measured - clean.force_measured
    assert np.std(added) > 0.5
    # Nearly: beside a damping of 6 rad/s an observer of 140 rad/s sees a force a little later than beside a mass alone.
    assert np.median(np.abs(noisy.force_augmented - clean.force_augmented)) < 0.2 * np.median(np.abs(added))


def test_the_page_is_whole(presliding: tuple[object, Diagnosis]) -> None:
    case, found = presliding
    page = diagnosis_report(found, case.train, case.validation)  # type: ignore[attr-defined]
    assert found.sentence.split(":", maxsplit=1)[0] in page
    for heading in ("The difference", "How the model grew", "Effects that are not there", "Grown model"):
        assert heading in page


def test_the_recording_that_was_learnt_from_is_no_validation() -> None:
    case = draw(3, "nothing")
    with pytest.raises(DiagnosisError, match="learnt from, too"):
        diagnose(case.train, case.train, case.nominal)


def test_rest_and_missing_force_are_refused() -> None:
    case = draw(3, "nothing")
    record = case.train[0]
    still = replace(record, position=np.zeros(record.n_samples))
    with pytest.raises(DiagnosisError, match="nothing but rest"):
        diagnose([still], case.validation, case.nominal)
    silent = replace(record, effort=np.zeros(record.n_samples))
    with pytest.raises(DiagnosisError, match="no force signal"):
        diagnose([silent], case.validation, case.nominal)


@pytest.mark.long
def test_a_model_of_another_plant_is_refused_unless_it_holds_the_right_one() -> None:
    case = draw(3, "nothing")
    terms = [term("coulomb", force=1.0), term("viscous", coefficient=1.0)]
    cart = build_model("cart_pendulum", {"cart_mass": 1.0, "pole_mass": 1.0, "length": 0.5, "pole_inertia": 0.08}, terms)
    with pytest.raises(DiagnosisError, match=r"is of no 'cart_pendulum'.*same terms 0.00.*plant 'rigid'"):
        diagnose(case.train, case.validation, cart)
    # A pendulum whose weight comes out at nothing is a mass.
    found = diagnose(case.train, case.validation, build_model("pendulum", {"inertia": 1.0, "gravity": 10.0}, terms))
    assert not found.mismatch
    assert found.model.value("inertia") == pytest.approx(case.key["physics"]["mass"], rel=0.02)


def test_a_term_that_comes_out_at_nothing_is_not_told_of(presliding: tuple[object, Diagnosis]) -> None:
    _, found = presliding
    nothing = replace(found.model, terms=(*found.model.terms, term("bias", force=0.0)), standard_errors={})
    steps = tuple(Step(name, 1.0, 0.1, 0.01, 0.9, (), ()) for name in ("bias", "presliding"))
    track = Track.of([draw(0, "moderate", "presliding").train[0]], 100.0, nothing)
    state = State(track.fit(nothing, ("bias.force",), 1), 0.1, lambda: (0.01, ()))
    growth = Growth(track, state, state, steps, (), 1.0)
    left, end = without_nothings(growth, nothing)
    assert [step.term for step in left.steps] == ["presliding"]
    assert "bias" not in {held.effect.id for held in end.terms}
    assert left.rejected[0][0] == "bias"
    assert "at nothing" in left.rejected[0][1]


@pytest.mark.parametrize("where", ["train", "validation", "both"])
def test_a_wrong_sign_is_taken_out_of_the_recordings_that_have_it(where: str) -> None:
    case = draw(3, "nothing")
    turned = [replace(each, effort=-each.effort) for each in (*case.train, *case.validation)]
    train = turned[:1] if where != "validation" else list(case.train)
    validation = turned[1:] if where != "train" else list(case.validation)
    found = diagnose(train, validation, case.nominal)
    assert not found.mismatch
    assert found.model.value("mass") == pytest.approx(case.key["physics"]["mass"], rel=0.02)
    assert found.validation.noe_refit < 0.2


def test_a_recording_of_rest_is_told_from_motion_beside_its_noise() -> None:
    case = draw(3, "nothing")
    record = case.train[0]
    random = np.random.default_rng(1)
    noisy = 1e-7 * random.standard_normal(record.n_samples)
    flickering = np.where(random.random(record.n_samples) > 0.9, 1e-6, 0.0)
    for position in (noisy, flickering):
        still = replace(record, position=position, source="still.mcap")
        with pytest.raises(DiagnosisError, match=r"still.mcap.*nothing but rest"):
            diagnose([still], case.validation, case.nominal)
        # Beside another recording it is left out, and that is said.
        found = diagnose([record, still], case.validation, case.nominal)
        assert not found.mismatch
        assert "still.mcap holds nothing but rest: left out" in found.notes


@pytest.mark.long
def test_three_effects_at_once_are_all_named_and_nothing_else() -> None:
    order = plan(24, 99, "compound")[7]
    assert order.names == ("quadratic_drag", "stiffness", "asymmetry")
    case = make(order)
    found = diagnose(case.train, case.validation, case.nominal)
    assert {each.effect for each in found.findings if each.confidence >= 0.5} == set(order.names)
    assert found.validation.noe_augmented < 1.1 * found.validation.noise_floor
