"""Recordings that contradict each other are told from recordings that agree and lack an effect."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis import Diagnosis, diagnose
from fric.diagnosis.contradiction import contradiction_of, without_stand_ins
from fric.diagnosis.differences import Contradiction
from fric.diagnosis.fitting import best_track, refit
from fric.diagnosis.growth import Growth
from fric.diagnosis.settle import Step
from fric.diagnosis.start import started
from fric.model import Term, build_model, term
from fric.record import Record
from fric.report.diagnosis import diagnosis_report
from fric.simulation import simulate

pytestmark = pytest.mark.timeout(600)  # the first of them compiles what all share

H = 4e-3
NOMINAL = build_model("rigid", {"mass": 2.1}, [term("coulomb", force=5.0), term("viscous", coefficient=22.0)])
STRIBECK = (term("stribeck", force=4.0, velocity=0.02),)


def recording(
    number: int,
    mass: float = 2.0,
    force: float = 6.0,
    gain: float = 1.0,
    push: float = 1.0,
    more: Sequence[Term] = (),
    **measured: float,
) -> Record:
    """Eight seconds of an axis, each ``number`` with a motion and noise of its own."""
    random = np.random.default_rng(number)
    t = H * np.arange(2000)
    (a, b), (p, q) = random.uniform(0.8, 1.2, 2), random.uniform(0.0, 2.0 * np.pi, 2)
    effort = push * (20.0 * np.sin(2.0 * np.pi * 0.7 * a * t + p) + 10.0 * np.sin(2.0 * np.pi * 2.3 * b * t + q))
    axis = build_model("rigid", {"mass": mass}, [term("coulomb", force=force), term("viscous", coefficient=20.0), *more])
    position = simulate(axis, effort, H, n_substeps=8).position[: t.size] + 2e-7 * random.standard_normal(t.size)
    recorded = gain * (effort + 0.02 * random.standard_normal(t.size))
    signals = {name: value + 0.05 * random.standard_normal(t.size) for name, value in measured.items()}
    return Record(t, position, recorded, extra=signals, effort_hold="following", source=f"bag_{number}")


def growth(*train: Record) -> Growth:
    """The refitted nominal model, on which nothing grew."""
    tracks, start = started(NOMINAL, train, as_given=True)
    track, state = best_track(tracks, start)
    return Growth(track, state, state, (), (), 1.0)


def contradiction(*train: Record) -> Contradiction | None:
    """What is told where nothing grew."""
    return contradiction_of(growth(*train), train)


@pytest.fixture(scope="module")
def heavier() -> tuple[list[Record], Diagnosis]:
    train, held_back = [recording(1), recording(2, mass=2.8), recording(3)], [recording(4)]
    # No effect comes near: with more time as many more are tried and rejected.
    return held_back, diagnose(train, held_back, NOMINAL, at_most=0.5)


def test_it_is_said_which_recording_differs_and_how(heavier: tuple[list[Record], Diagnosis]) -> None:
    _, found = heavier
    assert found.mismatch
    assert found.contradiction is not None
    (told,) = found.contradiction.differs
    assert (told.parameter, told.unit, told.recording) == ("mass", "kg", (2, "bag_2"))
    assert told.interval[0] < 0.8 < told.interval[1]
    assert told.others == pytest.approx(2.0, rel=1e-3)
    assert [source for source, _, _ in told.values] == ["bag_1", "bag_2", "bag_3"]
    assert "mass is 2.8 kg in recording 2 (bag_2) and 2 kg in the others" in found.sentence


def test_no_effect_is_sure_beside_it(heavier: tuple[list[Record], Diagnosis]) -> None:
    held_back, found = heavier
    assert [each.effect for each in found.findings][:1] == ["unknown"]
    assert all(each.confidence < 0.5 for each in found.findings[1:])
    told = json.loads(json.dumps(found.report(), allow_nan=False))["contradiction"]
    assert told["differs"][0]["recording"] == {"number": 2, "source": "bag_2"}
    assert told["sentence"] in found.notes[-1]
    assert "contradict each other" in diagnosis_report(found, held_back, held_back)


@pytest.mark.parametrize(
    ("name", "odd", "parameter", "difference"),
    [
        ("force", {"force": 9.0}, "coulomb.force", 3.0),
        ("gain", {"gain": 1.2}, "gain of the force", 0.2),
    ],
)
def test_the_right_parameter_is_told(name: str, odd: dict[str, float], parameter: str, difference: float) -> None:
    found = contradiction(recording(1), recording(2), recording(3, **odd))
    assert found is not None, name
    (told,) = found.differs
    assert (told.parameter, told.recording[0]) == (parameter, 3)
    assert told.difference == pytest.approx(difference, abs=max(told.interval[1] - told.difference, 1e-3 * difference))
    assert found.share > 0.99


def test_two_recordings_are_told_as_well() -> None:
    found = contradiction(recording(1), recording(2, mass=2.8))
    assert found is not None
    assert abs(found.differs[0].difference) == pytest.approx(0.8, rel=1e-3)


def test_beside_an_effect_that_is_missing_in_all_of_them_it_is_told() -> None:
    train = [recording(k, mass=mass, more=STRIBECK) for k, mass in ((1, 2.0), (2, 2.8), (3, 2.0))]
    assert contradiction(*train) is None  # as long as the effect isn't there, too much stays
    plain = growth(*train)
    end = refit(plain.track, plain.begin.fit.model.with_terms((*plain.begin.fit.model.terms, *STRIBECK)))
    step = Step("stribeck", plain.begin.left, end.left, end.floor, plain.begin.excess, (), (), 0.0)
    grown = replace(plain, end=end, steps=(step,))
    found = contradiction_of(grown, train)
    assert found is not None
    assert found.beside
    assert (found.differs[0].parameter, found.differs[0].recording[0]) == ("mass", 2)
    assert found.differs[0].difference == pytest.approx(0.8, rel=5e-3)
    assert without_stand_ins(grown, found) is grown


@pytest.mark.parametrize("effect", [*STRIBECK, term("quadratic_drag", coefficient=15.0)], ids=lambda each: each.effect.id)
def test_averages_at_other_speeds_of_what_has_no_name_are_no_contradiction(effect: Term) -> None:
    assert contradiction(*(recording(k, push=push, more=(effect,)) for k, push in ((1, 0.5), (2, 0.8), (3, 1.3)))) is None


def test_nothing_is_said_of_recordings_that_agree() -> None:
    train, held_back = [recording(k) for k in (1, 2, 3)], [recording(4)]
    found = diagnose(train, held_back, NOMINAL)
    assert not found.mismatch
    assert found.contradiction is None
    assert found.report()["contradiction"] is None


def test_an_effect_missing_in_all_of_them_is_found_and_no_contradiction() -> None:
    train, held_back = [recording(k, more=STRIBECK) for k in (1, 2, 3)], [recording(4, more=STRIBECK)]
    found = diagnose(train, held_back, NOMINAL)
    assert [each.effect for each in found.findings] == ["stribeck"]
    assert found.findings[0].confidence > 0.9
    assert found.contradiction is None


def test_one_recording_contradicts_nothing() -> None:
    assert contradiction(recording(1, more=STRIBECK)) is None


@pytest.mark.parametrize("measured", ["normal_load", "temperature"])
def test_a_measured_cause_is_left_to_the_effects(measured: str) -> None:
    train = [recording(k, force=force, **{measured: 4.0 * force}) for k, force in ((1, 5.0), (2, 7.0), (3, 6.0))]
    assert contradiction(*train) is None
    assert contradiction(*(replace(each, extra={}) for each in train)) is not None


def test_a_temperature_that_is_constant_but_for_its_noise_explains_nothing() -> None:
    train = [recording(k, mass=mass, temperature=21.0 + 0.01 * k) for k, mass in ((1, 2.0), (2, 2.8), (3, 2.0))]
    assert contradiction(*train) is not None


def test_where_every_recording_differs_all_values_are_told() -> None:
    found = contradiction(*(recording(k, force=force) for k, force in ((1, 5.0), (2, 7.0), (3, 9.0))))
    assert found is not None
    (told,) = found.differs
    assert not told.others_agree
    assert all(f"in bag_{k}" in told.phrase for k in (1, 2, 3))
    assert [value for _, value, _ in told.values] == pytest.approx([5.0, 7.0, 9.0], rel=0.02)
