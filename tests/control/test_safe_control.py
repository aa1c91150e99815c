"""A controller behind the safety layer, and the axis behind another: limits, what is lost and comes back, second senders."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from fric.axis import SimulatedAxis
from fric.control.feedbacks.pid import Pid, PidGains
from fric.control.guarded_axis import GuardedAxis
from fric.control.reference_guard import ReferenceGuard, ReferenceLimits
from fric.control.safe_control import SafeControl
from fric.control.safety import Limits, SafetyError, SafetyLayer, State
from fric.control.stall import StallGuard, StallLimits
from fric.model import build_model, term

H = 2_000_000  # [ns]
DT = 1e-9 * H
MODEL = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=5.0), term("viscous", coefficient=35.0)])
LIMITS = Limits(100.0, 5000.0, command_timeout=0.05, resume=True)
SIZE, PACE = 0.02, 2.0 * math.pi


class Loop:
    """Reference, controller and axis in library time, each behind a layer of its own."""

    def __init__(self, limits: Limits = LIMITS, enabled: bool = True) -> None:
        self.now = self.origin = 10**18
        self.axis = SimulatedAxis(MODEL, resolution=1e-7)
        self.drive = GuardedAxis(self.axis, SafetyLayer(limits), self.now, True)
        references = ReferenceGuard(ReferenceLimits(0.05, 4.0, 0.5))
        guard = StallGuard(Pid(PidGains(21_500.0, 1.41e6, 328.0, 5e-4), 100.0), references, StallLimits(DT))
        self.control = SafeControl(guard, SafetyLayer(limits), 2.0 * DT, enabled)
        self.forces: list[float] = []
        self.positions: list[float] = []
        self.sent: list[float] = []
        self.joint: Callable[[float], float | None] = lambda position: position
        self.referenced = self.answered = True

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            self.now += H
            t = 1e-9 * (self.now - self.origin)
            if self.referenced:
                sine, cosine = math.sin(PACE * t), math.cos(PACE * t)
                self.control.reference(self.now, self.now, SIZE * sine, SIZE * PACE * cosine, -SIZE * PACE**2 * sine)
            self.drive.sample(self.now, 1)
            measured = self.axis.measure()
            seen = self.joint(measured.position)
            force = None
            if self.answered:
                given = None if seen is None else self.control.answer(self.now, self.now, seen, acting=measured.effort)
                force = given if given is not None else self.control.idle(self.now)
            if force is not None:
                self.sent.append(force)
                self.drive.command(self.now, self.now, force)
            self.forces.append(self.drive.force)
            self.positions.append(self.axis.position)

    def error(self) -> float:
        """Distance of axis and reference [m]."""
        return abs(self.axis.position - SIZE * math.sin(PACE * 1e-9 * (self.now - self.origin)))


def test_it_follows_and_keeps_the_force_rate() -> None:
    loop = Loop()
    loop.run(2.0)
    assert loop.error() < 2e-4
    # Between two samples a command adds a step of its own.
    assert np.abs(np.diff(loop.forces)).max() <= LIMITS.force_rate * DT * (1.0 + 1e-9)


def test_without_joint_states_the_force_comes_down_and_it_goes_on_when_they_are_back() -> None:
    loop = Loop()
    loop.run(0.62)
    loop.joint = lambda position: None
    before = len(loop.sent)
    loop.run(0.3)
    assert loop.sent[-1] == 0.0
    assert np.abs(np.diff(loop.sent[before - 1 :])).max() <= LIMITS.force_rate * 2.0 * DT * (1.0 + 1e-9)
    assert loop.control.layer.counters["joint state lost"] == 1
    assert not loop.control.layer.faults
    silent = len(loop.sent)
    loop.run(0.1)
    assert len(loop.sent) == silent
    loop.joint = lambda position: position
    loop.run(2.0)
    assert loop.control.layer.state is State.ENABLED
    assert loop.error() < 2e-4
    assert np.abs(np.diff(loop.positions)).max() / DT < 0.5


def test_a_pause_of_the_controller_ends_without_a_jump() -> None:
    loop = Loop()
    loop.run(0.7)
    loop.answered = False
    loop.run(0.4)
    assert loop.drive.layer.counters["command lost"] == 1
    assert loop.forces[-1] == 0.0
    loop.answered = True
    loop.run(2.0)
    assert loop.error() < 2e-4
    assert max(map(abs, loop.positions)) < SIZE + 1e-3


def test_a_fault_is_latched_until_it_is_reset_and_enabled_without_a_jump() -> None:
    limits = Limits(
        100.0, 5000.0, speed=0.5, inertia_min=1.6, inertia_max=2.4, friction=10.0, viscous=40.0, position_noise=1e-6,
        command_timeout=0.05, resume=True,
    )  # fmt: skip
    loop = Loop(limits)
    loop.run(1.02)
    loop.joint = lambda position: -position
    loop.run(0.3)
    control = loop.control
    assert set(control.layer.faults) <= {"motion contradicts force", "joint state implausible"}
    assert control.layer.state is State.FAULT
    loop.joint = lambda position: position
    loop.run(1.0)
    assert loop.sent[-1] == 0.0
    with pytest.raises(SafetyError, match="fault"):
        control.enable(loop.now)
    control.layer.reset(loop.now)
    loop.run(0.1)
    begin = loop.axis.position
    control.enable(loop.now)
    loop.run(0.01)
    assert abs(loop.axis.position - begin) < 1e-4  # it begins where the axis is, and approaches the reference
    loop.run(2.0)
    assert loop.error() < 2e-4


def test_it_waits_to_be_enabled_and_nothing_accumulates_meanwhile() -> None:
    loop = Loop(enabled=False)
    loop.run(1.0)
    assert loop.sent == []
    loop.control.enable(loop.now)
    loop.run(0.01)
    assert max(map(abs, loop.positions)) < 1e-4
    loop.run(2.0)
    assert loop.error() < 2e-4
    loop.control.disable(loop.now)
    loop.run(0.1)
    assert loop.sent[-1] == 0.0


@pytest.mark.parametrize("period", [H // 3, H, 3 * H])
def test_a_second_publisher_of_references_is_a_fault_and_one_alone_is_none(period: int) -> None:
    control, random = Loop().control, np.random.default_rng(0)
    now = 10**18

    def send(count: int, senders: int) -> bool:
        nonlocal now
        for _ in range(count):
            now += period
            for k in range(senders):
                # A sender may be late; what it sends then bears a later stamp.
                stamp = now + (k * period) // 3 + int(random.exponential(0.3) * period)
                control.reference(stamp, stamp, 0.0, 0.0, 0.0)
            control.referees(now, known)
        return "second reference source" in control.layer.faults

    known = 1
    assert not send(2000, 1)
    known = 2  # one of them is silent, as one that was killed
    assert not send(2000, 1)
    if period <= H:
        assert send(100, 2)


def test_what_queued_up_for_the_drive_is_no_second_sender() -> None:
    loop = Loop()
    loop.run(0.5)
    for _ in range(50):
        loop.drive.command(loop.now, loop.now, 1.0)
        loop.now += 1000
    loop.drive.sample(loop.now + H, 2)
    assert not loop.drive.layer.faults
    assert loop.drive.layer.counters["command burst"] == 1


@pytest.mark.parametrize("force", [math.nan, math.inf, -math.inf, 1e308])
def test_no_number_gets_through_to_the_axis(force: float) -> None:
    loop = Loop()
    loop.run(0.5)
    before = loop.drive.force
    loop.drive.command(loop.now + 1, loop.now + 1, force)
    assert loop.drive.force == pytest.approx(before, abs=0.1)
    loop.run(1.0)
    assert loop.error() < 2e-4


def test_the_drives_watchdog_stays_behind_the_layer() -> None:
    loop = Loop(Limits(100.0, command_timeout=0.05, resume=True))
    loop.run(0.7)
    assert loop.drive.force != 0.0
    # The process is held up for a second: nothing steps the layer.
    assert loop.drive.sample(loop.now + 10**9, 1)
    assert loop.drive.force == 0.0
    loop.now += 10**9
    loop.run(2.0)
    assert loop.error() < 2e-4
