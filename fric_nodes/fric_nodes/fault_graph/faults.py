"""Faults of the graph, and the names under which each may be reported on ``/diagnostics``."""

from __future__ import annotations

import copy
import math
import signal
import subprocess
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import Reference

from ..qos import SAMPLES
from .rig import PERIOD, GraphRig

__all__ = ["FAULTS", "GraphFault", "Outcome", "trial"]

_SECOND = 1_000_000_000
_Begin = Callable[[GraphRig, np.random.Generator], Callable[[], object]]
_ODD = (
    "joint state implausible",
    "motion contradicts force",
    "refused joint state: implausible",
    "overspeed",
    "following error",
)


@dataclass(frozen=True)
class GraphFault:
    """One kind of fault.

    Attributes:
        begin: injects it; gives what ends it.
        names: parts of the names under which it may be reported; empty: it is none that needs a name.
        least: it takes so long to be a fault, by the timeouts [s]; less is bridged.
        most: it lasts at most so long [s].
    """

    begin: _Begin
    names: tuple[str, ...]
    least: float = 0.0
    most: float = 0.6


@dataclass(frozen=True)
class Outcome:
    """What one injection came to.

    Attributes:
        injected: how long it lasted [s].
        samples: at the drive.
        unsafe: of them.
        why: the first of the unsafe ones.
        slow_stops: stops that took longer than stated.
        named: True when its cause was named.
        moves: True when the axis moved again afterwards.
        said: what was named meanwhile.
    """

    injected: float
    samples: int
    unsafe: int
    why: str
    slow_stops: int
    named: bool
    moves: bool
    said: frozenset[str]


def _wire(topic: str, make: Callable[[np.random.Generator], Callable[[Any], list[Any]]]) -> _Begin:
    def begin(rig: GraphRig, random: np.random.Generator) -> Callable[[], object]:
        rig.wires[topic] = make(random)
        return lambda: rig.wires.update({topic: None})

    return begin


def _changed(topic: str, **fields: Any) -> _Begin:
    """Messages with other values in ``fields``."""

    def change(message: Any) -> list[Any]:
        other = copy.copy(message)
        for name, value in fields.items():
            setattr(other, name, value)
        return [other]

    return _wire(topic, lambda _random: change)


def _shifted(topic: str, seconds: int) -> _Begin:
    """Messages with stamps that are ``seconds`` off."""

    def change(message: Any) -> list[Any]:
        other = copy.deepcopy(message)
        other.header.stamp.sec += seconds
        return [other]

    return _wire(topic, lambda _random: change)


def _command_burst(random: np.random.Generator) -> Callable[[Float64], list[Float64]]:
    return lambda _message: [Float64(data=float(force)) for force in random.normal(0.0, 100.0, 40)]


def _reference_step(random: np.random.Generator) -> Callable[[Reference], list[Reference]]:
    size = float(random.choice([-1.0, 1.0]) * random.uniform(0.02, 0.3))

    def change(message: Reference) -> list[Reference]:
        return [Reference(header=message.header, position=message.position + size, velocity=message.velocity)]

    return change


def _moved(of: Callable[[float, np.random.Generator], float]) -> Callable[[np.random.Generator], Any]:
    """Joint states with another position."""

    def make(random: np.random.Generator) -> Callable[[JointState], list[JointState]]:
        def change(message: JointState) -> list[JointState]:
            other = copy.copy(message)
            other.position = [of(message.position[0], random)]
            return [other]

        return change

    return make


def _frozen(_random: np.random.Generator) -> Callable[[JointState], list[JointState]]:
    kept: list[float] = []

    def change(message: JointState) -> list[JointState]:
        kept.append(message.position[0])
        other = copy.copy(message)
        other.position = kept[:1]
        return [other]

    return change


def _swapped(random: np.random.Generator) -> Callable[[JointState], list[JointState]]:
    kept: list[JointState] = []

    def change(message: JointState) -> list[JointState]:
        kept.append(message)
        if len(kept) < 4:
            return []
        mixed = [kept[k] for k in random.permutation(4)]
        kept.clear()
        return mixed

    return change


