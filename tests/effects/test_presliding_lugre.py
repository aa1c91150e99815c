"""LuGre pre-sliding against an implicit integration of the published equations, and against what follows from them on paper."""

from __future__ import annotations

import numpy as np
import pytest
from fric.model import Model, build_model, term
from fric.simulation import Predictor, Simulator, simulate, substeps
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]

COULOMB, SURPLUS, STRIBECK, VISCOUS = 4.0, 2.0, 0.01, 10.0


def axis(
    stiffness: float = 1e5,
    damping: float = 100.0,
    mass: float = 1.2,
    bias: float = 0.0,
    viscous: float = VISCOUS,
    forward: float = 0.0,
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


def radau(effort: Array, hold: float, step: float, stiffness: float, damping: float, mass: float) -> tuple[Array, Array]:
    """Canudas de Wit et al. 1995, Eqs. 1 to 3 with g of Eq. 5, and the body; force constant for ``hold`` seconds each.

    Position at every ``step`` and the mean of friction over it, from its impulse as a fourth state.
    """

    def right_side(t: float, y: Array, u: float) -> Array:
        _, v, z, _ = y
        g = COULOMB + SURPLUS * np.exp(-((v / STRIBECK) ** 2))
        dz = v - stiffness * abs(v) / g * z
        friction = stiffness * z + damping * dz
        return np.array([v, (u - friction - VISCOUS * v) / mass, dz, friction])

    def jacobian(t: float, y: Array, u: float) -> Array:
        _, v, z, _ = y
        fall = SURPLUS * np.exp(-((v / STRIBECK) ** 2))
        g, dg = COULOMB + fall, -2.0 * v / STRIBECK**2 * fall
        dv = 1.0 - stiffness * np.sign(v) / g * z + stiffness * abs(v) * z / g**2 * dg
        dz = -stiffness * abs(v) / g
        f_v, f_z = damping * dv, stiffness + damping * dz
        return np.array([[0, 1, 0, 0], [0, -(f_v + VISCOUS) / mass, -f_z / mass, 0], [0, dv, dz, 0], [0, f_v, f_z, 0]])

    y = np.zeros(4)
    rows = [y]
    grid = step * np.arange(1, round(hold / step) + 1)
    tolerance = 1e-10 * np.array([1e-3, 1e-2, 1e-5, 1e-2])
    for u in effort:
        answer = solve_ivp(
            right_side, (0.0, grid[-1]), y, method="Radau", rtol=1e-10, atol=tolerance, t_eval=grid, args=(u,), jac=jacobian
        )
        assert answer.success
        rows += list(answer.y.T)
        y = answer.y[:, -1]
    states = np.array(rows)
    return states[:, 0], np.diff(states[:, 3]) / step


# Force constant for 10 ms each: through break-away, sliding and two reversals.
EFFORT = 12.0 * np.sin(2 * np.pi * 1.3 * (0.01 * np.arange(60) + 0.005))


@pytest.mark.parametrize(
    ("stiffness", "damping", "mass"),
    [(1e5, 100.0, 1.2), (1e6, 800.0, 2.0), (1e5, 316.0, 0.3), (1e4, 30.0, 1.2)],
)
def test_force_and_motion_at_1_khz_match_an_implicit_integration(stiffness: float, damping: float, mass: float) -> None:
    q, expected = radau(EFFORT, 0.01, 1e-3, stiffness, damping, mass)
    states, friction = Simulator(axis(stiffness, damping, mass)).run(np.repeat(EFFORT, 10), 1e-3)
    force_error = np.max(np.abs(friction - expected)) / np.ptp(expected)
    assert force_error < 1e-4, force_error
    assert np.max(np.abs(states[:, 0] - q[1:])) < 1e-5 * np.ptp(q)


def test_the_error_falls_with_the_square_of_the_step_through_reversals() -> None:
    q, expected = radau(EFFORT, 0.01, 1e-3, 1e5, 100.0, 1.2)
    position, force = [], []
    for n_substeps in (4, 8, 16):
        states, friction = Simulator(axis()).run(np.repeat(EFFORT, 10), 1e-3, n_substeps)
        position.append(float(np.max(np.abs(states[:, 0] - q[1:]))))
        force.append(float(np.max(np.abs(friction - expected))))
    for errors in (position, force):
        assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15), errors
        assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.15), errors


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
    assert motion.position[-1] == pytest.approx(push / 1e5, rel=2e-3)
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
    # A step in which it turns is two steps, whose mean velocity is not that of its ends.
    on = v[1:] * v[:-1] > 0
    assert np.mean(on) > 0.99
    needed = 1.2 * np.diff(v) / 5e-4 + friction + VISCOUS * mean + 0.7
    np.testing.assert_allclose(needed[on], effort[on], atol=1e-9 * scale)
    np.testing.assert_allclose(np.diff(q)[on], 5e-4 * mean[on], atol=1e-15)
    wanted, _ = Predictor(model).run(t, 0.5 * (q[1:] + q[:-1]), mean, np.diff(v) / 5e-4, 5e-4)
    # The predictor takes each sample's velocity as constant; where the axis turns within one, it can't know the instant.
    np.testing.assert_allclose(wanted[on], effort[on], atol=2e-3 * scale)
    assert np.sqrt(np.mean((wanted - effort)[on] ** 2)) < 2e-4 * scale


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
        assert 1e-3 / n * np.sqrt(stiffness / mass) <= 0.04 * (1 + 1e-12)
    assert substeps(axis(stiffness=10.0), 1e-3) == 1


@pytest.mark.parametrize("r", [0.0, 1e-12, 1e-6, 1e-3, 0.05, 0.1249, 0.1251, 0.4, 3.0, 39.9, 40.1, 1e3])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_step_at_constant_velocity_is_exact(r: float, direction: float) -> None:
    # dz/dt = v - a z with a = sigma_0 |v| / g: the series of its solution, summed in extended precision.
    level, h, stiffness, damping, z_0 = 5.0, 1e-3, 1e5, 100.0, 2e-5
    v = direction * r * level / (stiffness * h)
    a = np.longdouble(stiffness) * abs(v) / level
    if r < 1.0:
        psi = np.longdouble(0.0)
        product = np.longdouble(0.5)
        for k in range(3, 40):
            psi += product
            product *= -np.longdouble(r) / k
        phi = 1 - np.longdouble(r) * psi
    else:
        phi = (1 - np.exp(-np.longdouble(r))) / np.longdouble(r)
        psi = (1 - phi) / np.longdouble(r)
    z_1 = z_0 + (v - a * z_0) * phi * h
    z_mean = z_0 * phi + v * h * psi
    slip = term("presliding", stiffness=1.0).effect.slip
    assert slip is not None
    z, z_next = np.array([9.0, z_0]), np.zeros(2)
    friction = slip(z, z_next, 1, v, h, level, stiffness, damping)
    assert z_next[1] == pytest.approx(float(z_1), rel=1e-12)
    assert friction == pytest.approx(float(stiffness * z_mean + damping * (z_1 - z_0) / h), rel=1e-11)
    assert (z[0], z[1], z_next[0]) == (9.0, z_0, 0.0)
