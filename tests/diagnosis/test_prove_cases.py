"""Cases: they are what their kind promises, follow from the seed, and fric's own models agree with the physics in them."""

from __future__ import annotations

import json

import numpy as np
import pytest
from fric.diagnosis.prove.cases import KINDS, VARIANTS, Case, Order, draw, make, plan
from fric.diagnosis.prove.concealed import CONCEALED, clash
from fric.diagnosis.prove.outside import OUTSIDE
from fric.effects import EFFECTS
from fric.errors import InputError
from fric.identification.equations import equations
from fric.identification.result import Options
from fric.identification.scoring import driving_force, force_along
from fric.model_file import model_from_text

_COMPONENTS = {"command path", "transmission", "guideway friction", "load", "sensor"}


def test_the_examiner_conceals_every_effect_of_the_registry() -> None:
    assert set(CONCEALED) == {effect.id for effect in EFFECTS.values()}


def test_at_least_six_kinds_lie_outside_the_vocabulary_each_with_its_place() -> None:
    assert len(OUTSIDE) >= 6
    assert not set(OUTSIDE) & set(CONCEALED)
    assert all(each.components and each.components <= _COMPONENTS for each in OUTSIDE.values())


def test_a_plan_is_balanced_and_follows_from_its_seed() -> None:
    orders = plan(300, 4)
    assert orders == plan(300, 4)
    assert orders != plan(300, 5)
    counts = {kind: sum(order.kind == kind for order in orders) for kind in KINDS}
    assert counts["nothing"] >= 60
    assert sum(counts.values()) == 300
    for kind, names in (("moderate", CONCEALED), ("weak", CONCEALED), ("unknown", OUTSIDE)):
        each = [sum(order.names == (name,) for order in orders if order.kind == kind) for name in names]
        assert max(each) - min(each) <= 1
    assert all(not clash(*(CONCEALED[name] for name in order.names)) for order in orders if order.kind == "pair")
    assert len({order.seed for order in orders}) == 300


@pytest.mark.parametrize("other", ["position_dependence", "time_drift", "stribeck", "load_dependence", "presliding"])
def test_what_changes_a_friction_that_is_concealed_itself_is_no_pair_with_it(other: str) -> None:
    assert clash(CONCEALED["coulomb"], CONCEALED[other])
    assert clash(CONCEALED[other], CONCEALED["coulomb"])


@pytest.mark.parametrize("kind", ["moderate", "weak"])
def test_strength_is_what_the_kind_says_and_the_seed_gives_the_same_case(kind: str) -> None:
    first, second = draw(5, kind, "stribeck"), draw(5, kind, "stribeck")
    np.testing.assert_array_equal(first.train[0].effort, second.train[0].effort)
    assert first.key == second.key
    ratio = first.key["noe_refit"] / first.key["noise_floor"]
    if kind == "weak":
        assert 3.0 <= ratio <= 5.0
    else:
        assert 1.0 <= first.key["noe_refit"] <= 15.0
        assert ratio >= 15.0


def test_nominal_values_are_off_and_nothing_else_is_told() -> None:
    case = draw(6, "moderate", "stribeck")
    errors = [abs(value) for value in case.key["nominal_error_percent"].values() if value != 0.0]
    assert all(4.99 <= error <= 40.01 for error in errors)
    assert "stribeck" not in {held.effect.id for held in case.nominal.terms}
    assert not case.nominal.provenance


def _noe(case: Case, text: str | None = None) -> float:
    """Of every row that slides, those beside reversals included: there some of what is concealed shows most."""
    model = case.nominal if text is None else model_from_text(text)
    found = equations(list(case.validation), Options(cutoff=100.0, decimation=5))
    force = driving_force(model, found)[found.sliding]
    error = force - found.rows(lambda stretch: force_along(model, stretch))[found.sliding]
    return float(100.0 * error @ error / np.sum((force - np.mean(force)) ** 2))


@pytest.mark.parametrize("effect", ["ripple", "load_dependence", "actuator_lag", "presliding", "temperature"])
def test_frics_own_model_with_the_true_values_explains_the_recording(effect: str) -> None:
    case = draw(12, "moderate", effect)
    assert _noe(case, case.key["true_structure"]) < 0.3 * case.key["noe_refit"]
    assert _noe(case) > 3.0 * _noe(case, case.key["true_structure"])


def test_where_nothing_is_missing_the_nominal_structure_explains_it_all() -> None:
    case = draw(8, "nothing")
    assert case.key["effects"] == []
    assert case.key["noe_refit"] < case.key["noise_floor"]


def test_the_energy_adds_up_to_the_strength_and_shows_when_a_payload_joins() -> None:
    case = draw(3, "unknown", "payload_step")
    energy = np.array(case.key["energy"])
    duration = case.validation[0].duration
    assert energy.shape[0] * case.key["cell"] == pytest.approx(duration, abs=0.03)
    assert np.all(energy >= 0.0)
    assert json.loads(json.dumps(dict(case.key)))["components"] == ["load"]


