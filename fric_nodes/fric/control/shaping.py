"""What is done to the force of every feedforward: scale, let-down before and build-up after a reversal, limits, and their sum.

With F the force, F_f the share of it that changes its sign with the direction, and d the way to or since the reversal,

    u = s (F - (1 - w) F_f),    w = min(d_before / l_before, d_since / l_since, 1),

so that friction is let down over the way l_before before a reversal and built up over l_since after it, while inertia and
everything else stay. The way to the reversal is that of the present deceleration, v^2 / (2 |a|); the way since the reversal is
what the reference has travelled. A model that knows pre-sliding has its own build-up: leave the ways at 0 there. A rigid one
flips by 2 F_C in one sample, which excites the loop, and which is wrong by the pre-sliding displacement and by the delay of
the loop.

The force is then limited, and so is its change per second (slew); what the limits took away is counted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from .feedforward_kind import FeedforwardKindError, Force

__all__ = ["Shaped", "Shaping", "Total"]

_LONGEST = 0.1  # [s], numerical: a longer pause of the reference isn't travelled


@dataclass(frozen=True)
class Shaping:
    """How the force of a feedforward is changed.

    Attributes:
        scale: s, 0 to 1 [1].
        let_down: way before a reversal over which friction is let down [x]; 0: none.
        build_up: way after a reversal over which it is built up [x]; 0: none.
        force_limit: largest force [F].
        slew_limit: largest change of the force per second [F/s].

    Raises:
        FeedforwardKindError: a value is out of its range.
    """

    scale: float = 1.0
    let_down: float = 0.0
    build_up: float = 0.0
    force_limit: float = math.inf
    slew_limit: float = math.inf

    def __post_init__(self) -> None:
        if not 0.0 <= self.scale <= 1.0:
            raise FeedforwardKindError("feedforward", f"scale is {self.scale:g}", "give a number from 0 to 1")
        for name in ("let_down", "build_up"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise FeedforwardKindError("feedforward", f"{name} is {getattr(self, name):g}", "give a way of at least 0")
        for name in ("force_limit", "slew_limit"):
            if not getattr(self, name) > 0.0:
                raise FeedforwardKindError("feedforward", f"{name} is {getattr(self, name):g}", "give a number greater than 0")


class Shaped:
    """A feedforward whose force is scaled, faded at reversals and limited.

    Args:
        force: the feedforward.
        shaping: what is done to its force.

    Attributes:
        friction: share of the last force that changes its sign with the direction [F], before the limits.
        limited: number of samples at which a limit took something away.
    """

    def __init__(self, force: Force, shaping: Shaping) -> None:
        self.force = force
        self.shaping = shaping
        self.limited = 0
        self.reset()

    def reset(self) -> None:
        """Start anew; the friction force is taken as built up until the first reversal."""
        self.force.reset()
        self.friction = 0.0
        self._since = math.inf
        self._sign = 0.0
        self._before: tuple[float, float] | None = None

    def _weight(self, position: float, velocity: float, acceleration: float) -> float:
        """The weight w of the module's equation [1]."""
        shaping = self.shaping
        if velocity != 0.0 and velocity * self._sign < 0.0:
            self._since = 0.0
        if velocity != 0.0:
            self._sign = math.copysign(1.0, velocity)
        weight = 1.0
        if shaping.build_up > 0.0:
            weight = min(weight, self._since / shaping.build_up)
        if shaping.let_down > 0.0 and velocity * acceleration < 0.0:
            weight = min(weight, 0.5 * velocity * velocity / abs(acceleration) / shaping.let_down)
        return weight

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        """See :meth:`fric.control.feedforward_kind.Force.step`."""
        shaping = self.shaping
        wanted = self.force.step(time, position, velocity, acceleration)
        if not math.isfinite(wanted):
            raise FeedforwardKindError("feedforward", "its force is not finite", "check its values and the reference")
        self.friction = self.force.friction
        if shaping.build_up > 0.0 or shaping.let_down > 0.0:
            duration = 0.0 if self._before is None else time - self._before[0]
            if 0.0 < duration < _LONGEST:
                self._since += abs(velocity) * duration
            missing = (1.0 - self._weight(position, velocity, acceleration)) * self.friction
            wanted -= missing
            self.friction -= missing
        wanted *= shaping.scale
        self.friction *= shaping.scale
        output = min(max(wanted, -shaping.force_limit), shaping.force_limit)
        if self._before is not None and shaping.slew_limit < math.inf:
            most = shaping.slew_limit * max(time - self._before[0], 0.0)
            output = min(max(output, self._before[1] - most), self._before[1] + most)
        if output != wanted:
            self.limited += 1
        self._before = time, output
        return output


@dataclass
class Total:
    """Several feedforwards together.

    Attributes:
        parts: whose forces are added.
    """

    parts: Sequence[Force] = field(default_factory=tuple)

    @property
    def friction(self) -> float:
        """Share of the last force that changes its sign with the direction [F]."""
        return sum(part.friction for part in self.parts)

    def reset(self) -> None:
        """Start all of them anew."""
        for part in self.parts:
            part.reset()

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        """See :meth:`fric.control.feedforward_kind.Force.step`."""
        return sum(part.step(time, position, velocity, acceleration) for part in self.parts)
