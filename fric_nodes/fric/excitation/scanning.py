"""Scanning: lines to and fro at constant speed, with a step between two lines, as microscopes and inspection stages scan.

Equation: first axis: constant velocity +v and -v over the lines, joined by v(s) = v_0 + (v_1 - v_0)(3 s^2 - 2 s^3) within twice
the time T that it takes from rest to v; second axis: at rest along a line, a move of least jerk by the pitch while the first
one turns. Both go back to their start in the same time at the end.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, Trajectory
from ..parameter import Parameter
from .piecewise import Piecewise

__all__ = ["EXCITATION"]


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    speed, lines = values["speed"], int(values["lines"])
    turn = 1.5 * speed / values["acceleration"]
    along = values["length"] / speed
    motion = Piecewise()
    first = values["axis"] <= 1.0
    for line in range(lines):
        if first:
            motion.change_velocity(speed if line % 2 == 0 else -speed, turn if line == 0 else 2.0 * turn)
            motion.cruise(along)
        else:
            if line == 0:
                motion.hold(turn)
            else:
                motion.move(line * values["pitch"], 2.0 * turn)
            motion.hold(along)
    if first:
        motion.change_velocity(0.0, turn)
    else:
        motion.hold(turn)
    motion.move(0.0, values["return_time"])
    return motion


EXCITATION = Excitation(
    id="scanning",
    title="lines of a scan",
    shows="following at constant speed between reversals, and small steps after rests",
    parameters=(
        Parameter("length", "l", "x", "length of a line at constant speed", default=0.02, positive=True, upper=1e4),
        Parameter("speed", "v", "x/s", "speed along a line", default=0.02, positive=True, upper=1e4),
        Parameter("lines", "n", "1", "number of lines", lower=1, upper=100_000, default=8),
        Parameter("pitch", "p", "x", "step of the second axis between two lines", default=1e-4, positive=True, upper=1e4),
        Parameter("acceleration", "a", "x/s^2", "largest acceleration at a turn", default=0.5, positive=True, upper=1e5),
        Parameter("axis", "k", "1", "1: the axis along the lines, 2: the one that steps", lower=1, upper=2, default=1),
        Parameter("return_time", "T_r", "s", "time of the way back", default=1.0, positive=True, upper=1e4),
    ),
    plan=plan,
)
