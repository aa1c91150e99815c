"""Parametric harmonic oscillation: feedback of position and velocity makes the axis an oscillator, which is let go.

Equation: u = -(P (q - r) + D v). The axis is first led to the deflection r = r_0 (P r is the offset force), with the damping
D_s; when it has settled, r and D change at once to 0 and D, and it oscillates freely:

    m q'' + (c + D) q' + (k + P) q = -(friction),

until the time is over. A negative D takes viscous friction away, so that an overdamped axis oscillates. Then the same with the
next P, from the lowest to the highest in equal steps, alternately to both sides: the differences of P and of the squared
natural frequencies give the mass, whatever the friction.
The velocity is the filtered difference quotient v_k = (T_f v_(k-1) + q_k - q_(k-1))/(T_f + h) of the positions measured. Its
delay and the held force make P take the damping P h/2 away and D the mass D (h + T_f), which an evaluation has to add again.
Should the deflection get beyond the travel allowed, the damping is D_s until the next release.
Source: de Marchi 1998 (defence, "Parametric Harmonic Osc" and "Physical Parameter Estimation").
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..excitation_kind import Excitation, ExcitationError
from ..parameter import Parameter

__all__ = ["EXCITATION", "Oscillation"]


class Oscillation:
    """The feedback for ``values`` of the parameters.

    Attributes:
        duration: from the start to the end [s].
        stiffness: P in use, one after the other [F/x].
        cycle: from one start to the next [s].
        release: from the start of a cycle to its release [s].
    """

    def __init__(self, values: Mapping[str, float]) -> None:
        low, high, deflection, travel = (values[n] for n in ("stiffness_low", "stiffness_high", "deflection", "travel"))
        if low > high:
            problem = f"stiffness_low {low:g} exceeds stiffness_high {high:g}"
            raise ExcitationError("parametric_oscillation", problem, "swap them")
        if deflection > travel:
            problem = f"deflection {deflection:g} exceeds travel {travel:g}"
            raise ExcitationError("parametric_oscillation", problem, "shorten it")
        self.stiffness: list[float] = np.linspace(low, high, int(values["gains"])).tolist()
        self.release = values["set_time"] + values["hold"]
        self.cycle = self.release + values["oscillation_time"]
        self.duration = self.cycle * len(self.stiffness)
        self._values = values
        self._start()

    def _start(self) -> None:
        self._time = -math.inf
        self._position = 0.0
        self._velocity = 0.0
        self._number = 0
        self._astray = False

    def force(self, time: float, position: float) -> float:
        """See :class:`fric.excitation_kind.Feedback`."""
        values = self._values
        if time <= self._time:
            self._start()
        if math.isfinite(self._time):
            filter_time = values["filter_time"]
            change = position - self._position
            self._velocity = (filter_time * self._velocity + change) / (filter_time + time - self._time)
        self._time, self._position = time, position
        number = min(int(time / self.cycle), len(self.stiffness) - 1)
        local = time - number * self.cycle
        held = local < self.release
        if number != self._number or held:
            self._number, self._astray = number, False
        self._astray = self._astray or (not held and abs(position) > values["travel"])
        target = 0.0
        if held:
            s = min(local / values["set_time"], 1.0)
            side = -1.0 if number % 2 == 1 and values["sides"] >= 2.0 else 1.0
            target = side * values["deflection"] * s**3 * (10.0 + s * (-15.0 + 6.0 * s))
        damping = values["damping_set"] if held or self._astray else values["damping"]
        return self.stiffness[number] * (target - position) - damping * self._velocity


EXCITATION = Excitation(
    id="parametric_oscillation",
    title="free oscillation under position and velocity feedback",
    shows="mass, stiffness, viscous and Coulomb friction and their asymmetry, also where the axis alone doesn't oscillate",
    parameters=(
        Parameter("stiffness_low", "P_1", "F/x", "lowest position gain", default=500.0, positive=True, upper=1e12),
        Parameter("stiffness_high", "P_n", "F/x", "highest position gain", default=2000.0, positive=True, upper=1e12),
        Parameter("gains", "n", "1", "number of position gains, in equal steps", lower=1, upper=1000, default=4),
        Parameter(
            "damping",
            "D",
            "F s/x",
            "velocity gain meanwhile; negative drives it",
            lower=-1e9,
            upper=1e9,
            default=-20.0,
        ),
        Parameter(
            "damping_set", "D_s", "F s/x", "velocity gain while it is led to the deflection", lower=0.0, upper=1e9, default=40.0
        ),
        Parameter("deflection", "r_0", "x", "deflection from which it is let go", default=0.04, positive=True, upper=1e6),
        Parameter("travel", "s", "x", "beyond this the oscillation is damped", default=0.08, positive=True, upper=1e6),
        Parameter("sides", "k", "1", "1: from the positive side only; 2: alternately from both", lower=1, upper=2, default=2),
        Parameter("set_time", "T_r", "s", "time in which it is led to the deflection", default=1.0, positive=True, upper=1e4),
        Parameter("hold", "T_h", "s", "time to settle there", lower=0.0, upper=1e4, default=1.0),
        Parameter("oscillation_time", "T_d", "s", "time to oscillate", default=3.0, positive=True, upper=1e5),
        Parameter("filter_time", "T_f", "s", "time constant of the velocity's filter", lower=0.0, upper=10.0, default=0.001),
    ),
    answer=Oscillation,
    outputs=("force",),
)
"""Only as a force, since it closes the loop itself."""
