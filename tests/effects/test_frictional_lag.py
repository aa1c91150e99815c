"""Friction that stays behind its steady curve: its laws against closed forms and an independent integration."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from fric.effect import Context
from fric.effects import EFFECTS
from fric.model import Model, build_model, term
from fric.simulation import Predictor, Simulator
from scipy.integrate import solve_ivp

F_C, SURPLUS, V_S, F_V = 4.0, 3.0, 0.02, 10.0
LAWS = pytest.mark.parametrize("law", ["first_order", "second_order", "delay"])
MORE = {"second_order": (1.0,)}  # parameters beside the time


def steady(v: np.ndarray) -> np.ndarray:
    return F_C + SURPLUS * np.exp(-((v / V_S) ** 2))


def model_with(law: str, time: float, mass: float = 1.0) -> Model:
    terms = [
        term("coulomb", force=F_C),
        term("viscous", coefficient=F_V),
        term("stribeck", force=SURPLUS, velocity=V_S),
        term("frictional_lag", law, time=time),
    ]
    return build_model("rigid", {"mass": mass}, terms)


def followed(
    law: str, time: float, base: Callable[[np.ndarray], np.ndarray], h: float, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Middles of the steps, and the level there when the other terms' level is ``base`` of time."""
    effect = EFFECTS[f"frictional_lag/{law}"]
    assert effect.level is not None
    assert effect.remember is not None
    memory = np.zeros(effect.n_memory)
    middles = (np.arange(round(duration / h)) + 0.5) * h
    levels = np.empty(middles.shape[0])
    for k, (t, given) in enumerate(zip(middles, base(middles), strict=True)):
        c = Context(0.0, 0.1, 1.0, t, 1.0, 0.0, 0.0, h, memory, 0.0)
        levels[k] = effect.level(c, float(given), 0, time, *MORE.get(law, ()))
        effect.remember(c, float(given), 0, time, *MORE.get(law, ()))
    return middles, levels


@LAWS
def test_steady_friction_is_the_curve_itself(law: str) -> None:
    for v in (0.004, 0.02, -0.3):
        n = 300
        t = np.arange(n) * 1e-3
        _, friction = Predictor(model_with(law, 0.02)).run(t, v * t, np.full(n, v), np.zeros(n), 1e-3)
        assert friction[[0, 1, -1]] == pytest.approx([np.sign(v) * steady(np.array(v))] * 3, rel=1e-12)


@LAWS
def test_a_sinusoidal_level_comes_out_later_and_as_large_as_the_law_says(law: str) -> None:
    omega, tau = 2.0 * np.pi * 5.0, 0.02
    passed = {
        "delay": np.exp(-1j * omega * tau),
        "first_order": 1.0 / (1.0 + 1j * omega * tau),
        "second_order": 1.0 / (1.0 + 0.5j * omega * tau) ** 2,  # two lags of half the time
    }[law]
    gain, phase = float(np.abs(passed)), float(-np.angle(passed))
    errors = []
    for h in (2e-3, 1e-3, 5e-4):
        t, levels = followed(law, tau, lambda t: 5.0 + np.sin(omega * t), h, 1.0)
        expected = 5.0 + gain * np.sin(omega * t - phase)
        errors.append(float(np.max(np.abs(levels - expected)[t > 12 * tau])))
    assert errors[-1] < 5e-5
    if law != "delay":
        assert errors[0] / errors[2] > 12.0  # second order in the step


@LAWS
@pytest.mark.parametrize("h", [1e-5, 1e-4, 3e-4, 1e-3, 7e-3, 0.02, 0.05])
def test_steps_much_shorter_and_longer_than_the_lag(law: str, h: float) -> None:
    """A level that rises steadily is followed exactly, whatever the step: behind it by the time of the law."""
    tau = 0.02
    t, levels = followed(law, tau, lambda t: 3.0 + 2.0 * t, h, max(0.6, 8 * h))
    late = t > 20 * tau
    assert levels[late] == pytest.approx(3.0 + 2.0 * (t[late] - tau), abs=1e-7 + (0.0 if law == "delay" else 2e-2 * h))


def test_a_jump_of_the_level_comes_out_after_the_delay_and_not_before() -> None:
    t, levels = followed("delay", 0.02, lambda t: np.where(t < 0.1, 1.0, 2.0), 1e-4, 0.3)
    width = 2.0 * 0.02 / 64.0  # a cell
    assert np.all(levels[t < 0.12 - width] == 1.0)
    assert np.all(levels[t > 0.12 + width] == 2.0)
    assert np.trapezoid(levels - 1.0, t) == pytest.approx(0.18, abs=1e-4)


def test_a_long_run_of_the_delay_line_stays_exact() -> None:
    t, levels = followed("delay", 0.0137, lambda t: 5.0 + np.sin(20.0 * t), 1.3e-3, 100.0)
    error = np.abs(levels - 5.0 - np.sin(20.0 * (t - 0.0137)))
    assert 1e-6 < np.max(error[-1000:]) <= 1.01 * np.max(error[100:1100])


MASS = 10.0  # on this one the falling curve lets an error grow by a factor of e in 77 ms


