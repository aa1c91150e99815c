"""What stands between command and force: limits, dead zone, lag and delay, alone and in a model."""

from __future__ import annotations

import numpy as np
import pytest
from fric.control.feedforward import Feedforward
from fric.effects import EFFECTS
from fric.model import build_model, term
from fric.simulation import Simulator, predict_force, simulate
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import expm


def passed(key: str, *p: float, commands: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Mean force over each step."""
    effect = EFFECTS[key]
    assert effect.command is not None
    y = np.zeros(effect.n_memory)
    return np.array([effect.command(u, h, y, 0, *p) for u, h in zip(commands, steps, strict=True)])


def through(key: str, *p: float, u: float) -> float:
    return float(passed(key, *p, commands=np.array([u]), steps=np.array([1e-3]))[0])


def test_limits_and_dead_zone() -> None:
    for u, f in ((7.0, 5.0), (-7.0, -5.0), (4.9, 4.9), (0.0, 0.0)):
        assert through("saturation/hard", 5.0, u=u) == f
    for u, f in ((7.0, 5.5), (-7.0, -5.5), (1.5, 0.0), (-1.4, 0.0), (1.6, 0.1), (0.0, 0.0)):
        assert through("input_deadzone/hard", 1.5, u=u) == pytest.approx(f)
    assert EFFECTS["input_deadzone/hard"].uncommand(0.0, 1.5) == 0.0  # type: ignore[misc]
    assert EFFECTS["input_deadzone/hard"].uncommand(-0.1, 1.5) == -1.6  # type: ignore[misc]
    assert EFFECTS["saturation/hard"].uncommand(9.0, 5.0) == 5.0  # type: ignore[misc]


def test_a_knee_joins_the_lines_without_a_corner() -> None:
    """Against spline interpolation of value and slope where the parabola begins and ends, which determine it."""
    limit, softness = 5.0, 0.3
    begin, end = limit * (1.0 - softness), limit * (1.0 + softness)
    knee = CubicHermiteSpline([begin, end], [begin, limit], [1.0, 0.0])
    for u in np.linspace(-9.0, 9.0, 181):
        size = abs(u)
        expected = np.sign(u) * (size if size < begin else limit if size > end else float(knee(size)))
        assert through("saturation/soft", limit, softness, u=u) == pytest.approx(expected, abs=1e-12)
        # What a limiter cuts off is what a dead zone lets through.
        assert through("input_deadzone/soft", limit, softness, u=u) == pytest.approx(u - expected, abs=1e-12)
        assert through("saturation/soft", limit, 0.0, u=u) == through("saturation/hard", limit, u=u)
        assert through("input_deadzone/soft", limit, 0.0, u=u) == pytest.approx(through("input_deadzone/hard", limit, u=u))


@pytest.mark.parametrize("softness", [0.0, 0.3, 1.0])
@pytest.mark.parametrize(("key", "most"), [("saturation/soft", 4.999), ("input_deadzone/soft", 20.0)])
def test_the_command_for_a_force_gives_that_force(key: str, most: float, softness: float) -> None:
    uncommand = EFFECTS[key].uncommand
    assert uncommand is not None
    for f in np.linspace(-most, most, 41):
        assert through(key, 5.0, softness, u=uncommand(f, 5.0, softness)) == pytest.approx(f, abs=1e-9)
    assert through("saturation/soft", 5.0, softness, u=EFFECTS["saturation/soft"].uncommand(9.0, 5.0, softness)) == 5.0  # type: ignore[misc]


@pytest.mark.parametrize("seed", range(4))
def test_the_lag_is_the_exact_mean_over_any_step(seed: int) -> None:
    rng = np.random.default_rng(seed)
    T = 0.004
    steps = np.exp(rng.uniform(np.log(1e-6), np.log(0.1), 60))
    u = rng.normal(size=60)
    # Closed form of T df/dt = u - f: the mean of f over a step is u - T (f_1 - f_0)/h.
    f, expected = 0.0, []
    for h, command in zip(steps, u, strict=True):
        after = command + (f - command) * np.exp(-h / T)
        expected.append(command - T * (after - f) / h)
        f = after
    assert passed("actuator_lag/first_order", T, commands=u, steps=steps) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("damping", [0.1, 0.7, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.6, 10.0])
def test_the_lag_of_second_order_is_the_exact_mean_over_any_step(damping: float) -> None:
    """Against the matrix exponential of the filter with the integral of its force as a third state."""
    rng = np.random.default_rng(5)
    T = 0.004
    steps = np.exp(rng.uniform(np.log(1e-7), np.log(0.1), 60))
    u = rng.normal(size=60)
    state, expected = np.zeros(2), []
    for h, command in zip(steps, u, strict=True):
        # (f, T df/dt, integral of f over t/T, u) by t/T
        rates = np.array([[0, 1, 0, 0], [-1, -2 * damping, 0, 1], [1, 0, 0, 0], [0, 0, 0, 0]], dtype=float)
        after = expm(rates * h / T) @ np.array([*state, 0.0, command])
        expected.append(after[2] * T / h)
        state = after[:2]
    found = passed("actuator_lag/second_order", T, damping, commands=u, steps=steps)
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-9)


def test_two_equal_lags_in_a_row_are_one_of_second_order() -> None:
    T, h, n = 0.003, 1e-5, 3000
    first = passed("actuator_lag/first_order", T, commands=np.ones(n), steps=np.full(n, h))
    second = passed("actuator_lag/first_order", T, commands=first, steps=np.full(n, h))
    together = passed("actuator_lag/second_order", T, 1.0, commands=np.ones(n), steps=np.full(n, h))
    assert together == pytest.approx(second, abs=2e-3)  # the first hands on its mean over each step


@pytest.mark.parametrize("delay", [1e-5, 0.4e-3, 1e-3, 3.7e-3, 0.03, 0.06])
@pytest.mark.parametrize("parts", [1, 5])
def test_the_delay_is_the_exact_mean_over_any_step(delay: float, parts: int) -> None:
    """Held commands, steps that cut them anywhere: the mean from the integral of the delayed command."""
    rng = np.random.default_rng(parts)
    n, held = 300, 1e-3
    u = rng.normal(size=n)
    cuts = np.sort(np.concatenate([rng.uniform(0.0, 1.0, (n, parts - 1)), np.zeros((n, 1))], axis=1))
    edges = np.append(((np.arange(n)[:, None] + cuts) * held).ravel(), n * held)
    sums = np.concatenate([[0.0], np.cumsum(u * held)])
    delayed = np.interp(np.maximum(edges - delay, 0.0), np.arange(n + 1) * held, sums)
    steps = np.diff(edges)
    found = passed("delay", delay, commands=np.repeat(u, parts), steps=steps)
    assert found * steps == pytest.approx(np.diff(delayed), abs=1e-14)


def test_a_delay_of_many_samples_shares_cells_and_keeps_the_impulse() -> None:
    u = np.zeros(4000)
    u[1000:1003] = 5.0, -2.0, 7.0
    f = passed("delay", 0.5, commands=u, steps=np.full(4000, 1e-3))
    assert np.sum(f) == pytest.approx(10.0)
    assert np.sum(f * np.arange(4000)) / 10.0 == pytest.approx(np.sum(u * np.arange(4000)) / 10.0 + 500.0, abs=8.0)  # a cell


@pytest.mark.parametrize("h", [1e-4, 1e-3, 0.1])
def test_a_constant_comes_out_to_the_last_bit(h: float) -> None:
    f = passed("delay", 0.0137, commands=np.full(2000, 0.1), steps=np.full(2000, h))
    assert np.all(f[np.arange(2000) * h > 0.0138] == 0.1)


def test_after_a_long_constant_command_the_delay_is_as_sharp_as_before() -> None:
    steps = np.concatenate([np.full(100_000, 1.0), np.full(250, 1e-4)])
    u = np.concatenate([np.full(100_000, 0.1), np.full(250, 0.2)])
    f = passed("delay", 0.01005, commands=u, steps=steps)[100_000:]
    assert f == pytest.approx(np.concatenate([np.full(100, 0.1), [0.15], np.full(149, 0.2)]), abs=1e-11)


def test_in_a_model_the_force_that_comes_out_moves_the_body() -> None:
    terms = [term("delay", time=2e-3), term("saturation", limit=3.0)]
    model = build_model("rigid", {"mass": 2.0}, terms)
    u = np.concatenate([np.full(10, 8.0), np.full(10, -1.0)])
    motion = simulate(model, np.append(u, 0.0), 1e-3)
    expected = np.concatenate([[0.0, 0.0], np.full(10, 3.0), np.full(8, -1.0)])
    assert motion.applied[1:] == pytest.approx(expected, abs=1e-12)
    assert motion.velocity[1:] == pytest.approx(np.cumsum(expected) * 1e-3 / 2.0, abs=1e-12)
    fine = simulate(model, np.append(u, 0.0), 1e-3, n_substeps=7)
    assert fine.applied == pytest.approx(motion.applied, abs=1e-11)


def test_terms_of_the_command_path_act_in_the_order_of_the_model() -> None:
    first = [term("saturation", limit=3.0), term("input_deadzone", width=1.0)]
    for terms, f in ((first, 2.0), (first[::-1], 3.0)):
        model = build_model("rigid", {"mass": 1.0}, terms)
        simulator = Simulator(model)
        simulator.run(np.full(1, 8.0), 1e-3)
        assert simulator.applied == f


def test_the_command_that_a_motion_needs_undoes_the_path() -> None:
    terms = [term("coulomb", force=2.0), term("input_deadzone", width=1.0), term("actuator_lag", time=0.01)]
    model = build_model("rigid", {"mass": 1.5}, terms)
    zero, v, a = np.zeros(3), np.array([0.1, -0.1, 0.1]), np.array([2.0, -2.0, -4.0])
    needed = predict_force(model, zero, zero, v, a, 1e-3)
    assert needed == pytest.approx([5.0, -5.0, -4.0])
    # A lag can't be undone from one sample; what has no memory can.
    assert [model.uncommand(float(force)) for force in needed] == pytest.approx([6.0, -6.0, -5.0])
    feedforward = Feedforward(1e-3, preview=0.0)
    feedforward.set_model(model, at_once=True)
    assert feedforward.step(0.0, 0.0, 0.1, 2.0) == pytest.approx(6.0)


def test_a_lagged_force_starts_the_body_when_it_has_grown_to_break_away() -> None:
    model = build_model("rigid", {"mass": 1.0}, [term("actuator_lag", time=0.02), term("coulomb", force=4.0)])
    states, _ = Simulator(model).run(np.full(400, 5.0), 1e-4)
    first = np.flatnonzero(states[:, 1])[0] * 1e-4
    assert first == pytest.approx(0.02 * np.log(5.0), abs=2e-4)
