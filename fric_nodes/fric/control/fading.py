"""A feedforward that is faded in and out, and to another scale, without a jump.

u = g F,    g moves towards the scale wanted (0 while switched off) by at most 1 in ``time``.
"""

from __future__ import annotations

from .feedforward_kind import FeedforwardKindError, Force

__all__ = ["Faded"]


class Faded:
    """A feedforward behind a gain that changes slowly.

    Args:
        force: the feedforward.
        period: between two references [s].
        scale: gain wanted, 0 to 1.
        enabled: False wants a gain of 0.
        time: in which the gain may change by 1 [s].

    Attributes:
        enabled: may be changed at any time.
        gain: in use now [1].
    """

    def __init__(self, force: Force, period: float, *, scale: float = 1.0, enabled: bool = True, time: float = 0.2) -> None:
        self.force = force
        self._part = period / time if time > period else 1.0
        self.scale = scale
        self.enabled = enabled
        self.gain = scale if enabled else 0.0

    @property
    def scale(self) -> float:
        """Gain wanted while switched on [1].

        Raises:
            FeedforwardKindError: it is set to something that isn't within 0 and 1.
        """
        return self._scale

    @scale.setter
    def scale(self, value: float) -> None:
        if not 0.0 <= value <= 1.0:
            raise FeedforwardKindError("feedforward", f"scale is {value:g}", "give a number from 0 to 1")
        self._scale = value

    @property
    def friction(self) -> float:
        """Share of the last force that changes its sign with the direction of motion [F]."""
        return self.gain * self.force.friction

    def reset(self) -> None:
        """Start anew, with the gain that is wanted."""
        self.force.reset()
        self.gain = self.scale if self.enabled else 0.0

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        """See :meth:`fric.control.feedforward_kind.Force.step`."""
        force = self.force.step(time, position, velocity, acceleration)
        aim = self.scale if self.enabled else 0.0
        self.gain += min(max(aim - self.gain, -self._part), self._part)
        return self.gain * force
