"""Friction that depends on the sign of the acceleration: its two branches, and how a body moves between them."""

from __future__ import annotations

import numpy as np
import pytest
from fric.effect import Context
from fric.effects import EFFECTS
from fric.model import Model, build_model, term
from fric.simulation import Simulator, predict_force
from scipy.integrate import solve_ivp

# Szell, parameters of Model A and B.
F_C, F_S, F_V, V_S = 2.447, 3.7, 15.0, 0.019


def model_b(mass: float = 0.5) -> Model:
    terms = [
        term("coulomb", force=F_C),
        term("accel_hysteresis", force=F_S - F_C, velocity=V_S),
        term("viscous", coefficient=F_V),
    ]
    return build_model("rigid", {"mass": mass}, terms)


@pytest.mark.parametrize(
    ("v", "a", "upper"), [(0.01, 1.0, True), (0.01, -1.0, False), (-0.01, -1.0, True), (-0.01, 1.0, False), (0.01, 0.0, True)]
)
def test_the_surplus_acts_while_speeding_up_in_either_direction(v: float, a: float, upper: bool) -> None:
    zero, v_, a_ = np.zeros(1), np.array([v]), np.array([a])
    found = predict_force(model_b(), zero, zero, v_, a_, 1e-3) - 0.5 * a
    surplus = (F_S - F_C) / (1.0 + (v / V_S) ** 2) if upper else 0.0
    assert found == pytest.approx([np.sign(v) * (F_C + surplus) + F_V * v], rel=1e-12)


def test_the_exponential_law_falls_as_a_stribeck_curve_and_only_while_speeding_up() -> None:
    level = EFFECTS["accel_hysteresis/exponential"].level
    assert level is not None
    one, two = 0.36787944117144233, 0.018315638888734179  # 1/e and 1/e^4
    for v, a, left in ((V_S, 1.0, one), (2.0 * V_S, 1.0, two), (V_S, -1.0, 0.0), (50.0 * V_S, 1.0, 0.0)):
        c = Context(0.0, -v, -1.0, 0.0, 1.0, 0.0, -a, 0.0, np.zeros(0), 0.0)
        assert level(c, F_C, F_S - F_C, V_S, 2.0) == pytest.approx(F_C + left * (F_S - F_C))


def test_at_rest_it_pushes_back_with_the_static_level_from_either_side() -> None:
    for side in (1.0, -1.0):
        c = Context(0.0, 0.0, side, 0.0, 1.0, 0.0, side, 0.0, np.zeros(0), 0.0)
        assert EFFECTS["accel_hysteresis/rational"].level(c, F_C, F_S - F_C, V_S) == pytest.approx(F_S)  # type: ignore[misc]
        states, friction = Simulator(model_b()).run(np.full(50, 0.999999 * side * F_S), 1e-3)
        assert np.all(states == 0.0)
        assert np.all(friction == 0.999999 * side * F_S)
        states, _ = Simulator(model_b()).run(np.full(50, 1.000001 * side * F_S), 1e-3)
        assert states[-1, 1] * side > 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_slip_and_its_end_as_an_independent_integration_has_them(side: float) -> None:
    """Pushed beyond break-away, then less: the body speeds up on the upper branch and slows down on the lower one."""
    m, push, rest = 0.5, 5.0, 1.5

    def upper(_: float, y: np.ndarray) -> list[float]:
        return [y[1], (push - F_C - (F_S - F_C) / (1.0 + (y[1] / V_S) ** 2) - F_V * y[1]) / m]

    def lower(_: float, y: np.ndarray) -> list[float]:
        return [y[1], (rest - F_C - F_V * y[1]) / m]

    up = solve_ivp(upper, (0.0, 0.05), [0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-15)
    stopped = lambda _, y: y[1]  # noqa: E731
    stopped.terminal = True  # type: ignore[attr-defined]
    down = solve_ivp(lower, (0.0, 1.0), up.y[:, -1], "DOP853", rtol=1e-12, atol=1e-15, events=stopped)

    u = side * np.concatenate([np.full(500, push), np.full(1000, rest)])
    states, _ = Simulator(model_b(m)).run(u, 1e-4)
    assert side * states[499] == pytest.approx(up.y[:, -1], rel=1e-4)
    assert states[-1, 1] == 0.0
    assert side * states[-1, 0] == pytest.approx(down.y[0, -1], rel=1e-4)
    end = 0.05 + down.t_events[0][0]
    assert np.flatnonzero(states[:, 1])[-1] * 1e-4 == pytest.approx(end, abs=2e-4)


def test_between_the_branches_the_velocity_stays_what_it_is() -> None:
    """A force between what slows the body down and what speeds it up changes nothing about its velocity."""
    v = 0.01
    lower, upper = F_C + F_V * v, F_C + (F_S - F_C) / (1.0 + (v / V_S) ** 2) + F_V * v
    for share in (0.05, 0.5, 0.95):
        u = lower + share * (upper - lower)
        states, friction = Simulator(model_b(), velocity=v).run(np.full(100, u), 1e-3)
        assert np.all(states[:, 1] == v)
        assert friction == pytest.approx(u - F_V * v, rel=1e-12)
    states, _ = Simulator(model_b(), velocity=v).run(np.full(20, lower - 0.01), 1e-3)
    assert np.all(np.diff(states[:, 1]) < 0.0)
    states, _ = Simulator(model_b(), velocity=v).run(np.full(20, upper + 0.01), 1e-3)
    assert np.all(np.diff(states[:, 1]) > 0.0)
