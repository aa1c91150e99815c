"""Circle: one of the two axes of a machine that goes round, as the circle test of machine tools has it.

Equation: first axis q = R (cos phi - 1), second axis q = R sin phi, the angle phi(t) speeding up from rest to the feed's rate
v/R by w(s) = (v/R) (3 s^2 - 2 s^3), and slowing down alike after whole turns. Each axis reverses twice in a turn, a quarter of
a turn after the other, where friction draws its quadrant peaks.
Source: ISO 230-4, circular tests for numerically controlled machine tools.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Points, Trajectory
from ..parameter import Parameter
from ..record import Array
from .piecewise import Piecewise

__all__ = ["EXCITATION"]


class _Round:
    """One axis of the circle.

    Args:
        angle: of the motion over time [rad].
        radius: [x].
        second: the sine's axis.
    """

    def __init__(self, angle: Piecewise, radius: float, second: bool) -> None:
        self._angle, self._radius, self._second = angle, radius, second
        self.duration = angle.duration

    def at(self, time: Array) -> Points:
        phi, rate, bend = self._angle.at(time)
        sine, cosine = self._radius * np.sin(phi), self._radius * np.cos(phi)
        if self._second:
            return Points(sine, cosine * rate, cosine * bend - sine * rate**2)
        return Points(cosine - self._radius, -sine * rate, -sine * bend - cosine * rate**2)


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    rate, ramp = values["feed"] / values["radius"], values["ramp_time"]
    cruise = 2.0 * math.pi * values["turns"] / rate - ramp  # both ramps together take up one of them at the full rate
    if cruise < 0.0:
        problem = f"{values['turns']:g} turn(s) take {cruise + ramp:.3g} s, less than ramp_time {ramp:g} s"
        raise ExcitationError("circle", problem, "shorten ramp_time, lower the feed, or give more turns")
    angle = Piecewise()
    angle.change_velocity(rate, ramp)
    angle.cruise(cruise)
    angle.change_velocity(0.0, ramp)
    return _Round(angle, values["radius"], values["axis"] > 1.0)


EXCITATION = Excitation(
    id="circle",
    title="one axis of a circle",
    shows="quadrant peaks: what friction does at the reversals of a feed motion",
    parameters=(
        Parameter("radius", "R", "x", "radius of the circle", default=0.025, positive=True, upper=1e4),
        Parameter("feed", "v", "x/s", "speed along the circle", default=0.05, positive=True, upper=1e4),
        Parameter("turns", "n", "1", "number of turns, a whole one", lower=1, upper=10_000, default=2),
        Parameter("axis", "k", "1", "1: the axis of the cosine, 2: that of the sine", lower=1, upper=2, default=1),
        Parameter("ramp_time", "T", "s", "time from rest to the feed, and back", default=0.5, positive=True, upper=1e4),
    ),
    plan=plan,
)
