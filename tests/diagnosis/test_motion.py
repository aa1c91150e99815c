"""The measured motion, smoothed, and the force that a model needs along it, against motions of closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.diagnosis.motion import along, motion_of, smooth
from fric.model import build_model, term

from .small_axis import STEP, followed

MIDDLE = slice(400, -400)


def test_what_is_slow_passes_without_phase_and_what_is_fast_does_not() -> None:
    t = STEP * np.arange(4000)
    slow, fast = np.sin(4.0 * t), np.sin(900.0 * t)
    assert smooth(slow, STEP, 80.0)[MIDDLE] == pytest.approx(slow[MIDDLE], abs=1e-4)
    assert float(np.max(np.abs(smooth(fast, STEP, 80.0)[MIDDLE]))) < 1e-3


def test_forward_and_backward_a_sine_at_the_cutoff_is_halved() -> None:
    t = STEP * np.arange(4000)
    found = smooth(np.sin(80.0 * t), STEP, 80.0)[MIDDLE]
    assert found == pytest.approx(0.5 * np.sin(80.0 * t)[MIDDLE], abs=0.01)


def test_a_cutoff_beyond_the_samples_changes_nothing() -> None:
    noise = np.random.default_rng(1).standard_normal(50)
    assert smooth(noise, STEP, math.inf) is noise


def test_the_force_along_a_motion_is_mass_by_acceleration_and_friction_by_velocity() -> None:
    run = followed().runs[0]
    motion = motion_of(run, 180.0)
    model = build_model("rigid", {"mass": 3.0}, [term("viscous", coefficient=20.0), term("bias", force=2.0)])
    time = STEP * np.arange(1, run.position.shape[0] + 1)
    needed = along(model, run, time, motion, motion.velocity, model.inner_states(0.0))
    assert needed == pytest.approx(3.0 * motion.acceleration + 20.0 * motion.velocity + 2.0)
