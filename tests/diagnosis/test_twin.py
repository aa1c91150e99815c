"""What twins leave is what the dirt of a recording leaves, where nothing is missing."""

from __future__ import annotations

from dataclasses import replace

import fric
import fric.diagnosis.twin as twin_module
import numpy as np
import pytest
from fric.diagnosis.fitting import refit
from fric.diagnosis.start import started
from fric.model import build_model, term
from fric.record import Record

H = 2e-3
AXIS = build_model("rigid", {"mass": 5.0}, [term("coulomb", force=8.0), term("viscous", coefficient=30.0)])


@pytest.fixture(scope="module")
def read_late() -> Record:
    """An axis that lacks nothing, whose position is read up to some tens of microseconds early or late."""
    t = H * np.arange(8000)
    force = 30.0 * np.sin(2.0 * np.pi * (0.3 + 0.06 * t) * t) + 12.0 * np.sin(2.0 * np.pi * 1.7 * t)
    moved = fric.simulate(AXIS, force, period=H)
    random = np.random.default_rng(3)
    late = 4e-5 * random.standard_normal(t.shape[0]) * np.gradient(moved.position, H)
    position = np.round((moved.position + late) / 1e-6) * 1e-6
    return replace(moved, position=position, effort=moved.effort + 0.05 * random.standard_normal(t.shape[0]))


def over_floor(record: Record) -> list[float]:
    """What the true structure leaves, over what its twins leave, for each observer."""
    tracks, start = started(AXIS, [record])
    states = [refit(track, start) for track in tracks]
    return [state.left / state.floor for state in states]


def test_a_position_that_is_read_late_is_no_physics(read_late: Record, monkeypatch: pytest.MonkeyPatch) -> None:
    assert max(over_floor(read_late)) < 1.3
    monkeypatch.setattr(twin_module, "_SPEEDS", 1)  # noise that is the same at every speed
    assert max(over_floor(read_late)) > 1.5
