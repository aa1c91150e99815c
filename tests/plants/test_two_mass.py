"""The two-mass test bed: coupling, friction on either side, sticking, slip dynamics, and the balances."""

from __future__ import annotations

import numpy as np
import pytest
from fric.model import Model, Term, build_model, term
from fric.plants import PLANTS
from fric.simulation import Predictor, Simulator, simulate
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
MOTOR, LOAD = 1.0, 3.0
LUGRE = (
    term("coulomb", force=2.0),
    term("stribeck", force=1.0, velocity=0.02),
    term("presliding", stiffness=2e5, damping=300.0),
)
DRY = (term("coulomb", force=2.0), term("stribeck", force=1.0, velocity=0.02))
PLAIN = (term("coulomb", force=2.0), term("stribeck", force=0.0, velocity=0.02))  # Coulomb friction, without another structure
SPRING = term("compliance", stiffness=2e4, damping=5.0)


def bed(*terms: Term, coulomb: float = 0.0, viscous: float = 0.0) -> Model:
    values = {"motor_mass": MOTOR, "load_mass": LOAD, "motor_coulomb": coulomb, "motor_viscous": viscous}
    return build_model("two_mass", values, terms)


def wave(n: int, size: float, step: float, frequency: float = 1.3) -> Array:
    return np.asarray(size * np.sin(2.0 * np.pi * frequency * step * (np.arange(n) + 0.5)))


# --- rigidly coupled ---


@pytest.mark.parametrize("terms", [DRY, pytest.param(LUGRE, marks=pytest.mark.long)], ids=["dry", "lugre"])
def test_without_a_transmission_both_are_one_body(terms: tuple[Term, ...]) -> None:
    u = wave(3000, 5.0, 1e-3)
    pair, friction = Simulator(bed(*terms)).run(u, 1e-3, 4)
    alone = build_model(
        "pendulum", {"inertia": MOTOR + LOAD, "proportional": 0, "derivative": 0, "gravity": 0, "start": 0}, terms
    )
    one, expected = Simulator(alone).run(u, 1e-3, 4)
    assert np.max(np.abs(one[:, 0])) > 1e-2
    np.testing.assert_array_equal(pair[:, :2], one)
    np.testing.assert_array_equal(pair[:, 2:], one)
    np.testing.assert_allclose(friction, expected, rtol=1e-14)


@pytest.mark.parametrize("terms", [PLAIN, LUGRE], ids=["dry", "lugre"])
def test_friction_of_the_motor_adds_to_that_of_the_load_where_both_are_one(terms: tuple[Term, ...]) -> None:
    step = 1e-4
    u = wave(20_000, 7.0, step)
    pair = Simulator(bed(*terms, coulomb=1.5, viscous=3.0)).run(u, step, 1)[0]
    if terms is not LUGRE:
        sums = [term("coulomb", force=3.5), term("viscous", coefficient=3.0)]
        plant = {"inertia": MOTOR + LOAD, "proportional": 0, "derivative": 0, "gravity": 0, "start": 0}
        one = Simulator(build_model("pendulum", plant, sums)).run(u, step, 1)[0]
        assert np.max(np.abs(pair[:, :2] - one) / np.ptp(one, axis=0)) < 1e-4
    rest = (pair[1:, 1] == 0.0) & (pair[:-1, 1] == 0.0)
    assert np.sum(rest) > 100
    assert np.all(np.diff(pair[:, 0])[rest] == 0.0)
    np.testing.assert_array_equal(pair[:, :2], pair[:, 2:])


def test_at_rest_both_sides_hold() -> None:
    for u, moves in ((3.4999, False), (3.5001, True)):
        states, _ = Simulator(bed(*PLAIN, coulomb=1.5)).run(np.full(1000, u), 1e-3, 1)
        assert (states[-1, 0] != 0.0) == moves


# --- elastically coupled ---


@pytest.mark.parametrize("terms", [DRY, LUGRE], ids=["dry", "lugre"])
def test_against_an_independent_integration(terms: tuple[Term, ...]) -> None:
    step, n = 2e-4, 1500
    u = 20.0  # strong enough for the load to slide on without a stop
    states, _ = Simulator(bed(SPRING, *terms, viscous=2.0)).run(np.full(n, u), step)

    def right_side(t: float, y: Array) -> list[float]:
        q, v, x, w, z = y
        pull = 2e4 * (x - q) + 5.0 * (w - v)
        g = 2.0 + np.exp(-((v / 0.02) ** 2))
        z_rate = v - 2e5 * abs(v) / g * z
        friction = 2e5 * z + 300.0 * z_rate
        if terms is DRY:
            friction = g if v > 0.0 or pull > 3.0 else pull
        return [v, (pull - friction) / LOAD, w, (u - pull - 2.0 * w) / MOTOR, z_rate]

    times = step * np.arange(1, n + 1)
    tight = {"method": "LSODA", "rtol": 1e-10, "atol": 1e-13, "max_step": 1e-4}
    theirs = solve_ivp(right_side, (0.0, times[-1]), np.zeros(5), t_eval=times, **tight).y[:4].T
    assert np.max(np.abs(states - theirs) / np.ptp(theirs, axis=0)) < 2e-3


