"""The pneumatic cylinder: the air alone, the piston on closed air, the ends of the stroke, stick-slip, and Radau's method."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.model import Model, Term, build_model, term
from fric.model_file import read_model
from fric.plants import PLANTS
from fric.plants.pneumatic import flow, opening, psi
from fric.shared_files import config_file
from fric.simulation import Simulator
from fric.verification import pneumatic_reference as reference
from numpy.typing import NDArray

Array = NDArray[np.float64]

PLANT = PLANTS["pneumatic"]
DEFAULTS: dict[str, float] = {p.name: float(p.default) for p in PLANT.parameters if p.default is not None}
AREA, STROKE, DEAD, KAPPA, RT = 3.14159e-4, 0.1, 1e-6, 1.4, 287.0 * 293.0
CLAMPED = term("coulomb", force=1e6)


def cylinder(*terms: Term, **changed: float) -> Model:
    return build_model("pneumatic", DEFAULTS | changed, terms)


def follow(model: Model, command: Array, step: float, start: Array, n_substeps: int = 1) -> Array:
    """States at all n + 1 instants."""
    simulator = Simulator(model)
    simulator.states[:] = start
    return np.vstack([start, simulator.run(command, step, n_substeps)[0]])


def test_its_values() -> None:
    model = read_model(config_file("pneumatic_model.yaml"))
    for name, value in DEFAULTS.items():
        assert model.value(name) == value
    assert model.value("area") == pytest.approx(math.pi / 4 * 0.02**2, rel=1e-5)
    # Eq. 24: 1000 velocities from -0.05 to 0.05 m/s, the innermost at 0.05/999.
    assert model.value("mass") == pytest.approx(3.7 / (7.25e5 * 0.05 / 999), rel=1e-3)
    assert model.value("coulomb.force") + model.value("accel_hysteresis.force") == pytest.approx(3.7)


# --- the valve ---


def nozzle(ratio: Array | float) -> Array:
    """Saint-Venant: speed from the enthalpy that is freed, density along the adiabat; times sqrt(R T/2)/p_n."""
    return np.asarray(ratio ** (1 / 1.4) * np.sqrt(1.4 / 0.4 * (1 - ratio ** (0.4 / 1.4))))


@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.5282, 0.53, 0.7, 0.9, 0.99, 0.9989])
def test_the_flow_function_is_that_of_a_nozzle(ratio: float) -> None:
    ratios = np.linspace(0.0, 1.0, 100_001)
    # Lowering the pressure behind the throat doesn't help beyond the greatest flow.
    expected = np.max(nozzle(ratios[ratios >= ratio]))
    assert psi(ratio, 1.4) == pytest.approx(expected, rel=1e-6)
    assert psi(1.0, 1.4) == 0.0


def test_the_flow_function_has_no_jump() -> None:
    for at in (0.5282817877, 0.999):
        assert psi(at - 1e-9, 1.4) == pytest.approx(psi(at + 1e-9, 1.4), abs=1e-7)


def test_flow_goes_both_ways_alike() -> None:
    p = np.array(list(DEFAULTS.values()))
    assert flow(p, 1e-6, 5e5, 2e5) == -flow(p, 1e-6, 2e5, 5e5) > 0.0
    assert flow(p, 1e-6, 5e5, 5e5) == 0.0
    assert flow(p, 0.0, 5e5, 1e5) == 0.0
    # Choked: alpha A p_n psi sqrt(2/(R T)) kg/s, 4.84e-3 kg/s for 2 mm^2 and 10 bar; here times R T.
    assert flow(p, 2e-6, 10e5, 1e5) / RT == pytest.approx(2e-6 * 10e5 * 0.48418 * math.sqrt(2 / RT), rel=1e-4)


@pytest.mark.parametrize(
    ("u", "overlap", "expected"), [(0.0, 0.02, 0.0), (0.02, 0.02, 0.0), (-0.51, 0.02, 0.5), (1.0, 0.02, 1.0), (3.0, 0.1, 1.0)]
)
def test_an_edge_opens_beyond_its_overlap(u: float, overlap: float, expected: float) -> None:
    assert opening(u, overlap) == pytest.approx(expected)


# --- chambers of a clamped piston ---


def test_a_chamber_fills_in_a_straight_line_while_the_flow_is_choked() -> None:
    step, n = 1e-3, 2000
    opened = 0.1
    u = 0.02 + 0.98 * opened
    start = np.array([0.05, 0.0, 1.01325e5, 1.01325e5])
    states = follow(cylinder(CLAMPED, valve_area=1e-6), np.full(n, u), step, start)
    rate = KAPPA * RT * opened * 1e-6 * 7e5 * 0.484179 * math.sqrt(2 / RT) / (DEAD + AREA * 0.05)
    t = step * np.arange(n + 1)
    choked = start[2] + rate * t < 0.528 * 7e5
    assert np.sum(choked) > 40
    np.testing.assert_allclose(states[choked, 2], (start[2] + rate * t)[choked], rtol=1e-5)
    assert states[-1, 2] == pytest.approx(7e5, rel=1e-3)
    assert np.all(states[:, :2] == start[:2])


def test_a_chamber_empties_exponentially_while_the_flow_is_choked() -> None:
    step, n = 1e-3, 300
    start = np.array([0.02, 0.0, 6e5, 6e5])
    model = cylinder(CLAMPED, supply_overlap=0.9)
    states = follow(model, np.full(n, 0.05), step, start)
    rate = KAPPA * 0.05 * 1.6e-6 * 0.484179 * math.sqrt(2 * RT) / (DEAD + AREA * (STROKE - 0.02))
    expected = 6e5 * np.exp(-rate * step * np.arange(n + 1))
    choked = expected > 1.01325e5 / 0.528
    assert np.sum(choked) > 50
    np.testing.assert_allclose(states[choked, 3], expected[choked], rtol=1e-5)
    np.testing.assert_array_equal(states[:, 2], 6e5)
    assert states[-1, 3] >= 1.01325e5


def test_nothing_moves_with_the_valve_closed() -> None:
    states = follow(cylinder(term("coulomb", force=1.0)), np.zeros(10_000), 1e-3, np.array([0.03, 0.0, 1.5e5, 1.5e5]))
    assert np.all(states == states[0])


# --- the piston on its air ---


def test_the_closed_gas_spring() -> None:
    step = 1e-4
    start = np.array([0.07, 2e-4, 4e5, 4e5])
    t, x = step * np.arange(20_001), follow(cylinder(), np.zeros(20_000), step, start)[:, 0]
    stiffness = KAPPA * 4e5 * AREA**2 * (1 / (DEAD + AREA * 0.07) + 1 / (DEAD + AREA * 0.03))
    omega = math.sqrt(stiffness / DEFAULTS["mass"])
    np.testing.assert_allclose(x - 0.07, 2e-4 / omega * np.sin(omega * t), atol=2e-2 * 2e-4 / omega)


def test_closed_air_stays_on_its_adiabat_even_through_the_ends() -> None:
    states = follow(cylinder(), np.zeros(3000), 1e-4, np.array([0.05, 10.0, 2e4, 2e4]))
    x, p_a, p_b = states[:, 0], states[:, 2], states[:, 3]
    assert np.sum(x == STROKE) > 0
    np.testing.assert_allclose(p_a * (DEAD + AREA * x) ** 1.4, p_a[0] * (DEAD + AREA * x[0]) ** 1.4, rtol=1e-4)
    np.testing.assert_allclose(
        p_b * (DEAD + AREA * (STROKE - x)) ** 1.4, p_b[0] * (DEAD + AREA * (STROKE - x[0])) ** 1.4, rtol=1e-4
    )


def test_the_step_is_of_second_order() -> None:
    wanted = np.repeat([0.035, -0.05, 0.03], 100)
    start = np.array([0.03, 0.0, 1.01325e5, 1.01325e5])
    model = cylinder(term("viscous", coefficient=20.0))
    runs = [follow(model, wanted, 1e-3, start, n) for n in (2, 4, 16)]
    coarse, fine = (np.max(np.abs(run - runs[2]), axis=0) for run in runs[:2])
    assert np.all(coarse / fine > 3.0)


def test_radau_s_method_agrees() -> None:
    step, n = 1e-3, 400
    start = np.array([0.06, 0.0, 1.01325e5, 1.01325e5])
    wanted = np.array([-0.04, 0.06])

    def command(t: float) -> float:
        return float(wanted[0] if t < 0.2 else wanted[1])

    mine = follow(cylinder(term("viscous", coefficient=30.0)), np.repeat(wanted, n // 2), step, start, 9)
    theirs = reference.free_motion(start, step * np.arange(n + 1.0), command, (0.2,), 30.0)
    assert np.all(np.ptp(theirs, axis=0) > [0.01, 0.1, 1e4, 1e4])
    assert np.max(np.max(np.abs(mine - theirs), axis=0) / np.ptp(theirs, axis=0)) < 1e-4


def test_both_directions_alike() -> None:
    terms = [term("coulomb", force=2.0), term("viscous", coefficient=15.0)]
    wanted = np.repeat([0.03, -0.04, 0.022], 100)
    forth = follow(cylinder(*terms), wanted, 1e-3, np.array([0.03, 0.0, 1.2e5, 1.1e5]))
    back = follow(cylinder(*terms), -wanted, 1e-3, np.array([0.07, 0.0, 1.1e5, 1.2e5]))
    np.testing.assert_allclose(back[:, 0], STROKE - forth[:, 0], atol=1e-9)
    np.testing.assert_allclose(back[:, 2:], forth[:, :1:-1], rtol=1e-7)


def test_the_ends_of_the_stroke_stop_it() -> None:
    model = cylinder(term("coulomb", force=2.0), term("viscous", coefficient=15.0))
    wanted = np.repeat([0.5, -0.5, 0.5], 500)
    states = follow(model, wanted, 1e-3, np.array([0.05, 0.0, 1.01325e5, 1.01325e5]))
    x, v = states[:, 0], states[:, 1]
    assert np.min(x) == 0.0
    assert np.max(x) == STROKE
    for end in (500, 1000, 1500):
        last = slice(end - 100, end)
        assert np.all(x[last] == (0.0 if end == 1000 else STROKE))
        assert np.all(v[last] == 0.0)


@pytest.mark.parametrize("n_substeps", [1, 9])
def test_it_is_stable_under_any_command(n_substeps: int) -> None:
    model = read_model(config_file("pneumatic_model.yaml"))
    random = np.random.default_rng(1)
    wanted = np.repeat(random.uniform(-1.5, 1.5, 100) * random.choice([0.03, 1.0], 100), 40)
    states = follow(model, wanted, 1e-3, np.array([0.05, 0.0, 1.01325e5, 1.01325e5]), n_substeps)
    assert np.all(np.isfinite(states))
    assert np.all((states[:, 0] >= 0.0) & (states[:, 0] <= STROKE))
    assert np.all((states[:, 2:] > 0.3e5) & (states[:, 2:] < 60e5))
    assert np.ptp(states[:, 0]) > 0.05


# --- stick-slip ---


def test_stick_slip_under_a_constant_command() -> None:
    step = 1e-4
    model = read_model(config_file("pneumatic_model.yaml"))
    simulator = Simulator(model, position=0.002)
    states, friction = simulator.run(np.full(20_000, 0.0208), step)
    v = states[:, 1]
    force = AREA * (states[:, 2] - states[:, 3])
    starts = np.flatnonzero((v[1:] > 0.0) & (v[:-1] == 0.0))
    assert starts.shape[0] > 10
    np.testing.assert_allclose(force[starts], 3.7, rtol=0.01)
    rests = (v[1:] == 0.0) & (v[:-1] == 0.0)
    assert np.all(np.diff(states[:, 0])[rests] == 0.0)
    # At rest friction is what the air pushes, in the middle of the step.
    middle = 0.5 * (force[1:] + force[:-1])
    np.testing.assert_allclose(friction[1:][rests], middle[rests], atol=1e-4)


def test_what_it_measures() -> None:
    values = np.array(list(DEFAULTS.values()))
    states = np.array([[0.01, 0.0, 3e5, 2e5], [0.02, 0.1, 1e5, 4e5]])
    signals = {signal.name: signal.of(values, states, np.zeros(2)) for signal in PLANT.signals}
    np.testing.assert_array_equal(signals["pressure_a"], [3e5, 1e5])
    np.testing.assert_array_equal(signals["pressure_b"], [2e5, 4e5])
    assert PLANT.effort is not None
    np.testing.assert_allclose(PLANT.effort(values, states, np.zeros(2)), [AREA * 1e5, -AREA * 3e5])
    assert PLANT.command.lower == -1.0
    np.testing.assert_array_equal(PLANT.start(values, 0.2, 0.0), [0.1, 0.0, 1.01325e5, 1.01325e5])
