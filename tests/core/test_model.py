"""Models in code: names, order, structure, refusals."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from fric.model import ModelError, Term, build_model, term
from fric.parameter import Parameter, unit_text
from fric.record import Units


def test_terms_stand_in_the_order_of_assembly_whatever_the_order_given() -> None:
    terms = [term("viscous", coefficient=10.0), term("presliding", stiffness=1e5), term("coulomb", force=4.0)]
    model = build_model("rigid", {"mass": 1.2}, terms)
    assert [held.effect.id for held in model.terms] == ["coulomb", "presliding", "viscous"]
    assert model.names == ("mass", "coulomb.force", "presliding.stiffness", "presliding.damping", "viscous.coefficient")
    np.testing.assert_array_equal(model.values, [1.2, 4.0, 1e5, 0.0, 10.0])
    assert model.has_slip_dynamics


def test_values_by_name_and_new_ones() -> None:
    model = build_model("rigid", {"mass": 1.2}, [term("coulomb", force=4.0)], units=Units("rad", "N m"))
    assert model.value("coulomb.force") == 4.0
    assert model.unit("coulomb.force") == "N m"
    assert model.unit("mass") == "kg m^2"
    changed = model.with_value("coulomb.force", 5.0)
    assert (changed.value("coulomb.force"), model.value("coulomb.force")) == (5.0, 4.0)
    assert changed.with_values(np.array([2.0, 3.0]), {"mass": 0.1}).standard_errors == {"mass": 0.1}
    with pytest.raises(ValueError, match="3 values for 2 parameters"):
        model.with_values(np.zeros(3))
    with pytest.raises(ModelError, match=r"no parameter 'coulomb.level'; choose one of mass, coulomb.force"):
        model.value("coulomb.level")


def test_other_terms_drop_the_standard_errors_of_the_old() -> None:
    model = build_model("rigid", {"mass": 1.2}, [term("coulomb", force=4.0)], standard_errors={"mass": 0.1})
    assert model.with_terms([term("viscous", coefficient=1.0)]).standard_errors == {}


def test_a_model_does_not_change() -> None:
    model = build_model("rigid", {"mass": 1.2})
    with pytest.raises(dataclasses.FrozenInstanceError):
        model.joint = "other"  # type: ignore[misc]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: term("coulob", force=1.0), "unknown effect 'coulob'; choose one of"),
        (lambda: term("stribeck", "hess", force=1.0, velocity=1.0), "unknown effect 'stribeck/hess'"),
        (lambda: term("coulomb", froce=1.0), "unknown parameter 'froce'; it takes force"),
        (lambda: term("coulomb"), "parameter 'force' is missing"),
        (lambda: term("coulomb", force=-1.0), "force is -1, must lie in [0, inf]"),
        (lambda: term("coulomb", force=float("nan")), "force is nan, not a finite number"),
        (lambda: term("stribeck", force=1.0, velocity=0.0), "velocity is 0, must be greater than 0"),
        (lambda: build_model("rigid", {"mass": 1.0}, [term("coulomb", force=1.0)] * 2), "effect 'coulomb' is there twice"),
    ],
)
def test_what_makes_no_model_is_refused(make: object, words: str) -> None:
    with pytest.raises(ModelError) as caught:
        make()  # type: ignore[operator]
    assert words in str(caught.value)


def test_two_laws_of_slip_dynamics_do_not_stand_together() -> None:
    lugre = term("presliding", stiffness=1e5)
    other = Term(dataclasses.replace(lugre.effect, id="frictional_lag", law="x"), lugre.values)
    with pytest.raises(ModelError, match="two terms with slip dynamics"):
        build_model("rigid", {"mass": 1.0}, [lugre, other])


def test_repeated_terms_are_numbered() -> None:
    coulomb = term("coulomb", force=1.0)
    repeatable = Term(dataclasses.replace(coulomb.effect, repeatable=True), coulomb.values)
    model = build_model("rigid", {"mass": 1.0}, [repeatable, repeatable])
    assert model.names == ("mass", "coulomb.force", "coulomb#2.force")


def test_units_are_spelt_out() -> None:
    slide, servo, drive = Units("m", "N"), Units("rad", "N m"), Units("m", "A")
    assert unit_text("F s/x", slide) == "N s/m"
    assert unit_text("F s/x", servo) == "N m s/rad"
    assert unit_text("F s^2/x", slide) == "kg"
    assert unit_text("F s^2/x", drive) == "A s^2/m"
    assert unit_text("1", slide) == "1"


def test_bounds_of_a_parameter_are_its_refusals() -> None:
    share = Parameter("share", "r", "1", "a share", lower=0.0, upper=1.0)
    assert share.refusal(0.0) is None
    assert share.refusal(1.0) is None
    assert share.refusal(1.0001) == "is 1.0001, must lie in [0, 1]"