def test_the_load_sticks_exactly_behind_a_spring() -> None:
    states, friction = Simulator(bed(SPRING, *DRY)).run(wave(20_000, 0.9, 1e-3, 8.0), 1e-3)
    assert np.max(np.abs(states[:, 2])) > 1e-5
    assert np.all(states[:, :2] == 0.0)
    # What the spring pulls with in the mean, up to the damper's share.
    assert np.max(np.abs(friction)) < 3.0


@pytest.mark.parametrize(
    "transmission",
    [
        (term("compliance", stiffness=2e4),),
        (term("compliance", "hardening", stiffness=2e4, hardening=1e9),),
        (term("impact_backlash", gap=1e-3, stiffness=2e4),),
    ],
    ids=["linear", "hardening", "impact"],
)
def test_what_the_motor_gives_is_in_the_bodies_or_in_friction(transmission: tuple[Term, ...]) -> None:
    step = 5e-4
    u = wave(8000, 6.0, step)
    model = bed(*transmission, *PLAIN)
    states, friction = Simulator(model).run(u, step, 1)
    ways = np.diff(np.vstack([np.zeros(4), states]), axis=0)
    play = 0.0 if transmission[0].effect.id == "compliance" else 0.5e-3
    e = np.maximum(np.abs(states[:, 2] - states[:, 0]) - play, 0.0)
    k_3 = 1e9 if transmission[0].effect.law == "hardening" else 0.0
    held = 0.5 * MOTOR * states[:, 3] ** 2 + 0.5 * LOAD * states[:, 1] ** 2 + 0.5 * 2e4 * e**2 + 0.25 * k_3 * e**4
    given, taken = np.cumsum(u * ways[:, 2]), np.cumsum(2.0 * np.abs(ways[:, 0]))
    assert np.max(np.abs(given - taken - held)) < 1e-6 * np.sum(np.abs(u * ways[:, 2]))
    # The friction reported is the momentum that is missing.
    momentum = MOTOR * states[:, 3] + LOAD * states[:, 1]
    np.testing.assert_allclose(momentum, step * np.cumsum(u - friction), atol=1e-11)


def test_dry_friction_of_the_motor_stops_it_exactly() -> None:
    model = bed(term("impact_backlash", gap=1.0, stiffness=1e4), coulomb=2.0)
    simulator = Simulator(model)
    simulator.states[:] = 0.0, 0.0, 0.0, 0.3
    states, _ = simulator.run(np.zeros(400), 1e-3, 1)
    assert states[-1, 3] == 0.0
    assert states[-1, 2] == pytest.approx(0.3**2 / (2.0 * 2.0), rel=1e-12)
    pushed, _ = simulator.run(np.full(100, 1.9999), 1e-3, 1)
    assert np.all(pushed[:, 2] == states[-1, 2])
    pushed, _ = simulator.run(np.full(100, -3.0), 1e-3, 1)
    assert pushed[-1, 3] == pytest.approx(-0.1, rel=1e-12)


@pytest.mark.parametrize("terms", [DRY, LUGRE], ids=["dry", "lugre"])
def test_halving_the_step_changes_little(terms: tuple[Term, ...]) -> None:
    model = bed(term("impact_backlash", gap=1e-3, stiffness=5e4, damping=60.0), *terms)
    ends = []
    for step in (4e-4, 2e-4, 1e-4):
        n = round(1.2 / step)
        ends.append(Simulator(model).run(wave(n, 9.0, step), step)[0][:: n // 60])
    coarse, fine = (np.max(np.abs(each - ends[2]) / np.ptp(ends[2], axis=0)) for each in ends[:2])
    assert fine < 0.5 * coarse or fine < 1e-3
    assert fine < 2e-2


# --- what is seen ---


def test_the_sensor_sees_the_motor_and_the_load_is_a_signal() -> None:
    model = bed(SPRING)
    motion = simulate(model, np.full(200, 5.0), 1e-3, position=0.2)
    np.testing.assert_array_equal(motion.position, motion.states[:, 2])
    np.testing.assert_array_equal(motion.velocity, motion.states[:, 3])
    assert motion.states[0].tolist() == [0.2, 0.0, 0.2, 0.0]
    values = np.array(model.plant_values)
    load, deflection = (signal.of(values, motion.states, np.zeros(200)) for signal in model.plant.signals)
    np.testing.assert_array_equal(load, motion.states[:, 0])
    np.testing.assert_array_equal(deflection, motion.states[:, 2] - motion.states[:, 0])


def test_the_force_that_a_motion_needs() -> None:
    t, one = np.zeros(1), np.ones(1)
    effort, _ = Predictor(bed(coulomb=1.5, viscous=3.0)).run(t, t, -0.5 * one, 2.0 * one, 1e-3)
    assert effort[0] == pytest.approx((MOTOR + LOAD) * 2.0 - 3.0 * 0.5 - 1.5)


def test_it_is_in_the_catalogue() -> None:
    plant = PLANTS["two_mass"]
    assert plant.driven is not None
    assert plant.driven.functions == plant.functions
    assert plant.inertia(1.0, 3.0, 0.0, 0.0) == 0.75
