"""Free decay: the axis is pushed aside against its spring or gravity, held, and let go.

Equation: force from 0 to F within the rise time, held, to 0 within the release time, then 0 while the motion decays; forces
from the largest to the smallest in equal ratios, alternately to both sides. Rise and release are minimum-jerk moves; with a
release time of 0 the force jumps.
Source: free vibration for the logarithmic decrement, de Marchi 1998 (defence, "Log. Decrement Method" and what follows).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError, Trajectory
from ..parameter import Parameter
from .piecewise import Piecewise

__all__ = ["EXCITATION"]


def plan(values: Mapping[str, float], random: np.random.Generator) -> Trajectory:
    low, high = values["force_low"], values["force_high"]
    releases = int(values["releases"])
    if low > high and releases > 1:
        raise ExcitationError("free_decay", f"force_low {low:g} exceeds force_high {high:g}", "swap them")
    force = Piecewise()
    for number, size in enumerate(np.geomspace(high, low, releases)):
        force.move(float(size) if number % 2 == 0 or values["sides"] < 2.0 else -float(size), values["rise_time"])
        force.hold(values["hold"])
        force.move(0.0, values["release_time"])
        force.hold(values["decay_time"])
    return force


EXCITATION = Excitation(
    id="free_decay",
    title="initial deflection and release",
    shows="natural frequency, viscous and Coulomb friction and their asymmetry, from the peaks of the free motion",
    parameters=(
        Parameter("force_high", "F_1", "F", "force of the first push, the largest", default=50.0, positive=True, upper=1e9),
        Parameter("force_low", "F_n", "F", "force of the last push", default=25.0, positive=True, upper=1e9),
        Parameter("releases", "n", "1", "number of pushes, in equal ratios", lower=1, upper=1000, default=2),
        Parameter("sides", "k", "1", "1: to the positive side only; 2: alternately to both", lower=1, upper=2, default=2),
        Parameter("rise_time", "T_r", "s", "time in which the force rises", default=1.0, positive=True, upper=1e4),
        Parameter("hold", "T_h", "s", "time for which it is held, until the axis rests", default=2.0, lower=0.0, upper=1e4),
        Parameter("release_time", "T_0", "s", "time in which it falls; 0: at once", lower=0.0, upper=100.0, default=0.005),
        Parameter("decay_time", "T_d", "s", "time without force after the release", default=5.0, positive=True, upper=1e5),
    ),
    plan=plan,
    outputs=("force",),
)
"""Only as a force: nobody lets go of an axis whose controller holds it."""
