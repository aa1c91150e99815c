"""PID, or P-PI, with a disturbance observer: what the nominal axis doesn't explain is taken for a force and compensated.

Equation, with the force u_f = u - f that the feedforward f didn't give, the error e = r - y, the nominal inertia J and damping
B:

    d = Q(s) [u_f + (J s^2 + B s) e],    Q = 1 / (1 + s T_q)^2,
    u = clip(C(e) + f + d).

With e instead of -y the reference's own inertia force is part of d as far as no feedforward gives it, and a feedforward that
is right leaves d at 0: nothing is compensated twice. The filters are two backward-Euler lags for each signal, of which (J s^2
+ B s) Q is made exactly, without a difference of second order. The observer takes the limited force, so that it doesn't wind
up. With k_i = 0, k_p = k_v k_pos and k_d = k_v the controller C is the P-P cascade of drives, and d is its integral.

In the linear loop the observer adds (C + J s^2 + B s) Q/(1 - Q) to the controller: see :func:`fric.control.loop.margins`. It
acts as an integral, and so hunts against Coulomb friction as one does; ``dead_zone`` holds d while the error is smaller and
the reference at rest, which stops that. Source: Ohnishi 1987; Umeno, Kaneko, Hori 1993; Sariyildiz, Oboe, Ohnishi 2020
(stability and robustness).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ...model import Model
from ...parameter import Parameter
from ...record import Array
from ..controller import Controller, Setpoint, check_inputs
from ..loop import Polynomials, added
from ..tunable import Basis, Tunable
from .error_pid import PID_PARAMETERS, AroundPid, gains_from, linear_pid
from .pid import PidGains

__all__ = ["CONTROLLER", "DisturbanceObserver", "Filtered", "nominal_of"]


class Filtered:
    """A signal behind Q = 1/(1 + s T)^2, with its first and second derivative, by backward Euler.

    Args:
        time: T [s].

    Attributes:
        value: Q x.
        rate: s Q x.
        bend: s^2 Q x.
    """

    def __init__(self, time: float) -> None:
        self.time = time
        self.reset(0.0)

    def reset(self, value: float, rate: float = 0.0) -> None:
        """As if the signal had been at ``value`` with this ``rate`` for long."""
        self._first = value - self.time * rate
        self.value = self._first - self.time * rate
        self.rate, self.bend = rate, 0.0

    def take(self, value: float, duration: float) -> None:
        """One sample more, after ``duration`` [s]."""
        share = duration / (self.time + duration)
        slope = (value - self._first) / (self.time + duration)
        self._first += share * (value - self._first)
        self.bend = (slope - self.rate) / (self.time + duration)
        self.rate += share * (slope - self.rate)
        self.value += share * (self._first - self.value)


class DisturbanceObserver(AroundPid):
    """The controller with its state.

    Args:
        gains: of the PID.
        inertia: J [F s^2/x].
        damping: B [F s/x].
        observer_time: T_q [s].
        dead_zone: error below which the estimate is held while the reference rests [x].
        limit: largest output [F].

    Attributes:
        disturbance: d, the force that the nominal axis doesn't explain [F].
    """

    def __init__(
        self,
        gains: PidGains,
        inertia: float,
        damping: float,
        observer_time: float,
        dead_zone: float = 0.0,
        limit: float = math.inf,
    ) -> None:
        super().__init__(gains, limit)
        self.inertia, self.damping, self.dead_zone = inertia, damping, dead_zone
        self._error, self._force = Filtered(observer_time), Filtered(observer_time)
        self.reset()

    def reset(self) -> None:
        """Start anew, at rest."""
        self.pid.reset()
        self._error.reset(0.0)
        self._force.reset(0.0)
        self.disturbance = 0.0
        self._last = 0.0
        self._begun = False

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None:
        """Start in motion, see :meth:`fric.control.controller.Law.begin`."""
        self.reset()
        error, rate = wanted.position - state[0], wanted.velocity - state[1]
        gains = self.pid.gains
        inner = gains.proportional * error + gains.derivative * rate
        self.disturbance = min(max(force - inner, -self.limit), self.limit)
        self.pid.begin(wanted, state, inner, duration)
        self._error.reset(error - duration * rate, rate)
        self._force.reset(self.disturbance - self.damping * rate)
        self._last = force
        self._begun = True

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """See :meth:`fric.control.controller.Law.answer`.

        Raises:
            ControlInputError: an input isn't finite, or the duration isn't positive; the state is left as it was.
        """
        check_inputs(wanted, measured, duration, feedforward)
        error = wanted.position - measured
        if not self._begun:
            self._error.reset(error)
            self._begun = True
        self._error.take(error, duration)
        self._force.take(self._last, duration)
        if wanted.velocity != 0.0 or abs(error) > self.dead_zone:
            estimate = self._force.value + self.inertia * self._error.bend + self.damping * self._error.rate
            self.disturbance = min(max(estimate, -self.limit), self.limit)
        else:
            # Held: the filter follows, so that it goes on from here.
            self._force.reset(self.disturbance)
        output = self.pid.step(wanted.position, measured, duration, feedforward + self.disturbance)
        self._last = output - feedforward
        return output


def nominal_of(model: Model) -> dict[str, float]:
    """Inertia and damping of an identified model, by the names of parameters."""
    damping = next((p.value for p in model.parameters() if p.name == "viscous.coefficient"), 0.0)
    return {"inertia": model.total_inertia, "damping": damping}


def _build(values: dict[str, float], limit: float) -> DisturbanceObserver:
    return DisturbanceObserver(
        gains_from(values), values["inertia"], values["damping"], values["observer_time"], values["dead_zone"], limit
    )


def _gains(basis: Basis) -> dict[str, float]:
    nominal = nominal_of(basis.model)
    # A softer inner loop would leave the observer more of the margins, and more action against a constant force; but the loop
    # then bears less of what the model doesn't have: on the geared axis of fric compete it hunts in the backlash.
    base = {**basis.pid, "integral": 0.0, **nominal, "dead_zone": basis.dead_zone if basis.calm > 0 else 0.0}
    slowest = 30.0 / basis.crossover
    bandwidth = basis.largest(lambda value: {**base, "observer_time": 1.0 / value}, 1.0 / slowest, 10.0 * basis.crossover)
    return {**base, "observer_time": 1.0 / bandwidth}


def _linear(values: Mapping[str, float], period: float) -> list[Polynomials]:
    """U (1 - Q/z) = (C + J s^2 Q + B s Q) e, of which everything is as :class:`Filtered` computes it."""
    time = values["observer_time"]
    (inner,) = linear_pid(values, period)
    lag = np.array([time + period, -time])
    difference, low = np.array([1.0, -1.0]), np.array([period, 0.0])
    square = np.polymul(lag, lag)
    observed: Array = np.asarray(values["inertia"] * np.polymul(difference, difference))
    observed = np.asarray(np.polyadd(observed, values["damping"] * np.polymul(difference, low)))
    top, bottom = added([inner, (np.asarray(observed), np.asarray(square))])
    # 1/(1 - Q/z) = z lag^2/(z lag^2 - low^2), of which low^2 = h^2 z^2.
    filtered = np.polymul([1.0, 0.0], square)
    return [(np.asarray(np.polymul(top, filtered)), np.asarray(np.polymul(bottom, np.polysub(filtered, np.polymul(low, low)))))]


CONTROLLER = Controller(
    id="disturbance_observer",
    title="PID controller with a disturbance observer",
    parameters=(
        *PID_PARAMETERS,
        Parameter("inertia", "J", "F s^2/x", "nominal inertia", positive=True),
        Parameter("damping", "B", "F s/x", "nominal viscous damping", lower=0.0, default=0.0),
        Parameter("observer_time", "T_q", "s", "time constant of the observer's filter", positive=True),
        Parameter("dead_zone", "e_d", "x", "error below which the estimate is held at rest", lower=0.0, default=0.0),
    ),
    build=lambda values, limit: _build(dict(values), limit),
    source="Ohnishi 1987; Umeno, Kaneko, Hori 1993",
    from_model=nominal_of,
    tunable=Tunable(_gains, _linear),
)
