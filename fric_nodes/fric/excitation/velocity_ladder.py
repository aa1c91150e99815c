"""Velocity ladder: one constant velocity after another, each in both directions, with time to settle before what counts.

Equation: at each speed v a stroke forward and one back, joined by rests; in a stroke v(s) = v_0 + (v_1 - v_0)(3 s^2 - 2 s^3) of
limited acceleration from rest to v, constant v for the settling time and then for the measuring time, and back to rest. Speeds
from the lowest to the highest in equal ratios; where a stroke would need more travel than there is, the measuring time is
shortened.
Source: ladder of constant velocities, as in Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section 5.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..excitation_kind import Excitation, ExcitationError
from ..parameter import Parameter
from .piecewise import Piecewise

__all__ = ["EXCITATION", "Ladder", "Rung"]


class Rung(NamedTuple):
    """A settled part: its velocity [x/s], and from when to when it lasts [s]."""

    velocity: float
    first: float
    last: float


class Ladder(Piecewise):
    """The motion; ``rungs`` are its settled parts, in order."""

    def __init__(self) -> None:
        super().__init__()
        self.rungs: list[Rung] = []


def plan(values: Mapping[str, float], random: np.random.Generator) -> Ladder:
    low, high, settle = values["speed_low"], values["speed_high"], values["settle"]
    if low > high:
        raise ExcitationError("velocity_ladder", f"speed_low {low:g} exceeds speed_high {high:g}", "swap them")
    motion = Ladder()
    for speed in np.geomspace(low, high, int(values["speeds"])).tolist():
        rise = max(1.5 * speed / values["acceleration"], values["corner_time"])
        # The two corners take up half of their time each at full speed.
        measure = min(values["measure"], values["travel"] / speed - rise - settle)
        if measure < values["least_measure"]:
            problem = f"at {speed:.3g} a travel of {values['travel']:g} leaves {max(measure, 0.0):.3g} s to measure"
            remedy = "allow more travel, shorten settle, raise acceleration or lower speed_high"
            raise ExcitationError("velocity_ladder", problem, remedy)
        end = speed * (rise + settle + measure)
        for velocity, goal in ((speed, end), (-speed, 0.0)):
            motion.change_velocity(velocity, rise)
            motion.cruise(settle)
            motion.rungs.append(Rung(velocity, motion.duration, motion.duration + measure))
            motion.cruise(measure)
            motion.change_velocity(0.0, rise)
            motion.position = goal  # rounding of many pieces must not add up
            motion.hold(values["rest"])
    return motion


EXCITATION = Excitation(
    id="velocity_ladder",
    title="ladder of constant velocities",
    shows="the steady friction curve in both directions, point by point",
    parameters=(
        Parameter("speed_low", "v_1", "x/s", "lowest speed", default=0.0005, positive=True, upper=1e4),
        Parameter("speed_high", "v_2", "x/s", "highest speed", default=0.1, positive=True, upper=1e4),
        Parameter("speeds", "n", "1", "number of speeds, in equal ratios", lower=1, upper=200, default=10),
        Parameter("settle", "T_s", "s", "time at constant velocity before it counts", lower=0.0, upper=1e4, default=0.2),
        Parameter("measure", "T_m", "s", "time at constant velocity that counts", default=1.0, positive=True, upper=1e4),
        Parameter("least_measure", "T_1", "s", "least of it, where the travel is short", default=0.1, positive=True, upper=1e4),
        Parameter("travel", "s", "x", "travel that there is", default=0.05, positive=True, upper=1e5),
        Parameter("acceleration", "a", "x/s^2", "largest acceleration", default=2.0, positive=True, upper=1e6),
        Parameter(
            "corner_time",
            "T_c",
            "s",
            "least time between rest and speed",
            default=0.02,
            positive=True,
            upper=100.0,
        ),
        Parameter("rest", "T_0", "s", "rest after each stroke", lower=0.0, upper=1e4, default=0.1),
    ),
    plan=plan,
)
