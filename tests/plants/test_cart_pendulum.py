"""Cart with inverted pendulum: energy, momentum, an independent integration, and a cart that sticks under a swinging pole."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.model import Model, Term, build_model, term
from fric.simulation import Predictor, Simulator
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
CART, POLE, LENGTH, INERTIA, GRAVITY = 1.5, 0.4, 0.3, 0.012, 9.81
LEVER, WEIGHT, TOTAL = POLE * LENGTH, POLE * LENGTH * GRAVITY, INERTIA + POLE * LENGTH**2


def system(*terms: Term, damping: float = 0.0, start: float = 1.0, gravity: float = GRAVITY) -> Model:
    values = {
        **{"cart_mass": CART, "pole_mass": POLE, "length": LENGTH, "pole_inertia": INERTIA},
        **{"gravity": gravity, "pivot_damping": damping, "start": start},
    }
    return build_model("cart_pendulum", values, terms)


def energy(states: Array) -> Array:
    _, v, a, w = states.T
    return np.asarray(0.5 * (CART + POLE) * v**2 + LEVER * v * w * np.cos(a) + 0.5 * TOTAL * w**2 + WEIGHT * np.cos(a))


def test_upright_is_an_equilibrium_and_an_unstable_one() -> None:
    states, _ = Simulator(system(start=0.0)).run(np.zeros(2000), 1e-3)
    assert np.all(states == 0.0)
    states, _ = Simulator(system(start=1e-6)).run(np.zeros(800), 1e-3)
    rate = math.sqrt(WEIGHT / (TOTAL - LEVER**2 / (CART + POLE)))
    assert states[-1, 2] == pytest.approx(1e-6 * math.cosh(0.8 * rate), rel=1e-3)


def test_energy_swings_with_the_square_of_the_step_and_does_not_drift() -> None:
    swings = []
    for step in (4e-3, 2e-3, 1e-3):
        states, _ = Simulator(system()).run(np.zeros(round(60.0 / step)), step, 1)
        off = energy(states) - WEIGHT * math.cos(1.0)
        swings.append(np.max(np.abs(off)) / WEIGHT)
        part = off.shape[0] // 10
        assert abs(np.mean(off[-part:]) - np.mean(off[:part])) < 0.05 * swings[-1] * WEIGHT
    assert swings[-1] < 1e-5
    assert swings[0] / swings[1] == pytest.approx(4.0, rel=0.1)
    assert swings[1] / swings[2] == pytest.approx(4.0, rel=0.1)


def test_the_centre_of_mass_stays_where_it_is() -> None:
    states, _ = Simulator(system()).run(np.zeros(20_000), 1e-3, 1)
    centre = ((CART + POLE) * states[:, 0] + LEVER * np.sin(states[:, 2])) / (CART + POLE)
    assert np.ptp(states[:, 0]) > 0.05
    np.testing.assert_allclose(centre, LEVER * math.sin(1.0) / (CART + POLE), atol=1e-5)


@pytest.mark.parametrize("terms", [(), (term("viscous", coefficient=2.0),)], ids=["free", "viscous"])
def test_against_an_independent_integration(terms: tuple[Term, ...]) -> None:
    states, _ = Simulator(system(*terms, damping=3e-3)).run(np.full(3000, 3.0), 1e-3)
    friction = 2.0 if terms else 0.0

    def right_side(t: float, y: Array) -> list[float]:
        _, v, a, w = y
        mass = np.array([[CART + POLE, LEVER * np.cos(a)], [LEVER * np.cos(a), TOTAL]])
        pull = [3.0 + LEVER * w**2 * np.sin(a) - friction * v, WEIGHT * np.sin(a) - 3e-3 * w]
        first, second = np.linalg.solve(mass, pull)
        return [v, float(first), w, float(second)]

    times = 1e-3 * np.arange(1, 3001)
    start = [0.0, 0.0, 1.0, 0.0]
    theirs = solve_ivp(right_side, (0.0, 3.0), start, t_eval=times, method="DOP853", rtol=1e-11, atol=1e-12).y.T
    assert np.max(np.abs(states - theirs) / np.ptp(theirs, axis=0)) < 1e-4


def test_a_cart_that_friction_holds_does_not_move_and_its_pole_swings_about_a_fixed_pivot() -> None:
    states, friction = Simulator(system(term("coulomb", force=50.0))).run(np.zeros(4000), 1e-3, 1)
    assert np.all(states[:, :2] == 0.0)

    def right_side(t: float, y: Array) -> list[float]:
        return [y[1], WEIGHT * math.sin(y[0]) / TOTAL]

    times = 1e-3 * np.arange(1, 4001)
    pole = solve_ivp(right_side, (0.0, 4.0), [1.0, 0.0], t_eval=times, method="DOP853", rtol=1e-11, atol=1e-12).y
    np.testing.assert_allclose(states[:, 2], pole[0], atol=1e-6)
    # Friction holds the horizontal force of the pole: the acceleration of its centre of mass.
    a, w = pole[:, 1:]
    a, w = 0.5 * (a + pole[0, :-1]), 0.5 * (w + pole[1, :-1])
    expected = LEVER * (w**2 * np.sin(a) - WEIGHT * np.sin(a) / TOTAL * np.cos(a))
    np.testing.assert_allclose(friction[1:], expected, atol=1e-3)


def test_it_slips_only_when_friction_is_overcome_and_energy_falls() -> None:
    states, friction = Simulator(system(term("coulomb", force=3.0))).run(np.zeros(20_000), 1e-3, 1)
    still = (states[1:, 1] == 0.0) & (states[:-1, 1] == 0.0)
    assert 100 < np.sum(still) < 19_000
    assert np.max(np.abs(friction)) <= 3.0 + 1e-12
    way = np.abs(np.diff(np.concatenate([[0.0], states[:, 0]])))
    balance = energy(states) + 3.0 * np.cumsum(way) - WEIGHT * math.cos(1.0)
    assert np.max(np.abs(balance)) < 1e-3 * 3.0 * np.sum(way)


def test_the_start_and_the_signals() -> None:
    model = system(start=0.4)
    simulator = Simulator(model, 0.2, 0.1)
    assert simulator.states.tolist() == [0.2, 0.1, 0.4, 0.0]
    states = np.arange(8.0).reshape(2, 4)
    signals = {signal.name: signal.of(np.array(model.plant_values), states, np.zeros(2)) for signal in model.plant.signals}
    assert signals["pole_angle"].tolist() == [2.0, 6.0]
    assert signals["pole_rate"].tolist() == [3.0, 7.0]


def test_the_force_that_a_motion_needs_without_the_pole_swinging() -> None:
    one = np.ones(1)
    effort, _ = Predictor(system()).run(0 * one, one, one, 2.0 * one, 1e-3)
    assert effort[0] == pytest.approx((CART + POLE) * 2.0)
