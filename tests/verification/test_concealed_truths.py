"""The truths of the concealed cases, against closed forms and equations written elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.friction.asperity import AsperityParameters, AsperityPopulation
from fric.verification.concealed_asperities import slide
from fric.verification.concealed_asymmetry import swing
from fric.verification.concealed_bearing import _case as bearing
from fric.verification.concealed_compliance import _case as compliance
from fric.verification.concealed_presliding import _case as presliding
from fric.verification.pneumatic_reference import FRICTION, MASS, slips, surplus
from scipy.integrate import solve_ivp


def _turning_points(coulomb: tuple[float, float]) -> np.ndarray:
    """Angles at which a pendulum of 1 N m s^2 on 100 N m/rad turns after a pull of 20 N m is let go."""
    torque = np.concatenate([np.linspace(0.0, 20.0, 2000), np.zeros(4000)])
    angle = np.empty_like(torque)
    swing(np.array([1.0, 100.0, 0.0, *coulomb, 0.0, 0.0]), torque, 1e-5, 100, angle)
    free = angle[2000:]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(free))) != 0) + 1
    return free[turns]


def test_the_pendulum_turns_where_friction_of_each_direction_lets_it() -> None:
    found = _turning_points((1.5, 0.5))
    # Over each half swing the amplitude about f/k changes sides: x_n = -x_(n-1) -+ 2 f/k with f of the direction of the swing.
    for n in range(1, 6):
        forward = found[n] > found[n - 1]
        shift = -2.0 * 1.5 / 100.0 if forward else 2.0 * 0.5 / 100.0
        assert found[n] == pytest.approx(-found[n - 1] + shift, abs=2e-4)


def test_the_pendulum_swings_on_without_friction() -> None:
    found = np.abs(_turning_points((0.0, 0.0)))
    assert np.ptp(found) < 1e-3 * found[0]


def test_a_body_on_hardly_any_asperities_moves_as_a_general_solver_has_it() -> None:
    step, mass, viscous = 2e-3, 2.0, 12.0
    t = step * np.arange(400)
    w = 2.0 * np.pi * 1.7
    wanted = 0.01 * np.sin(w * t), 0.01 * w * np.cos(w * t), -0.01 * w**2 * np.sin(w * t)
    nothing = AsperityPopulation(AsperityParameters(force=1e-6, stiffness=1e-2, wavelength=2e-3, time=0.05, growth=1.0), 50, 1)
    position, force = slide(nothing, mass, viscous, wanted, step, 64)

    def rates(t: float, x: np.ndarray) -> list[float]:
        return [x[1], (force[min(int(t / step + 1e-9), force.shape[0] - 1)] - viscous * x[1]) / mass]

    found = solve_ivp(rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, max_step=step, rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(position, found.y[0], atol=2e-3 * 0.01)


@pytest.mark.long
def test_a_slipping_piston_obeys_newton_under_friction_that_is_more_while_it_speeds_up() -> None:
    step = 1e-4
    position, force = slips(0.02, (0.022,), step)
    moving = position > position[0] + 1e-10
    assert np.all(np.diff(position) > -1e-12)
    # It rests until the pressures overcome stiction.
    assert float(np.max(force[~moving])) == pytest.approx(FRICTION["F_S"], rel=2e-3)
    velocity = np.gradient(position, step)
    acceleration = np.gradient(velocity, step)
    # Past the first moments, whose bends no difference of samples follows.
    inner = np.flatnonzero(moving & (velocity > 0.2 * np.max(velocity)))[5:-5]
    friction = force[inner] - MASS * acceleration[inner]
    above = (friction - FRICTION["F_C"] - FRICTION["F_v"] * velocity[inner]) / surplus(velocity[inner])
    faster = acceleration[inner] > 0.2 * np.max(acceleration[inner])
    slower = acceleration[inner] < 0.2 * np.min(acceleration[inner])
    assert np.median(above[faster]) == pytest.approx(1.0, abs=0.1)
    assert np.median(above[slower]) == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("case", [presliding, compliance, bearing])
def test_the_same_case_is_the_same_recording(case: object) -> None:
    assert callable(case)
    one, other = case(), case()
    for first, second in zip((*one.train, *one.validation), (*other.train, *other.validation), strict=True):
        assert np.array_equal(first.position, second.position)
        assert np.array_equal(first.effort, second.effort)
    learnt, held = one.train[0].effort, one.validation[0].effort
    assert learnt.shape != held.shape or not np.array_equal(learnt, held)
    assert math.isfinite(float(np.sum(one.train[0].effort)))
