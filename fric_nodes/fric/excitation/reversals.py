"""Reversals: slow triangles with rounded corners, a few at each of several speeds.

Equation: constant velocity +v and -v over a stroke, joined by velocity changes v(s) = v_0 + (v_1 - v_0)(3 s^2 - 2 s^3) of
limited acceleration; speeds from the lowest to the highest in equal ratios, the same number of cycles at each; at low speed
the stroke is shortened so that no half cycle takes longer than a given time.
Source: stroke-wise friction measurement at constant velocities, as in Armstrong-Helouvry, Dupont, Canudas de Wit 1994,
section 5.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Trajectory
from ..parameter import Parameter
from .piecewise import Piecewise

__all__ = ["EXCITATION"]


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    slow, fast, acceleration = values["speed_low"], values["speed_high"], values["acceleration"]
    if slow > fast:
        raise ExcitationError("reversals", f"speed_low {slow:g} exceeds speed_high {fast:g}", "swap them")
    cycles = int(values["cycles"])
    motion = Piecewise()
    for speed in np.geomspace(slow, fast, int(values["speeds"])):
        rise = max(1.5 * speed / acceleration, values["corner_time"])  # from rest to the speed
        stroke = min(values["stroke"], speed * values["half_cycle"])
        if speed * rise > stroke:
            remedy = "lengthen stroke or half_cycle, raise acceleration or lower speed_high"
            raise ExcitationError("reversals", f"{speed:g} is not reached within a stroke of {stroke:g}", remedy)
        cruise = stroke / speed - rise  # the two velocity changes of a half cycle take up `rise` at half the speed each
        motion.change_velocity(speed, rise)
        motion.cruise(0.5 * (stroke / speed - rise))
        for half in range(2 * cycles):
            direction = -1.0 if half % 2 == 0 else 1.0
            motion.change_velocity(direction * speed, 2.0 * rise)
            # The turn at the end of a stroke covers no net way, so each half cycle is one stroke of cruising.
            motion.cruise(cruise if half < 2 * cycles - 1 else 0.5 * cruise)
        motion.change_velocity(0.0, rise)
        motion.move(0.0, values["corner_time"] + 2.0 * rise)
        motion.hold(values["rest"])
    return motion


EXCITATION = Excitation(
    id="reversals",
    title="triangles at several speeds",
    shows="the friction curve from pre-sliding through the Stribeck minimum to the viscous branch, and asymmetry",
    parameters=(
        Parameter("speed_low", "v_1", "x/s", "lowest speed", default=0.0005, positive=True, upper=1e4),
        Parameter("speed_high", "v_2", "x/s", "highest speed", default=0.1, positive=True, upper=1e4),
        Parameter("speeds", "n", "1", "number of speeds, in equal ratios", lower=1, upper=100, default=8),
        Parameter("cycles", "m", "1", "there and back at each speed", lower=1, upper=1000, default=2),
        Parameter("stroke", "s", "x", "length of a stroke", default=0.03, positive=True, upper=1e4),
        Parameter(
            "half_cycle", "T_h", "s", "a stroke takes no longer; shortened at low speed", default=0.6, positive=True, upper=1e4
        ),
        Parameter("acceleration", "a", "x/s^2", "largest acceleration at the corners", default=2.0, positive=True, upper=1e5),
        Parameter(
            "corner_time", "T_c", "s", "least time for a change from rest to speed", default=0.02, positive=True, upper=100.0
        ),
        Parameter("rest", "T_0", "s", "rest after each speed", lower=0.0, upper=1e4, default=0.1),
    ),
    plan=plan,
)
