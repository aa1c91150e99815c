"""A model that the effort means nothing to foretells none: measured against what a set-valued law swallows."""

from __future__ import annotations

import math
from dataclasses import replace

import fric
import numpy as np
import pytest
from fric.diagnosis.indifference import dearer, indifference
from fric.diagnosis.start import started
from fric.diagnosis.track import Track
from fric.model import Model, build_model, term

H = 5e-3
LIGHT = build_model("rigid", {"mass": 0.5}, [term("coulomb", force=8.0), term("viscous", coefficient=2.0)])
RIPPLE = term("ripple", cosine=0.0, sine=3.0, period=0.05)


@pytest.fixture(scope="module")
def followed() -> tuple[Track, Model]:
    """A light axis with a ripple, moved slowly to and fro by the force that this takes: its inertia hardly shows."""
    t = H * np.arange(8000)
    wanted = 0.2 * np.sin(2.0 * np.pi * 0.1 * t)
    velocity, acceleration = np.gradient(wanted, t), np.gradient(np.gradient(wanted, t), t)
    ripple = 3.0 * np.sin(2.0 * np.pi * wanted / 0.05)
    effort = 0.5 * acceleration + 8.0 * np.sign(velocity) + 2.0 * velocity + ripple
    noise = np.random.default_rng(3).standard_normal((2, t.shape[0]))
    moved = fric.simulate(LIGHT, effort, period=H)
    record = replace(moved, position=wanted + 1e-6 * noise[0], effort=effort + 0.2 * noise[1])
    tracks, start = started(LIGHT, [record])
    return tracks[0], start


def test_friction_springs_and_ripples_mind_all_of_the_effort(followed: tuple[Track, Model]) -> None:
    track, start = followed
    for added in (
        (),
        (RIPPLE,),
        (term("stiffness", stiffness=5.0, position=0.0),),
        (term("stribeck", force=2.0, velocity=0.02),),
    ):
        assert indifference(track, start.with_terms((*start.terms, *added))) < 0.03


def test_what_a_dead_zone_swallows_costs_how_far_it_stands_out_from_the_noise(followed: tuple[Track, Model]) -> None:
    track, _ = followed
    assert track.noticeable is not None
    missing, hidden = track.noticeable
    assert missing == pytest.approx(3.0 / math.sqrt(2.0), rel=0.3)  # the ripple's
    swallowing = build_model("rigid", {"mass": 0.5}, [term("input_deadzone", width=40.0)])
    cost = indifference(track, swallowing)
    moving = 1.0 - 8 * 2.0 * track.settled(0) / track.n_samples  # eight turns, and as long before as after each
    assert cost == pytest.approx(moving * math.log(missing / hidden), rel=0.1)
    assert dearer(track, swallowing) == pytest.approx(math.exp(2.0 * cost))


def test_it_is_asked_only_where_something_is_known_to_be_missing(followed: tuple[Track, Model]) -> None:
    track, _ = followed
    swallowing = build_model("rigid", {"mass": 0.5}, [term("input_deadzone", width=40.0)])
    assert indifference(replace(track, noticeable=None), swallowing) == 0.0
    assert indifference(replace(track, noticeable=(0.1, 0.2)), swallowing) == 0.0
