"""What a model lacks, held against a force that is known because it was added."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from fric.diagnosis.fitting import best_track
from fric.diagnosis.track import Track
from fric.diagnosis.twin import twins
from fric.model import Model, Term, build_model, term
from fric.record import Record
from scipy.integrate import solve_ivp

MASS, VISCOUS, LACKING = 2.0, 300.0, 5.0
H = 0.001


@cache
def recorded() -> Record:
    """An axis in thick oil against a constant force, by an integrator of scipy."""
    time = np.arange(8000) * H
    effort = 40.0 * np.sin(2.0 * np.pi * 0.7 * time) + 25.0 * np.sin(2.0 * np.pi * 3.1 * time)

    def motion(t: float, state: np.ndarray) -> list[float]:
        # The command is held from sample to sample.
        u = effort[min(int(t / H + 1e-9), effort.shape[0] - 1)]
        return [state[1], (u - VISCOUS * state[1] - LACKING) / MASS]

    found = solve_ivp(motion, (0.0, time[-1]), [0.0, 0.0], t_eval=time, max_step=H, rtol=1e-9, atol=1e-12)
    return Record(time, found.y[0], effort, effort_hold="following")


def model(viscous: float = VISCOUS, **extra: float) -> Model:
    terms = [term("viscous", coefficient=viscous)]
    return build_model("rigid", {"mass": MASS}, [*terms, term("bias", **extra)] if extra else terms)


@pytest.mark.parametrize("bandwidth", [pytest.param(45.0, marks=pytest.mark.long), 140.0, 400.0])
def test_a_constant_force_is_lacking_in_full_however_much_friction_the_model_has(bandwidth: float) -> None:
    track = Track.of([recorded()], bandwidth, model())
    lacking = track.residual(model())
    lacking = lacking[lacking.shape[0] // 2 :]  # so much friction makes the observer slow to settle
    # Positive is what the model would have to be given besides.
    assert float(np.mean(lacking)) == pytest.approx(-LACKING, rel=2e-3)
    assert float(np.std(lacking)) < 0.02 * LACKING


def test_nothing_is_lacking_with_the_force_there() -> None:
    track = Track.of([recorded()], 140.0, model())
    assert float(np.max(np.abs(track.residual(model(force=LACKING))))) < 0.02 * LACKING


def test_friction_that_is_too_much_does_not_hide_what_is_lacking() -> None:
    """With its position set at each sample a model would be given the motion that its friction costs."""
    track = Track.of([recorded()], 400.0, model())
    v = np.gradient(track.runs[0].position, H)
    slow = track.seen([(2.0 * VISCOUS - VISCOUS) * v - LACKING])
    lacking = track.residual(model(2.0 * VISCOUS))
    assert float(np.std(lacking)) == pytest.approx(float(np.std(slow)), rel=0.05)


def test_a_fit_finds_mass_and_friction_from_far_away() -> None:
    track = Track.of([recorded()], 45.0, model())
    start = build_model("rigid", {"mass": 3.5}, [term("viscous", coefficient=40.0), term("bias", force=0.0)])
    found = {p.name: p.value for p in track.fit(start, start.names, 20).model.parameters()}
    assert found["mass"] == pytest.approx(MASS, rel=0.02)
    assert found["viscous.coefficient"] == pytest.approx(VISCOUS, rel=0.01)
    assert found["bias.force"] == pytest.approx(LACKING, rel=0.01)


def test_a_twin_lacks_nothing_but_noise() -> None:
    complete = model(force=LACKING)
    track = Track.of([recorded()], 140.0, complete)
    for twin in twins(track, complete, 2):
        assert float(np.std(track.residual(complete, twin))) < 0.02 * LACKING


def test_a_twin_of_a_light_motor_that_rattles_in_its_play_stays_where_the_axis_was() -> None:
    play = term("impact_backlash", "viscoelastic", gap=2e-5, stiffness=1.5e6, damping=60.0)
    rattling = build_model("rigid", {"mass": MASS, "load_share": 0.85}, [play, *model(force=LACKING).terms])
    track = Track.of([recorded()], 400.0, model())
    found = twins(track, rattling, 1)[0]
    assert float(np.max(np.abs(found.positions[0] - track.runs[0].position))) < 1e-3 * float(np.ptp(recorded().position))
    # What leads it is small beside the forces that act: it must not be a swing between the stops.
    assert float(np.std(found.extras[0])) < 0.5 * LACKING


def noisy() -> Record:
    """The same, as an encoder with noise reads it."""
    found = recorded()
    return replace(found, position=found.position + 2e-6 * np.random.default_rng(5).standard_normal(found.position.shape[0]))


def test_noise_weighs_the_same_whatever_body_the_encoder_sits_on() -> None:
    """Or a light body that carries the rest on a stiff spring would explain the noise of an encoder."""
    whole = build_model("rigid", {"mass": MASS}, [*contact(), term("bias", force=LACKING)])
    mode = term("compliance", "appendage", mass=0.7 * MASS, frequency=150.0, damping=0.1)
    parted = build_model("rigid", {"mass": 0.3 * MASS}, [*contact(), term("bias", force=LACKING), mode])
    track = Track.of([noisy()], 140.0, whole)
    energy = [float(np.sum(track.residual(each) ** 2)) for each in (whole, parted)]
    assert 0.7 < energy[1] / energy[0] < 1.6


def contact() -> list[Term]:
    """Thick oil, and bristles that are too weak to matter."""
    bristles = term("presliding", stiffness=1e3, damping=1.0)
    return [term("viscous", coefficient=VISCOUS), term("coulomb", force=1e-3), bristles]


def test_where_nothing_is_missing_to_any_observer_the_one_that_has_seen_it_is_kept() -> None:
    complete = model(force=LACKING)
    tracks = [Track.of([noisy()], bandwidth, complete) for bandwidth in (45.0, 140.0, 400.0)]
    for track in tracks:
        assert best_track(tracks, complete, otherwise=track)[0] is track
    # Where something is, the fastest that sees it clearly.
    assert best_track(tracks, model(), otherwise=tracks[0])[0] is tracks[2]
