"""Slow triangles: one low speed, reversed again and again, with sharp or rounded corners.

Equation: constant velocity +v and -v between -A and +A. Rounded corners: v(s) = v_0 + (v_1 - v_0)(3 s^2 - 2 s^3) within the
corner time T; a reversal then goes on for 0.3125 v T before it turns, which the straight parts leave room for. With a corner
time of 0 the velocity jumps.
Source: slow triangular motion as in Al-Bender, Lampaert, Swevers 2004, and Amthor et al. 2008, section 3 (pre-sliding to
sliding); the corners are this module's own.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Trajectory
from ..parameter import Parameter
from .piecewise import TURN, Piecewise

__all__ = ["EXCITATION"]


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    speed, amplitude, corner = values["speed"], values["amplitude"], values["corner_time"]
    room = TURN * speed * corner  # from where a corner begins to the peak
    start = 0.25 * speed * corner  # way of the change between rest and the speed, within half a corner time
    if room + start >= amplitude:
        problem = f"amplitude {amplitude:g} leaves no straight part at {speed:g} and corners of {corner:g} s"
        raise ExcitationError("slow_triangles", problem, "raise amplitude, shorten corner_time or lower speed")
    motion = Piecewise()
    motion.change_velocity(speed, 0.5 * corner)
    side = 1.0
    for _ in range(int(values["reversals"])):
        motion.cruise(abs(side * (amplitude - room) - motion.position) / speed)
        side = -side
        motion.change_velocity(side * speed, corner)
        # Rounding of many pieces must not add up.
        motion.position = -side * (amplitude - room)
    motion.cruise(abs(motion.position + side * start) / speed)
    motion.change_velocity(0.0, 0.5 * corner)
    motion.position = 0.0
    motion.hold(values["rest"])
    return motion


EXCITATION = Excitation(
    id="slow_triangles",
    title="slow triangles",
    shows="friction at every reversal: pre-sliding, Coulomb level and asymmetry, with next to no inertia and viscosity",
    parameters=(
        Parameter("speed", "v", "x/s", "speed of the straight parts", default=0.001, positive=True, upper=1e4),
        Parameter("amplitude", "A", "x", "peak position", default=0.001, positive=True, upper=1e4),
        Parameter("reversals", "n", "1", "number of reversals", lower=1, upper=100_000, default=20),
        Parameter(
            "corner_time",
            "T_c",
            "s",
            "time of a reversal; 0: the velocity jumps",
            lower=0.0,
            upper=100.0,
            default=0.02,
        ),
        Parameter("rest", "T_0", "s", "rest at the end", lower=0.0, upper=1e4, default=0.2),
    ),
    plan=plan,
)