def _two_joints(_random: np.random.Generator) -> Callable[[JointState], list[JointState]]:
    def change(message: JointState) -> list[JointState]:
        position, effort = [5.0, message.position[0]], [0.0, message.effort[0]]
        return [JointState(header=message.header, name=["other", message.name[0]], position=position, effort=effort)]

    return change


def _second(topic: str, kind: Any, value: Callable[[GraphRig, np.random.Generator], Callable[[], Any]]) -> _Begin:
    """Another publisher on ``topic``, as often as the first."""

    def begin(rig: GraphRig, random: np.random.Generator) -> Callable[[], object]:
        publisher = rig.node.create_publisher(kind, topic, SAMPLES)
        make = value(rig, random)
        sending = [True]
        timer = rig.node.create_timer(PERIOD, lambda: publisher.publish(make()) if sending else None)

        def end() -> None:
            sending.clear()
            time.sleep(0.1)  # the relay's thread may be about to publish
            rig.node.destroy_timer(timer)
            rig.node.destroy_publisher(publisher)

        return end

    return begin


def _push(_rig: GraphRig, random: np.random.Generator) -> Callable[[], Float64]:
    force = float(random.choice([-80.0, 80.0]))
    return lambda: Float64(data=force)


def _elsewhere(_rig: GraphRig, _random: np.random.Generator) -> Callable[[], Reference]:
    def make() -> Reference:
        message = Reference(position=0.05)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(time.time_ns(), _SECOND)
        return message

    return make


def _killed(name: str) -> _Begin:
    def begin(rig: GraphRig, _random: np.random.Generator) -> Callable[[], object]:
        rig.kill(name)
        return lambda: rig.start(name)

    return begin


def _stopped(name: str) -> _Begin:
    def begin(rig: GraphRig, _random: np.random.Generator) -> Callable[[], object]:
        rig.send(name, signal.SIGSTOP)
        return lambda: rig.send(name, signal.SIGCONT)

    return begin


def _restarted(name: str) -> _Begin:
    def begin(rig: GraphRig, _random: np.random.Generator) -> Callable[[], object]:
        rig.kill(name)
        rig.start(name)
        return lambda: None

    return begin


def _nonsense(rig: GraphRig, _random: np.random.Generator) -> Callable[[], object]:
    for name, value in (("ki", 1e12), ("kp", math.nan), ("kd", -1.0), ("force_limit", math.inf)):
        if rig.set("pid", name, value) is not False:
            return lambda: None
    rig.heard("parameters refused")
    return lambda: None


def _disk_full(rig: GraphRig, _random: np.random.Generator) -> Callable[[], object]:
    recorder = rig.record(100_000)

    def end() -> None:
        try:
            said, _ = recorder.communicate(timeout=30.0)
        except subprocess.TimeoutExpired:
            recorder.kill()
            said, _ = recorder.communicate()
        if recorder.returncode == 2 and "free space on the disk" in said:
            rig.heard("the recorder says that the disk is full, and ends")

    return end


def _wild(rig: GraphRig, _random: np.random.Generator) -> Callable[[], object]:
    """Gains that are allowed, and with which the loop is unstable."""
    rig.set("pid", "kp", 2e5)

    def end() -> None:
        rig.set("pid", "kp", 8000.0)

    return end


