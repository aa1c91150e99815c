"""Point to point: moves of least jerk between random positions, with rests of varied length.

Equation: q(s) = q_0 + (q_1 - q_0)(10 s^3 - 15 s^4 + 6 s^5) for each move, as fast as the limits on velocity and acceleration
allow.
Source: Flash and Hogan 1985, Eq. 3 (minimum-jerk motion).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, Trajectory
from ..parameter import Parameter
from .piecewise import PEAK_ACCELERATION, PEAK_VELOCITY, Piecewise

__all__ = ["EXCITATION"]


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    motion = Piecewise()
    amplitude = values["amplitude"]
    moves = int(values["moves"])
    for number in range(moves + 1):
        # Sizes in equal ratios, so that short moves, which are all pre-sliding and low speed, come as often as long ones.
        size = amplitude * 10.0 ** random.uniform(-values["decades"], 0.0)
        target = 0.0 if number == moves else float(random.choice([-1.0, 1.0]) * size)
        way = abs(target - motion.position)
        if way == 0.0:
            continue
        time = max(PEAK_VELOCITY * way / values["speed"], math.sqrt(PEAK_ACCELERATION * way / values["acceleration"]))
        motion.move(target, time)
        motion.hold(float(random.uniform(values["rest_low"], max(values["rest_high"], values["rest_low"]))))
    return motion


EXCITATION = Excitation(
    id="point_to_point",
    title="moves from point to point",
    shows="inertia, break-away after rests of graded length, and behaviour at rest",
    parameters=(
        Parameter("moves", "n", "1", "number of moves, and one back", lower=1, upper=100_000, default=12),
        Parameter("amplitude", "q_max", "x", "largest position", default=0.05, positive=True, upper=1e4),
        Parameter("decades", "d", "1", "positions are spread over so many powers of ten", lower=0.0, upper=6.0, default=2.0),
        Parameter("speed", "v_max", "x/s", "largest velocity", default=0.3, positive=True, upper=1e4),
        Parameter("acceleration", "a_max", "x/s^2", "largest acceleration", default=5.0, positive=True, upper=1e5),
        Parameter("rest_low", "T_1", "s", "shortest rest", lower=0.0, upper=1e4, default=0.05),
        Parameter("rest_high", "T_2", "s", "longest rest", lower=0.0, upper=1e4, default=0.8),
    ),
    plan=plan,
)
