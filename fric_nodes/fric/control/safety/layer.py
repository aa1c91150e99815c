"""The one layer in front of every force: what comes in is checked, what goes out is safe, a fault ends in a controlled stop.

States: ``disabled`` -> ``enabled`` on request; ``enabled`` -> ``stopping`` by request or fault; ``stopping`` -> ``disabled``
or, with a latched fault, ``fault``; ``fault`` -> ``disabled`` by reset. In every state and for every input the force given is
finite, within the force limit, and changes by no more than the force rate.

A stop brakes by the law of :mod:`fric.control.safety.stopping` while the joint states can be trusted. When they can't, nothing
tells which force would brake: then the force goes to zero with the force rate, and the axis coasts.

Times are whole nanoseconds of one clock, that of the caller.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from enum import Enum
from typing import NamedTuple

from .guard import guarded
from .hold import Hold
from .limits import Limits, SafetyError
from .motion import MotionWatch
from .senders import SenderWatch
from .stamps import StampGate
from .stopping import brake_force, stop_from

__all__ = ["Event", "SafetyLayer", "State"]

_NS = 1e-9
_ABSURD = 1e3  # physical scale: a command so many times the force limit is no control action but an error
_JUMPS = 3  # numerical: refused as jumps in a row, readings are a fault of the encoder and not a single garbled message
_BURST = 20  # numerical: commands between two steps; a sender that is only unpunctual doesn't send so many
_LONGEST_STOP = 1e6  # numerical: stands for a stop without end [s]
_EVENTS = 256  # numerical: events kept for a caller that doesn't ask for them


class State(str, Enum):
    """State of the layer."""

    DISABLED = "disabled"
    ENABLED = "enabled"
    STOPPING = "stopping"
    FAULT = "fault"


class Event(NamedTuple):
    """Something that began or ended: time [ns] and text."""

    time: int
    text: str


class SafetyLayer:
    """Safety layer of one axis.

    Args:
        limits: of the axis.

    Attributes:
        state: present state.
        faults: latched faults, each cause by name with its detail, the first one first.
        counters: inputs refused, limits hit, stops: how often each, by name.
        force: the force given last [F].
        resuming: True while the layer waits for what was lost, to go on by itself.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.state = State.DISABLED
        self.faults: dict[str, str] = {}
        self.counters: Counter[str] = Counter()
        self.force = 0.0
        self._motion = MotionWatch(limits)
        self._states = StampGate(limits.state_timeout, limits.clock_tolerance)
        self._commands = StampGate(limits.command_timeout, limits.clock_tolerance)
        self._hold = Hold(limits)
        self._senders = SenderWatch()
        self._events: list[Event] = []
        self._now: int | None = None
        self._hit = ""
        self._forget()

    def _forget(self) -> None:
        """Start anew with all inputs."""
        self._wanted = 0.0
        self._source: str | None = None
        self._commands.newest = self._states.newest = None
        self._refused: dict[str, str] = {}
        self._jumps = self._contradictions = 0
        self._publishers = 1
        self._senders.forget()
        self._blind = False
        self.resuming = False
        self._asked = self._deadline = 0
        self._motion.clear()

    # Inputs

    def command(self, now: int, stamp: int, force: float, source: str = "") -> bool:
        """Take in a wanted ``force`` [F] of ``source``, made at ``stamp`` [ns] and received at ``now`` [ns]; False: refused."""
        why = self._commands.refusal(now, stamp)
        if not math.isfinite(force):
            why = "not finite"
        elif abs(force) > _ABSURD * self.limits.force:
            why = "implausible"
        if self._source is not None and source != self._source:
            if self.state is State.ENABLED:
                why = "second source"
                self.fail("second command source", f"'{source}' beside '{self._source}'", now)
            elif not why:
                self._source = source
        if why:
            return self._refuse("command", why)
        self._source = source
        self._commands.newest = stamp
        self._wanted = force
        self._senders.command()
        self._refused.pop("command", None)
        return True

    def allow(self, force: float) -> None:
        """Change the largest force [F].

        Raises:
            SafetyError: it doesn't fit the other limits.
        """
        self.limits = self._motion.limits = replace(self.limits, force=force)
        self._hold = Hold(self.limits)

    def publishers(self, count: int) -> None:
        """So many senders of commands are known; more than one at work is a fault."""
        self._publishers = count

    def reading(self, now: int, stamp: int, position: float, temperature: float = math.nan) -> bool:
        """Take in a joint state, measured at ``stamp`` [ns] and received at ``now`` [ns]; False: refused.

        Args:
            now: time of reception [ns].
            stamp: time of measurement [ns].
            position: of the axis [x].
            temperature: of the drive [degC]; NaN where none is measured.
        """
        why = self._states.refusal(now, stamp)
        if not math.isfinite(position):
            why = "not finite"
        elif not why and self._motion.jump(stamp, position):
            why = "implausible"
        if why:
            if why == "implausible":
                self._on_jump(now)
            return self._refuse("joint state", why)
        self._jumps = 0
        if not self._states.lost(now) or self._states.newest is None:
            fits = self._motion.take(stamp, position)
        else:
            self._motion.clear()
            fits = self._motion.take(stamp, position)
        self._states.newest = stamp
        self._refused.pop("joint state", None)
        self._contradictions = 0 if fits else self._contradictions + 1
        if self._contradictions > 1:
            self.counters["motion contradicts force"] += 1
            if self.state in {State.ENABLED, State.STOPPING}:
                self._blind = True
                self.fail("motion contradicts force", "encoder frozen, reversed or mis-scaled, or the axis is blocked", now)
        if temperature > self.limits.temperature:
            self.fail("temperature", f"{temperature:.1f} degC", now)
        return True

    def _on_jump(self, now: int) -> None:
        self._jumps += 1
        if self._jumps < _JUMPS:
            return
        self._jumps = 0
        if self.state in {State.ENABLED, State.STOPPING}:
            self._blind = True
            self.fail("joint state implausible", f"{_JUMPS} readings in a row that no motion leads to", now)
        else:
            self._motion.clear()  # at rest without force nothing contradicts a new start

    def _refuse(self, what: str, why: str) -> bool:
        self.counters[f"refused {what}: {why}"] += 1
        self._refused[what] = why
        return False

    # Requests

    def enable(self, now: int, keep: bool = False) -> None:
        """Let commands through from now on.

        Args:
            now: present time [ns].
            keep: let a command that has come just before through, too; otherwise only those that come from now on.

        Raises:
            SafetyError: a fault is latched, a stop is under way, or there is no joint state to rely on.
        """
        if self.state is State.ENABLED:
            return
        if self.faults:
            raise SafetyError("safety", f"fault: {self.cause}", "take the cause away and reset the fault")
        if self.state is State.STOPPING and not self.resuming:
            raise SafetyError("safety", "the axis is being stopped", "enable it when it rests")
        if self._states.lost(now) or not self._motion.known:
            why = self._refused.get("joint state", "none has come")
            raise SafetyError("safety", f"no joint state to rely on ({why})", "start the drive or the plant first")
        self._enter(State.ENABLED, now, "on request")
        if not keep:
            self._source = None
        self._asked = now
        self._senders.begin()
        self.resuming = False

    def disable(self, now: int) -> None:
        """Stop the axis and let no command through from now on."""
        self.resuming = False
        if self.state is State.ENABLED:
            self._stop(now, "on request")

    def reset(self, now: int) -> None:
        """Clear latched faults, and what was learnt of the inputs.

        Raises:
            SafetyError: a stop is under way.
        """
        if self.state is State.STOPPING:
            raise SafetyError("safety", "the axis is being stopped", "reset the fault when it rests")
        self.faults.clear()
        if self.state is State.FAULT:
            self._forget()
            self._enter(State.DISABLED, now, "fault reset")

    def fail(self, cause: str, detail: str, now: int) -> None:
        """Latch a fault and stop; ``cause`` is its name, ``detail`` what was found."""
        if cause in self.faults:
            return
        self.faults[cause] = detail
        self.resuming = False
        self.counters[f"fault: {cause}"] += 1
        self._say(now, f"fault: {cause} ({detail})")
        if self.state is State.ENABLED:
            self._stop(now, cause)
        elif self.state is State.DISABLED:
            self._enter(State.FAULT, now, cause)

    def cut(self, now: int) -> None:
        """The drive itself has taken the force away before ``now`` [ns], as its watchdog does."""
        self.force = 0.0
        self._motion.forget(now)

    @property
    def commanded(self) -> bool:
        """True when there is a command that isn't lost yet."""
        return self._now is not None and self._source is not None and not self._commands.lost(self._now)

    @property
    def cause(self) -> str:
        """The first latched fault with its detail; empty when there is none."""
        return next((f"{name} ({detail})" for name, detail in self.faults.items()), "")

    def events(self) -> list[Event]:
        """What began or ended since the last call."""
        taken, self._events = self._events, []
        return taken

    def condition(self) -> Mapping[str, str]:
        """State, faults and counters as text, for a report."""
        faults = "; ".join(f"{name} ({detail})" for name, detail in self.faults.items())
        counted = {name: str(n) for name, n in self.counters.items()}
        return {"safety state": self.state.value, "faults": faults, "limit": self._hit, **counted}

    def _say(self, now: int, text: str) -> None:
        if len(self._events) < _EVENTS:
            self._events.append(Event(now, text))

    def _enter(self, state: State, now: int, why: str) -> None:
        self._say(now, f"{self.state.value} -> {state.value}: {why}")
        self.state = state
        self._hold.release()

    def _stop(self, now: int, why: str) -> None:
        self.counters["stops"] += 1
        self._enter(State.STOPPING, now, why)
        self._deadline = 0
        if self.limits.brakes and self._motion.known:
            fastest = max(self._motion.fastest(now), key=abs)
            self._deadline = now + round(min(stop_from(self.limits, fastest, self.force).time, _LONGEST_STOP) / _NS)

    # Output

    def step(self, now: int, reference: float = math.nan, between: bool = False) -> float:
        """The force [F] that may be applied from ``now`` [ns] on.

        Args:
            now: present time [ns].
            reference: position wanted now [x], for the following error; NaN: none.
            between: True where this isn't the step of a sample but one between two, because a command has come.
        """
        limits = self.limits
        passed = 0.0 if self._now is None else (now - self._now) * _NS
        self._now = now
        if passed < -limits.clock_tolerance:
            self.fail("clock went back", f"by {-passed:.6g} s", now)
        passed = min(max(passed, 0.0), limits.longest_step)
        if not between:
            self._senders.tick(now)
        if self.state is State.ENABLED:
            self._watch(now, reference, between)
        elif self.resuming and not (self._states.lost(now) or self._commands.lost(now)) and self._motion.known:
            self.enable(now, keep=True)
        target, change = 0.0, limits.force_rate * passed if passed > 0.0 else 0.0
        if self.state is State.ENABLED:
            target = self._allowed(now, change, passed)
        elif self.state is State.STOPPING:
            target = self._braking(now)
        elif self.state is State.FAULT and limits.hold and self._trusted(now):
            target = self._hold.force(self._motion.position(), self._motion.velocity, passed)
        before = self.force
        force = min(max(target, before - change), before + change)
        self.force = min(max(force, -limits.force), limits.force)
        self._motion.force(now, self.force)
        return self.force

    def _trusted(self, now: int) -> bool:
        return not self._blind and self._motion.known and not self._states.lost(now)

    def _watch(self, now: int, reference: float, between: bool) -> None:
        """Look for what ends the enabled state."""
        limits, motion = self.limits, self._motion
        if not between:
            if self._senders.commands > _BURST:
                self.counters["command burst"] += 1
            self._senders.sample(self._publishers)
        if self._senders.many:
            self.fail("second command source", f"{self._publishers} publishers, more commands than samples", now)
            return
        newest = self._commands.newest
        since = self._asked if newest is None else max(newest, self._asked)
        if self._states.lost(now):
            self._lose("joint state lost", "joint state", now)
        elif (now - since) * _NS > limits.command_timeout:
            self._lose("command lost", "command", now)
        elif abs(motion.velocity) > limits.speed:
            self.fail("overspeed", f"{motion.velocity:.6g}", now)
        elif abs(reference - motion.position()) > limits.following_error:
            self.fail("following error", f"{reference - motion.position():.6g}", now)

    def _lose(self, cause: str, what: str, now: int) -> None:
        detail = f"last one refused: {self._refused[what]}" if what in self._refused else "none comes"
        if self.limits.resume:
            self.counters[cause] += 1
            self._say(now, f"{cause} ({detail})")
            self._stop(now, cause)
            self.resuming = True
        else:
            self.fail(cause, detail, now)

    def _allowed(self, now: int, change: float, passed: float) -> float:
        """The command within all limits."""
        limits, before = self.limits, self.force
        # Between enabling and the first command of this time there is none.
        wanted = self._wanted if self._source is not None else 0.0
        clipped = min(max(wanted, -limits.force), limits.force)
        candidate = min(max(clipped, before - change), before + change)
        motion = self._motion
        newest = self._states.newest
        age = passed + limits.latency + (0.0 if newest is None else (now - newest) * _NS)
        allowed, hit = guarded(limits, candidate, motion.position(), motion.fastest(now), age)
        if not hit and clipped != wanted:
            hit = "force limit"
        if hit != self._hit:
            self._say(now, f"{hit} reached" if hit else f"{self._hit} left")
            self._hit = hit
        if hit:
            self.counters[hit] += 1
        elif candidate != clipped:
            self.counters["force rate limit"] += 1
        return allowed

    def _braking(self, now: int) -> float:
        """The braking force, and the end of the stop."""
        limits, speed = self.limits, self._motion.velocity
        if not (limits.brakes and self._trusted(now)):
            if self.force == 0.0:
                self._end_stop(now, "force is zero")
            return 0.0
        if self._deadline and now > self._deadline:
            self._deadline = 0
            self.fail("stop not reached", f"still at {speed:.6g} when the axis should rest", now)
        if abs(speed) <= limits.at_rest and abs(self.force) <= brake_force(limits, limits.at_rest) + limits.load:
            self._end_stop(now, "at rest")
            return self.force if limits.hold and self.faults else 0.0
        return -math.copysign(brake_force(limits, abs(speed)), speed)

    def _end_stop(self, now: int, why: str) -> None:
        self._enter(State.FAULT if self.faults else State.DISABLED, now, why)
        self._hold.take(self._motion.position(), self.force)
