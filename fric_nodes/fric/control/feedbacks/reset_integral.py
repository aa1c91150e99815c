"""PID whose integral is reset when the error passes zero, against hunting.

Equation: the PID of :mod:`.pid`, and at each sample at which the error has passed zero, while the reference is slower than v_r,

    I = r I,

with r = 0 the integrator of Clegg: after an overshoot the integral starts anew instead of having to be emptied first, which is
what makes an axis with friction hunt. A factor near 1 leaves a part of the hunting. Within ``dead_zone`` the integral is held:
an encoder that can't show a smaller error gives none that could be integrated. Passing zero counts once the error has left the
dead zone on the other side, so that the encoder's flicker is no passing.

Resets that follow each other within ``dwell`` don't count (temporal regularisation): a loop that swings faster than that, by a
delay or an encoder that nobody told of, is led by its linear part, whose margins hold, and not stirred at every swing.

A constant force beside friction (gravity) is in the integral too, and a reset takes it away: give it as feedforward.
Source: Clegg 1958; Beerens, Bisoffi, Zaccarian, Heemels, Nijmeijer, van de Wouw 2019, Automatica 107.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ...parameter import Parameter
from ..controller import Controller, Setpoint, check_inputs
from ..tunable import Basis, Tunable
from .error_pid import PID_PARAMETERS, ErrorPid, gains_from, linear_pid
from .pid import PidGains

__all__ = ["CONTROLLER", "ResetIntegral"]


class ResetIntegral:
    """The controller with its state.

    Args:
        gains: of the PID.
        reset_factor: r [1].
        dead_zone: error within which the integral is held [x].
        slow: v_r, speed of the reference up to which the integral is reset [x/s].
        limit: largest output [F].
        dwell: shortest time between two resets [s].

    Attributes:
        resets: number of resets.
    """

    def __init__(
        self,
        gains: PidGains,
        reset_factor: float = 0.0,
        dead_zone: float = 0.0,
        slow: float = 0.0,
        limit: float = math.inf,
        dwell: float = 0.0,
    ) -> None:
        self.gains = gains
        self.limit = limit
        self._factor, self._dead_zone, self._slow, self._dwell = reset_factor, dead_zone, slow, dwell
        self._pid = ErrorPid(gains.derivative, gains.filter_time, limit)
        self.resets = 0
        self.reset()

    @property
    def saturated(self) -> int:
        """Number of samples at which the limit took something away."""
        return self._pid.saturated

    def reset(self) -> None:
        """Start anew, at rest."""
        self._pid.reset()
        self._side, self._since = 0.0, math.inf

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None:
        """Start in motion, see :meth:`fric.control.controller.Law.begin`."""
        self._pid.begin(self.gains.proportional, self.gains.integral > 0.0, wanted, state, force, duration)
        self._side, self._since = 0.0, math.inf

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """See :meth:`fric.control.controller.Law.answer`.

        Raises:
            ControlInputError: an input isn't finite, or the duration isn't positive; the state is left as it was.
        """
        check_inputs(wanted, measured, duration, feedforward)
        gains, error = self.gains, wanted.position - measured
        self._since += duration
        if abs(error) > self._dead_zone:
            side = math.copysign(1.0, error)
            if side * self._side < 0.0 and abs(wanted.velocity) <= self._slow:
                if self._since >= self._dwell:
                    self._pid.integral *= self._factor
                    self.resets += 1
                self._since = 0.0
            self._side = side
            self._pid.integral += gains.integral * duration * error
        return self._pid.output(error, gains.proportional, gains.integral, duration, feedforward)


def _build(given: Mapping[str, float], limit: float) -> ResetIntegral:
    return ResetIntegral(gains_from(given), given["reset_factor"], given["dead_zone"], given["slow"], limit, given["dwell"])


_PERIODS = 2.0 * math.pi  # physical: a swing of the loop at its margins takes so many times 1/crossover, or less


def _gains(basis: Basis) -> dict[str, float]:
    return {**basis.pid, "reset_factor": 0.0, "dead_zone": basis.dead_zone, "slow": 0.0, "dwell": _PERIODS / basis.crossover}


CONTROLLER = Controller(
    id="reset_integral",
    title="PID controller whose integral is reset when the error passes zero",
    parameters=(
        *PID_PARAMETERS,
        Parameter("reset_factor", "r", "1", "what the integral is multiplied by at a reset", 0.0, 1.0, default=0.0),
        Parameter("dead_zone", "e_d", "x", "error within which the integral is held", lower=0.0, default=0.0),
        Parameter("slow", "v_r", "x/s", "speed of the reference up to which it is reset", lower=0.0, default=0.0),
        Parameter("dwell", "T_d", "s", "shortest time between two resets", lower=0.0, default=0.0),
    ),
    build=_build,
    source="Clegg 1958; Beerens et al. 2019, Automatica 107",
    tunable=Tunable(_gains, linear_pid),
)