def pushed(law: str, tau: float, h: float, n: int) -> np.ndarray:
    """Mean forces over steps of ``h`` that take the body down to where the curve is steep and up again, 4 times a second."""
    omega = 2.0 * np.pi * 4.0
    t = (np.arange(n) + 0.5) * h
    v = 0.04 + 0.025 * np.cos(omega * t)
    effort, _ = Predictor(model_with(law, tau, MASS)).run(t, np.zeros(n), v, -0.025 * omega * np.sin(omega * t), h)
    return effort


def test_first_order_in_a_moving_body_as_an_independent_integration_has_it() -> None:
    tau, h, n = 0.01, 1e-3, 300
    model = model_with("first_order", tau, MASS)
    u = pushed("first_order", tau, h, n)
    states, friction = Simulator(model, velocity=0.065).run(u, h, 8)
    y = np.array([0.065, float(steady(np.array(0.065)))])
    worst = 0.0
    for k in range(n):
        step = solve_ivp(
            lambda _, y, k=k: [(u[k] - y[1] - F_V * y[0]) / MASS, (steady(y[0]) - y[1]) / tau],
            (0.0, h),
            y,
            rtol=1e-9,
            atol=1e-12,
        )
        y = step.y[:, -1]
        worst = max(worst, abs(states[k, 1] - y[0]))
    assert 0.0 < np.min(states[:, 1]) < V_S  # it did go down to where the curve is steep
    assert np.ptp(friction) > 1.0
    assert worst < 1e-6 * np.ptp(states[:, 1])


@pytest.mark.parametrize("damping", [0.4, 1.0, 3.0])
def test_second_order_in_a_moving_body_as_an_independent_integration_has_it(damping: float) -> None:
    tau, h, n = 0.01, 1e-3, 300
    natural = 0.5 * tau / damping
    model = model_with("second_order", tau, MASS).with_value("frictional_lag.damping", damping)
    u = pushed("second_order", tau, h, n)
    states, _ = Simulator(model, velocity=0.065).run(u, h, 8)
    y = np.array([0.065, float(steady(np.array(0.065))), 0.0])
    worst = 0.0
    for k in range(n):
        step = solve_ivp(
            lambda _, y, k=k: [(u[k] - y[1] - F_V * y[0]) / MASS, y[2], (steady(y[0]) - y[1] - tau * y[2]) / natural**2],
            (0.0, h),
            y,
            rtol=1e-9,
            atol=1e-12,
        )
        y = step.y[:, -1]
        worst = max(worst, abs(states[k, 1] - y[0]))
    assert worst < 2e-6 * np.ptp(states[:, 1])


def test_the_delay_in_a_moving_body_by_the_method_of_steps() -> None:
    """Friction of the last ``tau`` is known, so each stretch of that length is an ordinary equation."""
    tau, h, n = 0.02, 1e-3, 300
    u = pushed("delay", tau, h, n)
    past: list[Callable[[float], float]] = [lambda t: 0.065]
    y, found = np.array([0.065]), []
    for k in range(n):
        # The stretch of the solution that the moment ``tau`` before falls into; its velocity gives the friction of now.
        before = past[max(k - round(tau / h) + 1, 0)]
        step = solve_ivp(
            lambda t, y, k=k, before=before: [(u[k] - steady(before(t - tau)) - F_V * y[0]) / MASS],
            (k * h, (k + 1) * h),
            y,
            rtol=1e-9,
            atol=1e-12,
            dense_output=True,
        )
        past.append(lambda t, s=step.sol: s(t)[0])  # type: ignore[misc]
        y = step.y[:, -1]
        found.append(y[0])
    errors = []
    for parts in (1, 4, 16):
        states, _ = Simulator(model_with("delay", tau, MASS), velocity=0.065).run(u, h, parts)
        errors.append(np.max(np.abs(states[:, 1] - found)) / np.ptp(found))
    assert 0.0 < min(found) < V_S
    assert errors[-1] < 1e-5
    assert errors[0] > errors[1]


@LAWS
def test_the_jump_between_the_directions_does_not_lag(law: str) -> None:
    terms = [term("asymmetry", force=1.0), term("frictional_lag", law, time=0.05), term("coulomb", force=4.0)]
    model = build_model("rigid", {"mass": 1.0}, terms)
    n = 40
    t = np.arange(n) * 1e-3
    v = np.where(t < 0.02, 0.1, -0.1)
    _, friction = Predictor(model).run(t, np.zeros(n), v, np.zeros(n), 1e-3)
    assert friction == pytest.approx(np.where(t < 0.02, 5.0, -3.0), rel=1e-12)


@LAWS
def test_friction_lies_above_the_curve_while_the_speed_rises_and_the_loop_grows_with_frequency(law: str) -> None:
    areas = []
    for frequency in (0.5, 1.0, 2.0):
        h = 1e-4
        t = np.arange(round(2.0 / frequency / h)) * h
        omega = 2.0 * np.pi * frequency
        v = 0.03 - 0.02 * np.cos(omega * t)
        a = 0.02 * omega * np.sin(omega * t)
        _, friction = Predictor(model_with(law, 0.02)).run(t, np.zeros_like(t), v, a, h)
        last = t >= 1.0 / frequency
        up = last & (a > 0.6 * np.max(a))
        down = last & (a < -0.6 * np.max(a))
        assert np.all(friction[up] > steady(v[up]))
        assert np.all(friction[down] < steady(v[down]))
        areas.append(abs(np.trapezoid(friction[last], v[last])))
    assert areas[1] > 1.5 * areas[0]
    assert areas[2] > 1.5 * areas[1]
