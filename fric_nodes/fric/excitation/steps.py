"""Steps of speed: constant speeds one after another in one direction, up and down again, then the same in the other direction.

Equation: constant velocities v_k, joined by v(s) = v_k + (v_(k+1) - v_k)(3 s^2 - 2 s^3) of limited acceleration; no reversal
within a staircase.
Source: ladder of constant velocities, as in Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section 5.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Trajectory
from ..parameter import Parameter
from .piecewise import Piecewise

__all__ = ["EXCITATION"]


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    low, high, hold = values["speed_low"], values["speed_high"], values["hold"]
    if low > high:
        raise ExcitationError("steps", f"speed_low {low:g} exceeds speed_high {high:g}", "swap them")
    speeds = np.geomspace(low, high, int(values["speeds"]))
    staircase = [*speeds, *speeds[-2::-1], 0.0]
    motion = Piecewise()
    for direction in (1.0, -1.0):
        for speed in staircase:
            target = float(direction * speed)
            motion.change_velocity(target, max(1.5 * abs(target - motion.velocity) / values["acceleration"], 0.01))
            motion.cruise(hold if target != 0.0 else 0.0)
        if abs(motion.position) > values["travel"] and direction > 0.0:
            remedy = "shorten hold, lower speed_high or allow more travel"
            raise ExcitationError("steps", f"needs {motion.position:.3g} of travel, {values['travel']:g} is allowed", remedy)
        motion.hold(values["rest"])
    # Up to rounding both staircases cover the same way.
    motion.move(0.0, 0.1)
    return motion


EXCITATION = Excitation(
    id="steps",
    title="staircase of speeds",
    shows="the friction curve without reversals, free of pre-sliding",
    parameters=(
        Parameter("speed_low", "v_1", "x/s", "lowest speed", default=0.001, positive=True, upper=1e4),
        Parameter("speed_high", "v_2", "x/s", "highest speed", default=0.1, positive=True, upper=1e4),
        Parameter("speeds", "n", "1", "number of speeds, in equal ratios", lower=2, upper=100, default=7),
        Parameter("hold", "T", "s", "time at each speed", default=0.4, positive=True, upper=1e4),
        Parameter(
            "acceleration", "a", "x/s^2", "largest acceleration between two speeds", default=2.0, positive=True, upper=1e5
        ),
        Parameter("travel", "s", "x", "travel that there is", default=0.3, positive=True, upper=1e5),
        Parameter("rest", "T_0", "s", "rest after each staircase", lower=0.0, upper=1e4, default=0.3),
    ),
    plan=plan,
)