def test_an_effect_beside_physics_outside_the_vocabulary() -> None:
    orders = plan(80, 4, "mixed")
    assert {order.kind for order in orders} == {"mixed", "unknown"}
    assert sum(order.kind == "mixed" for order in orders) == 40
    for order in orders:
        if order.kind == "mixed":
            assert order.names[0] in CONCEALED
            assert not CONCEALED[order.names[0]].needs & OUTSIDE[order.names[1]].lacks
    case = draw(7, "mixed", ("stribeck", "payload_step"), "mixed")
    assert case.key["effects"] == ["stribeck", "unknown"]
    assert case.key["physics_outside"] == "payload_step"
    # Both are there, the one that a model can have in the true structure.
    assert {"stribeck", "payload"} <= set(case.key["physics"])
    assert "stribeck" in case.key["true_structure"]
    assert case.key["noe_refit"] >= 15.0 * case.key["noise_floor"]
    with pytest.raises(InputError, match="payload_step"):
        draw(7, "mixed", ("payload_step", "stribeck"), "mixed")


def test_several_effects_at_once_each_of_which_shows_alone() -> None:
    orders = plan(60, 4, "compound")
    assert {order.kind for order in orders} == {"compound", "nothing"}
    several = [order.names for order in orders if order.kind == "compound"]
    assert {len(names) for names in several} == {3, 4, 5}
    assert not any(clash(CONCEALED[a], CONCEALED[b]) for names in several for a in names for b in names if a != b)
    case = draw(3, "compound", ("ripple", "asymmetry", "stribeck"), "compound")
    assert min(case.key["noe_alone"]) >= 5.0 * case.key["noise_floor"]
    assert _noe(case, case.key["true_structure"]) < 0.1 * case.key["noe_refit"]


def test_dirt_of_the_recordings_is_what_the_key_says() -> None:
    clean, dirty = draw(9, "nothing"), draw(9, "nothing", variant="dirt")
    assert clean.key.get("dirt") is None
    dirt = dirty.key["dirt"]
    record = dirty.train[0]
    line = np.exp(-2j * np.pi * 50.0 * record.time)  # mains are what stands at 50 Hz above its neighbours
    aside = np.exp(-2j * np.pi * 53.0 * record.time)
    at_50, at_53 = (2.0 * abs(np.mean((record.effort - np.mean(record.effort)) * each)) for each in (line, aside))
    assert at_50 == pytest.approx(dirt["mains"], abs=3.0 * at_53 + 0.05 * dirt["mains"])
    step = np.diff(record.time)
    assert np.all(step > 0.0)
    stamps = np.std(step - np.median(step)) / np.sqrt(2.0)
    assert stamps == pytest.approx(0.0 if dirt["read_late"] else dirt["jitter"], abs=1e-7, rel=0.1)


def test_other_forms_and_rates() -> None:
    assert draw(4, "moderate", "presliding", "form").key["forms"][0] > 0
    half, double = draw(4, "moderate", "viscous", "half-rate"), draw(4, "moderate", "viscous", "double-rate")
    assert half.train[0].sample_time in (pytest.approx(1 / 250), pytest.approx(1 / 500))
    assert double.train[0].sample_time in (pytest.approx(1 / 1000), pytest.approx(1 / 2000))


@pytest.mark.parametrize(
    "effect",
    [
        pytest.param(name, marks=pytest.mark.long) if name == "compliance" else name
        for name, each in CONCEALED.items()
        if each.foreign
    ],
)
def test_laws_that_fric_has_not_are_drawn_too(effect: str) -> None:
    case = draw(11, "moderate", effect, "foreign")
    assert case.key["forms"][0] in CONCEALED[effect].foreign
    assert 1.0 <= case.key["noe_refit"] <= 15.0
    # Nor does the usual law with the same numbers explain it all, where their meaning is the same.
    if effect in {"load_dependence", "temperature", "position_dependence", "saturation", "accel_hysteresis"}:
        assert _noe(case, case.key["true_structure"]) > 3.0 * case.key["noise_floor"]


@pytest.mark.long
def test_an_axis_that_swings_up_at_some_strength_of_an_effect_is_drawn_weaker() -> None:
    case = make(Order(73, 2031861075, "weak", ("actuator_lag",), "form"))
    assert 3.0 <= case.key["noe_refit"] / case.key["noise_floor"] <= 5.0


def test_refusals() -> None:
    with pytest.raises(InputError, match="stribek"):
        draw(1, "moderate", "stribek")
    with pytest.raises(InputError, match="use one of"):
        draw(1, "strong")
    with pytest.raises(InputError, match="variant"):
        plan(10, 1, "odd")
    with pytest.raises(InputError, match="cases"):
        plan(0, 1)
    known = {"standard", "form", "half-rate", "double-rate", "mixed", "slow-log", "foreign", "dirt", "compound"}
    assert set(VARIANTS) == known | {"mujoco", "events"}
