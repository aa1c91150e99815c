"""What controllers that are built on a PID share: its parameters and linear form, the PID of the error, and one inside another.

A PID of the error has no weights of the reference; its gains may change from sample to sample:

    I = I + k_i h e,    D = (T_f D + k_d (change of e)) / (T_f + h),    u = clip(P + I + D + f),

with anti-windup by back-calculation over T_t = k_p/k_i, as of :mod:`.pid`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ...parameter import Parameter
from ..controller import Setpoint
from ..loop import Polynomials, pid_polynomials
from .pid import Pid, PidGains

__all__ = ["PID_PARAMETERS", "AroundPid", "ErrorPid", "gains_from", "linear_pid"]

_NAMES = ("proportional", "integral", "derivative", "filter_time")
PID_PARAMETERS = (
    Parameter("proportional", "k_p", "F/x", "proportional gain", lower=0.0),
    Parameter("integral", "k_i", "F/(x s)", "integral gain", lower=0.0, default=0.0),
    Parameter("derivative", "k_d", "F s/x", "derivative gain", lower=0.0),
    Parameter("filter_time", "T_f", "s", "time constant of the derivative's filter", lower=0.0, default=0.0),
)
"""Of a PID inside another controller."""


def gains_from(values: Mapping[str, float]) -> PidGains:
    """The gains of the PID among ``values``."""
    return PidGains(*(values[name] for name in _NAMES))


def linear_pid(values: Mapping[str, float], period: float) -> list[Polynomials]:
    """The linear form of the PID among ``values``, alone."""
    kp, ki, kd, filter_time = (values[name] for name in _NAMES)
    return [pid_polynomials(kp, ki, kd, filter_time, period)]


class AroundPid:
    """A controller with a PID inside.

    Args:
        gains: of the PID.
        limit: largest output [F].

    Attributes:
        pid: the PID, which limits the output as a whole.
    """

    def __init__(self, gains: PidGains, limit: float = math.inf) -> None:
        self.pid = Pid(gains, limit)
        self.limit = limit

    @property
    def saturated(self) -> int:
        """Number of samples at which the limit took something away."""
        return self.pid.saturated


class ErrorPid:
    """The state of a PID of the error.

    Args:
        derivative: k_d [F s/x].
        filter_time: T_f [s].
        limit: largest output [F].

    Attributes:
        saturated: number of samples at which the limit took something away.
        integral: I [F].
    """

    def __init__(self, derivative: float, filter_time: float, limit: float = math.inf) -> None:
        self._gain, self._filter, self._limit = derivative, filter_time, limit
        self.saturated = 0
        self.reset()

    def reset(self) -> None:
        """Start anew, at rest."""
        self.integral = self._derivative = 0.0
        self._before: float | None = None

    def begin(
        self, proportional: float, integrates: bool, wanted: Setpoint, state: tuple[float, float], force: float, duration: float
    ) -> None:
        """Start in motion with the proportional gain [F/x] that holds there; see :meth:`fric.control.controller.Law.begin`."""
        error, rate = wanted.position - state[0], wanted.velocity - state[1]
        self._before, self._derivative = error - duration * rate, self._gain * rate
        self.integral = force - proportional * error - self._derivative if integrates else 0.0

    def output(self, error: float, proportional: float, integral: float, duration: float, feedforward: float) -> float:
        """Limited output [F] for the ``error`` [x]; the integral has taken it in already.

        Args:
            error: e [x].
            proportional: k_p at this sample [F/x].
            integral: k_i at this sample, for the anti-windup [F/(x s)].
            duration: h [s].
            feedforward: f [F].
        """
        before = error if self._before is None else self._before
        self._before = error
        self._derivative = (self._filter * self._derivative + self._gain * (error - before)) / (self._filter + duration)
        free = proportional * error + self.integral + self._derivative + feedforward
        output = min(max(free, -self._limit), self._limit)
        if output != free:
            self.saturated += 1
            if integral > 0.0 and proportional > 0.0:
                # A tracking time shorter than the sample would overshoot the limit's own value.
                self.integral += (output - free) * min(duration * integral / proportional, 1.0)
        return output
