"""The quarter car on its road simulator: the paper's numbers, balance, exact sticking, and Radau's method beside it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.friction.lubricated_bearing import general
from fric.model import Model, build_model, term
from fric.model_file import read_model
from fric.plants import PLANTS
from fric.shared_files import config_file
from fric.simulation import Simulator
from fric.verification.quarter_car_reference import integrate, normal_force
from numpy.typing import NDArray

Array = NDArray[np.float64]

PLANT = PLANTS["quarter_car"]
STATES = {name: number for number, name in enumerate(PLANT.states)}
MU, CURVATURE, VISCOUS, TRANSITION = 0.3, 0.02, 2500.0, 187.9


def car(*, rough: bool = True, mu: float = MU, **changed: float) -> Model:
    values = {p.name: p.default for p in PLANT.parameters} | changed
    terms = general(mu, TRANSITION, CURVATURE, VISCOUS, values["nominal_load"] or 0.0) if rough else ()
    return build_model("quarter_car", values, terms)  # type: ignore[arg-type]


def follow(model: Model, wanted: Array, step: float, start: Array | None = None) -> tuple[Array, Array]:
    """States at all n + 1 instants and contact force over all n intervals."""
    simulator = Simulator(model)
    if start is not None:
        simulator.states[:] = start
    first = simulator.states.copy()
    states, friction = simulator.run(wanted, step, 1)
    return np.vstack([first, states]), friction


def test_its_values_are_the_paper_s() -> None:
    # The paper's list of symbols.
    listed = {
        **{"body_mass": 240, "wheel_mass": 40, "tyre_mass": 5, "suspension_stiffness": 2.89e4, "suspension_damping": 260},
        **{"tyre_stiffness": 9.2e5, "tyre_damping": 3886, "strut_length": 0.342, "area_1": 1.96e-3, "area_2": 0.94e-3},
        **{"volume_1": 80e-6, "volume_2": 167e-6, "actuator_damping": 500, "supply_pressure": 200e5},
        **{"leakage_resistance": 2.45e11, "flow_constant": 0.99e-4, "bulk_modulus": 1.43e9},
    }
    for model in (car(), *(read_model(config_file(f"quarter_car_{name}.yaml")) for name in ("model", "conventional"))):
        for name, value in listed.items():
            assert model.value(name) == value
    assert len(read_model(config_file("quarter_car_conventional.yaml")).terms) == 0


# --- balance ---


@pytest.mark.parametrize("rough", [True, False])
@pytest.mark.parametrize("gravity", [9.81, 60.0])  # the second takes more pressure under the piston than above it
@pytest.mark.parametrize("position", [0.0, 0.085])
def test_it_starts_in_balance_and_stays_there(rough: bool, gravity: float, position: float) -> None:
    model = car(rough=rough, gravity=gravity)
    simulator = Simulator(model, position)
    start = simulator.states.copy()
    lifting, other = np.linalg.solve([[1.96e-3, -0.94e-3], [1.0, 1.0]], [285.0 * gravity, 200e5])
    assert start[STATES["pressure_1"]] == pytest.approx(lifting, rel=1e-12)
    assert start[STATES["pressure_2"]] == pytest.approx(other, rel=1e-12)
    assert math.copysign(1.0, start[STATES["spool"]]) == math.copysign(1.0, lifting - other)
    states, _ = simulator.run(np.full(5000, position), 1e-3)
    scale = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1e7, 1e7, 1.0, 1.0])
    np.testing.assert_allclose(states / scale, np.broadcast_to(start / scale, states.shape), rtol=0, atol=1e-12)
    if rough:
        assert np.all(states[:, 0] == position)


# --- sticking ---


def test_the_body_does_not_move_at_all_while_the_wheel_stays_inside_the_stiction_band() -> None:
    wanted = 0.006 * np.sin(2 * np.pi * 0.5 * 1e-3 * np.arange(20_000))
    states, friction = follow(car(), wanted, 1e-3)
    assert np.all(states[:, :2] == 0.0)
    assert np.ptp(states[:, 2]) > 0.01
    # What holds it is the suspension's force, and nothing more.
    middle = 0.5 * (states[1:] + states[:-1])
    np.testing.assert_allclose(friction, 2.89e4 * middle[:, 2] + 260.0 * middle[:, 3], atol=0.02)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_it_breaks_away_where_the_suspension_exceeds_transition_and_coulomb_friction(direction: float) -> None:
    step = 1e-3
    wanted = direction * 0.004 * step * np.arange(4000)
    states, _ = follow(car(), wanted, step)
    moves = int(np.argmax(states[:, 0] != 0.0))
    assert moves > 0
    force, limit = np.empty(2), np.empty(2)
    for k in range(2):  # just before and just after
        d, rate = states[moves - 1 + k, 2] - states[moves - 1 + k, 0], states[moves - 1 + k, 3]
        force[k] = direction * (2.89e4 * d + 260.0 * rate)
        limit[k] = TRANSITION + MU * float(normal_force(d, rate, 1.0472))
    assert force[0] <= limit[0] + 0.1
    assert force[1] >= limit[1] - 0.1
    # The strut lies flatter when compressed: it takes more to push the body up than to pull it down.
    assert np.sign(limit[0] - TRANSITION / (1.0 - MU / math.tan(1.0472))) == direction


# --- the whole, against Radau's method on equations typed a second time ---


def _deviation(model: Model, expected: Array, wanted: float, step: float, span: float) -> Array:
    every = round(span / step / (expected.shape[0] - 1))
    states, _ = follow(model, np.full(round(span / step), wanted), step, expected[0])
    off: Array = np.max(np.abs(states[::every] - expected), axis=0) / np.ptp(expected, axis=0)
    return off


def test_without_friction_it_converges_to_radau_with_the_square_of_the_step() -> None:
    start = Simulator(car(rough=False)).states.copy()
    expected = integrate(start, np.linspace(0.0, 1.0, 101), lambda t: np.full_like(t, 0.05))
    errors = [_deviation(car(rough=False), expected, 0.05, step, 1.0).max() for step in (1e-3, 5e-4, 2.5e-4)]
    assert errors[0] < 1e-4
    assert errors[0] / errors[2] > 12.0, errors


def test_sliding_under_the_general_law_it_converges_to_radau_too() -> None:
    start = Simulator(car()).states.copy()
    start[[1, 3]] = 0.4  # so that the body slides one way throughout

    def friction(v: float, d: float, rate: float) -> float:
        assert v > 0.0
        return TRANSITION * np.exp(-v / CURVATURE) + MU * float(normal_force(d, rate, 1.0472)) + VISCOUS * v

    expected = integrate(start, np.linspace(0.0, 0.3, 31), lambda t: np.full_like(t, 0.12), friction=friction)
    errors = [_deviation(car(), expected, 0.12, step, 0.3)[:4].max() for step in (1e-3, 5e-4, 2.5e-4)]
    assert errors[0] < 1e-4
    # The kink in |F_nb| costs some regularity.
    assert errors[0] / errors[2] > 8.0, errors


def test_stick_and_slip_do_not_depend_on_the_step() -> None:
    moves = []
    for step in (1e-3, 2.5e-4):
        n = round(2.0 / step)
        states, _ = follow(car(), 0.05 * np.minimum(step * (np.arange(n) + 0.5), 1.0), step)
        moves.append(states[:: round(1e-3 / step)])
    assert np.any(moves[0][:, 1] != 0.0)
    assert moves[0][-1, 1] == 0.0
    np.testing.assert_allclose(moves[0][:, 0], moves[1][:, 0], atol=1e-4 * np.ptp(moves[1][:, 0]))


def test_the_force_it_reports_is_the_one_that_moves_the_body() -> None:
    model = car()
    wanted = 0.05 * np.sin(2 * np.pi * 0.7 * 1e-3 * np.arange(4000))
    states, contact = follow(model, wanted, 1e-3)
    effort = PLANT.effort
    assert effort is not None
    suspension = effort(np.array(model.plant_values), states, wanted)
    np.testing.assert_allclose(
        suspension, 2.89e4 * (states[:, 2] - states[:, 0]) + 260.0 * (states[:, 3] - states[:, 1]), rtol=1e-12, atol=1e-12
    )
    mean = 0.5 * (suspension[1:] + suspension[:-1])
    # Momentum of the body: suspension less bearing, coulomb, transition and viscous part.
    impulse = np.cumsum(mean - contact) * 1e-3 - VISCOUS * (states[1:, 0] - states[0, 0])
    np.testing.assert_allclose(impulse, 240.0 * states[1:, 1], atol=1e-3 * np.ptp(240.0 * states[:, 1]))


def test_signals() -> None:
    model = car()
    wanted = 0.05 * np.sin(2 * np.pi * 0.7 * 1e-3 * np.arange(3000))
    states, _ = follow(model, wanted, 1e-3)
    found = {signal.name: signal.of(np.array(model.plant_values), states, wanted) for signal in PLANT.signals}
    d, rate = states[:, 2] - states[:, 0], states[:, 3] - states[:, 1]
    np.testing.assert_allclose(found["normal_load"], normal_force(d, rate, 1.0472), rtol=1e-9)
    for name in ("wheel_position", "road_position", "pressure_1", "pressure_2"):
        np.testing.assert_array_equal(found[name], states[:, STATES[name]])


# --- robustness ---


def test_a_load_from_outside_scales_the_normal_load() -> None:
    start = Simulator(car()).states.copy()
    start[1] = 0.3
    friction = []
    for load, mu in ((1.0, 0.2), (2.0, 0.1)):
        simulator = Simulator(car(mu=mu))
        simulator.states[:] = start
        friction.append(simulator.run(np.full(200, 0.1), 1e-3, load=np.array([load]))[1])
    np.testing.assert_allclose(friction[0], friction[1], rtol=1e-12)


@pytest.mark.parametrize("hold", [1, 700])
def test_no_command_breaks_it(hold: int) -> None:
    random = np.random.default_rng(1)
    wanted = np.repeat(random.choice([-1e6, 1e6, 0.0, 0.1], 20_000 // hold), hold)
    for model in (car(), car(rough=False)):
        states, friction = follow(model, wanted, 1e-3)
        assert np.all(np.isfinite(states))
        assert np.all(np.isfinite(friction))
        # The oil volumes stay above their floor: 0.178 m empties the side of the rod, -0.041 m the other.
        assert states[:, STATES["road_position"]].min() > -0.037
        assert states[:, STATES["road_position"]].max() < 0.17


def test_sample_by_sample_is_one_run_to_the_last_bit() -> None:
    wanted = 0.03 * np.sin(0.02 * np.arange(300))
    states, _ = Simulator(car()).run(wanted, 1e-3)
    single = Simulator(car())
    for k, value in enumerate(wanted):
        state, _ = single.run(np.array([value]), 1e-3)
        assert state[0].tobytes() == states[k].tobytes()


def test_a_pre_sliding_law_takes_the_place_of_exact_sticking() -> None:
    terms = (*general(0.0, TRANSITION, CURVATURE, VISCOUS, 1000.0), term("presliding", "lugre", stiffness=5e6))
    values = {p.name: p.default for p in PLANT.parameters}
    model = build_model("quarter_car", values, terms)  # type: ignore[arg-type]
    states, _ = Simulator(model).run(np.full(1000, 0.004), 1e-3)
    body, wheel = states[-1, 0], states[-1, 2]
    # Slow loading of bristles from rest: F = g (1 - exp(-sigma x/g)).
    force = 2.89e4 * (wheel - body)
    assert body == pytest.approx(-TRANSITION / 5e6 * math.log(1.0 - force / TRANSITION), rel=0.01)
    assert body > 2e-5
