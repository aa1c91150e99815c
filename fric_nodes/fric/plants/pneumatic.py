"""Servo-pneumatic cylinder: a piston between two chambers of air that a 5/3 proportional valve fills and empties.

Equations (numbers of Szell; x from 0 to the stroke l, p_a pushes towards positive x):

    m v' = A (p_a - p_b) - F_fric                                                                                      (12)
    p_a' = kappa (R T m_a' - A v p_a) / (V_0 + A x)                                                                    (13)
    p_b' = kappa (R T m_b' + A v p_b) / (V_0 + A (l - x))                                                              (14)
    m_a' = flow from the supply minus flow to the exhaust, m_b' alike                                              (15, 16)
    flow = alpha A_v p_n psi(p_m/p_n) sqrt(2/(R T)),  p_n upstream, p_m downstream                                 (21, 22)
    psi(r) = sqrt(kappa/(kappa-1) (r^(2/kappa) - r^((kappa+1)/kappa)))   for r > r* = (2/(kappa+1))^(kappa/(kappa-1))
             psi(r*)                                                     for r <= r*, where the flow is choked

The command u in [-1, 1] is the valve's opening (its voltage over the voltage that opens it fully). u > 0 joins chamber a to the
supply and b to the exhaust, u < 0 the other way round. An edge opens when |u| goes beyond its overlap c and then in proportion,
A_v (|u| - c)/(1 - c). The supply edges have more overlap than the exhaust edges, so a small constant u fills one chamber slowly
through a nearly closed edge while the other is open to the exhaust, as in the experiment.

Read from the printed equations: Eqs. 19 and 20 lack the factor kappa that Eqs. 13 and 14 give, a_32 = -kappa A p_a/(V_0 + A x)
and a_42 = kappa A p_b/(V_0 + A (l - x)); their signs are right. Eqs. 21 and 22 print psi(p_n/p_m), with p_n called upstream:
psi takes the ratio that is below 1. As they stand they also hold for inflow to a and outflow from b only, where A_v counts as
proportional to u.
psi has an infinite slope at r = 1. There a real restriction is laminar: for r > 0.999 psi goes to 0 in a straight line.

Ends of the stroke: a piston that would go beyond stops there, plastically, and stays until it is pushed back. While it is
pressed against an end the friction reported is that of a piston that would slide on, since wall and friction can't be told
apart.

Not in the paper, chosen here for the DSNU-20-100 (the defaults): piston area pi/4 (20 mm)^2 on both sides (the paper has one A;
the 8 mm rod would take 16 % from side b); mass 0.102 kg, which Eqs. 24 and 26 agree on (F_S/(m v_1) and F_C/(m v_1) with
v_1 = 0.05/999 m/s, the innermost of 1000 velocities, give 0.1020 and 0.1021 kg); dead volume 1 cm^3, the valve at the port;
293 K; supply 7 bar and exhaust 1.013 bar absolute; alpha A_v = 1.6 mm^2, of a valve for 100 l/min; overlaps 2 % and 0.

Step: Strang splitting. Half a step of the pressures, the piston gliding on at its velocity; the piston's whole step under the
force that they then give, exact in its sticking (:mod:`fric.engine.contact`); half a step of the pressures. The half
steps are split into as many classic Runge-Kutta steps as the flow at small pressure differences needs.
Source: Szell, Eqs. 12-22; psi as in any textbook of pneumatics, e.g. Beater, Pneumatic Drives, 2007.
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
    return 0.0


@kernel
def psi(ratio: float, kappa: float) -> float:
    """Flow function of the pressure ratio downstream over upstream, 0 to 1."""
    critical = (2.0 / (kappa + 1.0)) ** (kappa / (kappa - 1.0))
    laminar = 0.999
    r = min(max(ratio, critical), laminar)
    value = math.sqrt(kappa / (kappa - 1.0) * (r ** (2.0 / kappa) - r ** ((kappa + 1.0) / kappa)))
    return float(value if ratio <= laminar else value * (1.0 - ratio) / (1.0 - laminar))


@kernel
def flow(p: Any, area: float, high: float, low: float) -> float:
    """R T times the mass flow [F x/s] through ``area`` from the pressure ``high`` to ``low``; negative when it goes back."""
    if area == 0.0:
        return 0.0
    root = math.sqrt(2.0 * p[5] * p[6])
    if high >= low:
        return float(area * high * root * psi(low / high, p[4]))
    return float(-area * low * root * psi(high / low, p[4]))


@kernel
def opening(u: float, overlap: float) -> float:
    """Share of the full area at which an edge is open under the command ``u``."""
    return max(min(abs(u), 1.0) - overlap, 0.0) / (1.0 - overlap)


@kernel
def pressure_rates(p: Any, u: float, x: float, v: float, p_a: float, p_b: float) -> tuple[float, float]:
    """Time derivatives of the two pressures."""
    filling, emptying = p[7] * opening(u, p[8]), p[7] * opening(u, p[9])
    if u >= 0.0:
        into_a = flow(p, filling, p[10], p_a)
        into_b = -flow(p, emptying, p_b, p[11])
    else:
        into_a = -flow(p, emptying, p_a, p[11])
        into_b = flow(p, filling, p[10], p_b)
    # Gliding on for half a step the piston may go beyond an end; a twentieth of the dead volume stays in the chamber.
    rate_a = p[4] * (into_a - p[1] * v * p_a) / max(p[3] + p[1] * x, 0.05 * p[3])
    rate_b = p[4] * (into_b + p[1] * v * p_b) / max(p[3] + p[1] * (p[2] - x), 0.05 * p[3])
    return rate_a, rate_b


@kernel
def pressures(p: Any, x: Any, x_0: float, v: float, u: float, h: float) -> None:
    """Lead the pressures ``x[2]``, ``x[3]`` over ``h`` [s], while the piston glides on from ``x_0`` at the velocity ``v``."""
    x_1 = x_0 + h * v
    end = min(x_0, p[2] - x_0, x_1, p[2] - x_1)
    # Fastest: an edge at a pressure ratio near 1, where psi rises by 31.6 per ratio, and the piston near an end.
    widest = p[7] * max(opening(u, p[8]), opening(u, p[9]))
    rate = p[4] * (31.6 * widest * math.sqrt(2.0 * p[5] * p[6]) + p[1] * abs(v)) / max(p[3] + p[1] * end, 0.05 * p[3])
    n = int(h * rate / 0.5) + 1
    h_n = h / n
    p_a, p_b = x[2], x[3]
    for k in range(n):
        at = x_0 + k * h_n * v
        middle = at + 0.5 * h_n * v
        a_1, b_1 = pressure_rates(p, u, at, v, p_a, p_b)
        a_2, b_2 = pressure_rates(p, u, middle, v, p_a + 0.5 * h_n * a_1, p_b + 0.5 * h_n * b_1)
        a_3, b_3 = pressure_rates(p, u, middle, v, p_a + 0.5 * h_n * a_2, p_b + 0.5 * h_n * b_2)
        a_4, b_4 = pressure_rates(p, u, at + h_n * v, v, p_a + h_n * a_3, p_b + h_n * b_3)
        p_a += h_n / 6.0 * (a_1 + 2.0 * (a_2 + a_3) + a_4)
        p_b += h_n / 6.0 * (b_1 + 2.0 * (b_2 + b_3) + b_4)
    x[2] = p_a
    x[3] = p_b


@kernel
def step(p: Any, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    half = 0.5 * h
    middle = x[0] + half * x[1]
    pressures(p, x, x[0], x[1], u, half)
    friction = contact_step(p, p[0], x, x_next, s, p[1] * (x[2] - x[3]), h, around)
    if x_next[0] < 0.0:
        x_next[0] = 0.0
        x_next[1] = max(x_next[1], 0.0)
    elif x_next[0] > p[2]:
        x_next[0] = p[2]
        x_next[1] = min(x_next[1], 0.0)
    x_next[2] = x[2]
    x_next[3] = x[3]
    # Its new velocity leads from the middle to the new position; at an end of the stroke, what is left of the way does.
    pressures(p, x_next, middle, (x_next[0] - middle) / half, u, half)
    return friction


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    return float(p[0] * a)


def _inertia(mass: float, *others: float) -> float:
    return mass


def _rate(
    mass: float, area: float, stroke: float, dead_volume: float, heat_ratio: float, _r: float, _t: float, *valve: float
) -> float:
    """Of the piston at mid-stroke on air at the pressure of the supply, the stiffest that it meets but near the ends."""
    supply = valve[3]
    stiffness = 2.0 * heat_ratio * supply * area * area / (dead_volume + 0.5 * area * stroke)
    return math.sqrt(stiffness / mass)


def _initial(values: Array, position: float, velocity: float) -> Array:
    """Both chambers at the pressure of the exhaust."""
    return np.array([min(max(position, 0.0), values[2]), velocity, values[11], values[11]])


def _force(values: Array, states: Array, command: Array) -> Array:
    result: Array = values[1] * (states[:, 2] - states[:, 3])
    return result


def _state(number: int) -> Any:
    return lambda values, states, command: states[:, number]


def _positive(name: str, symbol: str, dimension: str, doc: str, default: float, lower: float = 0.0) -> Parameter:
    return Parameter(name, symbol, dimension, doc, default=default, positive=True, lower=lower)


PLANT = Plant(
    id="pneumatic",
    title="servo-pneumatic cylinder",
    equation="m v' = A (p_a - p_b) - F(q, v, t) - F_contact",
    source="Szell, Eqs. 12-22",
    parameters=(
        Parameter("mass", "m", "F s^2/x", "mass of piston, rod and sensor", default=0.102, positive=True, linear=True),
        _positive("area", "A", "x^2", "surface of the piston, on both sides", 3.14159e-4),
        _positive("stroke", "l", "x", "stroke length", 0.1),
        _positive("dead_volume", "V_0", "x^3", "volume of a chamber with the piston at its end", 1e-6),
        Parameter("heat_ratio", "kappa", "1", "ratio of the heat capacities", default=1.4, lower=1.01, upper=2.0),
        _positive("gas_constant", "R", "x^2/(s^2 K)", "specific gas constant", 287.0),
        _positive("temperature", "T", "K", "temperature of the air in the chambers", 293.0),
        _positive("valve_area", "alpha A_v", "x^2", "flow rate coefficient times area of a fully open edge", 1.6e-6),
        Parameter("supply_overlap", "c_S", "1", "command at which the supply edges open", default=0.02, lower=0.0, upper=0.9),
        Parameter("exhaust_overlap", "c_E", "1", "command at which the exhaust edges open", default=0.0, lower=0.0, upper=0.9),
        _positive("supply_pressure", "p_S", "F/x^2", "absolute pressure of the supply", 7e5),
        _positive("exhaust_pressure", "p_E", "F/x^2", "absolute pressure of the exhaust", 1.01325e5),
    ),
    states=("position", "velocity", "pressure_a", "pressure_b"),
    functions=(own, *CONTACT_FUNCTIONS, psi, flow, opening, pressure_rates, pressures, step, drive),
    inertia=_inertia,
    initial=_initial,
    signals=(
        Signal("pressure_a", "F/x^2", "absolute pressure of the chamber that pushes forward", _state(2)),
        Signal("pressure_b", "F/x^2", "absolute pressure of the other chamber", _state(3)),
    ),
    effort=_force,
    command=Parameter("opening", "u", "1", "opening of the valve, its voltage over that of full opening", -1.0, 1.0),
    rate=_rate,
)
