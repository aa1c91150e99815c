"""The rigid axis against closed forms, against an event-driven integration, and against the balance of energy."""

from __future__ import annotations

import numpy as np
import pytest
from fric.model import Model, build_model, term
from fric.simulation import Predictor, Simulator, simulate
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


def axis(
    mass: float = 1.2,
    coulomb: float = 0.0,
    surplus: float = 0.0,
    stribeck: float = 0.01,
    viscous: float = 0.0,
    bias: float = 0.0,
    forward: float = 0.0,
    forward_viscous: float = 0.0,
) -> Model:
    """One structure for all these tests, so that it is compiled once; what a test doesn't need is zero."""
    terms = [
        term("coulomb", force=coulomb),
        term("stribeck", force=surplus, velocity=stribeck),
        term("asymmetry", force=forward, coefficient=forward_viscous),
        term("viscous", coefficient=viscous),
        term("bias", force=bias),
    ]
    return build_model("rigid", {"mass": mass}, terms)


def run(
    model: Model, effort: Array, step: float, q: float = 0.0, v: float = 0.0, n_substeps: int | None = 1
) -> tuple[Array, Array, Array]:
    """Position, velocity at all n + 1 instants and friction over all n intervals."""
    states, friction = Simulator(model, q, v).run(effort, step, n_substeps)
    return np.r_[q, states[:, 0]], np.r_[v, states[:, 1]], friction


# --- sticking ---


@pytest.mark.parametrize("slope", [5.0, -5.0, 6.0, -6.0, 1e-300])
def test_a_body_on_a_slope_does_not_move_at_all_in_a_million_steps(slope: float) -> None:
    model = axis(coulomb=4.0, surplus=2.0, bias=slope, viscous=10.0)
    q, v, friction = run(model, np.zeros(1_000_000), 1e-3, q=0.1234567891)
    assert np.all(q == 0.1234567891)
    assert np.all(v == 0.0)
    assert np.all(friction == -slope)  # friction holds exactly what pulls


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_it_slides_just_above_break_away(direction: float) -> None:
    model = axis(coulomb=4.0, surplus=2.0)
    for push, moves in ((6.0, False), (6.0 * (1 + 1e-12), True)):
        q, v, _ = run(model, np.full(100, direction * push), 1e-3)
        assert bool(np.any(q != 0.0)) is moves
        assert bool(np.any(v != 0.0)) is moves
    # The surplus falls as it moves: what broke loose runs away.
    assert direction * v[-1] > 0


def test_break_away_under_a_ramp_takes_coulomb_and_stribeck_force_together() -> None:
    effort = np.linspace(0.0, 10.0, 10_001)
    q, _, friction = run(axis(coulomb=4.0, surplus=2.0), effort, 1e-3)
    first = int(np.argmax(q[1:] != 0.0))
    assert effort[first - 1] <= 6.0 < effort[first]
    np.testing.assert_array_equal(friction[:first], effort[:first])


def test_an_asymmetric_level_does_not_push_and_shifts_break_away_apart() -> None:
    model = axis(coulomb=4.0, forward=1.0)
    assert np.all(run(model, np.zeros(1000), 1e-3)[0] == 0.0)
    for push, moves in ((4.99, False), (5.01, True), (-2.99, False), (-3.01, True)):
        assert bool(np.any(run(model, np.full(20, push), 1e-3)[0] != 0.0)) is moves


def test_a_bias_shifts_both_break_away_forces_the_same_way() -> None:
    model = axis(coulomb=4.0, bias=1.0)
    for push, moves in ((4.99, False), (5.01, True), (-2.99, False), (-3.01, True)):
        assert bool(np.any(run(model, np.full(20, push), 1e-3)[0] != 0.0)) is moves
    # Unlike the asymmetric level, it pushes once friction is too small to hold it.
    assert run(axis(coulomb=0.5, bias=1.0), np.zeros(20), 1e-3)[0][-1] < 0.0


def test_a_body_that_stops_stays_where_it_stopped() -> None:
    q, v, _ = run(axis(coulomb=3.0, surplus=1.0, viscous=2.0), np.zeros(20_000), 1e-3, v=0.7)
    stop = int(np.argmax(v == 0.0))
    assert 0 < stop < 2000
    assert np.all(v[stop:] == 0.0)
    assert np.all(q[stop:] == q[stop])


# --- closed forms ---


