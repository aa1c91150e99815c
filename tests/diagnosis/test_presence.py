"""What halves of a recording say of each term by itself: of one that is there, and of one that is not."""

from __future__ import annotations

from dataclasses import replace

import fric
import numpy as np
import pytest
from fric.diagnosis.additive.asked import Asked
from fric.diagnosis.calibration import Evidence
from fric.diagnosis.findings import with_presences
from fric.diagnosis.fitting import refit
from fric.diagnosis.growth import Growth
from fric.diagnosis.halves import Half
from fric.diagnosis.locate import Where
from fric.diagnosis.presence import Presence, presences
from fric.diagnosis.reproduced import reproduced
from fric.diagnosis.result import Estimate, Finding
from fric.diagnosis.settle import Step, audit, renamed
from fric.diagnosis.start import started
from fric.diagnosis.track import Track
from fric.model import Model, build_model, term

H = 2e-3
NOMINAL = build_model("rigid", {"mass": 5.0}, [term("coulomb", force=8.0), term("viscous", coefficient=30.0)])
SHARES = {"ripple": 0.6, "quadratic_drag": 0.01}
RIPPLE = {"cosine": 0.0, "sine": 2.0, "period": 0.02}


Fitted = tuple[Track, Model, list[Step]]


@pytest.fixture(scope="module")
def fitted() -> Fitted:
    """An axis with a ripple, and beside it a force over time that belongs to no law; the model grown by ripple and drag."""
    t = H * np.arange(7000)
    force = 30.0 * np.sin(2.0 * np.pi * (0.3 + 0.06 * t) * t) + 12.0 * np.sin(2.0 * np.pi * 1.7 * t)
    axis = NOMINAL.with_terms((*NOMINAL.terms, term("ripple", **RIPPLE)))
    moved = fric.simulate(axis, force, period=H)
    # The force that is recorded lacks what else acted: it wanders by half a newton.
    wander = 0.5 * np.sin(2.0 * np.pi * 0.31 * t + 1.0) + 0.4 * np.sin(2.0 * np.pi * 0.83 * t)
    noisy = 0.3 * np.random.default_rng(2).standard_normal(t.shape[0])
    tracks, start = started(NOMINAL, [replace(moved, effort=moved.effort + wander + noisy)])
    track = tracks[len(tracks) // 2]
    terms = (*start.terms, term("ripple", **RIPPLE), term("quadratic_drag", coefficient=0.5))
    state = refit(track, start.with_terms(terms))
    begin = refit(track, start)
    steps = [
        Step(name, begin.left, state.left, state.floor, begin.excess, (), ())
        for name in state.fit.model.prefixes
        if name.split("#")[0] in ("ripple", "quadratic_drag")
    ]
    return track, state.fit.model, steps


@pytest.fixture(scope="module")
def found(fitted: Fitted) -> dict[str, Presence]:
    return presences(*fitted, SHARES, 0.0)


def test_what_is_there_is_found_in_either_half_with_the_same_values(found: dict[str, Presence]) -> None:
    ripple = found["ripple"]
    assert ripple.evidence.halves == min(half.nats for half in ripple.halves)
    assert ripple.evidence.functions > 30.0
    for half in ripple.halves:
        assert half.nats > 6.0
        assert half.parameters["ripple.period"] == pytest.approx(0.02, rel=3e-3)
        assert np.hypot(half.parameters["ripple.cosine"], half.parameters["ripple.sine"]) == pytest.approx(2.0, rel=0.1)


def test_halves_agree_about_what_is_there(found: dict[str, Presence]) -> None:
    ripple = found["ripple"]
    one, other = (half.parameters for half in ripple.halves)
    # Nothing else in the model does what a ripple does: its own force is all of it, and so is the difference.
    place = 2.0 * np.pi * np.linspace(0.0, 0.3, 3001)
    force = [
        each["ripple.cosine"] * np.cos(place / each["ripple.period"])
        + each["ripple.sine"] * np.sin(place / each["ripple.period"])
        for each in (one, other)
    ]
    ratio = np.sum(np.mean(force, axis=0) ** 2) / np.sum((force[0] - force[1]) ** 2)
    assert ripple.evidence.agreement == pytest.approx(np.log(ratio), abs=1.5)
    assert ripple.evidence.agreement > found["quadratic_drag"].evidence.agreement


def test_what_stays_unexplained_never_makes_surer(found: dict[str, Presence], fitted: Fitted) -> None:
    sure = presences(*fitted, SHARES, 0.4)
    assert all(sure[name].probability <= each.probability for name, each in found.items())
    assert sure["ripple"].evidence.rest == 0.4


def test_what_only_mends_something_unknown_is_not_sure(fitted: Fitted) -> None:
    beside = presences(*fitted, SHARES, 0.4)
    assert beside["quadratic_drag"].probability < 0.3 * beside["ripple"].probability


def test_what_halves_contradict_each_other_about_goes(fitted: Fitted) -> None:
    track, model, steps = fitted
    ripple = next(held for held in model.terms if held.effect.id == "ripple")
    spring = term("stiffness", stiffness=5.0, position=0.0)  # what wanders over time goes with the position for a while
    begin = refit(track, model.with_terms(held for held in model.terms if held.effect.id in ("coulomb", "viscous")))
    end = refit(track, begin.fit.model.with_terms((*begin.fit.model.terms, ripple, spring)))
    both = tuple(replace(steps[0], term=name) for name in ("stiffness", "ripple"))
    growth = Growth(track, begin, end, both, (), audit(track, begin.fit.model, end.fit.model))
    said: list[str] = []
    fewer = reproduced(growth, said.append)
    assert [step.term for step in fewer.steps] == ["ripple"]
    assert [name for name, _ in fewer.rejected] == ["stiffness"]
    assert "stiffness" not in fewer.end.fit.model.prefixes
    assert len(said) == 1
    assert fewer.price < growth.price


def test_what_flexible_functions_explain_as_well_is_not_asked_for(fitted: Fitted) -> None:
    track, model, _ = fitted
    asked = Asked(track, refit(track, model))
    nats = {name: asked.nats(k) for k, name in enumerate(model.prefixes)}
    assert nats["ripple"] > 30.0
    assert nats["quadratic_drag"] < 3.0


NOWHERE = Where((((0.0, 1.0),),), 1.0, "", "speed", (0.0, 1.0), 1.0)


def told(name: str, error: float) -> Finding:
    values = {f"{name}.cosine": Estimate(2.0, error, "N")}
    return Finding("ripple", "", "ripple", 0.9, None, NOWHERE, "load", 0.9, "", values, 2.0, 0.1, term=name)


@pytest.mark.parametrize(("error", "most"), [(0.1, 1.0), (3.0, 0.45)])
def test_what_is_smaller_than_its_own_standard_error_is_not_told_as_likely(error: float, most: float) -> None:
    sure = Presence(0.97, (Half(9.0, {}), Half(9.0, {})), Evidence(0.9, 0.0, 9.0))
    assert with_presences({"ripple": sure}, [told("ripple", error)])[0].confidence == min(0.97, most)


def test_two_of_one_effect_are_each_as_sure_as_their_own_evidence() -> None:
    sure, unsure = (Presence(p, (Half(9.0, {}), Half(9.0, {})), Evidence(0.9, 0.0, 9.0)) for p in (0.97, 0.2))
    held = with_presences({"ripple": sure, "ripple#2": unsure}, [told("ripple", 0.1), told("ripple#2", 0.1)])
    assert [each.confidence for each in held] == [0.97, 0.2]


def test_a_term_that_goes_gives_its_name_to_the_next_of_its_effect() -> None:
    both = NOMINAL.with_terms((*NOMINAL.terms, term("ripple", **RIPPLE), term("ripple", **{**RIPPLE, "period": 0.03})))
    second, friction = (Step(name, 1.0, 0.1, 0.0, 1.0, (), ()) for name in ("ripple#2", "coulomb"))
    assert renamed(second, both, both.prefixes.index("ripple")).term == "ripple"
    assert renamed(friction, both, both.prefixes.index("ripple")).term == "coulomb"
