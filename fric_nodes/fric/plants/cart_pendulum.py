"""Cart with an inverted pendulum: the cart on its guideway with the friction of the terms, the pole on a viscous pivot.

Equations, with the angle a from upright, positive towards +q, J_t = J + m l^2:

    (M + m) dv/dt + m l (da2 cos a - w^2 sin a) = u - F(q, v, t) - F_contact,       w = da/dt, da2 = dw/dt
    J_t da2 + m l dv/dt cos a - m g l sin a = -c w.

Step (Strang splitting, symmetric and of second order). Half a step of the pole alone, while the cart's acceleration is zero:
J_t dw/dt = m g l sin a - c w, by one classic Runge-Kutta step. The cart's whole step with the angle held: eliminating da2,

    (M + m - (m l cos a)^2/J_t) dv/dt = u - F - F_contact + m l w^2 sin a - (m l cos a/J_t) (m g l sin a - c w),
    dw = -(m l cos a/J_t) dv    (beside what the pole's half steps do),

which is one body of the mass in brackets under a force that depends on v through w: :mod:`fric.engine.contact` leads it,
exact in its sticking, with w = w_0 - (m l cos a/J_t)(v - v_0) at the mean velocity. Half a step of the pole. While the cart
sticks, the pole swings about a fixed pivot, and its reaction is what friction has to hold. Energy isn't kept exactly, but
oscillates within the square of the step without drifting off.

The force that a motion of the cart needs is given for a pole that doesn't swing, since its angle isn't part of a recorded axis;
a fit holds the pole's parameters.
Source: de Marchi 1998, linear inverted pendulum (Tuefekci, de Marchi, Craig 1998); the equations are Lagrange's for it.
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
from ..plant import Plant, Signal
from ..record import Array

__all__ = ["PLANT"]


@kernel
def own(c: Context, p: Any) -> float:
    """Reaction of the pole on the cart; :func:`step` has put its state behind the model's values."""
    sine, share, lever, w_0, v_0, weight = p[-6:]
    w = w_0 - share * (c.velocity - v_0)
    return float(share * (weight * sine - p[5] * w) - lever * w * w * sine)


@kernel
def pole(p: Any, a: float, w: float, h: float) -> tuple[float, float]:
    """Angle and rate of the pole after ``h`` [s] while the cart doesn't accelerate."""
    total = p[3] + p[1] * p[2] * p[2]
    pull = p[1] * p[2] * p[4] / total
    brake = p[5] / total
    w_1 = pull * math.sin(a) - brake * w
    a_2 = w + 0.5 * h * w_1
    w_2 = pull * math.sin(a + 0.5 * h * w) - brake * a_2
    a_3 = w + 0.5 * h * w_2
    w_3 = pull * math.sin(a + 0.5 * h * a_2) - brake * a_3
    a_4 = w + h * w_3
    w_4 = pull * math.sin(a + h * a_3) - brake * a_4
    return a + h / 6.0 * (w + 2.0 * (a_2 + a_3) + a_4), w + h / 6.0 * (w_1 + 2.0 * (w_2 + w_3) + w_4)


@kernel
def step(p: Any, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    a, w = pole(p, x[2], x[3], 0.5 * h)
    lever = p[1] * p[2]
    share = lever * math.cos(a) / (p[3] + lever * p[2])
    mass = p[0] + p[1] - lever * math.cos(a) * share
    v = x[1]
    held = (*p, math.sin(a), share, lever, w, v, lever * p[4])
    friction = contact_step(held, mass, x, x_next, s, u, h, around)
    w -= share * (x_next[1] - v)
    x_next[2], x_next[3] = pole(p, a, w, 0.5 * h)
    return friction


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    return float((p[0] + p[1]) * a)


def _inertia(cart_mass: float, pole_mass: float, length: float, pole_inertia: float, *others: float) -> float:
    """What the cart feels while the pole is upright or hangs: it is least there."""
    return cart_mass + pole_mass - (pole_mass * length) ** 2 / (pole_inertia + pole_mass * length**2)


def _rate(cart_mass: float, pole_mass: float, length: float, pole_inertia: float, gravity: float, *others: float) -> float:
    """Twice that of the hanging pole on the free cart, since it swings through there."""
    lever = pole_mass * length
    total = pole_inertia + lever * length
    return 2.0 * math.sqrt(lever * gravity / (total - lever * lever / (cart_mass + pole_mass)))


def _initial(values: Array, position: float, velocity: float) -> Array:
    return np.array([position, velocity, values[6], 0.0])


def _state(number: int) -> Any:
    return lambda values, states, command: states[:, number]


PLANT = Plant(
    id="cart_pendulum",
    title="cart with an inverted pendulum",
    equation="(M + m) dv/dt + m l (dw/dt cos a - w^2 sin a) = u - F(q, v, t) - F_contact",
    source="de Marchi 1998, linear inverted pendulum; Lagrange",
    parameters=(
        Parameter("cart_mass", "M", "F s^2/x", "mass of the cart", positive=True, linear=True),
        Parameter("pole_mass", "m", "F s^2/x", "mass of the pole", positive=True, linear=True, shape=True),
        Parameter("length", "l", "x", "from pivot to the pole's centre of mass", positive=True, shape=True),
        Parameter(
            "pole_inertia", "J", "F s^2 x", "moment of inertia of the pole about its centre of mass", lower=0.0, shape=True
        ),
        Parameter("gravity", "g", "x/s^2", "gravitational acceleration", 0.0, 100.0, default=9.81, shape=True),
        Parameter(
            "pivot_damping", "c", "F s x", "viscous friction of the pivot, torque per angular rate", lower=0.0, default=0.0
        ),
        Parameter(
            "start", "a_0", "1", "angle of the pole from upright at the start [rad]", -10.0, 10.0, default=0.0, shape=True
        ),
    ),
    states=("position", "velocity", "pole_angle", "pole_rate"),
    functions=(own, *CONTACT_FUNCTIONS, pole, step, drive),
    inertia=_inertia,
    initial=_initial,
    signals=(
        Signal("pole_angle", "1", "angle of the pole from upright [rad]", _state(2)),
        Signal("pole_rate", "1/s", "angular rate of the pole [rad/s]", _state(3)),
    ),
    rate=_rate,
)
