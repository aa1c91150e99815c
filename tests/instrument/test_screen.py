"""End stops and limits of the force: what is one, and what only looks like one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from fric.identification.screen import screened
from fric.instrument import CHECKS, Evidence, Finding
from fric.record import Record
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 1e-3


def run(
    control: Callable[[float, float, float], float],
    duration: float,
    stiffness: float = 0.0,
    coulomb: float = 6.0,
    wall: float = np.inf,
    noise: float = 0.05,
) -> Record:
    """A body of 2 kg with Coulomb friction, stepped after Moreau; ``control(t, q, v)`` is the force until the next sample."""
    mass, viscous, fine = 2.0, 4.0, 10
    h = STEP / fine
    q = v = 0.0
    positions, forces = [], []
    for k in range(round(duration / STEP)):
        u = control(k * STEP, q, v)
        positions.append(q)
        forces.append(u)
        for _ in range(fine):
            free = v + h / mass * (u - viscous * v - stiffness * q)
            v = float(np.sign(free)) * max(abs(free) - h / mass * coulomb, 0.0)
            q += h * v
            if q > wall:
                q, v = wall, min(-0.1 * v, 0.0)
    n = len(positions)
    effort = np.array(forces) + noise * np.random.default_rng(1).standard_normal(n)
    return Record(STEP * np.arange(n), np.round(np.array(positions) / 1e-6) * 1e-6, effort, effort_hold="following")


def check(name: str, record: Record) -> Finding:
    return CHECKS[name].run(Evidence((record,)))[0]


def strokes(t: float) -> tuple[float, float]:
    """Trapezoidal strokes of 0.05 m with rests at both ends: position and velocity wanted."""
    phase = t % 2.0
    if phase < 0.5:
        return 0.1 * phase, 0.1
    if phase < 1.0:
        return 0.05, 0.0
    if phase < 1.5:
        return 0.05 - 0.1 * (phase - 1.0), -0.1
    return 0.0, 0.0


def follow(t: float, q: float, v: float) -> float:
    target, speed = strokes(t)
    return 4000.0 * (target - q) + 120.0 * (speed - v)


def test_rests_at_both_ends_of_a_stroke_are_neither_stops_nor_limits() -> None:
    record = run(follow, 6.0)
    assert check("end_stop", record).verdict == "ok"
    assert check("saturation", record).verdict != "fault"
    assert screened(record) is record


def test_a_held_deflection_is_neither_a_stop_nor_a_limit() -> None:
    def push(t: float, q: float, v: float) -> float:
        return 40.0 * min(t, 1.0) if t < 2.5 else 0.0

    record = run(push, 6.0, stiffness=800.0, coulomb=0.5)
    assert check("end_stop", record).verdict == "ok"
    assert check("saturation", record).verdict != "fault"
    assert screened(record) is record


def test_an_end_stop_is_found_where_it_is() -> None:
    record = run(follow, 6.0, wall=0.04)
    finding = check("end_stop", record)
    assert finding.verdict == "fault"
    # It meets the wall 0.4 s into each stroke and leaves it 1.1 s into it.
    assert [round(a, 1) for a, _ in finding.time] == pytest.approx([0.4, 2.4, 4.4], abs=0.11)
    left_out = screened(record)
    assert not left_out.mask[700]
    assert left_out.mask[1500]
    assert any("end stop" in note and "left out" in note for note in left_out.notes)


def limited(t: float, q: float, v: float) -> float:
    wanted = 0.03 * np.sin(2.0 * np.pi * 1.5 * t) + 0.01 * np.sin(2.0 * np.pi * 0.4 * t)
    speed = 0.03 * 2.0 * np.pi * 1.5 * np.cos(2.0 * np.pi * 1.5 * t)
    return 4000.0 * (wanted - q) + 120.0 * (speed - v)


def test_a_clipped_sensor_is_left_out_and_a_drive_at_its_limit_is_not() -> None:
    free = run(limited, 6.0)
    top = 0.8 * float(np.quantile(np.abs(free.effort), 0.99))
    clipped = Record(free.time, free.position, np.clip(free.effort, -top, top), effort_hold="following")
    assert check("saturation", clipped).verdict == "fault"
    assert any("saturation" in note for note in screened(clipped).notes)
    # The force recorded is the one that acted: named, but nothing is wrong with it.
    limit = 0.7 * float(np.max(np.abs(free.effort)))
    honest = run(lambda t, q, v: float(np.clip(limited(t, q, v), -limit, limit)), 6.0)
    assert check("saturation", honest).verdict == "warning"
    assert not any("saturation" in note for note in screened(honest).notes)
