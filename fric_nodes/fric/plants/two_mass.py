"""Two-mass test bed: a motor, a transmission, and a load on its guideway, each as adjustable as the terms of the model.

Equations, with q the load's position and y the motor's:

    m_m d^2y/dt^2 = u - L - c_m dy/dt - F_m sgn(dy/dt),    m_l d^2q/dt^2 = L - F(q, v, t) - F_contact.

L is the force of the model's transmission terms (``backlash``, ``impact_backlash``, ``compliance``) over y - q; without any,
both are rigidly coupled. The friction of the terms is the load's, F_m and c_m are the motor's own. The command acts on the
motor, and the sensor sees the motor, or the load (``encoder: load`` in a model file); the other position is measured besides.
Stepped by :mod:`fric.engine.transmission`.
A fit from force and motion sees the sum of the masses only, so it holds the load's unless it is asked to free it.
Source: de Marchi 1998, mechanical positioning test bed (Walczyk and Craig 1991) with adjustable friction, backlash and
compliance; the equations are those of the usual two-mass model.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..engine.assembled import Inner, Surroundings
from ..engine.kernel import kernel
from ..engine.transmission import TRANSMISSION_FUNCTIONS, driven_step
from ..parameter import Parameter
from ..plant import Plant, Signal
from ..record import Array
from .rigid_driven import MOTOR_COULOMB, MOTOR_VISCOUS

__all__ = ["PLANT"]


@kernel
def step(p: Any, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    return driven_step(p, p[0], p[1], p[2], p[3], x, x_next, s, u, h, around)


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    dry = p[2] if v > 0.0 else (-p[2] if v < 0.0 else 0.0)
    return float((p[0] + p[1]) * a + p[3] * v + dry)


def _inertia(motor_mass: float, load_mass: float, motor_coulomb: float, motor_viscous: float) -> float:
    """The reduced mass: what a spring between both feels, and less than either."""
    return motor_mass * load_mass / (motor_mass + load_mass)


def _whole(motor_mass: float, load_mass: float, motor_coulomb: float, motor_viscous: float) -> float:
    return motor_mass + load_mass


def _motor(motor_mass: float, load_mass: float, motor_coulomb: float, motor_viscous: float) -> float:
    return motor_mass


def _initial(values: Array, position: float, velocity: float) -> Array:
    """Both together, in the middle of the play."""
    return np.array([position, velocity, position, velocity])


def _load_position(values: Array, states: Array, command: Array) -> Array:
    return states[:, 0]


def _motor_position(values: Array, states: Array, command: Array) -> Array:
    return states[:, 2]


def _deflection(values: Array, states: Array, command: Array) -> Array:
    result: Array = states[:, 2] - states[:, 0]
    return result


_TEST_BED = Plant(
    id="two_mass",
    title="two-mass test bed",
    equation="m_m d^2y/dt^2 = u - L - c_m dy/dt - F_m sgn(dy/dt), m_l dv/dt = L - F(q, v, t) - F_contact",
    source="de Marchi 1998, mechanical positioning test bed; stepped as derived in fric.engine.transmission",
    parameters=(
        Parameter("motor_mass", "m_m", "F s^2/x", "mass or moment of inertia of the motor", positive=True, linear=True),
        Parameter(
            "load_mass", "m_l", "F s^2/x", "mass or moment of inertia of the load", positive=True, linear=True, shape=True
        ),
        MOTOR_COULOMB,
        MOTOR_VISCOUS,
    ),
    states=("position", "velocity", "motor_position", "motor_velocity"),
    functions=(*TRANSMISSION_FUNCTIONS, step, drive),
    inertia=_inertia,
    encoder=(2, 3),
    whole=_whole,
    actuated=(2, 3),
    motor=_motor,
    initial=_initial,
    signals=(
        Signal("load_position", "x", "position of the load, behind the transmission", _load_position),
        Signal("deflection", "x", "motor's position minus the load's", _deflection),
    ),
)

_BEHIND = replace(
    _TEST_BED,
    encoder=(0, 1),
    signals=(
        Signal("motor_position", "x", "position of the motor, before the transmission", _motor_position),
        _TEST_BED.signals[1],
    ),
)

PLANT = replace(_TEST_BED, driven=_TEST_BED, behind=_BEHIND)
