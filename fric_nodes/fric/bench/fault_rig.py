"""An axis under control with faults on its wires, in library time: reference, controller, safety layer, drive.

Every sample, as on a machine: the drive's reading goes through the wire of joint states to the safety layer and to the
controller; the reference goes through its wire to the controller; the controller's force goes through the wire of commands to
the safety layer; what the layer lets through goes to the drive. A fault changes what passes one wire for a while. What is
judged is what reaches the drive, and the true motion of the axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from ..axis import SimulatedAxis
from ..control.feedbacks.pid import Pid, PidGains
from ..control.reference_guard import ReferenceGuard, ReferenceLimits
from ..control.safety import Limits, SafetyError, SafetyLayer, State, stop_from
from ..control.stall import StallGuard, StallLimits
from ..drives import DriveError
from ..drives.serial import SerialDrive
from ..drives.serial_emulator import BadLine, SerialEmulator
from ..model_file import read_model
from ..shared_files import config_file

__all__ = ["LIMITS", "Command", "FaultRig", "H", "Joint", "Outcome", "Reference", "Wires"]

H = 2_000_000  # [ns] period
_DT = 1e-9 * H
_SIZE, _PACE = 0.03, 2.0 * math.pi * 0.8  # [m] and [rad/s] of the motion
LIMITS = Limits(
    100.0, 5000.0, speed=0.5, position_min=-0.1, position_max=0.1,
    inertia_min=1.6, inertia_max=2.4, friction=16.0, viscous=45.0, load=1.0, position_noise=3e-7,
)  # fmt: skip
"""Of the demo axis: 2 kg, 14 N to break away, 37 N s/m; its parameters known to a fifth."""


class Reference(NamedTuple):
    """A reference on its wire: stamp [ns], position [m], velocity [m/s], acceleration [m/s^2]."""

    stamp: int
    position: float
    velocity: float
    acceleration: float


class Joint(NamedTuple):
    """A joint state on its wire: stamp [ns], position [m]."""

    stamp: int
    position: float


class Command(NamedTuple):
    """A command on its wire: stamp [ns], force [N], and who sent it."""

    stamp: int
    force: float
    source: str = "pid"


@dataclass
class Wires:
    """What comes out of each wire for what goes in; None: unharmed."""

    reference: Callable[[Reference], list[Reference]] | None = None
    joint: Callable[[Joint], list[Joint]] | None = None
    command: Callable[[Command], list[Command]] | None = None


@dataclass
class Outcome:
    """What was counted.

    Attributes:
        samples: at the drive.
        unsafe: of them, with force, force rate, speed or position out of limits.
        why: which limit, and by how much, of the first.
        names: of faults latched, inputs refused and what else was counted by name.
        stopped: True unless a stop took longer than stated.
    """

    samples: int = 0
    unsafe: int = 0
    why: str = ""
    names: set[str] = field(default_factory=set)
    stopped: bool = True


class _Drive(Protocol):
    axis: SimulatedAxis

    @property
    def force(self) -> float: ...

    def exchange(self, force: float, now: int) -> Joint | None: ...


class _Direct:
    """The simulated plant."""

    def __init__(self, axis: SimulatedAxis) -> None:
        self.axis, self.force = axis, 0.0

    def exchange(self, force: float, now: int) -> Joint:
        """Give ``force`` over one period; what was measured before."""
        reading = Joint(now, self.axis.measure().position)
        self.force = force
        self.axis.advance(force, _DT)
        return reading


class _Serial:
    """The serial drive and its emulator on a pseudo-terminal."""

    def __init__(self, axis: SimulatedAxis, port: Path, random: np.random.Generator) -> None:
        self.axis, self._time = axis, 10**18
        self.emulator = SerialEmulator(axis, port, lambda: self._time)
        self.emulator.plug()
        self.drive = SerialDrive(str(port), 921_600, 0.05, lambda: self._time)
        self.drive.open()
        self.random = random

    @property
    def force(self) -> float:
        """Given now by the drive [N]."""
        return self.emulator.force

    def damage(self, share: float) -> None:
        """Make both directions of the line bad."""
        bad = {"drop": 0.02 * share, "flip": 0.02 * share, "split": share, "hold": share, "repeat": share}
        self.emulator.incoming, self.emulator.outgoing = BadLine(self.random, **bad), BadLine(self.random, **bad)

    def exchange(self, force: float, now: int) -> Joint | None:
        """Send ``force``, let the drive act, and move the axis by one period."""
        reading = self.drive.exchange(force)
        self.emulator.poll()
        self._time = now + H
        return None if reading is None else Joint(reading.stamp, reading.position)

    def close(self) -> None:
        """Let go of the pseudo-terminal."""
        self.drive.close()
        self.emulator.close()


class FaultRig:
    """One axis in motion.

    Args:
        port: where the serial emulator's device is to appear; None: the plant without a line.
        random: source of chance.
        limits: of the safety layer; what reaches the drive is judged by :data:`LIMITS`.

    Attributes:
        now: present time [ns].
        wires: faults on the wires.
        outcome: what was counted so far.
    """

    def __init__(self, port: Path | None, random: np.random.Generator, limits: Limits = LIMITS) -> None:
        axis = SimulatedAxis(read_model(config_file("demo_axis.yaml")), resolution=1e-7)
        self.serial = None if port is None else _Serial(axis, port, random)
        self._drive: _Drive = self.serial or _Direct(axis)
        self.layer = SafetyLayer(limits)
        self.references = ReferenceGuard(ReferenceLimits(0.05, 4.0, 0.5, -0.08, 0.08))
        self.controller = StallGuard(Pid(PidGains(21_500.0, 1.41e6, 328.0, 5e-4), 100.0), self.references, StallLimits(_DT))
        self.now = self._origin = 10**18
        self.wires = Wires()
        self.outcome = Outcome()
        self._force, self._position = 0.0, axis.position
        self._settled = self._origin
        self._broken = ""

    def wanted(self) -> Reference:
        """The reference of the present."""
        t = 1e-9 * (self.now - self._origin)
        sine, cosine = math.sin(_PACE * t), math.cos(_PACE * t)
        return Reference(self.now, _SIZE * sine, _SIZE * _PACE * cosine, -_SIZE * _PACE**2 * sine)

    def enable(self) -> None:
        """Let readings come, and enable."""
        self.run(0.03)
        self.layer.enable(self.now)

    def recover(self) -> bool:
        """Reset the fault and enable again; False when that isn't possible."""
        if self.serial is not None and self._broken:
            self.serial.drive.close()
            self.serial.drive.open()
            self._broken = ""
        try:
            self.layer.reset(self.now)
            if self.layer.state is not State.ENABLED:
                self.enable()
        except SafetyError:
            return False
        self.run(0.5)
        return self.layer.state is State.ENABLED

    def run(self, seconds: float) -> None:
        """Go on for so long [s]."""
        for _ in range(round(seconds / _DT)):
            self._sample()

    def _sample(self) -> None:
        self.now += H
        wires, now, layer = self.wires, self.now, self.layer
        given = self.wanted()
        for each in wires.reference(given) if wires.reference else [given]:
            self.references.take(now, *each)
        force = layer.force
        reading = self._exchange(force)
        if reading is not None:
            for joint in wires.joint(reading) if wires.joint else [reading]:
                layer.reading(now, *joint)
                acting = force if layer.state is State.ENABLED else 0.0
                answer = self.controller.answer(now, joint.stamp, joint.position, acting=acting)
                if answer is not None:
                    for command in self._commands(Command(now, answer)):
                        layer.command(now, *command)
        elif wires.command is not None:
            for command in wires.command(Command(now, math.nan, "")):
                if command.source:
                    layer.command(now, *command)
        layer.step(now)
        if layer.state is not State.ENABLED:
            self.controller.restart()
        self._judge()

    def _commands(self, command: Command) -> list[Command]:
        wire = self.wires.command
        return [command] if wire is None else wire(command)

    def _exchange(self, force: float) -> Joint | None:
        try:
            return self._drive.exchange(force, self.now)
        except DriveError as error:
            if not self._broken:
                self._broken = str(error)
                self.layer.fail("drive", error.problem, self.now)
            assert self.serial is not None
            self.serial.emulator.poll()
            self.serial._time = self.now + H
            return None

    def _judge(self) -> None:
        """Compare what reached the drive, and the true motion, with the limits."""
        outcome, limits = self.outcome, LIMITS
        force, position = self._drive.force, self._drive.axis.position
        speed = (position - self._position) / _DT
        change = abs(force - self._force)
        broken = ""
        if not abs(force) <= limits.force:
            broken = f"force {force:.6g}"
        elif self._changes_too_fast(change, force):
            broken = f"force rate {change / _DT:.6g}"
        elif not abs(speed) <= limits.speed:
            broken = f"speed {speed:.6g}"
        elif not limits.position_min <= position <= limits.position_max:
            broken = f"position {position:.6g}"
        outcome.samples += 1
        if broken:
            outcome.unsafe += 1
            outcome.why = outcome.why or broken
        self._force, self._position = force, position
        self._judge_stop(speed, force)

    def _changes_too_fast(self, change: float, force: float) -> bool:
        """True when the force changed by more than its rate allows since the last one that reached the drive."""
        if self.serial is None:
            return not change <= LIMITS.force_rate * _DT * (1.0 + 1e-9)
        # Commands may be lost on the line: the next one then makes up for them. The drive's own watchdog takes the force away.
        allowed = LIMITS.force_rate * 1e-9 * (self.now - self._settled + H)
        if change > 0.0:
            self._settled = self.now
        return force != 0.0 and not change <= allowed * (1.0 + 1e-9)

    def _judge_stop(self, speed: float, force: float) -> None:
        if self.layer.state is not State.STOPPING:
            self._until = math.inf
        elif self._until == math.inf:
            self._until = 1e-9 * self.now + stop_from(LIMITS, speed, force).time + LIMITS.latency
        elif 1e-9 * self.now > self._until:
            self.outcome.stopped = False

    _until = math.inf

    def conclude(self) -> Outcome:
        """The outcome, with everything that was named."""
        for counters in (self.layer.counters, self.references.counters, self.controller.counters):
            self.outcome.names |= {name for name, n in counters.items() if n}
        self.outcome.names |= set(self.layer.faults)
        if self._broken:
            self.outcome.names.add(self._broken)
        return self.outcome

    def close(self) -> None:
        """Let go of the line."""
        if self.serial is not None:
            self.serial.close()
