"""Rigid axis behind a transmission: its mass in two parts, of which the sensor sees the motor's, or the load's.

Equations: m_m d^2y/dt^2 = u - L - c_m dy/dt - F_m sgn(dy/dt), m_l d^2q/dt^2 = L - F(q, v, t) - F_contact, with m_l = s m,
m_m = (1 - s) m, and L the force of the model's transmission terms over y - q; stepped by :mod:`fric.engine.transmission`. It
takes the rigid axis's place as soon as a model of it gets backlash or compliance, so that a model can grow by them; the share s
of the mass that lies behind the transmission is held at its value unless a fit is asked to free it. The terms' friction F is
the load's; F_m and c_m are the motor's own, none unless they are given. The command acts on the motor. An encoder on its shaft
gives y; a scale on the guideway, or an encoder behind a gear, gives q (``encoder: load`` in a model file).
Source: Newton; the two-mass model of a drive.
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

__all__ = ["BEHIND", "DRIVEN", "MOTOR_COULOMB", "MOTOR_VISCOUS"]


@kernel
def step(p: Any, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    return driven_step(p, p[0] * (1.0 - p[1]), p[0] * p[1], p[2], p[3], x, x_next, s, u, h, around)


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    dry = p[2] if v > 0.0 else (-p[2] if v < 0.0 else 0.0)
    return float(p[0] * a + p[3] * v + dry)


def _inertia(mass: float, load_share: float, motor_coulomb: float, motor_viscous: float) -> float:
    """The reduced mass: what a spring between both feels, and less than either."""
    return mass * load_share * (1.0 - load_share)


def _whole(mass: float, load_share: float, motor_coulomb: float, motor_viscous: float) -> float:
    return mass


def _motor(mass: float, load_share: float, motor_coulomb: float, motor_viscous: float) -> float:
    return mass * (1.0 - load_share)


def _initial(values: Array, position: float, velocity: float) -> Array:
    """Both together, in the middle of the play."""
    return np.array([position, velocity, position, velocity])


def _load_position(values: Array, states: Array, command: Array) -> Array:
    return states[:, 0]


def _motor_position(values: Array, states: Array, command: Array) -> Array:
    return states[:, 2]


MOTOR_COULOMB = Parameter("motor_coulomb", "F_m", "F", "Coulomb friction of the motor itself", 0.0, default=0.0, linear=True)
MOTOR_VISCOUS = Parameter(
    "motor_viscous", "c_m", "F s/x", "viscous friction of the motor itself", 0.0, default=0.0, linear=True
)

DRIVEN = Plant(
    id="rigid",
    title="rigid axis behind a transmission",
    equation="m_m d^2y/dt^2 = u - L - c_m dy/dt - F_m sgn(dy/dt), m_l dv/dt = L - F(q, v, t) - F_contact",
    source="Newton; the two-mass model of a drive, stepped as derived in fric.engine.transmission",
    parameters=(
        Parameter("mass", "m", "F s^2/x", "moving mass, or moment of inertia of a rotary axis", positive=True, linear=True),
        Parameter(
            "load_share", "s", "1", "share of the mass that lies behind the transmission", 0.001, 0.999, default=0.5, shape=True
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
    signals=(Signal("load_position", "x", "position of the load, behind the transmission", _load_position),),
)

BEHIND = replace(
    DRIVEN,
    title="rigid axis behind a transmission, measured on the load",
    encoder=(0, 1),
    signals=(Signal("motor_position", "x", "position of the motor, before the transmission", _motor_position),),
)
