"""Ramps: up to a height at constant speed, a rest, and down again, at one speed after another, to both sides.

Equation: v(s) = v_0 + (v_1 - v_0)(3 s^2 - 2 s^3) within the corner time from rest to the speed v and back to rest, between them
constant v; speeds from the lowest to the highest in equal ratios. Published as a force the speeds are rates of force.
Source: ramps of position for the steady friction, of force for break-away, as in Armstrong-Helouvry, Dupont, Canudas de Wit
1994, sections 4 and 5.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Trajectory
from ..parameter import Parameter
from .piecewise import Piecewise

__all__ = ["EXCITATION"]


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    low, high, height, corner = (values[name] for name in ("speed_low", "speed_high", "height", "corner_time"))
    if low > high:
        raise ExcitationError("ramps", f"speed_low {low:g} exceeds speed_high {high:g}", "swap them")
    if high * corner > height:
        problem = f"speed_high {high:g} is not reached within a height of {height:g} and corners of {corner:g} s"
        raise ExcitationError("ramps", problem, "raise height, shorten corner_time or lower speed_high")
    motion = Piecewise()
    sides = (1.0, -1.0) if values["sides"] >= 2.0 else (1.0,)
    for speed in np.geomspace(low, high, int(values["speeds"])):
        for side in sides:
            for way in (side, -side):
                motion.change_velocity(float(way * speed), corner)
                motion.cruise(height / speed - corner)  # the two corners take up half of their time each
                motion.change_velocity(0.0, corner)
                # Rounding of many pieces must not add up.
                motion.position = side * height if way == side else 0.0
                motion.hold(values["rest"])
    return motion


EXCITATION = Excitation(
    id="ramps",
    title="ramps at graded speeds",
    shows="break-away and friction at constant speed, to both sides, each from rest",
    parameters=(
        Parameter("height", "s", "x", "height of a ramp", default=0.02, positive=True, upper=1e4),
        Parameter("speed_low", "v_1", "x/s", "lowest speed", default=0.002, positive=True, upper=1e4),
        Parameter("speed_high", "v_2", "x/s", "highest speed", default=0.05, positive=True, upper=1e4),
        Parameter("speeds", "n", "1", "number of speeds, in equal ratios", lower=1, upper=100, default=5),
        Parameter("sides", "k", "1", "1: to the positive side only; 2: to both", lower=1, upper=2, default=2),
        Parameter("corner_time", "T_c", "s", "time from rest to the speed, and back", default=0.05, positive=True, upper=100.0),
        Parameter("rest", "T_0", "s", "rest after each ramp", lower=0.0, upper=1e4, default=0.5),
    ),
    plan=plan,
)
