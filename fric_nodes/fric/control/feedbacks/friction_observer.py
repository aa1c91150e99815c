"""PID with an observer of the LuGre state, whose friction force is compensated.

Equation, with the bristles' deflection z, the velocity v and the error e = r - y:

    dz/dt = v - s0 |v| z / g(v) + K e,    g(v) = F_C + (F_S - F_C) exp(-(v/v_S)^2),
    F     = s0 z + s1 dz/dt,
    u     = clip(C(e) + f + s F).

v is that of the reference where ``reference_share`` c is 1 and the measured one, filtered, where it is 0. With the measured
velocity friction is compensated where the axis really moves, and over-compensated friction is an unstable spring: K e, the
error's injection of Canudas de Wit et al., and the scale s < 1 keep it from a limit cycle. With the reference's there is no
such loop besides K e. The deflection's equation is linear in z over a sample and is led on exactly; z stays within F_S/s0, so
that the force is bounded whatever the inputs. Use it with a feedforward that holds no friction of its own (``terms: [viscous,
bias]``). Source: Canudas de Wit, Olsson, Astrom, Lischinsky 1995, section V (observer and its passivity condition).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...model import Model, ModelError
from ...parameter import Parameter
from ..controller import Controller, Setpoint, check_inputs
from ..tunable import Basis, Tunable
from .error_pid import PID_PARAMETERS, AroundPid, gains_from, linear_pid
from .pid import PidGains

__all__ = ["CONTROLLER", "Bristles", "FrictionObserver", "bristles_of"]


@dataclass(frozen=True)
class Bristles:
    """A LuGre law.

    Attributes:
        coulomb: F_C [F].
        static: F_S [F].
        stribeck: v_S [x/s].
        stiffness: s0 [F/x].
        damping: s1 [F s/x].
    """

    coulomb: float
    static: float
    stribeck: float
    stiffness: float
    damping: float = 0.0

    def level(self, velocity: float) -> float:
        """g(v) [F]."""
        return self.coulomb + (self.static - self.coulomb) * math.exp(-((velocity / self.stribeck) ** 2))

    def led(self, z: float, velocity: float, injected: float, duration: float) -> tuple[float, float]:
        """Deflection after ``duration`` [s] at this velocity and injection [x/s], and mean friction force meanwhile [F]."""
        rate = self.stiffness * abs(velocity) / self.level(velocity)
        drive = velocity + injected
        most = max(self.static, self.coulomb) / self.stiffness
        if rate * duration > 1e-6:  # numerical: where 1 - exp cancels, the limit below is exact to 1e-6
            end = drive / rate
            z_next = end + (z - end) * math.exp(-rate * duration)
        else:
            z_next = z + duration * (drive - rate * z)
        z_next = min(max(z_next, -most), most)
        force = 0.5 * self.stiffness * (z + z_next) + self.damping * (z_next - z) / duration
        bound = max(self.static, self.coulomb)
        return z_next, min(max(force, -bound), bound)


class FrictionObserver(AroundPid):
    """The controller with its state.

    Args:
        gains: of the PID.
        bristles: of the friction.
        injection: K [1/s].
        scale: s [1].
        reference_share: c [1].
        velocity_filter: time constant of the measured velocity's filter [s].
        limit: largest output [F].

    Attributes:
        deflection: z [x].
        friction: F [F].
    """

    def __init__(
        self,
        gains: PidGains,
        bristles: Bristles,
        injection: float = 0.0,
        scale: float = 1.0,
        reference_share: float = 1.0,
        velocity_filter: float = 0.0,
        limit: float = math.inf,
    ) -> None:
        super().__init__(gains, limit)
        self.bristles = bristles
        self._injection, self._scale, self._share, self._filter = injection, scale, reference_share, velocity_filter
        self.reset()

    def reset(self) -> None:
        """Start anew, at rest with relaxed bristles."""
        self.pid.reset()
        self.deflection = self.friction = 0.0
        self._velocity = 0.0
        self._before: float | None = None

    def begin(self, wanted: Setpoint, state: tuple[float, float], force: float, duration: float) -> None:
        """Start in motion, see :meth:`fric.control.controller.Law.begin`: sliding for long where it moves."""
        self.reset()
        self._velocity, self._before = state[1], state[0] - duration * state[1]
        moves = self._share * wanted.velocity + (1.0 - self._share) * state[1]
        self.deflection = math.copysign(self.bristles.level(moves) / self.bristles.stiffness, moves) if moves != 0.0 else 0.0
        self.friction = self.bristles.stiffness * self.deflection
        self.pid.begin(wanted, state, force - self._scale * self.friction, duration)

    def answer(self, wanted: Setpoint, measured: float, duration: float, feedforward: float = 0.0) -> float:
        """See :meth:`fric.control.controller.Law.answer`.

        Raises:
            ControlInputError: an input isn't finite, or the duration isn't positive; the state is left as it was.
        """
        check_inputs(wanted, measured, duration, feedforward)
        before = measured if self._before is None else self._before
        self._before = measured
        self._velocity = (self._filter * self._velocity + measured - before) / (self._filter + duration)
        velocity = self._share * wanted.velocity + (1.0 - self._share) * self._velocity
        injected = self._injection * (wanted.position - measured)
        self.deflection, self.friction = self.bristles.led(self.deflection, velocity, injected, duration)
        return self.pid.step(wanted.position, measured, duration, feedforward + self._scale * self.friction)


def bristles_of(model: Model) -> dict[str, float]:
    """Coulomb and static force, Stribeck velocity, stiffness and damping of a model's pre-sliding term, by parameter.

    Raises:
        ModelError: the model has no Coulomb force or no pre-sliding term with a stiffness.
    """
    held = {parameter.name: parameter.value for parameter in model.parameters()}
    springs = [value for name, value in held.items() if name.startswith("presliding.stiffness")]
    if not springs or "coulomb.force" not in held:
        raise ModelError("model", "has no Coulomb force, or no pre-sliding term with a stiffness", "give sigma0 and sigma1")
    coulomb = held["coulomb.force"]
    return {
        "coulomb": coulomb,
        "static": coulomb + max(held.get("stribeck.force", 0.0), 0.0),
        "stribeck": held.get("stribeck.velocity", 1.0),
        "stiffness": sum(springs),
        "bristle_damping": held.get("presliding.damping", 0.0),
    }


def _build(given: dict[str, float], limit: float) -> FrictionObserver:
    bristles = Bristles(
        given["coulomb"],
        max(given["static"], given["coulomb"]),
        given["stribeck"],
        given["stiffness"],
        given["bristle_damping"],
    )
    return FrictionObserver(
        gains_from(given),
        bristles,
        given["injection"],
        given["scale"],
        given["reference_share"],
        given["velocity_filter"],
        limit,
    )


def _gains(basis: Basis) -> dict[str, float]:
    held = {parameter.name: parameter.value for parameter in basis.model.parameters()}
    if basis.stuck > 0.0:
        bristles = bristles_of(basis.model)
    else:
        # Rigid friction: bristles that give way by twice the encoder's step, or by what the loop can't resolve.
        way = max(2.0 * basis.resolution, 0.01 * basis.coulomb / basis.pid["proportional"])
        bristles = {
            "coulomb": basis.coulomb,
            "static": basis.coulomb + max(held.get("stribeck.force", 0.0), 0.0),
            "stribeck": held.get("stribeck.velocity", 1.0),
            "stiffness": basis.coulomb / way,
            "bristle_damping": 0.0,
        }
    integral = basis.pid["integral"] * 0.25**basis.calm
    rest = {"injection": 0.0, "scale": 1.0, "reference_share": 1.0, "velocity_filter": 0.0}
    return {**basis.pid, "integral": integral, **bristles, **rest}


CONTROLLER = Controller(
    id="friction_observer",
    title="PID controller with an observer of the LuGre state",
    parameters=(
        *PID_PARAMETERS,
        Parameter("coulomb", "F_C", "F", "Coulomb force", positive=True),
        Parameter("static", "F_S", "F", "static friction force; at least the Coulomb force", lower=0.0, default=0.0),
        Parameter("stribeck", "v_S", "x/s", "Stribeck velocity", positive=True, default=1.0),
        Parameter("stiffness", "s0", "F/x", "stiffness of the bristles", positive=True),
        Parameter("bristle_damping", "s1", "F s/x", "damping of the bristles", lower=0.0, default=0.0),
        Parameter("injection", "K", "1/s", "injection of the error into the deflection", lower=0.0, default=0.0),
        Parameter("scale", "s", "1", "share of the observed friction that is compensated", 0.0, 1.0, default=1.0),
        Parameter("reference_share", "c", "1", "share of the reference's velocity, beside the measured", 0.0, 1.0, default=1.0),
        Parameter("velocity_filter", "T_v", "s", "time constant of the measured velocity's filter", lower=0.0, default=0.0),
    ),
    build=lambda values, limit: _build(dict(values), limit),
    source="Canudas de Wit, Olsson, Astrom, Lischinsky 1995, section V",
    from_model=bristles_of,
    tunable=Tunable(_gains, linear_pid),
)
