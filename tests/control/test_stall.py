"""A controller that was held up in motion: no excursion, no jump of force, and nothing that stays."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
import pytest
from fric.axis import SimulatedAxis
from fric.control.feedbacks.pid import Pid, PidGains
from fric.control.reference_guard import ReferenceGuard, ReferenceLimits
from fric.control.stall import StallGuard, StallLimits
from fric.model_file import read_model
from fric.shared_files import config_file

H = 2_000_000  # [ns]
DT = 1e-9 * H
WATCHDOG = 0.1  # [s] as the plant has it: without a command for so long there is no force
SETTLED = 6e-4  # [m] what the reversal of friction leaves of this controller's error
GAINS = PidGains(21_500.0, 1.41e6, 328.0, 5e-4)  # of config/pid.yaml


def motion(t: float) -> tuple[float, float, float]:
    w = 2.0 * math.pi * 0.8
    return 0.03 * math.sin(w * t), 0.03 * w * math.cos(w * t), -0.03 * w * w * math.sin(w * t)


class Loop:
    """The controller in a process that can be held up; references and states queue up meanwhile."""

    def __init__(self, pid: Pid | None = None) -> None:
        self.pid = pid or Pid(GAINS, 100.0)
        self.references = ReferenceGuard(ReferenceLimits(timeout=0.1, acceleration=4.0, speed=0.5))
        self.guard = StallGuard(self.pid, self.references, StallLimits(DT))
        self.axis = SimulatedAxis(read_model(config_file("demo_axis.yaml")), resolution=1e-7)
        self.now = self.origin = 10**18
        self.queue: deque[tuple[int, tuple[float, float, float], float]] = deque()
        self.force, self.given = 0.0, self.now
        self.errors: list[float] = []
        self.forces: list[float] = []

    def go(self, seconds: float, held_up: bool = False) -> None:
        for _ in range(round(seconds / DT)):
            self.now += H
            wanted = motion(1e-9 * (self.now - self.origin))
            position = self.axis.measure().position
            self.queue.append((self.now, wanted, position))
            if not held_up:
                while self.queue:
                    stamp, reference, measured = self.queue.popleft()
                    self.references.take(self.now, stamp, *reference)
                    acting = self.force if 1e-9 * (self.now - self.given) < WATCHDOG else 0.0
                    force = self.guard.answer(self.now, stamp, measured, acting=acting)
                    if force is not None:
                        self.force, self.given = force, self.now
            if 1e-9 * (self.now - self.given) >= WATCHDOG:
                self.force = 0.0
            self.axis.advance(self.force, DT)
            self.errors.append(position - wanted[0])
            self.forces.append(self.force)


def test_without_a_stall_it_is_the_controller_alone() -> None:
    guarded = Loop()
    guarded.go(4.0)
    assert np.abs(guarded.errors[-500:]).max() < SETTLED
    assert not guarded.guard.counters


def test_fifty_stalls_leave_no_excursion() -> None:
    random = np.random.default_rng(3)
    for k in range(50):
        loop = Loop()
        loop.go(1.0 + 1.25 * random.random())
        stall = (0.05, 0.5, 2.0)[k % 3] * (0.5 + random.random())
        begin = len(loop.errors)
        force = loop.forces[-1]
        loop.go(stall, held_up=True)
        there = len(loop.errors)
        position = loop.axis.position
        # What the axis does meanwhile is physics: the force given last, then none. It is back then without going beyond
        # the motion itself by more than a millimetre.
        loop.go(2.0)
        reference = np.array([motion(DT * i)[0] for i in range(len(loop.errors) + 1)])
        path = np.array(loop.errors) + reference[1:]
        assert np.abs(path[there:]).max() <= max(0.03, abs(position)) + 1e-3
        assert np.abs(loop.errors[-250:]).max() < SETTLED
        # The first answer continues the force that acted.
        acted = loop.forces[there - 1]
        assert abs(loop.forces[there] - acted) < 15.0, (k, stall, force, acted, loop.forces[there])
        assert begin < there


@pytest.mark.parametrize("late", [0.006, 0.012, 0.018])
def test_a_short_gap_is_bridged_without_integrating_over_it(late: float) -> None:
    loop = Loop()
    loop.go(3.0)
    loop.go(late, held_up=True)
    at = len(loop.forces)
    loop.go(0.5)
    assert abs(loop.forces[at] - loop.forces[at - 1]) < 12.0
    assert np.abs(loop.errors[at:]).max() < 1e-3


def test_states_that_stay_later_than_before_are_answered_again() -> None:
    loop = Loop()
    loop.go(2.0)
    loop.go(0.5, held_up=True)
    loop.queue.clear()
    answered = 0
    for _ in range(200):
        loop.now += H
        loop.references.take(loop.now, loop.now, *motion(1e-9 * (loop.now - loop.origin)))
        measured = loop.axis.measure().position
        force = loop.guard.answer(loop.now + 6 * H, loop.now, measured)  # 12 ms late from now on
        answered += force is not None
        loop.axis.advance(force or 0.0, DT)
    assert answered > 150


def test_a_controller_whose_state_is_not_finite_resets_and_says_so() -> None:
    loop = Loop()
    loop.go(2.0)
    loop.pid._integral = math.inf
    loop.go(2.0)
    assert loop.guard.counters["controller not finite: reset"] == 1
    assert np.abs(loop.errors[-250:]).max() < SETTLED


def test_what_is_not_finite_never_comes_to_the_controller() -> None:
    loop = Loop()
    loop.go(2.0)
    for bad in (math.nan, math.inf, -math.inf):
        assert loop.guard.answer(loop.now + 1, loop.now + 1, bad) is None
    force = loop.guard.answer(loop.now + H, loop.now + H, loop.axis.measure().position, feedforward=math.nan)
    assert force is not None
    assert math.isfinite(force)
    assert loop.guard.counters == {"refused joint state: not finite": 3, "refused feedforward: not finite": 1}


@pytest.mark.parametrize("shift", [10**10, -(10**10), -H, 0])
def test_states_of_another_time_are_dropped(shift: int) -> None:
    loop = Loop()
    loop.go(1.0)
    assert loop.guard.answer(loop.now, loop.now + shift, 0.5) is None
    assert sum(loop.guard.counters.values()) == 1
