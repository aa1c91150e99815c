"""The reference as a controller may follow it: checked, brought to rest when it is lost, and approached anew without a jump.

A setpoint (r, w) is followed exactly while references come: their newest one, led on with its velocity until the next; its
acceleration counts no longer than the last two references were apart. When no reference has come for the timeout, the setpoint
is brought to rest with the acceleration a. When references come again, or the controller starts away from them, the setpoint
approaches them, at e behind them and at the relative velocity

    u = sgn(e) min(sqrt(a |e|), |e| / (4 h), V)

within the speed limit V, and with velocity changes of at most a h per sample of length h; what is left when the two meet fades
out. sqrt(a |e|) keeps half of the acceleration in reserve for that of the reference.
Source: the square root is the switching curve of a double integrator (Athans and Falb 1966, Optimal Control, section 7-2).
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from enum import Enum

from ..errors import InputError
from .controller import Setpoint
from .safety.stamps import StampGate

__all__ = ["Following", "ReferenceGuard", "ReferenceLimits"]

_NS = 1e-9
_LONGEST = 0.02  # numerical: a sample of the setpoint counts as at most so long [s]; after a pause it starts anew anyway
_SLACK = 1.05  # numerical: a reference may be faster than the speed limit by what rounding and stamps make of it
_FADE = 0.1  # physical scale: what is left when setpoint and reference meet fades with this time constant [s]


class Following(str, Enum):
    """What the setpoint does."""

    WAITING = "waiting"
    FOLLOWING = "following"
    APPROACHING = "approaching"
    STOPPING = "stopping"
    RESTING = "resting"


@dataclass(frozen=True)
class ReferenceLimits:
    """What a reference may be. Every value is a physical scale of the machine.

    Attributes:
        timeout: without a reference for so long it is lost [s].
        acceleration: of the stop and of the approach [x/s^2].
        speed: largest speed of a reference and of the approach [x/s].
        position_min: lower end of the range [x].
        position_max: upper end of the range [x].
        clock_tolerance: how far a stamp may lie in the future [s].

    Raises:
        InputError: a value can't be used.
    """

    timeout: float = 0.1
    acceleration: float = 5.0
    speed: float = 10.0
    position_min: float = -math.inf
    position_max: float = math.inf
    clock_tolerance: float = 0.005

    def __post_init__(self) -> None:
        for name in ("timeout", "acceleration", "speed"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InputError("reference limits", f"{name} is {value}", "give a finite number greater than 0")
        if not self.position_min < self.position_max:
            raise InputError("reference limits", "position_min is not below position_max", "give the ends in this order")


class ReferenceGuard:
    """Reference of one axis.

    Args:
        limits: what a reference may be.

    Attributes:
        following: what the setpoint does.
        counters: references refused, by reason; references lost.
    """

    def __init__(self, limits: ReferenceLimits) -> None:
        self.limits = limits
        self.counters: Counter[str] = Counter()
        self._gate = StampGate(limits.timeout, limits.clock_tolerance)
        self._gap = 0.0
        self._target = (0, 0.0, 0.0, 0.0)
        self._now: int | None = None
        self._setpoint = Setpoint(0.0, 0.0)
        self._offset = 0.0
        self.following = Following.WAITING

    def take(self, now: int, stamp: int, position: float, velocity: float, acceleration: float) -> str:
        """Take in a reference; why it is refused, or an empty text.

        Args:
            now: time of reception [ns].
            stamp: for when it is [ns].
            position: wanted [x].
            velocity: wanted [x/s].
            acceleration: wanted [x/s^2].
        """
        why = self._refusal(now, stamp, position, velocity, acceleration)
        if why:
            self.counters[f"refused reference: {why}"] += 1
            return why
        newest = self._gate.newest
        lost = newest is None or self._gate.lost(now)
        self._gap = 0.0 if lost or newest is None else (stamp - newest) * _NS
        self._gate.newest = stamp
        self._target = (stamp, position, velocity, acceleration)
        return ""

    def _refusal(self, now: int, stamp: int, position: float, velocity: float, acceleration: float) -> str:
        limits = self.limits
        if not (math.isfinite(position) and math.isfinite(velocity) and math.isfinite(acceleration)):
            return "not finite"
        why = self._gate.refusal(now, stamp)
        if why:
            return why
        if not limits.position_min <= position <= limits.position_max:
            return "outside the position range"
        if abs(velocity) > _SLACK * limits.speed:
            return "faster than the speed limit"
        newest = self._gate.newest
        if newest is not None and not self._gate.lost(now):
            passed = (stamp - newest) * _NS
            if abs(position - self._target[1]) > _SLACK * limits.speed * passed:
                return "a jump beyond the speed limit"
        if abs(acceleration) * limits.timeout > 1e3 * limits.speed:  # a thousand times what could last is no motion
            return "implausible acceleration"
        return ""

    def start(self, now: int, position: float, velocity: float) -> None:
        """Begin at the axis's own ``position`` [x] and ``velocity`` [x/s], and approach the reference from there."""
        self._now = now
        self._offset = 0.0
        speed = self.limits.speed
        self._setpoint = Setpoint(position, min(max(velocity, -speed), speed))
        self.following = Following.RESTING if self._setpoint.velocity == 0.0 else Following.STOPPING

    @property
    def position(self) -> float:
        """Position of the last setpoint [x]; NaN before the first."""
        return math.nan if self.following is Following.WAITING else self._setpoint.position

    @property
    def lost(self) -> bool:
        """True while the setpoint is brought to rest, or rests, because no reference comes."""
        return self.following in {Following.STOPPING, Following.RESTING}

    def at(self, now: int) -> Setpoint:
        """The setpoint at ``now`` [ns]; :meth:`start` comes first."""
        passed = 0.0 if self._now is None else min(max((now - self._now) * _NS, 0.0), _LONGEST)
        self._now = now
        if self._gate.lost(now):
            self._come_to_rest(passed)
        else:
            self._approach(self._ahead(now), passed)
        return self._setpoint

    def _ahead(self, now: int) -> Setpoint:
        """The reference at ``now``."""
        stamp, position, velocity, acceleration = self._target
        ahead = (now - stamp) * _NS
        bent = min(max(ahead, -self._gap), self._gap)
        faster = velocity + bent * acceleration
        limits = self.limits
        place = position + bent * (velocity + 0.5 * bent * acceleration) + (ahead - bent) * faster
        place = min(max(place, limits.position_min), limits.position_max)
        return Setpoint(place, faster, acceleration if bent == ahead else 0.0)

    def _come_to_rest(self, passed: float) -> None:
        position, velocity, _ = self._setpoint
        if self.following in {Following.FOLLOWING, Following.APPROACHING}:
            self.counters["reference lost"] += 1
        slower = math.copysign(max(abs(velocity) - self.limits.acceleration * passed, 0.0), velocity)
        position += 0.5 * (velocity + slower) * passed
        limits = self.limits
        self._setpoint = Setpoint(min(max(position, limits.position_min), limits.position_max), slower)
        self._offset = 0.0
        self.following = Following.STOPPING if slower != 0.0 else Following.RESTING

    def _approach(self, target: Setpoint, passed: float) -> None:
        position, velocity, _ = self._setpoint
        limits = self.limits
        if self.following is Following.FOLLOWING:
            self._offset *= math.exp(-passed / _FADE)
            here = target[0] + self._offset
            if abs(here - position) <= 2.0 * limits.speed * passed + 1e-9:
                self._setpoint = Setpoint(here, target[1] - self._offset / _FADE, target[2])
                return
        self.following = Following.APPROACHING
        if passed <= 0.0:
            return
        error = target[0] - position
        away = math.sqrt(limits.acceleration * abs(error))
        relative = math.copysign(min(away, abs(error) / (4.0 * passed), limits.speed), error)
        wanted = min(max(target[1] + relative, -limits.speed), limits.speed)
        change = limits.acceleration * passed
        faster = min(max(wanted, velocity - change), velocity + change)
        position += 0.5 * (velocity + faster) * passed
        self._setpoint = Setpoint(position, faster)
        left = position - (target[0] + target[1] * passed)
        if abs(faster - target[1]) <= 2.0 * change and abs(left) <= 2.0 * change * passed:
            self._offset = position - target[0]
            self.following = Following.FOLLOWING
