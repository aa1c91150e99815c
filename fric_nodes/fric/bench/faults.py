"""Faults to be injected on the wires of a moving axis, and the names under which each may be reported."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from .fault_rig import Command, FaultRig, Joint, Reference

__all__ = ["FAULTS", "Fault", "inject"]

_SECOND = 1_000_000_000


@dataclass(frozen=True)
class Fault:
    """One kind of fault.

    Attributes:
        wire: ``reference``, ``joint``, ``command`` or ``line``.
        begin: puts it on the wires of a rig.
        names: parts of the names under which it may be reported.
        least: it takes so long to be a fault, by the timeouts [s]; less is bridged.
        serial_only: needs a line.
    """

    wire: str
    begin: Callable[[FaultRig, np.random.Generator], None]
    names: tuple[str, ...]
    least: float = 0.0
    serial_only: bool = False


def _command(change: Callable[[Command], list[Command]]) -> Callable[[FaultRig, np.random.Generator], None]:
    def begin(rig: FaultRig, random: np.random.Generator) -> None:
        rig.wires.command = change

    return begin


def _reference(change: Callable[[Reference], list[Reference]]) -> Callable[[FaultRig, np.random.Generator], None]:
    def begin(rig: FaultRig, random: np.random.Generator) -> None:
        rig.wires.reference = change

    return begin


def _joint(change: Callable[[Joint], list[Joint]]) -> Callable[[FaultRig, np.random.Generator], None]:
    def begin(rig: FaultRig, random: np.random.Generator) -> None:
        rig.wires.joint = change

    return begin


def _burst(rig: FaultRig, random: np.random.Generator) -> None:
    def change(command: Command) -> list[Command]:
        forces = random.normal(0.0, 100.0, 200)
        return [Command(command.stamp - 200 + k, float(force)) for k, force in enumerate(forces)]

    rig.wires.command = change


def _second(rig: FaultRig, random: np.random.Generator) -> None:
    push = float(random.choice([-80.0, 80.0]))
    rig.wires.command = lambda command: [command, Command(command.stamp, push, "other")]


def _reference_step(rig: FaultRig, random: np.random.Generator) -> None:
    size = float(random.choice([-1.0, 1.0]) * random.uniform(0.02, 0.3))
    rig.wires.reference = lambda r: [r._replace(position=r.position + size)]


def _frozen(rig: FaultRig, random: np.random.Generator) -> None:
    kept: list[float] = []

    def change(joint: Joint) -> list[Joint]:
        kept.append(joint.position)
        return [joint._replace(position=kept[0])]

    rig.wires.joint = change


def _jumping(rig: FaultRig, random: np.random.Generator) -> None:
    def change(joint: Joint) -> list[Joint]:
        return [joint._replace(position=joint.position + float(random.choice([0.0, 0.0, 1.0]) * random.normal(0.0, 0.02)))]

    rig.wires.joint = change


def _offset(rig: FaultRig, random: np.random.Generator) -> None:
    size = float(random.choice([-1.0, 1.0]) * random.uniform(0.002, 0.1))
    rig.wires.joint = lambda joint: [joint._replace(position=joint.position + size)]


def _delayed(rig: FaultRig, random: np.random.Generator) -> None:
    kept: list[Joint] = []

    def change(joint: Joint) -> list[Joint]:
        kept.append(joint)
        return [kept.pop(0)] if len(kept) > 25 else []

    rig.wires.joint = change


def _swapped(rig: FaultRig, random: np.random.Generator) -> None:
    kept: list[Joint] = []

    def change(joint: Joint) -> list[Joint]:
        kept.append(joint)
        if len(kept) < 4:
            return []
        mixed = [kept[k] for k in random.permutation(4)]
        kept.clear()
        return mixed

    rig.wires.joint = change


def _bad_line(rig: FaultRig, random: np.random.Generator) -> None:
    assert rig.serial is not None
    rig.serial.damage(float(random.uniform(0.05, 0.9)))


def _unplugged(rig: FaultRig, random: np.random.Generator) -> None:
    assert rig.serial is not None
    rig.serial.emulator.unplug()


def _number(value: float) -> Fault:
    names = ("refused command: not finite",) if not math.isfinite(value) else ("refused command: implausible",)
    return Fault("command", _command(lambda c: [c._replace(force=value)]), names)


def _states(change: Callable[[Joint], list[Joint]], *names: str) -> Fault:
    return Fault("joint", _joint(change), names)


_ODD = ("joint state implausible", "motion contradicts force", "refused joint state: implausible", "overspeed")
FAULTS: Mapping[str, Fault] = {
    "command NaN": _number(math.nan),
    "command +inf": _number(math.inf),
    "command -inf": _number(-math.inf),
    "command 1e308": _number(1e308),
    "command silence": Fault("command", _command(lambda c: []), ("command lost",), 0.06),
    "command burst": Fault("command", _burst, ("command burst",)),
    "command from a second source": Fault("command", _second, ("second command source",)),
    "command 10 s old": Fault("command", _command(lambda c: [c._replace(stamp=c.stamp - 10 * _SECOND)]), ("command: too old",)),
    "command 10 s ahead": Fault("command", _command(lambda c: [c._replace(stamp=c.stamp + 10 * _SECOND)]), ("the future",)),
    "reference silence": Fault("reference", _reference(lambda r: []), ("reference lost",), 0.06),
    "reference step": Fault("reference", _reference_step, ("refused reference: a jump", "refused reference: outside")),
    "reference NaN": Fault("reference", _reference(lambda r: [r._replace(position=math.nan)]), ("reference: not finite",)),
    "reference 1e308": Fault("reference", _reference(lambda r: [r._replace(position=1e308)]), ("reference: outside",)),
    "reference 10 s old": Fault(
        "reference", _reference(lambda r: [r._replace(stamp=r.stamp - 10 * _SECOND)]), ("reference: too old",)
    ),
    "reference 10 s ahead": Fault(
        "reference", _reference(lambda r: [r._replace(stamp=r.stamp + 10 * _SECOND)]), ("reference: from the future",)
    ),
    "joint state silence": Fault("joint", _joint(lambda j: []), ("joint state lost",), 0.03),
    "joint state frozen": Fault("joint", _frozen, _ODD, 0.1),
    "joint state jumping": Fault("joint", _jumping, _ODD),
    "joint state with an offset": Fault("joint", _offset, _ODD),
    "joint state reversed": _states(lambda j: [j._replace(position=-j.position)], *_ODD),
    "joint state NaN": _states(lambda j: [j._replace(position=math.nan)], "joint state: not finite"),
    "joint state 1e308": _states(lambda j: [j._replace(position=1e308)], *_ODD),
    "joint state 5 s old": _states(lambda j: [j._replace(stamp=j.stamp - 5 * _SECOND)], "joint state: too old"),
    "joint state 5 s ahead": _states(lambda j: [j._replace(stamp=j.stamp + 5 * _SECOND)], "joint state: from the future"),
    "joint state delayed": Fault("joint", _delayed, ("joint state: too old", "joint state lost"), 0.1),
    "joint states in another order": Fault("joint", _swapped, ("joint state: out of order",)),
    "line with damage": Fault(
        "line", _bad_line, ("joint state lost", "drive", "out of order", "too old", "gaps", "damaged"), serial_only=True
    ),
    "line unplugged": Fault("line", _unplugged, ("drive", "is lost"), serial_only=True),
}
"""Every fault by its name."""


def inject(rig: FaultRig, fault: Fault, random: np.random.Generator) -> tuple[bool, bool]:
    """Let the axis move, inject ``fault`` at a random moment for a random time, and enable it again where it was stopped.

    Returns: if the cause was named, and if the axis moves again.
    """
    rig.enable()
    rig.run(0.6 + 1.25 * random.random())
    fault.begin(rig, random)
    rig.run(max(float(random.choice([0.02, 0.1, 0.6]) * (0.5 + random.random())), fault.least))
    rig.wires.reference = rig.wires.joint = rig.wires.command = None
    if rig.serial is not None and fault.serial_only:
        rig.serial.emulator.incoming = rig.serial.emulator.outgoing = None
        if not rig.serial.emulator.plugged:
            rig.serial.emulator.plug()
    rig.run(0.7)
    names = rig.conclude().names
    return any(part in name for part in fault.names for name in names), rig.recover()
