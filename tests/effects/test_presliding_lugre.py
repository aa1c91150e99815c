"""LuGre pre-sliding: against an implicit integration of the published equations, and against what follows from them on paper."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from fric_nodes.model import Model, build_model, term
from fric_nodes.simulate import Predictor, Simulator, simulate, substeps

Array = NDArray[np.float64]

COULOMB, SURPLUS, STRIBECK, VISCOUS = 4.0, 2.0, 0.01, 10.0


def axis(
    stiffness: float = 1e5, damping: float = 100.0, mass: float = 1.2, bias: float = 0.0, viscous: float = VISCOUS, forward: float = 0.0
) -> Model:
    terms = [
        term("coulomb", force=COULOMB),
        term("stribeck", force=SURPLUS, velocity=STRIBECK),
        term("asymmetry", force=forward),
        term("presliding", stiffness=stiffness, damping=damping),
        term("viscous", coefficient=viscous),
        term("bias", force=bias),
    ]
    return build_model("rigid", {"mass": mass}, terms)


def radau(drive: object, t_end: float, step: float, stiffness: float, damping: float, mass: float, viscous: float) -> tuple[Array, ...]:
    """Canudas de Wit et al. 1995, Eqs. 1 to 3 (g from Eq. 5), with the body they act on; the impulse of friction as a fourth state."""

    def right_side(t: float, y: Array) -> list[float]:
        _, v, z, _ = y
        g = COULOMB + SURPLUS * np.exp(-((v / STRIBECK) ** 2))
        dz = v - stiffness * abs(v) / g * z
        friction = stiffness * z + damping * dz
        return [v, (drive(t) - friction - viscous * v) / mass, dz, friction]  # type: ignore[operator]

    grid = step * np.arange(round(t_end / step) + 1)
    scale = np.array([1e-3, 1e-2, 1e-5, 1e-2])
    answer = solve_ivp(right_side, (0.0, grid[-1]), np.zeros(4), method="Radau", rtol=1e-10, atol=1e-10 * scale, t_eval=grid)
    assert answer.success
    return answer.y[0], answer.y[1], np.diff(answer.y[3]) / step


@pytest.mark.parametrize(
    ("stiffness", "damping", "mass"),
    [(1e5, 100.0, 1.2), (1e5, 0.0, 1.2), (1e6, 800.0, 2.0), (1e5, 316.0, 0.3)],
)
def test_force_and_motion_at_1_khz_match_an_implicit_integration(stiffness: float, damping: float, mass: float) -> None:
    def drive(t: float) -> float:
        return float(12.0 * np.sin(2 * np.pi * 0.7 * t))

    model = axis(stiffness, damping, mass)
    t = 1e-3 * np.arange(1500)
    effort = 12.0 * np.sin(2 * np.pi * 0.7 * (t + 0.5e-3))
    q, _, expected = radau(drive, 1.5, 1e-3, stiffness, damping, mass, VISCOUS)
    states, friction = Simulator(model).run(effort, 1e-3)
    force_error = np.max(np.abs(friction - expected)) / np.ptp(expected)
    assert force_error < 1e-4, force_error
    assert np.max(np.abs(states[:, 0] - q[1:])) < 1e-4 * np.ptp(q)


def test_the_error_falls_with_the_square_of_the_step() -> None:
    def drive(t: float) -> float:
        return float(9.0 * np.sin(2 * np.pi * 2.0 * t))

    q, _, _ = radau(drive, 0.6, 1e-3, 1e5, 100.0, 1.2, VISCOUS)
    errors = []
    for refine in (2, 4, 8):
        step = 1e-3 / refine
        effort = 9.0 * np.sin(2 * np.pi * 2.0 * step * (np.arange(600 * refine) + 0.5))
        states, _ = Simulator(axis()).run(effort, step, 1)
        errors.append(float(np.max(np.abs(states[refine - 1 :: refine, 0] - q[1:]))))
    assert errors[0] / errors[1] > 3.0, errors
    assert errors[1] / errors[2] > 3.0, errors


def test_break_away_under_a_slow_ramp_takes_coulomb_and_stribeck_force_together() -> None:
    # 0.5 N/s: slow enough that the bristles follow.
    effort = np.linspace(0.0, 8.0, 16_001)
    motion = simulate(axis(stiffness=1e6, damping=500.0), effort, 1e-3)
    slips = int(np.argmax(motion.velocity > 0.05))
    assert effort[slips] == pytest.approx(COULOMB + SURPLUS, rel=0.02)
    assert np.max(motion.friction) == pytest.approx(COULOMB + SURPLUS, rel=0.02)
    assert np.max(motion.friction) <= (COULOMB + SURPLUS) * (1 + 1e-9)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_steady_sliding_gives_the_slip_level_of_the_other_terms(direction: float) -> None:
    model = axis(mass=1e12, viscous=0.0, forward=0.5)
    for speed in (1e-4, 1e-3, 0.005, 0.01, 0.03, 1.0, 30.0):
        v = direction * speed
        # 40 relaxation lengths of the bristles, F_S/sigma_0 each.
        n = max(int(40 * 6.5e-5 / speed / 1e-3), 10)
        _, friction = Simulator(model, 0.0, v).run(np.zeros(n), 1e-3, 1)
        expected = direction * (COULOMB + SURPLUS * np.exp(-((speed / STRIBECK) ** 2))) + 0.5
        assert friction[-1] == pytest.approx(expected, rel=1e-9)
        wanted, _ = Predictor(model.with_value("mass", 1.0)).run(np.zeros(n), np.zeros(n), np.full(n, v), np.zeros(n), 1e-3)
        assert wanted[-1] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_small_force_bends_the_bristles_by_force_over_stiffness(direction: float) -> None:
    push = direction * 6e-3  # a thousandth of break-away: dz/dt = v (1 - z/z_max) bends off by half of that
    motion = simulate(axis(damping=300.0), np.full(3000, push), 1e-3)
    assert motion.position[-1] == pytest.approx(push / 1e5, rel=1e-3)
    assert motion.friction[-1] == pytest.approx(push, rel=1e-6)


def test_small_oscillation_has_the_natural_frequency_of_the_body_on_its_bristles() -> None:
    # Released from a deflection of a thousandth of break-away, no damping.
    model = axis(damping=0.0, viscous=0.0)
    simulator = Simulator(model)
    simulator.friction_state[:] = 6e-8
    states, _ = simulator.run(np.zeros(4000), 1e-4, 1)
    v = states[:, 1]
    crossings = np.flatnonzero((v[1:] > 0) & (v[:-1] <= 0))
    period = 1e-4 * (crossings[-1] - crossings[0]) / (crossings.shape[0] - 1)
    assert period == pytest.approx(2 * np.pi * np.sqrt(1.2 / 1e5), rel=2e-3)


def test_the_bristles_never_bend_beyond_what_break_away_takes() -> None:
    rng = np.random.default_rng(3)
    simulator = Simulator(axis(damping=100.0))
    largest = 0.0
    for force in 20.0 * rng.standard_normal(3000):
        simulator.step(float(force), 1e-3)
        largest = max(largest, abs(float(simulator.friction_state[0])))
    assert 0.5 * 4.0 / 1e5 < largest <= 6.0 / 1e5


def test_a_body_at_rest_on_its_bristles_comes_to_rest_for_good() -> None:
    motion = simulate(axis(damping=300.0, bias=3.0), np.zeros(60_000), 1e-3)
    assert np.max(np.abs(motion.velocity[-1000:])) < 1e-15
    assert motion.position[-1] - motion.position[30_000] == pytest.approx(0.0, abs=1e-15)
    assert motion.friction[-1] == pytest.approx(-3.0, rel=1e-12)


def test_without_slip_level_there_is_no_friction() -> None:
    model = axis(viscous=0.0).with_value("coulomb.force", 0.0).with_value("stribeck.force", 0.0)
    motion = simulate(model, np.zeros(100), 1e-3, velocity=0.3)
    assert np.all(motion.velocity == 0.3)
    assert np.all(motion.friction == 0.0)


def test_the_balance_of_momentum_closes_and_the_predictor_agrees() -> None:
    model = axis(bias=0.7)
    t = 5e-4 * (np.arange(6000) + 0.5)
    effort = 14.0 * np.sin(2 * np.pi * 0.7 * t)
    states, friction = Simulator(model).run(effort, 5e-4, 1)
    q, v = np.r_[0.0, states[:, 0]], np.r_[0.0, states[:, 1]]
    mean = 0.5 * (v[1:] + v[:-1])
    scale = np.max(np.abs(effort))
    np.testing.assert_allclose(1.2 * np.diff(v) / 5e-4 + friction + VISCOUS * mean + 0.7, effort, atol=1e-9 * scale)
    np.testing.assert_allclose(np.diff(q), 5e-4 * mean, atol=1e-15)
    wanted, _ = Predictor(model).run(t, 0.5 * (q[1:] + q[:-1]), mean, np.diff(v) / 5e-4, 5e-4)
    # Near rest the bristles turn an error of velocity into force: what is left there is rounding times stiffness.
    np.testing.assert_allclose(wanted, effort, atol=1e-6 * scale)


def test_friction_takes_energy_out_of_a_closed_cycle() -> None:
    model = axis(viscous=0.0)
    effort = 5.0 * np.sin(2 * np.pi * 1.0 * 1e-3 * (np.arange(4000) + 0.5))  # below break-away: a hysteresis loop
    motion = simulate(model, np.r_[effort, 0.0], 1e-3, n_substeps=4)
    moved = np.diff(motion.position)
    last = slice(3000, 4000)
    loop = float(motion.friction[last] @ moved[last])
    assert loop > 0.01 * 5.0 * float(np.ptp(motion.position[3000:]))


def test_sample_by_sample_is_one_run_to_the_last_bit() -> None:
    model = axis()
    effort = 9.0 * np.sin(0.02 * np.arange(500))
    states, friction = Simulator(model).run(effort, 1e-3)
    single = Simulator(model)
    for k, force in enumerate(effort):
        mean = single.step(float(force), 1e-3)
        assert (single.position, single.velocity, mean) == (states[k, 0], states[k, 1], friction[k])
    whole, _ = Predictor(model).run(np.zeros(500), states[:, 0], states[:, 1], effort, 1e-3)
    part = Predictor(model)
    np.testing.assert_array_equal([part.step(0.0, q, v, a, 1e-3) for (q, v), a in zip(states, effort, strict=True)], whole)


def test_the_step_follows_the_natural_frequency() -> None:
    for stiffness, mass in ((1e4, 1.2), (1e5, 1.2), (1e7, 1.2), (1e7, 0.1)):
        n = substeps(axis(stiffness=stiffness, mass=mass), 1e-3)
        assert 1e-3 / n * np.sqrt(stiffness / mass) <= 0.25 * (1 + 1e-12)
    assert substeps(axis(stiffness=10.0), 1e-3) == 1
