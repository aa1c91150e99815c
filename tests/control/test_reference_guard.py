"""The setpoint: exact while references come, at rest within bounds when they stop, without a jump when they come again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.control.reference_guard import Following, ReferenceGuard, ReferenceLimits
from hypothesis import given, settings
from hypothesis import strategies as st

H = 2_000_000  # [ns]
DT = 1e-9 * H
LIMITS = ReferenceLimits(timeout=0.05, acceleration=4.0, speed=0.5, position_min=-0.1, position_max=0.1)


def motion(t: float) -> tuple[float, float, float]:
    w = 2.0 * math.pi * 0.7
    return 0.04 * math.sin(w * t), 0.04 * w * math.cos(w * t), -0.04 * w * w * math.sin(w * t)


class Run:
    def __init__(self) -> None:
        self.guard = ReferenceGuard(LIMITS)
        self.now = 10**18
        self.guard.start(self.now, 0.0, 0.0)
        self.points: list[tuple[float, float]] = []

    def go(self, seconds: float, speaks: bool = True, shift: float = 0.0) -> None:
        for _ in range(round(seconds / DT)):
            self.now += H
            if speaks:
                position, velocity, acceleration = motion(1e-9 * (self.now - 10**18))
                self.guard.take(self.now, self.now, position + shift, velocity, acceleration)
            self.points.append(self.guard.at(self.now)[:2])

    def assert_smooth(self) -> None:
        position, velocity = np.array(self.points).T
        assert np.abs(np.diff(velocity)).max() <= 2.5 * LIMITS.acceleration * DT
        # The position moves by the velocity: no jump hides in it.
        assert np.abs(np.diff(position) / DT - 0.5 * (velocity[1:] + velocity[:-1])).max() < 2.5 * LIMITS.acceleration * DT
        assert np.abs(position).max() <= 0.1


def test_a_reference_is_followed_exactly_and_led_on_between() -> None:
    run = Run()
    run.go(4.0)
    assert run.guard.following is Following.FOLLOWING
    assert run.points[-1] == pytest.approx(motion(1e-9 * (run.now - 10**18))[:2], abs=1e-6)
    between = run.guard.at(run.now + H // 2)
    assert between.position == pytest.approx(motion(1e-9 * (run.now + H // 2 - 10**18))[0], abs=1e-6)
    run.assert_smooth()


@pytest.mark.parametrize("silence", [0.1, 0.4, 2.0])
@pytest.mark.parametrize("shift", [0.0, 0.04])
def test_a_lost_reference_ends_at_rest_and_comes_back_without_a_jump(silence: float, shift: float) -> None:
    run = Run()
    run.go(3.0)
    position, velocity = run.points[-1]
    run.go(silence, speaks=False)
    assert run.guard.lost
    if silence > 0.3:
        assert run.guard.following is Following.RESTING
        way = abs(velocity) * (LIMITS.timeout + DT) + velocity**2 / (2.0 * LIMITS.acceleration) + 0.002
        assert abs(run.points[-1][0] - position) <= way
    run.go(3.0, shift=shift)
    assert run.guard.following is Following.FOLLOWING
    assert run.points[-1][0] == pytest.approx(motion(1e-9 * (run.now - 10**18))[0] + shift, abs=1e-5)
    assert run.guard.counters["reference lost"] == 1
    run.assert_smooth()


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ((math.nan, 0.0, 0.0, 0), "not finite"),
        ((0.0, math.inf, 0.0, 0), "not finite"),
        ((1e308, 0.0, 0.0, 0), "outside the position range"),
        ((0.0, 1e300, 0.0, 0), "faster than the speed limit"),
        ((0.0, 0.0, 1e300, 0), "implausible acceleration"),
        ((0.09, 0.0, 0.0, 0), "a jump beyond the speed limit"),
        ((0.0, 0.0, 0.0, 10**10), "from the future"),
        ((0.0, 0.0, 0.0, -(10**10)), "too old"),
        ((0.0, 0.0, 0.0, -2 * H), "out of order"),
    ],
)
def test_what_no_reference_can_be_is_refused_by_name(change: tuple[float, float, float, int], why: str) -> None:
    run = Run()
    run.go(0.99)  # near the middle of the motion
    before = run.points[-1]
    run.now += H
    position, velocity, acceleration, shift = change
    position += motion(1e-9 * (run.now - 10**18))[0]
    assert run.guard.take(run.now, run.now + shift, position, velocity, acceleration) == why
    assert run.guard.counters[f"refused reference: {why}"] == 1
    run.points.append(run.guard.at(run.now)[:2])
    run.go(0.1)
    assert run.points[-1] == pytest.approx(motion(1e-9 * (run.now - 10**18))[:2], abs=1e-2)
    assert before != run.points[-1]
    run.assert_smooth()


wild = st.one_of(st.floats(), st.floats(-0.2, 0.2))


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(wild, wild, wild, st.integers(-(10**8), 10**8), st.integers(-H, 10**8)), max_size=50))
def test_whatever_comes_the_setpoint_is_finite_inside_and_without_jump(
    sequence: list[tuple[float, float, float, int, int]],
) -> None:
    guard, now = ReferenceGuard(LIMITS), 10**18
    guard.start(now, 0.0, 0.0)
    last = guard.at(now)
    for position, velocity, acceleration, shift, passed in sequence:
        guard.take(now, now + shift, position, velocity, acceleration)
        now += passed
        here = guard.at(now)
        assert math.isfinite(here.position)
        assert math.isfinite(here.velocity)
        assert abs(here.position) <= 0.3
        assert abs(here.position - last.position) <= 2.1 * LIMITS.speed * min(max(1e-9 * passed, 0.0), 0.02) + 1e-6
        last = here
