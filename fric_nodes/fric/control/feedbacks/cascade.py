"""Cascade of position and velocity control (P-PI), as most servo drives have it.

Equation, at sample k with the reference r and its velocity w, the measured position y and the feedforward force f:

    v_k = (T_f v_(k-1) + y_k - y_(k-1)) / (T_f + h)               measured velocity
    e_k = k_p (r_k - y_k) + c w_k - v_k                           error of the velocity
    I_k = I_(k-1) + k_i h e_k
    u_k = clip(k_v e_k + I_k + f_k)

While the output is limited, the integral stays where it would drive it further beyond the limit. Without k_i and with c = 0 it
is the controller of the EMPS benchmark (Janot, Gautier, Brunot 2019), k_v (k_p (r - y) - v).
Source: Leonhard 2001, Control of Electrical Drives, chapter 15.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...parameter import Parameter
from ..controller import Controller, Setpoint, check_inputs
from ..loop import Polynomials, added
from ..tunable import Basis, Tunable

__all__ = ["CONTROLLER", "Cascade", "CascadeGains"]


@dataclass(frozen=True)
class CascadeGains:
    """Gains of a cascade.

    Attributes:
        position_gain: k_p [1/s].
        velocity_gain: k_v [F s/x].
        velocity_integral: k_i [F/x].
        velocity_weight: weight c of the reference's velocity [1].
        filter_time: time constant T_f of the velocity's filter [s].
    """

    position_gain: float
    velocity_gain: float
    velocity_integral: float = 0.0
    velocity_weight: float = 0.0
    filter_time: float = 0.0


class Cascade:
    """A cascade with its state.

    Args:
        gains: of both loops.
        limit: largest output [F].

    Attributes:
        saturated: number of samples at which the limit took something away.
    """

    def __init__(self, gains: CascadeGains, limit: float = math.inf) -> None:
        self.gains = gains
        self.limit = limit
        self.saturated = 0
        self.reset()

    def reset(self) -> None:
        """Start anew, at rest."""
        self._integral = 0.0
        self._velocity = 0.0
        self._before: float | None = None

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None:
        """Start in motion, see :meth:`fric.control.controller.Law.begin`."""
        reference = wanted.position, wanted.velocity
        self._velocity = state[1]
        self._before = state[0] - duration * state[1]
        gains = self.gains
        error = gains.position_gain * (reference[0] - state[0]) + gains.velocity_weight * reference[1] - state[1]
        self._integral = force - gains.velocity_gain * error if gains.velocity_integral > 0.0 else 0.0

    def step(self, reference: float, velocity: float, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """Output [F] for one sample that comes ``duration`` [s] after the last.

        Args:
            reference: position wanted [x].
            velocity: velocity wanted [x/s].
            measured: position [x].
            duration: time since the last sample [s].
            feedforward: force added inside the limit [F].

        Raises:
            InputError: the output isn't finite; the controller has to be reset.
        """
        gains = self.gains
        before = measured if self._before is None else self._before
        self._velocity = (gains.filter_time * self._velocity + measured - before) / (gains.filter_time + duration)
        self._before = measured
        error = gains.position_gain * (reference - measured) + gains.velocity_weight * velocity - self._velocity
        integral = self._integral + gains.velocity_integral * duration * error
        wanted = gains.velocity_gain * error + integral + feedforward
        if not math.isfinite(wanted):
            raise InputError("cascade", f"its output is {wanted}", "reset the controller")
        output = min(max(wanted, -self.limit), self.limit)
        if output != wanted:
            self.saturated += 1
        if (wanted - output) * error <= 0.0:
            self._integral = integral
        return output

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """:meth:`step` towards a setpoint, of which it takes position and velocity; a bad input leaves the state as it was."""
        check_inputs(wanted, measured, duration, feedforward)
        return self.step(wanted.position, wanted.velocity, measured, duration, feedforward)


def _gains(basis: Basis) -> dict[str, float]:
    """With v = dy/dt and c = 1 the cascade is a PID of k_p = k_v k_pos + k_i, k_i k_pos and k_v, which is solved for k_pos.

    That has a solution while the PID's zeros are real: of its integral gain no more than that is kept.
    """
    kp, kd = basis.pid["proportional"], basis.pid["derivative"]
    ki = 0.0 if basis.calm > 0 else min(basis.pid["integral"], 0.24 * kp * kp / kd)
    position = (kp + math.sqrt(kp * kp - 4.0 * ki * kd)) / (2.0 * kd)
    return {
        "position_gain": position,
        "velocity_gain": kd,
        "velocity_integral": ki / position,
        "velocity_weight": 1.0,
        "filter_time": basis.pid["filter_time"],
    }


def _linear(values: Mapping[str, float], period: float) -> list[Polynomials]:
    k, time = values["position_gain"], values["filter_time"]
    inner = added([(np.array([k]), np.array([1.0])), (np.array([1.0, -1.0]), np.array([time + period, -time]))])
    gain = (np.array([values["velocity_gain"]]), np.array([1.0]))
    if values["velocity_integral"] > 0.0:
        gain = added([gain, (np.array([values["velocity_integral"] * period, 0.0]), np.array([1.0, -1.0]))])
    return [(np.asarray(np.polymul(inner[0], gain[0])), np.asarray(np.polymul(inner[1], gain[1])))]


CONTROLLER = Controller(
    id="cascade",
    title="cascade of position and velocity control (P-PI)",
    parameters=(
        Parameter("position_gain", "k_p", "1/s", "gain of the position loop", lower=0.0),
        Parameter("velocity_gain", "k_v", "F s/x", "gain of the velocity loop", positive=True),
        Parameter("velocity_integral", "k_i", "F/x", "integral gain of the velocity loop", lower=0.0, default=0.0),
        Parameter("velocity_weight", "c", "1", "weight of the reference's velocity", lower=0.0, default=0.0),
        Parameter("filter_time", "T_f", "s", "time constant of the measured velocity's filter", lower=0.0, default=0.0),
    ),
    build=lambda values, limit: Cascade(CascadeGains(**values), limit),
    source="Leonhard 2001, Control of Electrical Drives, chapter 15",
    tunable=Tunable(_gains, _linear),
)
