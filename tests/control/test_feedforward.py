"""The feedforward without ROS: right force, right moment, and no jumps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.control.feedforward import Feedforward, FeedforwardError
from fric.model import Model, build_model, term

H = 0.002
COULOMB = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=10.0), term("viscous", coefficient=30.0)])
LUGRE = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=10.0), term("presliding", "lugre", stiffness=1e6)])


def _along(
    feedforward: Feedforward, seconds: float, start: float = 0.0, amplitude: float = 0.02, omega: float = 5.0
) -> np.ndarray:
    forces = []
    for k in range(round(start / H), round((start + seconds) / H)):
        t = k * H
        q, v = amplitude * math.sin(omega * t), amplitude * omega * math.cos(omega * t)
        forces.append(feedforward.step(t, q, v, -omega * omega * q))
    return np.array(forces)


def test_force_is_the_model_s_at_the_preview() -> None:
    feedforward = Feedforward(H, preview=0.004)
    feedforward.set_model(COULOMB, at_once=True)
    forces = _along(feedforward, 0.2)
    t = np.arange(100) * H + 0.004
    v, a = 0.1 * np.cos(5.0 * t), -0.5 * np.sin(5.0 * t)
    assert forces[1:] == pytest.approx((2.0 * a + 30.0 * v + 10.0)[1:], abs=1e-3)


def test_default_preview_is_half_a_sample() -> None:
    assert Feedforward(H).preview == pytest.approx(0.001)


def test_inertia_and_terms_can_be_left_out() -> None:
    feedforward = Feedforward(H, terms=["viscous"], include_inertia=False, preview=0.0)
    feedforward.set_model(COULOMB, at_once=True)
    assert feedforward.step(0.0, 0.0, 0.1, 7.0) == pytest.approx(3.0)


def test_an_effect_that_is_not_there_is_named() -> None:
    with pytest.raises(FeedforwardError, match=r"stribeck.*coulomb, viscous"):
        Feedforward(H, terms=["stribeck"]).set_model(COULOMB)


def _largest_step(forces: np.ndarray) -> float:
    return float(np.abs(np.diff(forces)).max())


@pytest.mark.parametrize("new", [None, LUGRE, COULOMB.with_value("coulomb.force", 20.0)])
def test_change_of_model_is_spread_over_the_transition(new: Model | None) -> None:
    feedforward = Feedforward(H, transition_time=0.1)
    feedforward.set_model(COULOMB, at_once=True)
    before = _along(feedforward, 0.1, amplitude=0.2, omega=0.5)
    feedforward.set_model(new)
    after = _along(feedforward, 0.2, start=0.1, amplitude=0.2, omega=0.5)
    # 13 N change at most, over 50 samples.
    assert _largest_step(np.concatenate([before, after])) < 13.5 / 50
    alone = Feedforward(H)
    alone.set_model(new, at_once=True)
    _along(alone, 0.1, amplitude=0.2, omega=0.5)
    assert after[-1] == pytest.approx(_along(alone, 0.2, start=0.1, amplitude=0.2, omega=0.5)[-1], abs=1e-6)


def test_two_changes_within_one_transition_make_no_jump() -> None:
    feedforward = Feedforward(H, transition_time=0.1)
    feedforward.set_model(COULOMB, at_once=True)
    forces = [_along(feedforward, 0.05, amplitude=0.2, omega=0.5)]
    for k, model in enumerate((None, LUGRE, COULOMB)):
        feedforward.set_model(model)
        forces.append(_along(feedforward, 0.03, start=0.05 + 0.03 * k, amplitude=0.2, omega=0.5))
    assert _largest_step(np.concatenate(forces)) < 13.5 / 50


def test_switching_off_and_on_ramps() -> None:
    feedforward = Feedforward(H, transition_time=0.1)
    feedforward.set_model(COULOMB, at_once=True)
    forces = [_along(feedforward, 0.1, amplitude=0.2, omega=0.5)]
    feedforward.enabled = False
    forces.append(_along(feedforward, 0.2, start=0.1, amplitude=0.2, omega=0.5))
    assert forces[-1][-1] == 0.0
    feedforward.enabled = True
    forces.append(_along(feedforward, 0.2, start=0.3, amplitude=0.2, omega=0.5))
    assert forces[-1][-1] > 10.0
    assert _largest_step(np.concatenate(forces)) < 13.5 / 50


def test_static_friction_is_let_down_at_rest() -> None:
    feedforward = Feedforward(H, rest_fade_time=0.1, preview=0.0)
    feedforward.set_model(COULOMB, at_once=True)
    feedforward.step(0.0, 0.0, 1e-6, 0.0)
    rest = np.array([feedforward.step(k * H, 0.0, 0.0, 0.0) for k in range(1, 101)])
    assert rest[0] == pytest.approx(10.0 * (1.0 - H / 0.1))
    assert np.all(np.diff(rest) <= 0.0)
    assert rest[-1] == 0.0


def test_pre_sliding_keeps_its_own_force_at_rest() -> None:
    feedforward = Feedforward(H, preview=0.0)
    feedforward.set_model(LUGRE, at_once=True)
    for k in range(100):
        feedforward.step(k * H, 0.01 * k * H, 0.01, 0.0)
    assert feedforward.step(100 * H, 0.002, 0.0, 0.0) == pytest.approx(10.0, rel=1e-3)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_non_finite_references_are_refused(bad: float) -> None:
    feedforward = Feedforward(H)
    with pytest.raises(FeedforwardError):
        feedforward.step(0.0, 0.0, bad, 0.0)
