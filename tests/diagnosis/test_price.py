"""What a term costs and has to take off, and what speaks against a model whatever it explains."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.fitting import State
from fric.diagnosis.least_squares import Fit
from fric.diagnosis.price import earns, mass_off, price_of, strange, worth
from fric.diagnosis.screen import Column, Tried
from fric.identification.gauss_newton import Solution
from fric.model import Model, build_model, term

from .small_axis import NOMINAL


def state(left: float, floor: float) -> State:
    nothing = Solution(np.zeros(0), np.zeros(1), np.zeros((1, 0)), True, 0, np.zeros(0, dtype=np.bool_))
    return State(Fit(NOMINAL, (), nothing, np.zeros(0)), left, lambda: (floor, ()))


def tried(left: float, by_chance: float) -> Tried:
    column = Column(term("bias", force=1.0), (np.ones(1),), ("force",))
    return Tried(column, left, 100.0 - left, by_chance, np.ones(1), np.zeros(0))


def axis(mass: float, share: float | None = None) -> Model:
    if share is None:
        return build_model("rigid", {"mass": mass}, NOMINAL.terms)
    spring = term("compliance", stiffness=1e5, damping=10.0)
    return build_model("rigid", {"mass": mass, "load_share": share}, [*NOMINAL.terms, spring])


def test_shapes_cost_nothing() -> None:
    """Of a Stribeck effect the surplus and the velocity are fitted, the exponent isn't."""
    viscous, stribeck = term("viscous", coefficient=1.0).effect, term("stribeck", force=1.0, velocity=0.1).effect
    assert price_of(stribeck, 50.0) == pytest.approx(2.0 * price_of(viscous, 50.0))
    assert price_of(viscous, 100.0) == pytest.approx(2.0 * price_of(viscous, 50.0))


@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_a_mass_twice_or_half_the_given_one_costs_a_tenth_of_what_is_missing(factor: float) -> None:
    assert mass_off((3.0,), axis(3.0 * factor)) == pytest.approx(0.1)
    # As much for that of the half as of the double, and nothing where another mass was given too.
    assert mass_off((3.0, 3.0 * factor), axis(3.0 * factor)) == 0.0


@pytest.mark.parametrize("mass", [3.0, 3.5, 2.6])
def test_a_mass_nearby_costs_nothing(mass: float) -> None:
    assert mass_off((3.0,), axis(mass)) == 0.0


def test_what_hangs_on_the_body_is_part_of_its_mass() -> None:
    hanging = term("compliance", "appendage", mass=1.5, frequency=300.0, damping=0.05)
    parted = build_model("rigid", {"mass": 1.5}, [*NOMINAL.terms, hanging])
    assert mass_off((3.0,), parted) == 0.0
    assert mass_off((3.0,), axis(1.5)) > 0.0


def test_hardly_any_mass_behind_a_transmission_is_implausible() -> None:
    assert strange((3.0,), axis(3.0, 0.5)) == 0.0
    assert strange((3.0,), axis(3.0, 0.1)) == pytest.approx(0.0, abs=1e-12)
    assert strange((3.0,), axis(3.0, 0.05)) == pytest.approx(0.1)
    assert strange((3.0,), axis(6.0, 0.05)) == pytest.approx(0.2)


def test_a_term_earns_its_place_by_more_than_chance_a_floor_and_a_part_of_all() -> None:
    """100 are missing above a floor of 10: 12 of them, 1.5 of the floor and six times chance have to go."""
    missing = state(110.0, 10.0)
    assert earns(missing, 97.0, [tried(97.0, 0.0)])
    assert not earns(missing, 99.0, [tried(99.0, 0.0)])
    assert earns(missing, 99.0, [tried(99.0, 0.0)], of_excess=0.1)
    assert not earns(missing, 97.0, [tried(97.0, 3.0)])
    assert not earns(state(110.0, 100.0), 97.0, [tried(97.0, 0.0)])


def test_no_candidate_promises_nothing() -> None:
    assert not worth(state(110.0, 10.0), [])
    assert worth(state(110.0, 10.0), [tried(50.0, 0.0), tried(109.0, 0.0)])
