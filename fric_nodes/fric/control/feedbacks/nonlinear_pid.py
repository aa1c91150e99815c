"""Nonlinear PID: gains that grow where the axis is near its goal and slow, since friction is a stiff spring there.

Equation, with the error e, the reference's velocity w, and the measured velocity's filter of the derivative part:

    g = exp(-(e/e_s)^2 - (w/v_s)^2)                       1 near the goal and slow, 0 far from it or fast
    P = k_p (1 + (f_p - 1) g) e
    I = I + k_i (1 + (f_i - 1) g) h e
    D = (T_f D + k_d (change of e)) / (T_f + h)
    u = clip(P + I + D + f)

In pre-sliding the friction's own stiffness adds to the loop, so that it bears more integral action there than the free mass
does: f_i > 1. The gains change with the error, not with time, and the integral accumulates what its gain gave at each moment,
so that the output has no jump. The linear loop with any pair of factors between 1 and f_p, f_i has to be stable, which
:mod:`fric.control.autotune` checks with margins at the ends.

Anti-windup by back-calculation as of :mod:`.pid`. The speed is that of the reference: it has no noise, and no loop closes over
it. Source: Amthor et al. 2008, Fig. 7, names a nonlinear PID of the Ilmenau machine (Hausotte 2005), whose law it doesn't
print; the form here is that of gains scheduled by error and speed, Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section
5.2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ...parameter import Parameter
from ..controller import Controller, Setpoint, check_inputs
from ..loop import Polynomials, pid_polynomials
from ..tunable import Basis, Tunable
from .error_pid import ErrorPid

__all__ = ["CONTROLLER", "NonlinearPid", "NonlinearPidGains"]


@dataclass(frozen=True)
class NonlinearPidGains:
    """Gains of a nonlinear PID.

    Attributes:
        proportional: k_p [F/x].
        integral: k_i [F/(x s)].
        derivative: k_d [F s/x].
        filter_time: T_f [s].
        proportional_factor: f_p [1].
        integral_factor: f_i [1].
        error_scale: e_s [x].
        speed_scale: v_s [x/s].
    """

    proportional: float
    integral: float
    derivative: float
    filter_time: float
    proportional_factor: float
    integral_factor: float
    error_scale: float
    speed_scale: float


class NonlinearPid:
    """A nonlinear PID with its state.

    Args:
        gains: of all parts.
        limit: largest output [F].
    """

    def __init__(self, gains: NonlinearPidGains, limit: float = math.inf) -> None:
        self.gains = gains
        self.limit = limit
        self._pid = ErrorPid(gains.derivative, gains.filter_time, limit)

    @property
    def saturated(self) -> int:
        """Number of samples at which the limit took something away."""
        return self._pid.saturated

    def reset(self) -> None:
        """Start anew, at rest."""
        self._pid.reset()

    def _near(self, error: float, velocity: float) -> float:
        return math.exp(-((error / self.gains.error_scale) ** 2) - (velocity / self.gains.speed_scale) ** 2)

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None:
        """Start in motion, see :meth:`fric.control.controller.Law.begin`."""
        gains = self.gains
        near = self._near(wanted.position - state[0], wanted.velocity)
        proportional = gains.proportional * (1.0 + (gains.proportional_factor - 1.0) * near)
        self._pid.begin(proportional, gains.integral > 0.0, wanted, state, force, duration)

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """See :meth:`fric.control.controller.Law.answer`.

        Raises:
            ControlInputError: an input isn't finite, or the duration isn't positive; the state is left as it was.
        """
        check_inputs(wanted, measured, duration, feedforward)
        gains, error = self.gains, wanted.position - measured
        near = self._near(error, wanted.velocity)
        integral = gains.integral * (1.0 + (gains.integral_factor - 1.0) * near)
        self._pid.integral += integral * duration * error
        proportional = gains.proportional * (1.0 + (gains.proportional_factor - 1.0) * near)
        return self._pid.output(error, proportional, integral, duration, feedforward)


def _gains(basis: Basis) -> dict[str, float]:
    error = max(basis.coulomb / max(basis.pid["proportional"], 1e-300), 4.0 * basis.resolution)
    scales = {"error_scale": error, "speed_scale": error * basis.crossover}
    # The linear loop with the largest factor has to be stable with margins as well: some of the integral action is kept back.
    base = {**basis.pid, "integral": 0.5 * basis.pid["integral"], "proportional_factor": 1.0, **scales}
    if basis.calm > 0:
        base["integral"] *= 0.25**basis.calm
    factor = basis.largest(lambda value: {**base, "integral_factor": value}, 1.0, 30.0)
    return {**base, "integral_factor": factor}


def _linear(values: Mapping[str, float], period: float) -> list[Polynomials]:
    kp, ki, kd, filter_time = (values[name] for name in ("proportional", "integral", "derivative", "filter_time"))
    near = kp * values["proportional_factor"], ki * values["integral_factor"]
    return [pid_polynomials(kp, ki, kd, filter_time, period), pid_polynomials(*near, kd, filter_time, period)]


CONTROLLER = Controller(
    id="nonlinear_pid",
    title="PID controller with gains scheduled by error and speed",
    parameters=(
        Parameter("proportional", "k_p", "F/x", "proportional gain far from the goal", lower=0.0),
        Parameter("integral", "k_i", "F/(x s)", "integral gain far from the goal", lower=0.0),
        Parameter("derivative", "k_d", "F s/x", "derivative gain", lower=0.0),
        Parameter("filter_time", "T_f", "s", "time constant of the derivative's filter", lower=0.0, default=0.0),
        Parameter("proportional_factor", "f_p", "1", "factor of the proportional gain near the goal", lower=0.0, default=1.0),
        Parameter("integral_factor", "f_i", "1", "factor of the integral gain near the goal", lower=0.0, default=3.0),
        Parameter("error_scale", "e_s", "x", "error at which the factors have fallen to 1/e", positive=True),
        Parameter("speed_scale", "v_s", "x/s", "speed of the reference at which they have", positive=True),
    ),
    build=lambda values, limit: NonlinearPid(NonlinearPidGains(**values), limit),
    source="Amthor et al. 2008, Fig. 7; Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section 5.2",
    tunable=Tunable(_gains, _linear),
)