_LOST_STATES = ("joint state lost", "command lost", "gaps")
FAULTS: Mapping[str, GraphFault] = {
    **{
        f"command {text}": GraphFault(_changed("force_command", data=value), (name, "command lost"))
        for text, value, name in (
            ("NaN", math.nan, "refused command: not finite"), ("+inf", math.inf, "refused command: not finite"),
            ("-inf", -math.inf, "refused command: not finite"), ("1e308", 1e308, "refused command: implausible"),
        )
    },
    "command silence": GraphFault(_wire("force_command", lambda _r: lambda _m: []), ("command lost",), 0.1),
    "command burst": GraphFault(_wire("force_command", _command_burst), ("command burst",)),
    "command from a second publisher": GraphFault(_second("force_command", Float64, _push), ("second command source",), 0.3),
    "reference silence": GraphFault(_wire("reference", lambda _r: lambda _m: []), ("reference lost",), 0.2),
    "reference step": GraphFault(_wire("reference", _reference_step), ("reference: a jump", "reference: outside")),
    "reference NaN": GraphFault(_changed("reference", position=math.nan), ("refused reference",)),
    "reference 1e308": GraphFault(_changed("reference", position=1e308), ("refused reference: outside",)),
    "reference 10 s old": GraphFault(_shifted("reference", -10), ("refused reference: too old",)),
    "reference 10 s ahead": GraphFault(_shifted("reference", 10), ("refused reference: from the future",)),
    "reference from a second publisher": GraphFault(
        _second("reference", Reference, _elsewhere), ("second reference source",), 0.3
    ),
    "joint state silence": GraphFault(_wire("joint_states", lambda _r: lambda _m: []), ("joint state lost",), 0.1),
    "joint state frozen": GraphFault(_wire("joint_states", _frozen), _ODD, 0.4),
    "joint state jumping": GraphFault(
        _wire("joint_states", _moved(lambda x, random: x + float(random.choice([0.0, 0.0, 0.02]) * random.standard_normal()))),
        _ODD, 0.1,
    ),
    "joint state reversed": GraphFault(_wire("joint_states", _moved(lambda x, _random: -x)), _ODD, 0.4),
    "joint state NaN": GraphFault(_changed("joint_states", position=[math.nan]), ("refused joint state",)),
    "joint state 1e308": GraphFault(_changed("joint_states", position=[1e308]), _ODD),
    "joint state 5 s old": GraphFault(_shifted("joint_states", -5), ("refused joint state: too old",)),
    "joint state 5 s ahead": GraphFault(_shifted("joint_states", 5), ("refused joint state: from the future",)),
    "joint states in another order": GraphFault(_wire("joint_states", _swapped), ("refused joint state: out of order",)),
    "joint state of two joints": GraphFault(_wire("joint_states", _two_joints), ()),
    "joint state without effort": GraphFault(_changed("joint_states", effort=[]), ()),
    "pid killed": GraphFault(_killed("pid"), ("command lost",), 0.1),
    "excitation killed": GraphFault(_killed("excitation"), ("reference lost",), 0.4),
    "compensator killed": GraphFault(_killed("compensator"), ("feedforward lost",), 0.4),
    "plant killed": GraphFault(_killed("plant"), _LOST_STATES, 0.1),
    "pid stopped": GraphFault(_stopped("pid"), _LOST_STATES, 0.1, 2.0),
    "excitation stopped": GraphFault(_stopped("excitation"), ("reference lost",), 0.2, 2.0),
    "compensator stopped": GraphFault(_stopped("compensator"), ("feedforward lost",), 0.2, 2.0),
    "plant stopped": GraphFault(_stopped("plant"), _LOST_STATES, 0.15, 2.0),
    "pid restarted in motion": GraphFault(_restarted("pid"), ("command lost",)),
    "plant restarted in motion": GraphFault(_restarted("plant"), _LOST_STATES),
    "parameters to nonsense in motion": GraphFault(_nonsense, ("parameters refused",)),
    "disk full while a recorder runs": GraphFault(_disk_full, ("the disk is full",)),
    "gains far too large in motion": GraphFault(_wild, ("force rate limit", "force limit", "speed limit", *_ODD)),
}  # fmt: skip
"""Every fault by its name."""


def trial(rig: GraphRig, fault: GraphFault, random: np.random.Generator) -> Outcome:
    """Inject ``fault`` at a random moment of the moving axis for a random time, and let the axis move again afterwards."""
    time.sleep(0.1 + 0.5 * random.random())
    if not rig.enabled:  # on a machine that is busy with other work, the controller may have stopped by itself
        rig.recover()
    rig.judge.look()
    rig.forget()
    begin = time.monotonic()
    end = fault.begin(rig, random)
    wanted = min(max(float(random.choice([0.05, 0.3, fault.most]) * (0.5 + 0.5 * random.random())), fault.least), fault.most)
    time.sleep(max(wanted - (time.monotonic() - begin), 0.0))
    injected = time.monotonic() - begin
    end()

    def named() -> bool:
        return not fault.names or any(part in name for part in fault.names for name in rig.said)

    deadline = time.monotonic() + 2.0
    while not named() and time.monotonic() < deadline:
        time.sleep(0.02)
    known, said = named(), rig.said
    moves = rig.recover()
    found = rig.judge.look()
    return Outcome(injected, found.samples, found.unsafe, found.why, found.slow_stops, known, moves, said)
