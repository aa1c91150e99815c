"""A controller that survives a pause: stale states are dropped, a gap isn't integrated over, and it goes on without a jump.

A process that was held up finds a queue of old joint states. Answering them all would send commands for a motion that is over,
and a controller that integrates over the gap between the last state and a fresh one gives a jump. Here

- a state older than the age limit, from the future, out of order or not finite is dropped and counted;
- a gap between two states up to the bridge time is a late sample: the controller starts anew in motion with the force it gave
  last, so that neither its integral nor its derivative knows of the gap;
- after a longer gap the force given last isn't acting any more (a watchdog or a safety layer has taken it away): the first
  state isn't answered, since the axis's velocity isn't known; with the second one the controller starts with the force that
  acts then, zero unless it is told otherwise, and the setpoint starts at the axis itself;
- after a pause of the process, states older than usual are dropped too, so that only the newest one is used;
- an output or a state of the controller that isn't finite resets it, and is counted.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

from ..errors import InputError
from .controller import Law, Setpoint
from .reference_guard import ReferenceGuard
from .safety.stamps import StampGate

__all__ = ["StallGuard", "StallLimits"]

_NS = 1e-9
_LATE = 2.5  # numerical: a duration of more periods than this is a gap and no jitter
_JITTER = 1.5  # numerical: so many periods more than usual are the jitter of a state that is the newest
_SMOOTH = 0.05  # numerical: share of each new age in the usual one
_STILL = 1e-3  # physical scale: below it, times the speed limit, an axis isn't worth a stop of its own


@dataclass(frozen=True)
class StallLimits:
    """How late is too late.

    Attributes:
        period: nominal time between two states [s].
        age: a state older than this is stale [s].
        bridge: a gap between states of at most so long is bridged [s].
        clock_tolerance: how far a stamp may lie in the future [s].
    """

    period: float
    age: float = 0.02
    bridge: float = 0.02
    clock_tolerance: float = 0.005


class StallGuard:
    """A controller with its reference, safe against pauses and numbers that aren't finite.

    Args:
        controller: gives the force.
        references: give the setpoint.
        limits: how late is too late.

    Attributes:
        counters: states dropped, gaps, resets: how often each, by name.
    """

    def __init__(self, controller: Law, references: ReferenceGuard, limits: StallLimits) -> None:
        self.controller = controller
        self.references = references
        self.counters: Counter[str] = Counter()
        self._limits = limits
        self._gate = StampGate(limits.age, limits.clock_tolerance)
        self._before: tuple[int, float] | None = None  # stamp [ns] and position [x] of the last state
        self._running = False
        self._received: int | None = None
        self._paused = False
        self._resumed = 0
        self._usual_age = 0.0
        self._force = 0.0

    @property
    def period(self) -> float:
        """Nominal time between two states [s]."""
        return self._limits.period

    def restart(self) -> None:
        """Forget the motion so far; the next state is the first."""
        self._before, self._running = None, False
        self._gate.newest = None

    def answer(self, now: int, stamp: int, position: float, feedforward: float = 0.0, acting: float = 0.0) -> float | None:
        """The force [F] that answers a joint state; None when the state is dropped, or is the first one after a gap.

        Args:
            now: time of reception [ns].
            stamp: time of measurement [ns].
            position: measured [x].
            feedforward: force to be added [F]; left out where it isn't finite.
            acting: force that acts now [F], where the controller starts anew.
        """
        why = self._gate.refusal(now, stamp) if math.isfinite(position) else "not finite"
        why = why or self._left_over(now, stamp)
        if why:
            self.counters[f"refused joint state: {why}"] += 1
            return None
        self._gate.newest = stamp
        if not math.isfinite(feedforward):
            self.counters["refused feedforward: not finite"] += 1
            feedforward = 0.0
        before, period = self._before, self._limits.period
        duration = math.inf if before is None else (stamp - before[0]) * _NS
        if before is None or duration > self._limits.bridge:
            if before is not None:
                self.counters["gaps not bridged"] += 1
            self._before, self._running = (stamp, position), False
            return None
        velocity = (position - before[1]) / duration
        if not self._running:
            self._begin(stamp, position, velocity, acting, feedforward)
            self._running, duration = True, period
        elif duration > _LATE * period:
            self.counters["gaps bridged"] += 1
            self.controller.begin(self.references.at(stamp), (position, velocity), self._force - feedforward, period)
            duration = period
        try:
            force = self.controller.answer(self.references.at(stamp), position, duration, feedforward)
        except InputError:
            force = math.nan
        if not math.isfinite(force):
            self.counters["controller not finite: reset"] += 1
            self.controller.reset()
            self.restart()
            return None
        self._before, self._force = (stamp, position), force
        return force

    def _left_over(self, now: int, stamp: int) -> str:
        """Why a state is one of those that queued up during a pause; empty when it isn't."""
        age, period = (now - stamp) * _NS, self._limits.period
        if self._received is not None and (now - self._received) * _NS > self._limits.bridge:
            self._paused, self._resumed = True, now
        self._received = now
        # What queued up is worked off at once; ages that stay higher than they were are those of a busier machine.
        working_off = (now - self._resumed) * _NS <= self._limits.age
        if self._paused and working_off and age > self._usual_age + _JITTER * period:
            return "too old"
        self._paused = False
        self._usual_age += _SMOOTH * (age - self._usual_age)
        return ""

    def _begin(self, stamp: int, position: float, velocity: float, force: float, feedforward: float) -> None:
        """Start controller and setpoint where the axis is."""
        if abs(velocity) < _STILL * self.references.limits.speed:
            velocity = 0.0
        self.references.start(stamp, position, velocity)
        self.controller.begin(Setpoint(position, velocity), (position, velocity), force - feedforward, self._limits.period)