@pytest.mark.parametrize("step", [1e-4, 1e-3, 7.3e-3, 0.5])
@pytest.mark.parametrize("v_0", [0.31, -0.31])
def test_coulomb_friction_stops_a_body_after_v_squared_over_2a(step: float, v_0: float) -> None:
    deceleration = 3.0 / 1.2
    n = int(np.ceil(abs(v_0) / deceleration / step)) + 3
    q, v, _ = run(axis(coulomb=3.0), np.zeros(n), step, v=v_0)
    assert q[-1] == pytest.approx(v_0 * abs(v_0) / (2 * deceleration), rel=1e-12)
    t = step * np.arange(n + 1)
    np.testing.assert_allclose(v, np.sign(v_0) * np.maximum(abs(v_0) - deceleration * t, 0.0), atol=1e-13)
    assert v[-1] == 0.0


def test_constant_force_against_coulomb_friction_gives_a_parabola() -> None:
    q, v, friction = run(axis(coulomb=3.0), np.full(1000, 4.5), 1e-3)
    t = 1e-3 * np.arange(1001)
    np.testing.assert_allclose(q, 0.5 * (4.5 - 3.0) / 1.2 * t**2, rtol=1e-12)
    np.testing.assert_allclose(v, (4.5 - 3.0) / 1.2 * t, rtol=1e-12)
    np.testing.assert_allclose(friction, 3.0, rtol=1e-15)


def test_a_free_body_flies_on() -> None:
    q, v, friction = run(axis(), np.zeros(100_000), 1e-3, q=1.0, v=-0.37)
    assert np.all(v == -0.37)
    np.testing.assert_allclose(q, 1.0 - 0.37e-3 * np.arange(100_001), atol=1e-9)
    assert np.all(friction == 0.0)


def test_viscous_friction_decays_exponentially_and_the_error_falls_with_the_square_of_the_step() -> None:
    errors = []
    for step in (8e-3, 4e-3, 2e-3):
        n = round(0.4 / step)
        _, v, _ = run(axis(viscous=10.0), np.zeros(n), step, v=0.5)
        errors.append(np.max(np.abs(v - 0.5 * np.exp(-10.0 / 1.2 * step * np.arange(n + 1)))))
    assert errors[-1] < 3e-5
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.05)


def test_viscous_friction_alone_comes_to_rest_after_m_v_over_c_however_long_the_step() -> None:
    for step in (1e-3, 0.1, 10.0):
        q, _, _ = run(axis(viscous=10.0), np.zeros(max(int(20 / step), 5)), step, v=0.5)
        assert q[-1] == pytest.approx(1.2 * 0.5 / 10.0, rel=1e-6)


# --- steady sliding ---


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_steady_sliding_follows_the_curve_typed_here(direction: float) -> None:
    # So heavy that nothing changes its velocity within the run.
    model = axis(mass=1e12, coulomb=4.0, surplus=2.0, stribeck=0.01, forward=0.5, forward_viscous=3.0, viscous=10.0, bias=0.7)
    for speed in (1e-5, 1e-3, 0.005, 0.01, 0.02, 0.1, 2.0):
        v = direction * speed
        _, _, friction = run(model, np.zeros(3), 1e-3, v=v)
        expected = direction * (4.0 + 2.0 * np.exp(-((speed / 0.01) ** 2))) + 0.5
        assert friction[-1] == pytest.approx(expected, rel=1e-9)
        effort, _ = Predictor(model.with_value("mass", 1.0)).run(np.zeros(1), np.zeros(1), np.array([v]), np.array([0.3]), 1e-3)
        assert effort[0] == pytest.approx(0.3 + expected + 10.0 * v + 3.0 * speed + 0.7, rel=1e-12)


# --- energy ---


def test_the_work_of_the_drive_is_kinetic_energy_and_coulomb_friction_along_the_path_through_stops() -> None:
    rng = np.random.default_rng(4)
    # Pushes, each followed by enough time to come to rest: within a step the body never turns.
    effort = np.zeros((60, 50))
    effort[:, :20] = rng.choice([-1.0, 1.0], (60, 1)) * rng.uniform(3.5, 9.0, (60, 20))
    q, v, _ = run(axis(coulomb=3.0), effort.ravel(), 2e-3)
    work = float(effort.ravel() @ np.diff(q))
    path = float(np.sum(np.abs(np.diff(q))))
    assert np.sum(v == 0.0) > 100
    assert work == pytest.approx(3.0 * path + 0.6 * v[-1] ** 2, rel=1e-11)


