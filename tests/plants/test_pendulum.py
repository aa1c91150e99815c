"""The pendulum under P and D feedback, against closed forms, de Marchi's relation, and an independent integration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.model import Model, Term, build_model, term
from fric.simulation import Predictor, Simulator
from scipy.integrate import solve_ivp


def pendulum(
    *terms: Term, inertia: float = 0.0116, p: float = 0.6, d: float = 0.0, g: float = 0.0, start: float = 0.0
) -> Model:
    return build_model(
        "pendulum", {"inertia": inertia, "proportional": p, "derivative": d, "gravity": g, "start": start}, terms
    )


def test_it_starts_where_it_is_told_to() -> None:
    model = pendulum(start=0.7)
    assert Simulator(model).position == 0.7
    assert Simulator(model, 0.2).position == 0.2
    assert Simulator(model, 0.0, 1.0).position == 0.0


def test_damped_oscillation_against_the_closed_form() -> None:
    inertia, p, d = 0.0116, 0.6, 0.01
    n, step = 4000, 5e-4
    states, _ = Simulator(pendulum(inertia=inertia, p=p, d=d, start=1.0)).run(np.zeros(n), step, 1)
    t = step * np.arange(1, n + 1)
    s, w = 0.5 * d / inertia, math.sqrt(p / inertia - (0.5 * d / inertia) ** 2)
    expected = np.exp(-s * t) * (np.cos(w * t) + s / w * np.sin(w * t))
    assert np.max(np.abs(states[:, 0] - expected)) < 3e-5


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_turning_points_of_asymmetric_dry_friction(direction: float) -> None:
    # Without viscous friction each swing loses twice the resting width of its direction.
    k, mean, half = 0.6, 0.03, 0.012
    friction = (term("coulomb", force=mean), term("asymmetry", force=half))
    states, _ = Simulator(pendulum(*friction, p=k, start=direction)).run(np.zeros(40_000), 1e-4, 1)
    q, v = states.T
    turns = q[1:][v[:-1] * v[1:] < 0.0][:5]
    x = direction
    side = -direction
    for turn in turns:
        x = -x - 2.0 * (half + side * mean) / k
        assert turn == pytest.approx(x, abs=1e-6)
        side = -side
    assert turns.shape[0] == 5


def test_it_rests_within_the_band_of_friction_exactly() -> None:
    model = pendulum(term("coulomb", force=0.03), p=0.6, start=0.0499)
    states, _ = Simulator(model).run(np.zeros(1000), 1e-3)
    assert np.all(states[:, 0] == 0.0499)
    states, _ = Simulator(model, 0.0501).run(np.zeros(1000), 1e-3)
    assert states[-1, 0] != 0.0501
    assert states[-1, 1] == 0.0


@pytest.mark.parametrize("start", [0.5, 2.5, 3.1])
def test_weight_and_spring_keep_the_energy(start: float) -> None:
    model = pendulum(p=0.1, g=0.5, start=start)
    states, _ = Simulator(model).run(np.zeros(100_000), 5e-3, 1)
    q, v = states.T
    energy = 0.5 * 0.0116 * v**2 + 0.05 * q**2 - 0.5 * np.cos(q)
    # Over 100,000 steps of the largest length that a model of it is given.
    assert np.ptp(energy) < 1e-9 * (0.05 * start**2 + 0.5 * (1.0 - math.cos(start)))


def test_against_an_independent_integration() -> None:
    model = pendulum(term("viscous", coefficient=2e-3), p=0.1, d=1e-3, g=0.5, start=2.0)
    n, step = 3000, 1e-3
    u = 0.1 * np.sin(0.005 * (np.arange(n) + 0.5))
    states, _ = Simulator(model).run(u, step, 2)

    def right_side(t: float, y: np.ndarray) -> list[float]:
        drive = 0.1 * math.sin(5.0 * t)
        return [y[1], (drive - 0.1 * y[0] - 3e-3 * y[1] - 0.5 * math.sin(y[0])) / 0.0116]

    end = solve_ivp(right_side, (0.0, n * step), [2.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(states[-1], end, atol=3e-3)


def test_the_torque_that_a_motion_needs() -> None:
    one = np.ones(1)
    effort, _ = Predictor(pendulum(p=0.6, d=0.02, g=0.5)).run(0 * one, 0.3 * one, -2.0 * one, 7.0 * one, 1e-3)
    assert effort[0] == pytest.approx(0.0116 * 7.0 + 0.6 * 0.3 - 0.02 * 2.0 + 0.5 * math.sin(0.3))
