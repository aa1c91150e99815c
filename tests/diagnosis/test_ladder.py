"""Runs at constant speeds: what a nominal model leaves out of their means, and that nothing is found where nothing is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis import Diagnosis, diagnose
from fric.diagnosis.blocks import in_blocks
from fric.diagnosis.ladder import ladder_of
from fric.model import Model, Term, build_model, term
from fric.model_file import model_from_text, model_to_text
from fric.record import Array, Record
from fric.report.diagnosis import diagnosis_report

SPEEDS = np.geomspace(0.005, 0.3, 16)  # [m/s]
Law = Callable[[float], float]


def nominal(*more: Term) -> Model:
    terms = [term("coulomb", force=5.0), term("viscous", coefficient=2.0), term("bias", force=0.0)]
    return build_model("rigid", {"mass": 1.0}, [*terms, *more])


def runs(law: Law, seed: int = 0, scatter: float = 0.05) -> tuple[list[Record], list[Record]]:
    """Runs of 3 s, to and fro: friction of 4 N + 8 N s/m and ``law``, a ripple of the screw, and what differs by the day."""
    rng = np.random.default_rng(seed)
    held: tuple[list[Record], list[Record]] = ([], [])
    time = 0.005 * np.arange(600)
    for number, speed in enumerate(SPEEDS.tolist()):
        for way in (1.0, -1.0):
            v = way * speed
            position = v * time + rng.uniform(0.0, 0.1)
            force: Array = 4.0 * way + 8.0 * v + 0.7 + law(v) + scatter * rng.standard_normal() + np.zeros(time.size)
            force += 0.3 * np.sin(2.0 * np.pi * position / 0.002 + rng.uniform(0.0, 6.0)) + 0.1 * rng.standard_normal(time.size)
            position = np.round(position / 1e-6) * 1e-6
            held[number % 2].append(Record(time, position, force, effort_hold="following", source=f"run at {v:.3g}"))
    return held


def tustin(v: float) -> float:
    """A Stribeck effect of a form that no candidate has."""
    return float(np.sign(v) * np.exp(-abs(v) / 0.02))


def effects(found: Diagnosis) -> list[str]:
    assert found.by_means
    return [each.effect for each in found.findings]


@pytest.mark.parametrize("seed", range(12))
def test_where_nothing_is_missing_nothing_is_found(seed: int) -> None:
    found = diagnose(*runs(lambda v: 0.0, seed), nominal())
    assert effects(found) == []
    assert not found.mismatch
    assert found.nominal.refit_parameters["coulomb.force"] == pytest.approx(4.0, abs=0.1)
    assert found.nominal.refit_parameters["viscous.coefficient"] == pytest.approx(8.0, abs=0.8)
    assert "No term of the friction curve is missing" in found.sentence


@pytest.mark.parametrize(
    ("law", "effect"),
    [
        (tustin, "stribeck"),
        (lambda v: 30.0 * v * abs(v), "quadratic_drag"),
        (lambda v: 3.0 * abs(v), "asymmetry"),
    ],
    ids=["stribeck", "quadratic", "asymmetry"],
)
def test_what_is_missing_is_named_and_brings_the_runs_held_back_nearer(law: Law, effect: str) -> None:
    found = diagnose(*runs(law), nominal())
    assert effects(found) == [effect]
    assert found.findings[0].confidence > 0.5
    assert found.validation.noe_augmented < 0.3 * found.validation.noe_refit
    assert effect not in {each.effect for each in found.rejected}


def test_where_it_sits_and_what_it_is_worth() -> None:
    train, validation = runs(lambda v: float(np.sign(v) * 1.5 * np.exp(-((v / 0.03) ** 2))))
    found = diagnose(train, validation, nominal())
    finding = found.findings[0]
    assert finding.effect == "stribeck"
    assert finding.component == "guideway friction"
    assert finding.parameters["stribeck.force"].value == pytest.approx(
        1.5, abs=3.0 * (finding.parameters["stribeck.force"].std or 0)
    )
    assert finding.parameters["stribeck.velocity"].value == pytest.approx(0.03, rel=0.3)
    # The slow runs, and the recordings that hold them.
    assert finding.where.quantity == "speed"
    assert finding.where.range[1] < 0.06
    assert finding.where.time[0] == ((0.0, 2.995),)
    assert finding.where.time[-1] == ()
    # The model is one that others can use, and the page shows it.
    assert model_from_text(model_to_text(found.model)).value("stribeck.velocity") == pytest.approx(
        finding.parameters["stribeck.velocity"].value, rel=1e-3
    )
    page = diagnosis_report(found, train, validation)
    assert "mean of each run held back" in page
    assert found.report()["findings"][0]["effect"] == "stribeck"


def test_a_curve_that_no_candidate_has_is_unknown() -> None:
    found = diagnose(*runs(lambda v: float(np.sign(v) * 0.6 * np.sin(2.0 * np.pi * np.log(abs(v)) / 1.1))), nominal())
    assert effects(found)[0] == "unknown"
    assert all(each.confidence < 0.2 for each in found.findings[1:])
    assert found.unexplained.share > 0.5


def test_in_blocks_every_run_is_learnt_from_and_judged() -> None:
    train, validation = runs(tustin)
    found = diagnose(*in_blocks([*train, *validation], 2), nominal())
    assert effects(found) == ["stribeck"]


def test_a_run_that_stands_and_jumps_is_left_out_and_named() -> None:
    train, validation = runs(tustin)
    slow = train[0]
    steps = np.round(slow.position / 0.002) * 0.002  # stands, and jumps
    train[0] = replace(slow, position=steps)
    found = diagnose(train, validation, nominal())
    assert effects(found) == ["stribeck"]
    assert any(slow.source in note and "no settled part" in note for note in found.notes)


def test_other_recordings_are_looked_at_as_they_are() -> None:
    train, validation = runs(tustin)
    assert ladder_of(train, validation, nominal()) is not None
    # A model of more than a friction curve, a run that turns round, too few speeds, one direction.
    assert ladder_of(train, validation, nominal(term("quadratic_drag", coefficient=1.0), term("delay", time=0.001))) is None
    time = train[-1].time
    turned = replace(train[-1], position=0.3 * np.minimum(time, 3.0 - time))
    assert ladder_of([*train[:-1], turned], validation, nominal()) is None
    assert ladder_of(train[:6], validation, nominal()) is None
    assert ladder_of(train[::2], validation, nominal()) is None


def falling(v: float) -> float:
    """A surplus that falls over all speeds, and viscous friction of next to nothing beside it."""
    return float(np.sign(v) * 6.0 * np.exp(-((v / 0.15) ** 2))) - 8.0 * v


def test_a_surplus_beside_which_no_other_curve_is_possible_is_named() -> None:
    """Without it viscous friction would have to be negative: there is no plain curve with all of the nominal terms."""
    found = diagnose(*runs(falling), nominal())
    assert effects(found) == ["stribeck"]
    assert found.findings[0].parameters["stribeck.force"].value == pytest.approx(6.0, rel=0.1)
    assert found.findings[0].parameters["stribeck.velocity"].value == pytest.approx(0.15, rel=0.1)
    assert found.nominal.refit_parameters["viscous.coefficient"] == 0.0
    assert found.validation.noe_augmented < 0.01 * found.validation.noe_refit


@pytest.mark.parametrize("more", [0.0, 30.0])
def test_a_nominal_model_with_a_stribeck_effect_keeps_it(more: float) -> None:
    """All curves have it then: there is none without it to be compared with."""
    had = nominal(term("stribeck", force=1.0, velocity=0.05))
    found = diagnose(*runs(lambda v: float(np.sign(v) * 1.5 * np.exp(-((v / 0.03) ** 2)) + more * v * abs(v))), had)
    assert effects(found) == (["quadratic_drag"] if more else [])
    assert found.model.value("stribeck.force") == pytest.approx(1.5, rel=0.15)
    assert found.model.value("stribeck.velocity") == pytest.approx(0.03, rel=0.2)


def test_a_stribeck_effect_of_the_nominal_model_that_is_none_comes_out_at_nothing() -> None:
    """Friction rises from the slow runs on, where a surplus would make it fall; the other terms are found all the same."""
    had = nominal(term("stribeck", force=1.0, velocity=0.05))
    found = diagnose(*runs(lambda v: -float(np.sign(v) * 1.5 * np.exp(-((v / 0.01) ** 2)))), had)
    assert found.nominal.refit_parameters["stribeck.force"] == 0.0
    assert found.nominal.refit_parameters["viscous.coefficient"] > 4.0