def test_the_balance_of_energy_closes_in_every_step_of_a_curved_law() -> None:
    model = axis(coulomb=4.0, surplus=2.0, forward=0.5, forward_viscous=3.0, viscous=10.0, bias=0.7)
    t = 1e-3 * (np.arange(20_000) + 0.5)
    effort = 12.0 * np.sin(2 * np.pi * 0.7 * t) + 3.0 * np.sin(2 * np.pi * 3.1 * t)
    q, v, friction = run(model, effort, 1e-3)
    moved, mean = np.diff(q), 0.5 * (v[1:] + v[:-1])
    sliding = v[1:] * v[:-1] > 0
    assert np.mean(sliding) > 0.8
    drive = (effort * moved)[sliding]
    spent = (0.6 * np.diff(v**2) + (friction + 10.0 * mean + 3.0 * np.abs(mean) + 0.7) * moved)[sliding]
    assert abs(np.sum(drive - spent)) <= 1e-9 * np.sum(np.abs(drive))
    np.testing.assert_allclose(drive, spent, atol=1e-9 * np.max(np.abs(drive)))
    # Friction never gives energy back, stops and reversals included.
    assert np.all(effort * moved - 0.6 * np.diff(v**2) - 0.7 * moved > -1e-12)


# --- convergence, against an event-driven integration ---


def _event_driven(duration: float, force: float, frequency: float) -> tuple[Array, Array]:
    """Slide and stick phases under a sine, each ended by an event: m=1.2, F_C=4, surplus 2 at 0.01 m/s, c=10; 10 ms grid."""
    mass, level, surplus, v_s, viscous = 1.2, 4.0, 2.0, 0.01, 10.0
    grid = np.arange(0.0, duration + 5e-3, 0.01)
    position = np.zeros_like(grid)

    def drive(t: float) -> float:
        return force * np.sin(2 * np.pi * frequency * t)

    t, q = 0.0, 0.0
    while t < duration:
        # Break-away: the next instant at which the drive exceeds the static level.
        fine = np.linspace(t, duration, 200_001)
        above = np.abs(force * np.sin(2 * np.pi * frequency * fine)) > level + surplus
        start = float(fine[np.argmax(above)]) if np.any(above) else duration
        if start > t + 1e-9 and start < duration:
            lo, hi = start - (fine[1] - fine[0]), start
            for _ in range(60):
                middle = 0.5 * (lo + hi)
                lo, hi = (lo, middle) if abs(drive(middle)) > level + surplus else (middle, hi)
            start = hi
        position[(grid >= t) & (grid <= start)] = q
        if start >= duration:
            break
        s = float(np.sign(drive(start)))

        def slide(t: float, y: Array, s: float = s) -> list[float]:
            friction = s * (level + surplus * np.exp(-((y[1] / v_s) ** 2)))
            return [y[1], (drive(t) - friction - viscous * y[1]) / mass]

        def stopped(t: float, y: Array, s: float = s, start: float = start) -> float:
            return float(y[1] * s) if t > start + 1e-6 else 1.0

        stopped.terminal = True  # type: ignore[attr-defined]
        stopped.direction = -1  # type: ignore[attr-defined]
        inside = grid[(grid > start) & (grid <= duration)]
        answer = solve_ivp(
            slide,
            (start, duration),
            [q, s * 1e-12],
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
            events=stopped,
            t_eval=inside,
            max_step=1e-3,
        )
        position[np.isin(grid, answer.t)] = answer.y[0]
        if not answer.t_events[0].size:
            break
        t, q = float(answer.t_events[0][0]), float(answer.y_events[0][0][0])
    return grid, position


def test_stick_and_slip_converge_to_an_event_driven_solution_with_the_square_of_the_step() -> None:
    grid, expected = _event_driven(2.0, 8.0, 0.7)
    model = axis(coulomb=4.0, surplus=2.0, viscous=10.0)
    errors = []
    for step in (4e-4, 2e-4, 1e-4):
        t = step * (np.arange(round(2.0 / step)) + 0.5)
        q, v, _ = run(model, 8.0 * np.sin(2 * np.pi * 0.7 * t), step)
        errors.append(float(np.max(np.abs(np.interp(grid, step * np.arange(q.shape[0]), q) - expected))))
    travel = np.ptp(expected)
    assert np.sum(v == 0.0) > 1000  # it does stick in between
    assert errors[-1] < 2e-6 * travel, errors
    # The stick phase's end falls on a step's start, which costs regularity but not much: at least nearly second order.
    assert errors[0] / errors[2] > 8.0, errors


# --- simulator and predictor ---


