"""What can't be controlled: refused or borne in one line, and never an unbounded force."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from fric.axis import Measurement, SimulatedAxis
from fric.control.autotune import AutotuneError, Required, Timing, autotune
from fric.control.feedbacks import CONTROLLERS
from fric.control.feedforward import SPEED, Feedforward
from fric.control.feedforwards.dnlrx import DnlrxForce
from fric.control.tensor_product.quasi_lpv import TensorProductControlError
from fric.control.tensor_product.tuning import tuned_tensor_product
from fric.control.trial import Course, follow, sine
from fric.errors import InputError
from fric.friction.dnlrx import from_mechanics
from fric.model import Model, build_model, term

H, LIMIT = 1e-3, 100.0
MODEL = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=6.0), term("viscous", coefficient=20.0)])
TIMING = Timing(H, H, 1e-6, LIMIT)
TUNED = sorted(name for name, kind in CONTROLLERS.items() if kind.tunable is not None)


class Reversed:
    """An axis that a positive force moves backwards."""

    def __init__(self, axis: SimulatedAxis) -> None:
        self._axis = axis

    @property
    def position(self) -> float:
        return self._axis.position

    def measure(self) -> Measurement:
        return self._axis.measure()

    def advance(self, force: float, duration: float) -> None:
        self._axis.advance(-force, duration)


def _followed(name: str, truth: Model, backwards: bool = False) -> Course:
    kind = CONTROLLERS[name]
    ahead = Feedforward(H, preview=1.5 * H, transition_time=0.0)
    ahead.set_model(MODEL, at_once=True)
    axis = SimulatedAxis(truth, resolution=1e-6, force_limit=10.0 * LIMIT)
    law = kind.build(autotune(MODEL, kind, TIMING, draws=10, calm=False).gains, LIMIT)
    return follow(Reversed(axis) if backwards else axis, law, sine(H, 0.02, 1.0, 2.0), ahead, 1)


@pytest.mark.parametrize("name", [pytest.param(each, marks=[] if each == "pid" else pytest.mark.long) for each in TUNED])
def test_another_mass_is_borne_and_a_wrong_sign_bounded(name: str) -> None:
    for factor in (0.5, 2.0):
        course = _followed(name, MODEL.with_value("mass", factor * 2.0))
        assert course.stable
        assert np.sqrt(np.mean(course.error[1000:] ** 2)) < 3e-4
        assert np.max(np.abs(course.force)) < 0.5 * LIMIT
    wrong = _followed(name, MODEL, backwards=True)
    assert np.all(np.isfinite(wrong.force))
    assert np.max(np.abs(wrong.force)) <= LIMIT
    assert wrong.saturated > 0


@pytest.mark.parametrize(("name", "value"), [("coulomb.force", -6.0), ("mass", -2.0), ("viscous.coefficient", math.nan)])
def test_values_that_no_axis_has_are_refused_before_they_act(name: str, value: float) -> None:
    bad = MODEL.with_value(name, value)
    with pytest.raises(InputError, match=f"{name} is") as told:
        Feedforward(H).set_model(bad)
    assert "\n" not in str(told.value)
    with pytest.raises(InputError, match=f"{name} is"):
        autotune(bad, CONTROLLERS["pid"], TIMING)
    with pytest.raises(InputError, match=f"{name} is"):
        tuned_tensor_product(bad, TIMING, fastest=0.1)


def test_a_mass_that_nobody_knows_can_not_be_tuned_for() -> None:
    with pytest.raises(AutotuneError, match="identify mass and damping better"):
        autotune(replace(MODEL, standard_errors={"mass": 3.0}), CONTROLLERS["pid"], TIMING)


def test_references_faster_than_the_recordings_are_counted() -> None:
    known = replace(MODEL, provenance={SPEED: "0.1 m/s"})
    ahead = Feedforward(H, transition_time=0.0)
    ahead.set_model(known, at_once=True)
    for k in range(10):
        ahead.step(k * H, 0.0, 0.1 if k < 6 else 0.3, 0.0)
    assert ahead.beyond == 4
    ahead.set_model(MODEL, at_once=True)
    ahead.step(1.0, 0.0, 1e3, 0.0)
    assert ahead.beyond == 4, "a model that doesn't say how fast it was identified is taken as it is"


def test_a_dnlrx_at_another_rate_is_refused() -> None:
    model = from_mechanics(2.0, 20.0, 0.0, [1e4], [1e-6], 1e-3, order=3)
    with pytest.raises(InputError, match="identify it at the controller's period"):
        DnlrxForce(model, 2e-3)


def test_linear_matrix_inequalities_without_a_solution_are_refused_in_one_line() -> None:
    with pytest.raises(TensorProductControlError, match="shorten period or delay") as told:
        tuned_tensor_product(MODEL, TIMING, fastest=0.1, required=Required(phase=85.0, gain=20.0))
    assert "\n" not in str(told.value)
    with pytest.raises(TensorProductControlError, match="give the timing one"):
        tuned_tensor_product(MODEL, Timing(H), fastest=0.1)


def test_gains_that_make_it_unstable_are_told_and_bounded() -> None:
    kind = CONTROLLERS["pid"]
    gains = {**autotune(MODEL, kind, TIMING, draws=10, calm=False).gains}
    gains["derivative"] *= 30.0
    axis = SimulatedAxis(MODEL, resolution=1e-6, force_limit=LIMIT)
    course = follow(axis, kind.build(gains, LIMIT), sine(H, 0.02, 1.0, 2.0), None, 1)
    assert np.max(np.abs(course.force)) <= LIMIT
    assert course.saturated > 100
