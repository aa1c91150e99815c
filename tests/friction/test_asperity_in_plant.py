"""The asperity population as slip law of a moving body."""

from __future__ import annotations

import numpy as np
import pytest
from fric.friction.asperity import AsperityParameters, AsperityPopulation
from fric.model import Model, build_model, term
from fric.simulation import Predictor, Simulator

LEVEL, STIFFNESS, WAVE, TIME, GROWTH, N = 4.0, 2e5, 1e-3, 0.05, 3.0, 400
GAP = 0.8


def model(mass: float = 20.0, n: int = N, viscous: float = 0.0) -> Model:
    law = term(
        "presliding", "asperity", stiffness=STIFFNESS, wavelength=WAVE, time=TIME, growth=GROWTH, gap=GAP, asperities=n, seed=5
    )
    return build_model("rigid", {"mass": mass}, [term("coulomb", force=LEVEL), term("viscous", coefficient=viscous), law])


def population(n: int = N) -> AsperityPopulation:
    return AsperityPopulation(AsperityParameters(LEVEL, STIFFNESS, WAVE, TIME, GROWTH, gap=GAP), n, seed=5)


def energy(states: np.ndarray, n: int = N) -> float:
    each = STIFFNESS * (1 + GAP) / n
    return 0.5 * each * float(np.sum(states[n : 2 * n] ** 2))


def test_along_a_given_motion_it_is_the_population() -> None:
    rng = np.random.default_rng(1)
    velocity = np.repeat(rng.normal(0.0, 0.05, 40), 25)
    h = 2e-3
    position = np.concatenate([[0.0], np.cumsum(velocity * h)])
    _, friction = Predictor(model()).run(np.arange(velocity.shape[0]) * h, position[:-1], velocity, np.zeros_like(velocity), h)
    assert friction == pytest.approx(population().run(position, h).force, rel=1e-6, abs=1e-6)


def test_a_body_pushed_below_its_friction_stays_where_springs_hold_it() -> None:
    simulator = Simulator(model(viscous=500.0))
    share = float(np.mean(simulator.friction_state[3 * N :] % 2))
    states, _ = simulator.run(np.full(4000, 0.1), 1e-3)
    assert abs(states[-1, 1]) < 1e-9
    assert states[-1, 0] == pytest.approx(0.1 / (STIFFNESS * (1 + GAP) * share), rel=0.05)


def test_it_slides_where_the_population_balances_the_force() -> None:
    n = 4000
    simulator = Simulator(model(n=n, viscous=600.0))
    states, friction = simulator.run(np.full(4000, 40.0), 1e-3)
    speed = float(np.mean(states[2000:, 1]))
    steady = population(n).run(speed * 1e-3 * np.arange(4001), 1e-3)
    assert np.mean(friction[2000:]) == pytest.approx(40.0 - 600.0 * speed, abs=0.05)
    assert np.mean(friction[2000:]) == pytest.approx(np.mean(steady.force[2000:]), rel=0.02)
    assert LEVEL < np.mean(friction[2000:]) < GROWTH * LEVEL


def test_states_stay_within_what_contacts_can_hold() -> None:
    """Also where the solver of the step has interpolated between a trial with and one without a lost contact."""
    simulator = Simulator(model(mass=2.0))
    rng = np.random.default_rng(2)
    largest = 2.5 * LEVEL / STIFFNESS * GROWTH
    for _ in range(50):
        simulator.run(rng.normal(0.0, 20.0, 20), 1e-3, 1)
        q, d, clock, event = simulator.friction_state.reshape(4, N)
        assert np.all(np.isfinite(simulator.friction_state))
        assert np.all(np.abs(d) < 1.5 * largest)
        assert np.all((clock > -0.5) & (clock < 1.5))
        assert np.all((q > -0.2 * WAVE) & (q < 2.2 * WAVE))
        assert np.all(event > 0.5)


def test_the_body_gets_no_energy_from_its_asperities() -> None:
    mass = 2.0
    simulator = Simulator(model(mass))
    n_steps = 1500
    t = 1e-3 * np.arange(n_steps)
    position = velocity = work = dissipated = 0.0
    for u in 25.0 * np.sin(2 * np.pi * 1.5 * t) + 10.0 * np.sin(2 * np.pi * 40 * t):
        before = energy(simulator.friction_state)
        states, friction = simulator.run(np.array([u]), 1e-3, 1)
        way = states[0, 0] - position
        taken = u * way - 0.5 * mass * (states[0, 1] ** 2 - velocity**2)
        if states[0, 1] * velocity > 0.0:  # otherwise there are two forces in the step, in opposite directions
            assert friction[0] * way == pytest.approx(taken, rel=1e-9, abs=1e-12)
        work += abs(taken)
        dissipated += taken - (energy(simulator.friction_state) - before)
        assert dissipated >= -1e-6
        position, velocity = states[0]
    assert work > 0.1
    assert dissipated > 0.3 * work


def test_half_the_step_gives_nearly_the_same_motion() -> None:
    effort = np.repeat([15.0, -10.0, 20.0, 0.0], 200)
    ends = []
    for n in (4, 8):
        states, _ = Simulator(model(viscous=50.0)).run(effort, 1e-3, n)
        ends.append(states[:, 0])
    assert np.max(np.abs(ends[0] - ends[1])) < 2e-3 * float(np.ptp(ends[0]))


def test_the_load_changes_where_contacts_slip() -> None:
    """Half the load is half the level: the population whose springs are as stiff and slip at half the force."""
    loaded = model().with_terms([*model().terms, term("load_dependence")])
    h = 1e-3
    position = 0.02 * h * np.arange(401)
    _, friction = Predictor(loaded).run(
        h * np.arange(400), position[:-1], np.full(400, 0.02), np.zeros(400), h, load=np.array([0.5])
    )
    half = AsperityPopulation(AsperityParameters(0.5 * LEVEL, STIFFNESS, WAVE, TIME, GROWTH, gap=GAP), N, seed=5)
    assert friction == pytest.approx(half.run(position, h).force, rel=1e-9)


@pytest.mark.parametrize("creep", [1e-9, -1e-9])
def test_contacts_let_go_of_what_a_fallen_load_no_longer_holds(creep: float) -> None:
    loaded = model().with_terms([*model().terms, term("load_dependence")])
    n = 100
    velocity = np.concatenate([np.full(n, 0.02), np.full(5, creep)])
    load = np.concatenate([np.full(n, 1.0), np.full(5, 0.1)])
    zeros = np.zeros(n + 5)
    _, friction = Predictor(loaded).run(1e-3 * np.arange(n + 5), zeros, velocity, zeros, 1e-3, load=load)
    assert friction[n - 1] > LEVEL
    assert np.all(np.abs(friction[n:]) < 0.1 * GROWTH * LEVEL)