def test_the_predictor_asks_for_the_force_that_the_simulator_was_given() -> None:
    model = axis(coulomb=4.0, surplus=2.0, forward=0.5, forward_viscous=3.0, viscous=10.0, bias=0.7)
    t = 1e-3 * (np.arange(5000) + 0.5)
    effort = 14.0 * np.sin(2 * np.pi * 0.7 * t)
    q, v, friction = run(model, effort, 1e-3)
    effort_wanted, friction_wanted = Predictor(model).run(
        t, 0.5 * (q[1:] + q[:-1]), 0.5 * (v[1:] + v[:-1]), np.diff(v) / 1e-3, 1e-3
    )
    sliding = v[1:] * v[:-1] > 0
    np.testing.assert_allclose(effort_wanted[sliding], effort[sliding], atol=1e-5 * 14.0)
    np.testing.assert_allclose(friction_wanted[sliding], friction[sliding], atol=1e-5 * 14.0)


@pytest.mark.parametrize("n_substeps", [1, 3])
def test_sample_by_sample_is_one_run_to_the_last_bit(n_substeps: int) -> None:
    model = axis(coulomb=4.0, surplus=2.0, forward=0.5, viscous=10.0, bias=0.7)
    effort = 9.0 * np.sin(0.02 * np.arange(700))
    states, friction = Simulator(model, 0.1, 0.2).run(effort, 1e-3, n_substeps)
    single = Simulator(model, 0.1, 0.2)
    for k, force in enumerate(effort):
        state, mean = single.run(np.array([force]), 1e-3, n_substeps)
        assert (state[0, 0], state[0, 1], mean[0]) == (states[k, 0], states[k, 1], friction[k])
    assert single.time == pytest.approx(0.7)

    whole, _ = Predictor(model).run(np.zeros(700), states[:, 0], states[:, 1], effort, 1e-3)
    part = Predictor(model)
    stepwise = [part.step(0.0, q, v, a, 1e-3) for (q, v), a in zip(states, effort, strict=True)]
    np.testing.assert_array_equal(stepwise, whole)


def test_the_same_inputs_give_the_same_bits() -> None:
    model = axis(coulomb=4.0, surplus=2.0, viscous=10.0)
    effort = 9.0 * np.sin(0.02 * np.arange(700))
    first, second = (simulate(model, effort, 1e-3) for _ in range(2))
    assert first.position.tobytes() == second.position.tobytes()
    assert first.friction.tobytes() == second.friction.tobytes()


def test_a_light_axis_with_a_steep_stribeck_curve_neither_jumps_nor_gains_energy() -> None:
    # At this step the mass is too small for one step to resolve the fall of friction: sub-steps have to.
    model = axis(mass=0.01, coulomb=1.0, surplus=2.0, stribeck=0.002, viscous=1.0)
    effort = np.full(400, 3.5)
    step = 1e-3
    coarse = simulate(model, effort, step)
    fine = simulate(model, effort, step, n_substeps=2000)
    np.testing.assert_allclose(coarse.velocity, fine.velocity, atol=0.01 * np.max(fine.velocity))
    down = simulate(model, np.zeros(400), step, velocity=0.5)
    assert np.all(np.diff(np.abs(down.velocity)) <= 0.0)


def test_where_friction_falls_faster_than_the_step_allows_the_balance_of_forces_still_holds() -> None:
    """Several mean velocities fit such a step, or none in that direction: lines through two trials would lead astray."""
    mass, coulomb, surplus, stribeck, viscous, step = 2.46, 1.48, 3.0, 7.7e-4, 13.2, 2e-3
    assert step / (2.0 * mass) * surplus / stribeck * np.sqrt(2.0 / np.e) > 1.0  # the steepest fall of the curve
    model = axis(mass, coulomb, surplus, stribeck, viscous)
    random = np.random.default_rng(0)
    slid = 0
    for v_0, force in zip(random.uniform(-4.0, 4.0, 20_000) * stribeck, random.uniform(-6.0, 6.0, 20_000), strict=True):
        _, velocity, _ = run(model, np.array([force]), step, v=float(v_0))
        v_1 = float(velocity[-1])
        most = abs(force) + coulomb + surplus + viscous * max(abs(v_0), abs(v_1))
        assert abs(v_1 - v_0) <= step / mass * most
        if v_0 * v_1 <= 0.0:
            continue
        slid += 1
        w = 0.5 * (v_0 + v_1)
        level = coulomb + surplus * np.exp(-((w / stribeck) ** 2))
        assert mass * (v_1 - v_0) / step == pytest.approx(force - np.sign(w) * level - viscous * w, abs=0.01 * most)
    assert slid > 5000
