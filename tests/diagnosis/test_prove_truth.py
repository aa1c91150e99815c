"""The examiner's integrator against closed forms, and against fric's own models, with which it shares no line."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.diagnosis.prove.course import Course, Run
from fric.diagnosis.prove.physics import Physics
from fric.diagnosis.prove.truth import Loop, integrate

_H = 1e-3


def _open_loop(physics: Physics, force: np.ndarray, load: np.ndarray | None = None, windows: np.ndarray | None = None) -> Run:
    """The axis under a given force, from rest at 0, seen by an ideal encoder."""
    n = force.shape[0]
    ones, zeros = np.ones(n), np.zeros(n)
    spans = np.zeros((0, 2)) if windows is None else windows
    course = Course(zeros, force, ones if load is None else load, zeros, spans, zeros)
    return integrate(physics, Loop(0.0, 0.0, math.inf, _H, 0.0), course)


def test_constant_force_against_coulomb_friction_gives_a_parabola() -> None:
    run = _open_loop(Physics(mass=2.0, coulomb=3.0), np.full(1001, 7.0))
    assert run.seen[1000] == pytest.approx(0.5 * (7.0 - 3.0) / 2.0 * 1.0, rel=1e-4)


def test_sticks_exactly_below_break_away_and_goes_above() -> None:
    rising = np.linspace(0.0, 3.0, 3001)
    run = _open_loop(Physics(mass=1.0, coulomb=2.0), rising)
    assert np.all(run.seen[:2000] == 0.0)
    assert run.seen[2100] > 0.0


def test_coasting_stops_after_the_closed_form_distance_and_stays() -> None:
    force = np.where(np.arange(4000) < 500, 6.0, 0.0)
    run = _open_loop(Physics(mass=1.5, coulomb=2.0), force)
    speed = (6.0 - 2.0) / 1.5 * 0.5
    assert run.seen[-1] - run.seen[500] == pytest.approx(speed**2 * 1.5 / (2.0 * 2.0), rel=1e-3)
    assert run.speed[-1] == 0.0


def test_steady_speed_meets_every_form_of_the_stribeck_curve() -> None:
    for form, fall in ((0.0, math.exp(-4.0)), (1.0, 1.0 / 5.0), (2.0, math.exp(-2.0))):
        physics = Physics(mass=1.0, coulomb=2.0, viscous=50.0, stribeck=1.0, stribeck_velocity=0.05, stribeck_form=form)
        force = 2.0 + 50.0 * 0.1 + fall
        run = _open_loop(physics, np.concatenate([np.full(200, 20.0), np.full(4000, force)]))
        assert run.speed[-1] == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize("kind", [1.0, 2.0, 3.0])
def test_pre_sliding_begins_as_a_spring_and_ends_at_the_level(kind: float) -> None:
    elements = () if kind == 1.0 else ((0.2, 0.5), (0.3, 0.3), (0.5, 0.2))
    physics = Physics(mass=0.01, coulomb=4.0, viscous=1.0, presliding=kind, displacement=1e-4, elements=elements)
    physics = physics.using({"presliding_damping": 10.0})
    run = _open_loop(physics, np.concatenate([np.full(1000, 0.04), np.full(3000, 4.5)]))
    # Stiffness at rest is level over displacement; sliding takes the level and the viscous force.
    assert run.seen[999] == pytest.approx(0.04 / 4.0 * 1e-4, rel=0.03)
    assert run.speed[-1] == pytest.approx((4.5 - 4.0) / 1.0, rel=1e-3)


def test_gap_passes_nothing_and_the_impact_keeps_momentum() -> None:
    physics = Physics(mass=3.0, load_share=1.0 / 3.0, gap=0.02)
    run = _open_loop(physics, np.concatenate([np.full(50, 2.0), np.zeros(950)]))
    speed = 2.0 / 2.0 * 0.05
    assert run.speed[60] == pytest.approx(speed, rel=1e-6)
    assert run.speed[-1] == pytest.approx(speed * 2.0 / 3.0, rel=1e-6)


def test_shaft_swings_at_the_frequency_of_two_masses() -> None:
    stiffness, share, mass = 800.0, 0.4, 2.0
    reduced = mass * share * (1.0 - share)
    run = _open_loop(Physics(mass=mass, load_share=share, shaft=stiffness), np.concatenate([np.full(5, 10.0), np.zeros(4091)]))
    rate = run.speed[5:] - np.mean(run.speed[5:])
    spectrum = np.abs(np.fft.rfft(rate * np.hanning(rate.shape[0]), 1 << 17))
    found = np.argmax(spectrum) / (1 << 17) / _H
    assert found == pytest.approx(math.sqrt(stiffness / reduced) / (2.0 * math.pi), rel=2e-3)


def test_delay_lag_limit_and_dead_zone_change_the_impulse_as_they_must() -> None:
    push = np.concatenate([np.full(100, 5.0), np.zeros(900)])
    assert _open_loop(Physics(mass=1.0, delay=0.05), push).speed[-1] == pytest.approx(0.5, rel=1e-6)
    assert _open_loop(Physics(mass=1.0, delay=0.05), push).speed[50] == 0.0
    assert _open_loop(Physics(mass=1.0, delay=0.05), push).speed[60] == pytest.approx(0.05, rel=1e-6)
    lagged = _open_loop(Physics(mass=1.0, actuator=1.0, actuator_time=0.02), push)
    assert lagged.speed[100] == pytest.approx(5.0 * (0.1 - 0.02 * (1 - math.exp(-5.0))), rel=2e-3)
    assert lagged.speed[-1] == pytest.approx(0.5, rel=1e-6)
    assert _open_loop(Physics(mass=1.0, limit=3.0), push).speed[-1] == pytest.approx(0.3, rel=1e-6)
    assert _open_loop(Physics(mass=1.0, dead_zone=1.5), push).speed[-1] == pytest.approx(0.35, rel=1e-6)


def test_load_and_dirt_scale_the_level() -> None:
    load = np.full(1001, 1.5)
    run = _open_loop(Physics(mass=1.0, coulomb=2.0, load=1.0), np.full(1001, 5.0), load=load)
    assert run.speed[-1] == pytest.approx(5.0 - 3.0, rel=1e-4)
    run = _open_loop(Physics(mass=1.0, coulomb=2.0, dirt=0.5), np.full(1001, 5.0), windows=np.array([[0.0, 0.4]]))
    assert run.speed[-1] == pytest.approx((5.0 - 3.0) * 0.4 + (5.0 - 2.0) * 0.6, rel=1e-3)


def test_the_encoder_rounds_and_the_command_is_held() -> None:
    n = 2000
    reference = 0.01 * np.sin(2 * np.pi * np.arange(n) * _H)
    zeros = np.zeros(n)
    course = Course(reference, zeros, np.ones(n), zeros, np.zeros((0, 2)), zeros)
    run = integrate(Physics(mass=1.0, coulomb=0.5, viscous=1.0), Loop(2000.0, 60.0, 50.0, _H, 1e-5), course)
    steps = run.measured / 1e-5
    assert np.allclose(steps, np.round(steps), atol=1e-6)
    assert np.max(np.abs(run.measured - run.seen)) <= 0.5e-5 * (1 + 1e-9)
    assert np.max(np.abs(run.seen - reference)) < 1e-3
    assert np.max(np.abs(run.command)) <= 50.0
