"""How a force is held, on an axis of its own integrator whose controller holds its force in known ways."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.bench.dirty_axis import Axis, Dirt, recorded
from fric.record import Record
from fric.signals.hold import hold_of, resolved

AXIS = Axis(2.0, 5.0, 12.0, 0.3)
CLEAN = Dirt(1000.0, 1, 2e5, 0.0, 0.0, False, "following", 0.01, 0.0, 0.0, 0.0, 0, False, False)


@pytest.mark.parametrize(("hold", "kind"), [("following", "following"), ("preceding", "preceding"), ("mean", "preceding")])
@pytest.mark.parametrize("rate", [250.0, 1000.0, 4000.0])
def test_a_controllers_hold_is_found(hold: str, kind: str, rate: float) -> None:
    found = hold_of(recorded(AXIS, replace(CLEAN, hold=hold, rate=rate), 3))
    assert found.kind == kind
    assert found.late == pytest.approx(0.5 if kind == "following" else -0.5, abs=max(3.0 * found.error, 0.05))


@pytest.mark.parametrize(("every", "late"), [(2, 0.25), (5, 0.1)])
def test_in_a_log_slower_than_its_controller_it_lies_between(every: int, late: float) -> None:
    found = hold_of(recorded(AXIS, replace(CLEAN, every=every), 4))
    assert found.late == pytest.approx(late, abs=max(3.0 * found.error, 0.05))


def test_a_sampled_continuous_force_is_linear() -> None:
    time = np.arange(6000) * 2e-3
    angle = 2.0 * np.pi * np.array([0.7, 1.9])
    position = 0.03 * np.sin(angle[0] * time) + 0.01 * np.sin(angle[1] * time + 0.4)
    velocity = 0.03 * angle[0] * np.cos(angle[0] * time) + 0.01 * angle[1] * np.cos(angle[1] * time + 0.4)
    acceleration = -0.03 * angle[0] ** 2 * np.sin(angle[0] * time) - 0.01 * angle[1] ** 2 * np.sin(angle[1] * time + 0.4)
    noise = 0.01 * np.random.default_rng(1).standard_normal(time.size)
    force = 2.0 * acceleration + 5.0 * np.sign(velocity) + 12.0 * velocity + noise
    record = Record(time, position + 1e-7 * np.random.default_rng(2).standard_normal(time.size), force, effort_hold="unknown")
    found = hold_of(record)
    assert abs(found.late) < max(3.0 * found.error, 0.05)
    assert found.kind in {"linear", "between"}, "a sampled force may be late by anything"
    assert resolved(record).effort_hold == "linear"


def test_what_a_hold_does_not_explain_is_told_as_a_delay() -> None:
    record = recorded(AXIS, replace(CLEAN, hold="following"), 5)
    moved = replace(record, effort=np.roll(record.effort, -3))  # acts three samples later
    found = resolved(moved)
    assert found.effort_hold == "following"
    assert "delay" in found.notes[-1]
    assert found.timing_error > 2.0 * record.sample_time


def test_a_stated_hold_is_believed_and_rest_tells_nothing() -> None:
    record = recorded(AXIS, CLEAN, 6)
    stated = replace(record, effort_hold="preceding")
    assert resolved(stated) is stated
    rest = replace(record, position=np.zeros(record.n_samples))
    assert hold_of(rest).kind == "unknown"
    assert resolved(rest).effort_hold == "linear"
