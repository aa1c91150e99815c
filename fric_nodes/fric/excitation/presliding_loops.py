"""Pre-sliding loops: minor loops inside closed outer loops, outer loops from the largest to the smallest.

Equation: turning points of an outer loop of amplitude A with n inner loops on each branch:

    up:    -A -> p_1 -> p_1 - d_1 -> p_1 -> ... -> p_n -> p_n - d_n -> p_n -> A,   p_i = -A + 2 A i/(n + 1),
    down:  the mirror image; then up to A and down to -A once more without inner loops, so that the outer loop closes,

with d_i = 2 A c i/(n (n + 1)): graded in size, each ending where it began, none reaching further back than the share c of the
straight way between two of them. From turning point to turning point a move of least jerk, at a given peak speed or in a given
least time, so that velocity and acceleration are zero where it turns. Amplitudes fall in equal ratios.
Source: return-point memory test, as in Al-Bender, Lampaert, Swevers 2004 and Amthor et al. 2008, section 2.3; the pattern is
this module's own.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Trajectory
from ..parameter import Parameter
from .piecewise import PEAK_VELOCITY, Piecewise

__all__ = ["EXCITATION", "turning_points"]


def turning_points(amplitude: float, inner: int, share: float) -> list[float]:
    """Turning points and ends of inner loops of one outer loop, from -amplitude back to -amplitude [x]."""
    branch = []
    for i in range(1, inner + 1):
        begin = -amplitude + 2.0 * amplitude * i / (inner + 1)
        branch += [begin, begin - 2.0 * amplitude * share * i / (inner * (inner + 1)), begin]
    branch.append(amplitude)
    return [*branch, *(-point for point in branch), amplitude, -amplitude]


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    high, low = values["amplitude"], values["amplitude_low"]
    if low > high:
        raise ExcitationError("presliding_loops", f"amplitude_low {low:g} exceeds amplitude {high:g}", "swap them")
    motion = Piecewise()

    def move(position: float) -> None:
        way = abs(position - motion.position)
        if way > 0.0:
            motion.move(position, max(PEAK_VELOCITY * way / values["speed"], values["least_time"]))
            motion.hold(values["rest"])

    for amplitude in np.geomspace(high, low, int(values["loops"])):
        move(-float(amplitude))
        for _ in range(int(values["repeats"])):
            for point in turning_points(float(amplitude), int(values["inner"]), values["inner_share"]):
                move(point)
    move(0.0)
    return motion


EXCITATION = Excitation(
    id="presliding_loops",
    title="minor loops in pre-sliding",
    shows="the hysteresis of pre-sliding: the first loading, memory of turning points, loss per loop over amplitude",
    parameters=(
        Parameter(
            "amplitude", "A_1", "x", "amplitude of the first, largest outer loop", default=1e-5, positive=True, upper=1e4
        ),
        Parameter("amplitude_low", "A_n", "x", "amplitude of the last outer loop", default=2e-6, positive=True, upper=1e4),
        Parameter("loops", "m", "1", "number of outer loops, in equal ratios", lower=1, upper=1000, default=3),
        Parameter("inner", "n", "1", "inner loops on each branch of an outer loop", lower=0, upper=100, default=2),
        Parameter(
            "inner_share", "c", "1", "largest inner loop over the way between two of them", default=0.9, lower=0.0, upper=1.0
        ),
        Parameter("repeats", "k", "1", "how often each outer loop is run through", lower=1, upper=1000, default=1),
        Parameter("speed", "v_max", "x/s", "largest velocity", default=5e-5, positive=True, upper=1e4),
        Parameter("least_time", "T_1", "s", "a move takes no less", default=0.1, positive=True, upper=1e4),
        Parameter("rest", "T_0", "s", "rest at each turning point", lower=0.0, upper=1e4, default=0.0),
    ),
    plan=plan,
)
