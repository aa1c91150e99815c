"""Pulse of force after a reversal, as commercial controllers offer it against quadrant peaks.

Equation: with t the time since the reference's velocity changed its sign, T_u the rise and T_d the decay,

    F(t) = s H t / T_u                    for t < T_u,
    F(t) = s H exp(-(t - T_u) / T_d)      afterwards,

s the sign of the new direction; a viscous and an inertia force, c v + m a, come with it since such controllers feed both
forward. Height and times are tuned by circle tests, for one feed: the pulse knows nothing of the acceleration at the reversal
unless ``reference_acceleration`` a_0 is given, by which the times then scale as sqrt(a_0/|a|), the time to travel a given way.
"""

from __future__ import annotations

import math

from ...parameter import Parameter
from ..feedforward_kind import FeedforwardKind, FeedforwardKindError, Force, Setting

__all__ = ["FEEDFORWARD", "QuadrantPulse"]

_LONG_AGO = 20.0  # numerical: decay times after which nothing is left, exp(-20) = 2e-9
_SCALE = 10.0  # physical: largest factor by which the acceleration stretches or shortens the pulse


class QuadrantPulse:
    """A pulse after each reversal.

    Args:
        height: H [F].
        rise: T_u [s].
        decay: T_d [s].
        viscous: c [F s/x].
        mass: m [F s^2/x].
        reference_acceleration: a_0 [x/s^2]; 0: the times hold for every acceleration.
        preview: how far the reference is extrapolated [s].
    """

    def __init__(
        self,
        height: float,
        rise: float,
        decay: float,
        *,
        viscous: float = 0.0,
        mass: float = 0.0,
        reference_acceleration: float = 0.0,
        preview: float = 0.0,
    ) -> None:
        self._height, self._rise, self._decay = height, rise, decay
        self._viscous, self._mass, self._preview = viscous, mass, preview
        self._reference = reference_acceleration
        self.reset()

    def reset(self) -> None:
        """Start anew, without a reversal in memory."""
        self._sign = 0.0
        self._since = math.inf
        self._stretch = 1.0
        self._time: float | None = None
        self.friction = 0.0

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        """See :meth:`fric.control.feedforward_kind.Force.step`."""
        if not math.isfinite(velocity + acceleration):
            raise FeedforwardKindError("reference", "a value is not finite", "leave the sample out")
        velocity += self._preview * acceleration
        duration = 0.0 if self._time is None else max(time - self._time, 0.0)
        self._time = time
        self._since += duration
        if velocity * self._sign < 0.0 or (self._sign == 0.0 and velocity != 0.0):
            self._since = 0.0
            self._stretch = 1.0
            if self._reference > 0.0 and acceleration != 0.0:
                self._stretch = min(max(math.sqrt(self._reference / abs(acceleration)), 1.0 / _SCALE), _SCALE)
        if velocity != 0.0:
            self._sign = math.copysign(1.0, velocity)
        t = self._since / self._stretch
        if t >= self._rise + _LONG_AGO * self._decay:
            share = 0.0
        elif t < self._rise:
            share = t / self._rise
        else:
            share = math.exp(-(t - self._rise) / self._decay)
        pulse = self._sign * self._height * share
        self.friction = pulse + self._viscous * velocity
        return self.friction + self._mass * acceleration


def _build(setting: Setting) -> Force:
    given = dict(setting.values)
    return QuadrantPulse(given.pop("height"), given.pop("rise"), given.pop("decay"), preview=setting.preview, **given)


FEEDFORWARD = FeedforwardKind(
    id="quadrant_pulse",
    title="pulse of force after a reversal",
    build=_build,
    parameters=(
        Parameter("height", "H", "F", "height of the pulse"),
        Parameter("rise", "T_u", "s", "time in which it rises", lower=0.0, default=0.0),
        Parameter("decay", "T_d", "s", "time constant with which it falls", positive=True),
        Parameter("viscous", "c", "F s/x", "coefficient of a viscous force besides", lower=0.0, default=0.0),
        Parameter("mass", "m", "F s^2/x", "mass of the inertia force besides", lower=0.0, default=0.0),
        Parameter(
            "reference_acceleration", "a_0", "x/s^2", "acceleration at which the times hold; 0: at every one", 0.0, default=0.0
        ),
    ),
)
