"""Ramp and steps: where it rests, and how fast it gets there."""

from __future__ import annotations

import numpy as np
import pytest
from fric.excitation import EXCITATIONS
from fric.excitation_kind import ExcitationError

VALUES = {"midpoint": 0.085, "height": 0.05, "ramp_time": 2.5, "hold": 4.0, "edge_time": 0.02}


def test_it_rests_at_the_midpoint_above_and_below_it() -> None:
    motion = EXCITATIONS["ramp_and_steps"].plan(VALUES, np.random.default_rng(0))
    assert motion.duration == pytest.approx(2.5 + 4.0 + 2 * 4.02 + 2.5 + 0.02)
    q, v, _ = motion.at(np.array([2.5, 6.49, 6.53, 10.5, 10.56, 14.5]))
    assert q == pytest.approx([0.085, 0.085, 0.135, 0.135, 0.035, 0.035], abs=1e-12)
    assert v == pytest.approx(np.zeros(6), abs=1e-12)
    # On the ramp the speed is constant.
    _, v, a = motion.at(np.linspace(0.03, 2.47, 50))
    assert v == pytest.approx(np.full(50, 0.085 / 2.48), rel=1e-9)
    assert np.abs(a).max() < 1e-9


def test_a_ramp_too_short_for_its_bends_is_refused() -> None:
    with pytest.raises(ExcitationError, match="leaves no ramp"):
        EXCITATIONS["ramp_and_steps"].plan({**VALUES, "ramp_time": 0.04}, np.random.default_rng(0))
