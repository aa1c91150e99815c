"""Margins against those that the tuning computes on its own, linear forms against the laws, and what autotuning promises."""

from __future__ import annotations

import numpy as np
import pytest
from fric.control.autotune import Required, Timing, autotune, plants_around, resting_width
from fric.control.controller import Setpoint
from fric.control.feedbacks import CONTROLLERS
from fric.control.feedbacks.pid import PidGains
from fric.control.loop import LinearPlant, margins, pid_polynomials
from fric.control.tuning import loop_margins
from fric.model import build_model, term
from scipy.signal import lfilter

MODEL = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=6.0), term("viscous", coefficient=20.0)])
TIMING = Timing(1e-3, 1e-3, 1e-6, 100.0)
QUICK = ("pid", "nonlinear_pid", "disturbance_observer", "cascade")


@pytest.mark.parametrize("delay", [0.0, 0.4e-3, 2.3e-3])
def test_margins_are_those_of_the_tuning(delay: float) -> None:
    gains = PidGains(2e4, 2e5, 250.0, 1e-3)
    other = loop_margins(gains, 2.0, 20.0, 1e-3, delay=delay)
    found = margins(LinearPlant(2.0, 20.0, 1e-3, delay), pid_polynomials(2e4, 2e5, 250.0, 1e-3, 1e-3))
    assert found.stable == other.stable
    assert found.phase_margin == pytest.approx(other.phase_margin, abs=1.0)
    assert found.gain_margin == pytest.approx(other.gain_margin, rel=0.05)
    assert found.sensitivity == pytest.approx(other.sensitivity, rel=0.01)


def test_a_spring_is_in_the_plant() -> None:
    top, bottom = LinearPlant(2.0, 20.0, 1e-3, stiffness=500.0).polynomials()
    assert np.polyval(top, 1.0) / np.polyval(bottom, 1.0) == pytest.approx(1.0 / 500.0, rel=1e-6)


# The linear form of these two leaves out the friction that their law computes.
_WITH_FRICTION = {"adaptive", "friction_observer"}


@pytest.mark.parametrize("name", sorted(k for k, each in CONTROLLERS.items() if each.tunable and k not in _WITH_FRICTION))
def test_the_linear_form_is_the_law(name: str) -> None:
    """Errors so small that all is linear, on a reference at rest: the law's output is that of its polynomials."""
    kind = CONTROLLERS[name]
    assert kind.tunable is not None
    tuned = autotune(MODEL, kind, Timing(1e-3, 1e-3, 0.0, 1e9), draws=4, calm=False, required=Required(share=0.5))
    gains = {**tuned.gains, **({"dead_zone": 0.0} if "dead_zone" in tuned.gains else {})}
    law, form = kind.build(gains, 1e9), kind.tunable.linear(gains, 1e-3)[-1]
    law.answer(Setpoint(0.0), 0.0, 1e-3)
    random = np.random.default_rng(1)
    # An error of one sign, since a reset would count as nonlinear.
    error = 1e-9 * (1.0 + 0.5 * random.standard_normal(200).clip(-1.5, 1.5))
    given = np.array([law.answer(Setpoint(0.0), -e, 1e-3) for e in error.tolist()])
    # The form begins with the error before the first, which is 0 for both.
    expected = lfilter(
        np.concatenate([np.zeros(len(form[1]) - len(form[0])), form[0]]), form[1], np.concatenate([[0.0], error])
    )
    assert given == pytest.approx(expected[1:], rel=1e-5, abs=1e-12 * np.max(np.abs(expected)))


@pytest.mark.parametrize("name", QUICK)
def test_margins_are_kept_on_other_plants_and_nothing_hunts(name: str) -> None:
    found = autotune(MODEL, CONTROLLERS[name], TIMING, draws=60)
    assert found.kept >= 0.95
    assert found.stable == 1.0
    assert not found.cycles
    others = plants_around(MODEL, TIMING, 100, seed=99)
    kind = CONTROLLERS[name]
    assert kind.tunable is not None
    kept = [
        all(Required().kept(margins(plant, form), TIMING.period) for form in kind.tunable.linear(found.gains, TIMING.period))
        for plant in others
    ]
    assert np.mean(kept) >= 0.9


def test_hunting_is_found_and_ended() -> None:
    sticky = build_model(
        "rigid",
        {"mass": 2.0},
        [term("coulomb", force=6.0), term("stribeck", force=6.0, velocity=0.01), term("viscous", coefficient=5.0)],
    )
    kind = CONTROLLERS["pid"]
    hunting = autotune(sticky, kind, TIMING, draws=20, calm=False)
    assert hunting.cycles
    assert hunting.width > 3e-6
    calmed = autotune(sticky, kind, TIMING, draws=20)
    assert not calmed.cycles
    assert calmed.gains["integral"] == 0.0
    assert resting_width(sticky, kind, calmed.gains, TIMING) < 3e-6
