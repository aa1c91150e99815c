"""Ramp to a midpoint, then steps: one up from it, one down to as much below it, and back.

Equation: q = 0, ramp at constant speed to q_m within T_r, then q_m + s, q_m - s, each held for T_h, and a ramp back to 0. A
step is a minimum-jerk move within the short time T_s, so that velocity and acceleration are finite.
Source: road of a quarter-car test rig, Al-Zughaibi 2018, Sect. 2 and Fig. 6; the low-pass filter that follows there belongs to
its road simulator.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Trajectory
from ..parameter import Parameter
from .piecewise import Piecewise

__all__ = ["EXCITATION"]


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    midpoint, height, ramp, edge = (values[name] for name in ("midpoint", "height", "ramp_time", "edge_time"))
    if ramp <= 2.0 * edge:
        problem = f"ramp_time {ramp:g} s leaves no ramp between two bends of edge_time {edge:g} s"
        raise ExcitationError("ramp_and_steps", problem, "lengthen ramp_time or shorten edge_time")
    motion = Piecewise()

    def ramp_by(way: float) -> None:
        # Both bends take the way of half their time at full speed.
        speed = way / (ramp - edge)
        motion.change_velocity(speed, edge)
        motion.cruise(ramp - 2.0 * edge)
        motion.change_velocity(0.0, edge)

    ramp_by(midpoint)
    motion.hold(values["hold"])
    for position in (midpoint + height, midpoint - height):
        motion.move(position, edge)
        motion.hold(values["hold"])
    ramp_by(height - midpoint)
    # Up to rounding it is back.
    motion.move(0.0, edge)
    return motion


EXCITATION = Excitation(
    id="ramp_and_steps",
    title="ramp and steps",
    shows="how long a body sticks at the start of a motion, and whether it oscillates after a step",
    parameters=(
        Parameter("midpoint", "q_m", "x", "position that the ramp leads to", lower=-1e5, upper=1e5, default=0.085),
        Parameter("height", "s", "x", "height of the steps above and below it", lower=-1e5, upper=1e5, default=0.05),
        Parameter("ramp_time", "T_r", "s", "time of a ramp", default=2.5, positive=True, upper=1e5),
        Parameter("hold", "T_h", "s", "rest at the midpoint and after each step", default=4.0, lower=0.0, upper=1e5),
        Parameter("edge_time", "T_s", "s", "time of a step", default=0.02, positive=True, upper=1e3),
    ),
    plan=plan,
)
