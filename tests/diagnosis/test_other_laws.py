"""Other laws of an effect that is there: which come into question, and from which values they begin."""

from __future__ import annotations

import pytest
from fric.diagnosis.candidates import Scales
from fric.diagnosis.fitting import refit
from fric.diagnosis.other_laws import laws_beside, laws_further, laws_in_place, strained, told
from fric.diagnosis.worth_trying import worth_trying
from fric.effects import EFFECTS
from fric.model import Term, term

from .small_axis import followed, with_terms

SCALES = Scales(
    level=10.0, range=40.0, most=20.0, speed=0.5, slow=1e-3, low=0.0, high=0.2, duration=4.0, step=2e-3, mass=2.0,
    temperature=5.0, grain=1e-6, fastest=30.0,
)  # fmt: skip


def beside(held: Term) -> dict[str, list[Term]]:
    found: dict[str, list[Term]] = {}
    for each in laws_beside(held, SCALES):
        found.setdefault(each.effect.law, []).append(each)
    return found


def test_another_law_takes_the_values_over_that_it_shares() -> None:
    (soft,) = beside(term("saturation", "hard", limit=7.0))["soft"]
    assert soft.by_name["limit"] == 7.0
    (other_fall,) = beside(term("stribeck", force=1.5, velocity=0.03))["hess_soom"]
    assert other_fall.by_name == {"force": 1.5, "velocity": 0.03}


def test_a_shape_is_tried_in_each_form_that_machines_have_and_not_in_the_one_that_is_there() -> None:
    """The exponent of a Stribeck curve is 2 or 1."""
    for there, other in ((2.0, 1.0), (1.0, 2.0)):
        (bent,) = beside(term("stribeck", force=1.5, velocity=0.03, exponent=there))["exponential"]
        assert bent.by_name == {"force": 1.5, "velocity": 0.03, "exponent": other}


def test_a_shape_of_one_law_is_none_of_another() -> None:
    """The exponent of Dahl's model says something else than that of the sliding elements."""
    dahl = beside(term("presliding", "dahl", stiffness=1e5, exponent=0.7))
    assert [each.by_name["exponent"] for each in dahl["gms"]] == [2.0, 4.0]  # its own default, and its own other one


def test_sliding_elements_come_after_the_level_within_some_samples() -> None:
    """They have no natural rate but by the recording: five samples for the typical force."""
    for each in beside(term("presliding", "lugre", stiffness=1e5, damping=300.0))["gms"]:
        assert each.by_name["attraction"] == pytest.approx(10.0 / (5.0 * 2e-3))
        assert each.by_name["stiffness"] == 1e5


def test_a_spring_that_hardens_comes_in_the_place_of_a_linear_one_that_was_found() -> None:
    track = followed(term("compliance", "hardening", stiffness=2e4, hardening=5e10, damping=10.0))
    linear = refit(track, with_terms(term("compliance", stiffness=2.5e4, damping=10.0)))
    place = [held.effect.id for held in linear.fit.model.terms].index("compliance")
    (law,) = [each for each in laws_in_place(track, linear.fit, place) if each.effect.law == "hardening"]
    bent = refit(
        track, linear.fit.model.with_terms(law if k == place else held for k, held in enumerate(linear.fit.model.terms))
    )
    assert bent.left < 0.5 * linear.left
    found = bent.fit.model.terms[place].by_name
    assert found["stiffness"] == pytest.approx(2e4, rel=0.1)
    assert found["hardening"] == pytest.approx(5e10, rel=0.2)


@pytest.mark.parametrize("usual", worth_trying(), ids=lambda each: each.key)
def test_every_other_law_is_of_the_same_effect_within_its_bounds_and_tried_by_no_other_way(usual: object) -> None:
    effect = next(each for each in worth_trying() if each is usual)
    held = Term(effect, tuple(effect.values({p.name: 0.01 for p in effect.parameters if p.default is None})))
    for found in laws_beside(held, SCALES):
        assert found.effect.id == effect.id
        # A form of the law that is there may have come by itself, too, where that one would not have.
        assert found.effect is effect or found.effect not in worth_trying() or found.effect.form_of == effect.law
        assert found != held
        assert not found.effect.near
        for p, value in zip(found.effect.parameters, found.values, strict=True):
            assert p.refusal(value) is None


def test_a_form_of_one_law_is_no_form_of_another() -> None:
    """A single peak is a form of friction at one place, not of friction that comes back along the travel."""
    assert set(beside(term("position_dependence", "local", amplitude=0.5, position=0.1, width=0.02))) == {"peak"}
    assert beside(term("position_dependence", "periodic", cosine=0.5, sine=0.0, period=0.02)) == {}
    # Power laws and Eyring's are forms of shear thinning that levels off, and not of each other.
    assert set(beside(term("shear_thinning", "eyring", force=1.0, velocity=0.1))) == {"saturating"}


def test_a_spring_that_hardens_doubles_the_force_where_the_typical_force_bends_it() -> None:
    (further,) = laws_further(term("compliance", stiffness=2e4, damping=3.0), SCALES)
    bent = SCALES.level / 2e4
    given = further.by_name
    assert given["stiffness"] * bent + given["hardening"] * bent**3 == pytest.approx(2.0 * SCALES.level)
    assert given["damping"] == 3.0


def test_only_a_law_that_holds_the_other_as_a_case_goes_further() -> None:
    """Each law that goes further is the first one where what it has more is nothing."""
    for effect in EFFECTS.values():
        values = tuple(effect.values({p.name: 0.01 for p in effect.parameters if p.default is None}))
        for found in laws_further(Term(effect, values), SCALES):
            more = [p for p in found.effect.parameters if p.name not in {own.name for own in effect.parameters}]
            assert more
            assert all(p.lower == 0.0 for p in more)
            shared = {p.name: found.by_name[p.name] for p in effect.parameters}
            assert shared == Term(effect, values).by_name


@pytest.mark.parametrize("softness", [1e-4, 0.9995])
def test_a_bend_at_either_end_of_its_range_is_no_bend(softness: float) -> None:
    assert strained(term("saturation", "soft", limit=7.0, softness=softness))
    assert not told(term("saturation", "soft", limit=7.0, softness=softness), SCALES)
    assert told(term("saturation", "soft", limit=7.0, softness=0.5), SCALES)


def test_friction_at_a_place_is_told_within_the_travel_only() -> None:
    for place, seen in ((-0.05, False), (0.0, True), (0.11, True), (0.2, True), (0.21, False)):
        held = term("position_dependence", "local", amplitude=0.5, position=place, width=0.02)
        assert told(held, SCALES) is seen
