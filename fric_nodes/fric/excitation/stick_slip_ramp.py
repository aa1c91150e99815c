"""Stick-slip ramp: a slow constant pull, held, and taken back; at graded rates, to both sides.

Equation: q = r t with corners v(s) = v_0 + (v_1 - v_0)(3 s^2 - 2 s^3), up to the peak; a hold there; back at the return rate.
Published as a reference, the stiffness of the controller is the spring through which the axis is pulled; published as a
force, it is the loading ramp of a break-away test, and the rate is a rate of force [F/s].
Source: pull at constant rate as in Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section 4, and Szell, section 4 (stick-slip
under constant drive).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Trajectory
from ..parameter import Parameter
from .piecewise import Piecewise

__all__ = ["EXCITATION"]


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    peak, low, high, back = (values[name] for name in ("peak", "rate_low", "rate_high", "return_rate"))
    corner = values["corner_time"]
    if low > high:
        raise ExcitationError("stick_slip_ramp", f"rate_low {low:g} exceeds rate_high {high:g}", "swap them")
    if max(high, back) * corner > peak:
        problem = f"a rate of {max(high, back):g} is not reached within a peak of {peak:g} and corners of {corner:g} s"
        raise ExcitationError("stick_slip_ramp", problem, "raise peak, shorten corner_time or lower the rates")
    motion = Piecewise()

    def pull(goal: float, rate: float) -> None:
        motion.change_velocity(float(np.copysign(rate, goal - motion.position)), corner)
        motion.cruise(peak / rate - corner)
        motion.change_velocity(0.0, corner)
        motion.position = goal  # rounding must not add up

    for rate in np.geomspace(low, high, int(values["rates"])):
        for side in (1.0, -1.0) if values["sides"] >= 2.0 else (1.0,):
            pull(side * peak, float(rate))
            motion.hold(values["hold"])
            pull(0.0, back)
            motion.hold(values["rest"])
    return motion


EXCITATION = Excitation(
    id="stick_slip_ramp",
    title="stick-slip ramp",
    shows="break-away over the rate of loading, and stick-slip: its steps tell the static friction from the kinetic one",
    parameters=(
        Parameter("peak", "s", "x", "how far it is pulled", default=0.01, positive=True, upper=1e6),
        Parameter("rate_low", "r_1", "x/s", "lowest rate of the pull", default=0.0005, positive=True, upper=1e6),
        Parameter("rate_high", "r_2", "x/s", "highest rate of the pull", default=0.002, positive=True, upper=1e6),
        Parameter("rates", "n", "1", "number of rates, in equal ratios", lower=1, upper=100, default=2),
        Parameter("sides", "k", "1", "1: to the positive side only; 2: to both", lower=1, upper=2, default=2),
        Parameter("hold", "T_h", "s", "time at the peak", lower=0.0, upper=1e5, default=0.5),
        Parameter("return_rate", "r_3", "x/s", "rate of the way back", default=0.01, positive=True, upper=1e6),
        Parameter("corner_time", "T_c", "s", "time from rest to the rate, and back", default=0.05, positive=True, upper=100.0),
        Parameter("rest", "T_0", "s", "rest after each pull", lower=0.0, upper=1e5, default=0.5),
    ),
    plan=plan,
)
