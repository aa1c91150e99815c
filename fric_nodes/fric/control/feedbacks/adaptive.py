"""PID with friction that is identified in the loop and compensated along the reference.

Equation. The nominal axis behind the filter Q of :mod:`.disturbance_observer` gives, without a second difference, the force
that neither inertia nor feedforward explains,

    d = Q(s) [u_f + J s^2 e],    u_f = u - f - c_m J a,

which is friction: d = F_C Q sgn(v) + F_v Q v + b. Recursive least squares with forgetting finds F_C, F_v and b:

    K = P x / (lambda + x' P x),  theta = theta + K (d - x' theta),  P = (P - K x' P) / lambda,   lambda = exp(-h/T),

only while the axis is excited: the filtered speed has been above ``slow`` for four filter times, the output wasn't limited,
and the residual is above ``noise`` (dead zone). Otherwise everything is frozen, P too, so that nothing drifts and P doesn't
wind up. P is bounded by its start. theta is projected onto 0 <= F_C <= ``most_coulomb``, 0 <= F_v <= ``most_viscous``, |b| <=
``most_coulomb``.

Where the identified friction is larger near standstill, by the share r of F_C below the velocity v_S, its curve counts as a
whole: sgn(v) stands for sgn(v) (1 + r exp(-(v/v_S)^2)), and F_C scales all of it.

What is compensated, F = F_C s(w) + F_v w + b + c_m J a along the reference's velocity w, foretold by ``preview``, follows theta
through a lag of ``smoothing``, so that a change makes no bump. s(w) is the same curve over w/(|w| + v_s), or, where
``stiffness`` s0 is given, the force of bristles of that level with the damping s1, which builds up over F_C/s0 after a
reversal. The output of the law is limited as a whole.
Source: Astrom and Wittenmark 1995, Adaptive Control, sections 2.2 and 11.5 (dead zone, projection, conditional updating);
Canudas de Wit, Astrom, Braun 1987 (adaptive friction compensation).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...engine.kernel import loop
from ...model import Model
from ...parameter import Parameter
from ...record import Array
from ..controller import Controller, Setpoint, check_inputs
from ..tunable import Basis, Tunable
from .disturbance_observer import Filtered
from .error_pid import PID_PARAMETERS, AroundPid, gains_from, linear_pid
from .friction_observer import Bristles
from .pid import PidGains

__all__ = ["CONTROLLER", "Adaptation", "Adaptive"]

_SETTLED = 4.0  # numerical: filter times after which a second-order lag has forgotten all but 9 %
_WIDE = 100.0  # statistical: variance of the start beside that of a residual of the Coulomb force's size


@loop
def learn(theta: Any, p: Any, x: Any, target: float, forget: float, most: Any, px: Any) -> None:
    """One step of recursive least squares, in place, with P bounded by ``most`` on its diagonal; ``px`` is room to work."""
    n = theta.shape[0]
    for i in range(n):
        px[i] = 0.0
        for j in range(n):
            px[i] += p[i, j] * x[j]
    denominator = forget
    residual = target
    for i in range(n):
        denominator += x[i] * px[i]
        residual -= x[i] * theta[i]
    for i in range(n):
        theta[i] += px[i] / denominator * residual
    grow = 1.0 / forget
    for i in range(n):
        if (p[i, i] - px[i] * px[i] / denominator) / forget > most[i]:
            grow = 1.0
    for i in range(n):
        for j in range(n):
            p[i, j] = (p[i, j] - px[i] * px[j] / denominator) * grow


@dataclass(frozen=True)
class Adaptation:
    """How the friction is learnt.

    Attributes:
        inertia: J [F s^2/x].
        inertia_share: c_m, share of the inertia force along the reference that this law adds [1].
        observer_time: of Q [s].
        memory: T, time over which motion counts [s].
        slow: filtered speed below which nothing is learnt [x/s].
        noise: residual below which nothing is learnt [F].
        most_coulomb: bound of F_C and of |b| [F].
        most_viscous: bound of F_v [F s/x].
        smoothing: of the compensation [s].
        stiffness: s0 of the bristles of what is compensated [F/x]; 0: a smooth sign.
        bristle_damping: s1 of them [F s/x].
        stribeck_share: r, of F_C, by which friction is larger near standstill [1].
        stribeck_velocity: v_S [x/s].
        preview: how much later than its stamp a command acts [s].
        coulomb: F_C at the start [F].
        viscous: F_v at the start [F s/x].
        bias: b at the start [F].
    """

    inertia: float
    inertia_share: float
    observer_time: float
    memory: float
    slow: float
    noise: float
    most_coulomb: float
    most_viscous: float
    smoothing: float
    stiffness: float = 0.0
    bristle_damping: float = 0.0
    stribeck_share: float = 0.0
    stribeck_velocity: float = 1.0
    preview: float = 0.0
    coulomb: float = 0.0
    viscous: float = 0.0
    bias: float = 0.0


class Adaptive(AroundPid):
    """The controller with its state.

    Args:
        gains: of the PID.
        adaptation: of the friction.
        limit: largest output [F].

    Attributes:
        theta: F_C [F], F_v [F s/x] and b [F] as learnt.
        used: the same as compensated now.
        learnt: number of samples from which something was learnt.
    """

    def __init__(self, gains: PidGains, adaptation: Adaptation, limit: float = math.inf) -> None:
        super().__init__(gains, limit)
        self.adaptation = adaptation
        time = adaptation.observer_time
        self._error, self._force, self._way = Filtered(time), Filtered(time), Filtered(time)
        self._sign = Filtered(time)
        force = max(adaptation.most_coulomb, 1e-300)
        speed = max(force / adaptation.most_viscous, adaptation.slow) if adaptation.most_viscous > 0.0 else adaptation.slow
        scale = np.array([1.0, 1.0 / max(speed, 1e-300), 1.0])
        self._most: Array = _WIDE * scale**2
        self._p = np.zeros((3, 3))
        self._x, self._work = np.zeros(3), np.zeros(3)
        self.theta, self.used = np.zeros(3), np.zeros(3)
        learn(np.zeros(3), np.eye(3), np.zeros(3), 0.0, 1.0, self._most, self._work)  # compiles before the loop runs
        self.reset()

    def reset(self) -> None:
        """Start anew, at rest, with the friction that was given."""
        start = self.adaptation
        self.pid.reset()
        self.theta[:] = start.coulomb, start.viscous, start.bias
        self.used[:] = self.theta
        self._p[:] = np.diag(self._most)
        for each in (self._error, self._force, self._way, self._sign):
            each.reset(0.0)
        self.learnt = 0
        self._last = self._moving = self._bent = 0.0
        self._begun = False

    def _curve(self, velocity: float) -> float:
        """Friction level over F_C at a velocity [1]."""
        start = self.adaptation
        return 1.0 + start.stribeck_share * math.exp(-((velocity / start.stribeck_velocity) ** 2))

    def _compensation(self, velocity: float, duration: float) -> float:
        start = self.adaptation
        level = float(self.used[0])
        if start.stiffness > 0.0 and level > 0.0:
            # Bristles of the learnt level, led on exactly along the reference.
            surplus = (1.0 + start.stribeck_share) * level
            bristles = Bristles(level, surplus, start.stribeck_velocity, start.stiffness, start.bristle_damping)
            if duration > 0.0:
                self._bent, dry = bristles.led(self._bent, velocity, 0.0, duration)
            else:
                dry = start.stiffness * self._bent
        else:
            dry = level * self._curve(velocity) * velocity / (abs(velocity) + 0.1 * start.slow) if velocity != 0.0 else 0.0
        return dry + float(self.used[1]) * velocity + float(self.used[2])

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None:
        """Start in motion, see :meth:`fric.control.controller.Law.begin`; what was learnt stays."""
        error, rate = wanted.position - state[0], wanted.velocity - state[1]
        start, ahead = self.adaptation, wanted.velocity + self.adaptation.preview * wanted.acceleration
        # Sliding for long where it moves.
        level = float(self.used[0]) * self._curve(ahead)
        self._bent = math.copysign(level / start.stiffness, ahead) if ahead != 0.0 and start.stiffness > 0.0 else 0.0
        extra = self._compensation(ahead, 0.0)
        self.pid.begin(wanted, state, force - extra, duration)
        self._error.reset(error - duration * rate, rate)
        self._way.reset(state[0] - duration * state[1], state[1])
        self._force.reset(force)
        self._sign.reset(math.copysign(self._curve(state[1]), state[1]) if state[1] != 0.0 else 0.0)
        self._last, self._moving, self._begun = force, 0.0, True

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """See :meth:`fric.control.controller.Law.answer`.

        Raises:
            ControlInputError: an input isn't finite, or the duration isn't positive; the state is left as it was.
        """
        check_inputs(wanted, measured, duration, feedforward)
        if not self._begun:
            self._error.reset(wanted.position - measured)
            self._way.reset(measured)
            self._begun = True
        self._observe(wanted, measured, duration)
        share = duration / (self.adaptation.smoothing + duration)
        self.used += share * (self.theta - self.used)
        known = feedforward + self.adaptation.inertia_share * self.adaptation.inertia * wanted.acceleration
        before = self.pid.saturated
        ahead = wanted.velocity + self.adaptation.preview * wanted.acceleration
        output = self.pid.step(wanted.position, measured, duration, known + self._compensation(ahead, duration))
        if self.pid.saturated != before:
            self._moving = 0.0
        self._last = output - known
        return output

    def _observe(self, wanted: Setpoint, measured: float, duration: float) -> None:
        """Take a sample into the filters, and learn from it where it tells something."""
        start = self.adaptation
        self._error.take(wanted.position - measured, duration)
        self._way.take(measured, duration)
        self._force.take(self._last, duration)
        speed = self._way.rate
        self._moving = self._moving + duration if abs(speed) > start.slow else 0.0
        self._sign.take(math.copysign(self._curve(speed), speed) if abs(speed) > start.slow else 0.0, duration)
        if self._moving < _SETTLED * start.observer_time:
            return
        target = self._force.value + start.inertia * self._error.bend
        self._x[:] = self._sign.value, speed, 1.0
        if abs(target - float(self._x @ self.theta)) <= start.noise:
            return
        learn(self.theta, self._p, self._x, target, math.exp(-duration / start.memory), self._most, self._work)
        most = start.most_coulomb
        self.theta[0] = min(max(self.theta[0], 0.0), most)
        self.theta[1] = min(max(self.theta[1], 0.0), start.most_viscous)
        self.theta[2] = min(max(self.theta[2], -most), most)
        self.learnt += 1


def _build(given: Mapping[str, float], limit: float) -> Adaptive:
    names = {each.name for each in PID_PARAMETERS}
    return Adaptive(gains_from(given), Adaptation(**{name: value for name, value in given.items() if name not in names}), limit)


def _start_of(model: Model) -> dict[str, float]:
    """Inertia and friction at the start, and bounds of five times the identified friction."""
    held = {parameter.name: parameter.value for parameter in model.parameters()}
    coulomb, viscous = held.get("coulomb.force", 0.0), held.get("viscous.coefficient", 0.0)
    return {
        "inertia": model.total_inertia,
        "coulomb": coulomb,
        "viscous": viscous,
        "bias": held.get("bias.force", 0.0),
        "most_coulomb": 5.0 * coulomb,
        "most_viscous": 5.0 * viscous,
        "stribeck_share": max(held.get("stribeck.force", 0.0), 0.0) / coulomb if coulomb > 0.0 else 0.0,
        "stribeck_velocity": held.get("stribeck.velocity", 1.0),
        "bristle_damping": held.get("presliding.damping", 0.0),
    }


def _gains(basis: Basis) -> dict[str, float]:
    time = 1.0 / basis.crossover
    start = _start_of(basis.model)
    # Slow is what the filter can't tell from standing: two steps of the encoder in its time, or four tenths of what the loop's
    # bandwidth makes of the error at which the proportional part overcomes friction.
    slow = max(2.0 * basis.resolution / time, 0.4 * basis.crossover * basis.coulomb / max(basis.pid["proportional"], 1e-300))
    integral = basis.pid["integral"] * 0.25**basis.calm
    own = {"inertia_share": 1.0, "observer_time": time, "memory": 1.0, "slow": slow, "noise": 0.02 * basis.coulomb}
    return {
        **basis.pid,
        **start,
        **own,
        "integral": integral,
        "smoothing": 0.1,
        "stiffness": basis.stuck,
        "preview": basis.plant.delay + 0.5 * basis.plant.period,
    }


CONTROLLER = Controller(
    id="adaptive",
    title="PID controller with friction identified in the loop",
    parameters=(
        *PID_PARAMETERS,
        Parameter("inertia", "J", "F s^2/x", "nominal inertia", positive=True),
        Parameter("inertia_share", "c_m", "1", "share of the inertia force that this law feeds forward", 0.0, 1.0, default=1.0),
        Parameter("observer_time", "T_q", "s", "time constant of the filter before the identification", positive=True),
        Parameter("memory", "T", "s", "time over which motion counts", positive=True, default=1.0),
        Parameter("slow", "v_d", "x/s", "filtered speed below which nothing is learnt", positive=True),
        Parameter("noise", "d_d", "F", "residual below which nothing is learnt", lower=0.0, default=0.0),
        Parameter("most_coulomb", "F_max", "F", "bound of Coulomb force and bias", lower=0.0),
        Parameter("most_viscous", "c_max", "F s/x", "bound of the viscous coefficient", lower=0.0, default=0.0),
        Parameter("smoothing", "T_s", "s", "lag of the compensation behind what is learnt", lower=0.0, default=0.1),
        Parameter(
            "stiffness", "s0", "F/x", "stiffness of the compensation's bristles; 0: a smooth sign", lower=0.0, default=0.0
        ),
        Parameter("bristle_damping", "s1", "F s/x", "damping of these bristles", lower=0.0, default=0.0),
        Parameter(
            "stribeck_share", "r", "1", "share of F_C by which friction is larger near standstill", lower=0.0, default=0.0
        ),
        Parameter("stribeck_velocity", "v_S", "x/s", "velocity over which that falls", positive=True, default=1.0),
        Parameter("preview", "T_a", "s", "how much later than its stamp a command acts", lower=0.0, default=0.0),
        Parameter("coulomb", "F_C", "F", "Coulomb force at the start", lower=0.0, default=0.0),
        Parameter("viscous", "F_v", "F s/x", "viscous coefficient at the start", lower=0.0, default=0.0),
        Parameter("bias", "b", "F", "constant force at the start", default=0.0),
    ),
    build=_build,
    source="Astrom and Wittenmark 1995, sections 2.2 and 11.5; Canudas de Wit, Astrom, Braun 1987",
    from_model=_start_of,
    tunable=Tunable(_gains, linear_pid),
)
