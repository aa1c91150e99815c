"""PID position controller for one axis.

Equation, at sample k with the reference r, the measured position y and the feedforward force f:

    P_k = k_p (b r_k - y_k)
    I_k = I_(k-1) + k_i h (r_k - y_k)
    D_k = (T_f D_(k-1) + k_d ((c r_k - y_k) - (c r_(k-1) - y_(k-1)))) / (T_f + h)
    u_k = clip(P_k + I_k + D_k + f_k)

Anti-windup by back-calculation: what the limits took away, u_k - (P_k + I_k + D_k + f_k), is fed back into the integral with
the time constant T_t, so that the integral follows the limit and the output leaves it as soon as the error calls for it. The
feedforward takes part in the limit. A change of gains moves the difference into the integral, so that the output doesn't jump.
Source: Astrom and Hagglund 2006, Advanced PID Control, sections 3.2 to 3.5 and 13.4 (backward differences).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ...errors import InputError
from ...parameter import Parameter
from ..controller import Controller, Setpoint
from ..loop import Polynomials, pid_polynomials
from ..tunable import Basis, Tunable

__all__ = ["CONTROLLER", "Pid", "PidError", "PidGains"]


class PidError(InputError):
    """Gains or inputs that a controller can't work with."""


@dataclass(frozen=True)
class PidGains:
    """Gains of a PID controller.

    Attributes:
        proportional: k_p [F/x].
        integral: k_i [F/(x s)].
        derivative: k_d [F s/x].
        filter_time: time constant of the derivative filter T_f [s].
        position_weight: weight b of the reference in the proportional part [1].
        velocity_weight: weight c of the reference in the derivative part [1].
        tracking_time: time constant T_t of the anti-windup [s]; 0 takes k_p / k_i.

    Raises:
        PidError: a gain is negative or not finite.
    """

    proportional: float
    integral: float = 0.0
    derivative: float = 0.0
    filter_time: float = 0.0
    position_weight: float = 1.0
    velocity_weight: float = 1.0
    tracking_time: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not math.isfinite(value) or value < 0.0:
                raise PidError("PID gains", f"{name} is {value}", "give a finite number of at least 0")

    @property
    def anti_windup_time(self) -> float:
        """T_t in use [s]; infinite without an integral part."""
        if self.tracking_time > 0.0:
            return self.tracking_time
        return self.proportional / self.integral if self.integral > 0.0 else math.inf


class Pid:
    """A PID controller with its state.

    Args:
        gains: at the start; see :meth:`set_gains`.
        limit: largest output [F].

    Attributes:
        saturated: number of samples at which the limit took something away.
    """

    def __init__(self, gains: PidGains, limit: float = math.inf) -> None:
        self.gains = gains
        self.limit = limit
        self.saturated = 0
        self.reset()

    def reset(self, integral: float = 0.0) -> None:
        """Start anew with the integral part at ``integral`` [F]."""
        self._integral = integral
        self._derivative = 0.0
        self._before: tuple[float, float] | None = None

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None:
        """Start in motion, see :meth:`fric.control.controller.Law.begin`."""
        reference = wanted.position, wanted.velocity
        gains = self.gains
        self._derivative = gains.derivative * (gains.velocity_weight * reference[1] - state[1])
        self._before = reference[0] - duration * reference[1], state[0] - duration * state[1]
        proportional = gains.proportional * (gains.position_weight * reference[0] - state[0])
        self._integral = force - proportional - self._derivative if gains.integral > 0.0 else 0.0

    def set_gains(self, gains: PidGains) -> None:
        """Go on with other gains, without a jump of the output."""
        if self._before is not None:
            reference, measured = self._before
            old, new = self.gains, gains
            self._integral += old.proportional * (old.position_weight * reference - measured)
            self._integral -= new.proportional * (new.position_weight * reference - measured)
            if old.derivative > 0.0:
                # The derivative part is the gain times a filtered rate, and the rate is what it was.
                scaled = self._derivative * new.derivative / old.derivative
                self._integral += self._derivative - scaled
                self._derivative = scaled
        self.gains = gains

    def step(self, reference: float, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """Output [F] for one sample that comes ``duration`` [s] after the last.

        Args:
            reference: position wanted [x].
            measured: position [x].
            duration: time since the last sample [s].
            feedforward: force added inside the limit [F].

        Raises:
            PidError: an input isn't finite, or the duration isn't positive; the state is left as it was. Or the output isn't
                finite, by numbers that are too large; the controller has to be reset.
        """
        if not (math.isfinite(reference) and math.isfinite(measured) and math.isfinite(feedforward)):
            given = f"reference {reference}, measured {measured}, feedforward {feedforward}"
            raise PidError("PID", f"an input is not finite ({given})", "leave the sample out")
        if not 0.0 < duration < math.inf:
            raise PidError("PID", f"duration is {duration}", "give the time since the last sample, greater than 0")
        gains = self.gains
        b, c = gains.position_weight, gains.velocity_weight
        error = reference - measured
        before = (reference, measured) if self._before is None else self._before
        change = (c * reference - measured) - (c * before[0] - before[1])
        filtered = gains.filter_time * self._derivative + gains.derivative * change
        self._derivative = filtered / (gains.filter_time + duration)
        self._integral += gains.integral * duration * error
        wanted = gains.proportional * (b * reference - measured) + self._integral + self._derivative + feedforward
        if not math.isfinite(wanted):
            raise PidError("PID", f"its output is {wanted}", "reset the controller")
        output = min(max(wanted, -self.limit), self.limit)
        if output != wanted:
            self.saturated += 1
            time = gains.anti_windup_time
            if math.isfinite(time):
                # A tracking time shorter than the sample would overshoot the limit's own value.
                self._integral += (output - wanted) * duration / max(time, duration)
        self._before = (reference, measured)
        return output

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """:meth:`step` towards a setpoint, of which this law takes the position."""
        return self.step(wanted.position, measured, duration, feedforward)


_PID = ("proportional", "integral", "derivative", "filter_time")


def _gains(basis: Basis) -> dict[str, float]:
    # Against hunting there is no other remedy in a PID than to do without its integral.
    without = {"integral": 0.0} if basis.calm > 0 else {}
    return {**basis.pid, "position_weight": 1.0, "velocity_weight": 1.0, "tracking_time": 0.0, **without}


def _linear(values: Mapping[str, float], period: float) -> list[Polynomials]:
    kp, ki, kd, filter_time = (values[name] for name in _PID)
    return [pid_polynomials(kp, ki, kd, filter_time, period)]


CONTROLLER = Controller(
    id="pid",
    title="PID controller of the position",
    parameters=(
        Parameter("proportional", "k_p", "F/x", "proportional gain", lower=0.0),
        Parameter("integral", "k_i", "F/(x s)", "integral gain", lower=0.0, default=0.0),
        Parameter("derivative", "k_d", "F s/x", "derivative gain", lower=0.0, default=0.0),
        Parameter("filter_time", "T_f", "s", "time constant of the derivative's filter", lower=0.0, default=0.0),
        Parameter("position_weight", "b", "1", "weight of the reference in the proportional part", lower=0.0, default=1.0),
        Parameter("velocity_weight", "c", "1", "weight of the reference in the derivative part", lower=0.0, default=1.0),
        Parameter("tracking_time", "T_t", "s", "time constant of the anti-windup; 0 takes k_p/k_i", lower=0.0, default=0.0),
    ),
    build=lambda values, limit: Pid(PidGains(**values), limit),
    source="Astrom and Hagglund 2006, Advanced PID Control",
    tunable=Tunable(_gains, _linear),
)
