"""Friction that follows the driving force: efficiencies both ways, exact sticking, and the force that a motion needs."""

from __future__ import annotations

import fric
import numpy as np
import pytest
from fric.model import Model, build_model, term
from fric.simulation import predict_force, simulate

MASS, DRY, H = 2.0, 1.5, 1e-3
PROPORTIONAL = term("gear_friction", coefficient=0.25)
DIRECTIONAL = term("gear_friction", "directional", driving=0.2, driven=0.05)


def axis(*terms: fric.Term) -> Model:
    return build_model("rigid", {"mass": MASS}, [term("coulomb", force=DRY), *terms])


def test_driving_loses_the_share_of_the_force() -> None:
    moved = simulate(axis(PROPORTIONAL), np.full(1001, 10.0), H)
    assert moved.velocity[-1] == pytest.approx((0.75 * 10.0 - DRY) / MASS * 1.0, rel=1e-9)


@pytest.mark.parametrize(("gear", "share"), [(PROPORTIONAL, 0.25), (DIRECTIONAL, 0.05)], ids=["both ways", "by direction"])
def test_braking_is_helped_by_the_share_of_the_force(gear: fric.Term, share: float) -> None:
    moved = simulate(axis(gear), np.full(501, -4.0), H, velocity=10.0)
    assert moved.velocity[-1] == pytest.approx(10.0 - ((1.0 + share) * 4.0 + DRY) / MASS * 0.5, rel=1e-9)


@pytest.mark.parametrize(("force", "moves"), [(1.99, False), (2.01, True), (-1.99, False), (-2.01, True)])
def test_it_sticks_up_to_the_force_that_beats_dry_friction_and_its_own(force: float, moves: bool) -> None:
    # f - 0.25 |f| = 1.5 at 2 N.
    moved = simulate(axis(PROPORTIONAL), np.full(200, force), H)
    assert (moved.position[-1] != 0.0) == moves


@pytest.mark.parametrize(("force", "moves"), [(2.99, False), (3.01, True)])
def test_what_scales_a_guideway_leaves_the_gear_alone(force: float, moves: bool) -> None:
    # f - 0.25 |f| = 1.5 times 1.5 at 3 N, at a place where the guideway rubs half as much again.
    place = term("position_dependence", "periodic", cosine=0.5, sine=0.0, period=1.0)
    moved = simulate(axis(PROPORTIONAL, place), np.full(200, force), H)
    assert (moved.position[-1] != 0.0) == moves


@pytest.mark.parametrize("gear", [PROPORTIONAL, DIRECTIONAL], ids=["both ways", "by direction"])
def test_the_motion_needs_the_force_that_made_it(gear: fric.Term) -> None:
    model = axis(gear)
    t = H * np.arange(4000)
    force = 9.0 * np.sin(2.0 * np.pi * 0.9 * t) + 4.0 * np.sin(2.0 * np.pi * 0.37 * t)
    moved = simulate(model, force, H)
    velocity = moved.velocity
    middle, rate = 0.5 * (velocity[1:] + velocity[:-1]), np.diff(velocity) / H
    needed = predict_force(model, t[:-1] + 0.5 * H, moved.position[:-1], middle, rate, H)
    # Within a step the direction doesn't change where both of its ends have the same.
    slides = (velocity[1:] * velocity[:-1] > 0.0) & (np.abs(middle) > 1e-3)
    assert np.count_nonzero(slides) > 3000
    assert np.max(np.abs(needed - force[:-1])[slides]) < 1e-6


def test_behind_an_elastic_transmission_it_follows_what_that_passes_on() -> None:
    shaft = term("compliance", stiffness=4e4, damping=40.0)
    stiff = build_model("rigid", {"mass": MASS, "load_share": 0.5}, [term("coulomb", force=DRY), shaft, PROPORTIONAL])
    moved = simulate(stiff, np.full(2001, 10.0), H)
    # Accelerating as one, the load's half of the mass gets L with a = (0.75 L - 1.5)/1 = (10 - L)/1.
    passed = (10.0 + DRY) / 1.75
    assert moved.velocity[-1] == pytest.approx((10.0 - passed) / 1.0 * 2.0, rel=2e-3)
