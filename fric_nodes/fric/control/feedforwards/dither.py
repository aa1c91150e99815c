"""Dither: a small force to and fro that keeps an axis from sticking.

Equation: F(t) = A sin(2 pi f t) or its square wave, A sgn(sin(2 pi f t)) (the knocker), without regard to the reference; with
``only_slow`` v_d > 0 its amplitude fades with the reference's speed, A exp(-(v/v_d)^2), so that motion isn't disturbed.
Source: Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section 5.1; Hagglund 2002 (knocker).
"""

from __future__ import annotations

import math

from ...parameter import Parameter
from ..feedforward_kind import FeedforwardKind, FeedforwardKindError, Force, Setting

__all__ = ["FEEDFORWARD", "Dither"]


class Dither:
    """A force to and fro.

    Args:
        amplitude: A [F].
        frequency: f [Hz].
        square: square wave instead of a sine.
        only_slow: v_d [x/s]; 0: at every speed.
    """

    def __init__(self, amplitude: float, frequency: float, square: bool = False, only_slow: float = 0.0) -> None:
        self._amplitude, self._omega = amplitude, 2.0 * math.pi * frequency
        self._square, self._slow = square, only_slow
        self.friction = 0.0

    def reset(self) -> None:
        """There is no state."""

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        """See :meth:`fric.control.feedforward_kind.Force.step`."""
        if not math.isfinite(time + velocity):
            raise FeedforwardKindError("reference", "a value is not finite", "leave the sample out")
        wave = math.sin(self._omega * time)
        if self._square:
            wave = math.copysign(1.0, wave)
        share = math.exp(-((velocity / self._slow) ** 2)) if self._slow > 0.0 else 1.0
        return self._amplitude * share * wave


def _build(setting: Setting) -> Force:
    given = setting.values
    if 2.0 * given["frequency"] * setting.period >= 1.0:
        problem = f"frequency {given['frequency']:g} Hz is not below half the sampling rate"
        raise FeedforwardKindError("feedforward 'dither'", problem, f"give less than {0.5 / setting.period:g} Hz")
    return Dither(given["amplitude"], given["frequency"], given["square"] > 0.0, given["only_slow"])


FEEDFORWARD = FeedforwardKind(
    id="dither",
    title="dither",
    build=_build,
    parameters=(
        Parameter("amplitude", "A", "F", "amplitude", lower=0.0),
        Parameter("frequency", "f", "1/s", "frequency", positive=True),
        Parameter("square", "q", "1", "1 for a square wave, 0 for a sine", 0.0, 1.0, default=0.0),
        Parameter("only_slow", "v_d", "x/s", "speed of the reference at which it has faded to 1/e; 0: never", 0.0, default=0.0),
    ),
    source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section 5.1",
)
