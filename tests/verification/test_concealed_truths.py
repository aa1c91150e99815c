"""The truths of the concealed cases, against closed forms and equations written elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric_nodes.verification.concealed_asymmetry import swing
from fric_nodes.verification.concealed_presliding import _case as presliding


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


@pytest.mark.parametrize("case", [presliding])
def test_the_same_case_is_the_same_recording(case: object) -> None:
    assert callable(case)
    one, other = case(), case()
    for first, second in zip((*one.train, *one.validation), (*other.train, *other.validation), strict=True):
        assert np.array_equal(first.position, second.position)
        assert np.array_equal(first.effort, second.effort)
    assert one.train[0].n_samples != one.validation[0].n_samples
    assert math.isfinite(float(np.sum(one.train[0].effort)))
