"""Pendulum under internal P and D feedback, which gives a system without stiffness a free oscillation.

Equation: J dv/dt = u - P q - D v - G sin(q) - F(q, v, t) - F_contact, with the angle q from where it hangs and the torque
G = m g l of its weight (0 for a balanced rotor). The feedback P, D belongs to the plant; the command is the torque besides.
This is de Marchi's parametric harmonic oscillation. Asymmetric kinetic and viscous friction are the terms ``coulomb``,
``viscous`` and ``asymmetry``.

Without u the angle oscillates freely with k = P + G (small angles) and c = D + F_v about a resting place that friction shifts.
With x_k = f_k/k, mean and half difference of both directions as ``coulomb`` and ``asymmetry`` have them, and
exp(-pi beta), pi beta = pi zeta/sqrt(1 - zeta^2) for the direction of the swing, one turning point x follows from the last:

    x_n + x_(n-1) exp(-pi beta) = -(1 + exp(-pi beta)) (Dx_k + d mean(x_k)),   d = +1 for a swing upwards, -1 downwards.

Read from the printed slides: the decrement per half swing is exp(-pi beta) (printed once as exp(-n pi beta)) with
pi beta = pi s/w_d (printed without pi); y = x + Dx_k + mean(x_k) sgn(dx/dt) (mean and difference are exchanged in the print);
the two estimates of x_k there lack a minus sign against the relation above, which stands beside them. P_i is a torque per
angle, N m/rad (printed N m s^2). The table's k_i and c_i belong to the measured w_0 with J = k_i/w_0^2 = 0.01161 N m s^2 in
all four data sets, and c_i = 2 J zeta w_0, Dc_i likewise (Dzeta of data set 2 is then 0.0036, as estimated, and not 0.0086);
the 5.58e-4 N m s stated for the inertia is about a twentieth of that.

Step: :mod:`fric.engine.contact`, with the mean torque of spring and weight along the step, for the weight
G (cos q_0 - cos q_1)/(q_1 - q_0), so that neither gains or loses energy, whatever the step.
Source: de Marchi 1998, parametric harmonic oscillation and asymmetric friction identification.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..effect import Context
from ..engine.assembled import Inner, Surroundings
from ..engine.contact import CONTACT_FUNCTIONS, contact_step
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..plant import Plant
from ..record import Array

__all__ = ["PLANT"]


@kernel
def own(c: Context, p: Any) -> float:
    reach = 0.5 * c.velocity * c.step
    r = reach * reach
    mean = 1.0 - r * (1.0 / 6.0 - r * (1.0 / 120.0 - r / 5040.0)) if r < 0.01 else math.sin(reach) / reach
    return float(p[1] * c.position + p[2] * c.velocity + p[3] * math.sin(c.position) * mean)


@kernel
def step(p: Any, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    return contact_step(p, p[0], x, x_next, s, u, h, around)


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    return float(p[0] * a + p[1] * q + p[2] * v + p[3] * math.sin(q))


def _inertia(inertia: float, *others: float) -> float:
    return inertia


def _rate(inertia: float, proportional: float, derivative: float, gravity: float, start: float) -> float:
    """Of its oscillation, and of the damping that the feedback gives."""
    return math.sqrt((proportional + gravity) / inertia) + 0.5 * derivative / inertia


def _initial(values: Array, position: float, velocity: float) -> Array:
    if position == 0.0 and velocity == 0.0:
        position = float(values[4])
    return np.array([position, velocity])


PLANT = Plant(
    id="pendulum",
    title="pendulum under P and D feedback",
    equation="J dv/dt = u - P q - D v - G sin(q) - F(q, v, t) - F_contact",
    source="de Marchi 1998, parametric harmonic oscillation",
    parameters=(
        Parameter("inertia", "J", "F s^2/x", "moment of inertia", positive=True, linear=True),
        Parameter(
            "proportional", "P", "F/x", "internal position feedback, torque per angle", lower=0.0, default=0.0, linear=True
        ),
        Parameter("derivative", "D", "F s/x", "internal velocity feedback", lower=0.0, default=0.0, linear=True),
        Parameter("gravity", "G", "F", "torque m g l of the weight at 90 deg", lower=0.0, default=0.0, linear=True),
        Parameter("start", "q_0", "x", "angle that a run starts from when it isn't given another", default=0.0, shape=True),
    ),
    states=("position", "velocity"),
    functions=(own, *CONTACT_FUNCTIONS, step, drive),
    inertia=_inertia,
    initial=_initial,
    rate=_rate,
)
