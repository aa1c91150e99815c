"""Quarter car on a hydraulic road simulator: body on lubricated rails, wheel, tyre, servo-valve, cylinder and PI controller.

Equations (numbers of Al-Zughaibi 2018; all displacements from the static equilibrium, upwards):

    M_b X_b'' = F_s - F_fric,                F_s = k_s (X_w - X_b) + b_d (X_w' - X_b')                                (27)
    M_w X_w'' = -F_s + k_t (X_r - X_w) + b_t (X_r' - X_w')                                                            (28)
    M_r X_r'' = P_1 A_1 - P_2 A_2 - B_v X_r' - k_t (X_r - X_w) - b_t (X_r' - X_w') - M_T g                            (8)
    V_1/beta P_1' = Q_1 - A_1 X_r' - (P_1 - P_2)/R_i,   V_1 = V_10 + A_1 X_r                                          (6, 29)
    V_2/beta P_2' = A_2 X_r' + (P_1 - P_2)/R_i - Q_2,   V_2 = V_20 - A_2 X_r                                          (7, 30)
    x_s >= 0: Q_1 = K x_s root(P_s - P_1), Q_2 = K x_s root(P_2)                                                      (2, 3)
    x_s <  0: Q_1 = K x_s root(P_1),       Q_2 = K x_s root(P_s - P_2),   root(P) = sgn(P) sqrt|P|                    (4, 5)
    x_s' = (u_r - x_s)/tau_r,   u_r = K_p e + K_i int e dt,   e = X_rdf - X_r,   X_rdf' = (X_rd - X_rdf)/T_f          (1, 9, 10)
    F_nb = F_s / tan(theta - dtheta),   sin(dtheta) = d sin(theta)/(L_d - d sin(theta)),   d = X_w - X_b              (11, 12)

The contact is that of the body with its rails; its friction is that of the model's terms, which see |F_nb| as their normal
load. The command is the road displacement wanted, X_rd.

Read from the printed equations: the sign in Eqs. 3 and 5 stands outside the root, as in the paper's appendix. The total mass in
Eq. 8 is M_b + M_w + M_r. The weight appears in Eq. 8 alone, so springs and tyre are measured from their static deflection, and
the cylinder carries the whole weight at rest. The unit of R_i must be N s/m^5 (a pressure over a flow; printed N/m^5/s), and K
is per metre of spool: m^3/s / (m sqrt(N/m^2)) = m^3 s^-1 N^-1/2, as printed. Of -+ in Eq. 11 the minus belongs to a
compressed strut (d > 0): its lower end has moved up, so it lies flatter. Eq. 33's damping takes the rate of X_w, not X_w.
Eq. 12 is used as printed, although the triangle of the strut has cos(theta) where it puts sin(theta); what that makes is a
figure of ``fric verify quarter_car``.

Not in the paper, chosen here: tau_r = 3 ms (a small two-stage servo-valve); K_p = 0.3 and K_i = 1.2 1/s, which with the 160 to
210 1/s from spool to speed of the loaded cylinder give a crossover near 9 Hz and an integral time of 0.25 s; T_f = 0.15 s, slow
enough for the cylinder to follow the filtered step and fast enough to excite the body's 1.75 Hz; theta = 60 deg; and the stroke
-0.03 to 0.16 m to which the simulator's software limits X_rd, so that no command empties a chamber.

Step: Strang splitting. Half a step of everything but the body, which glides on at its velocity; the body's whole step with
wheel and wheel speed as they are then, exact in its sticking (:mod:`fric.engine.contact`; what the suspension force owes
to the body's own motion is the plant's own force there); half a step of the rest. The oil on the tyre's small mass oscillates
at about 700 Hz, so the half steps are split into as many classic Runge-Kutta steps as it needs.
Source: A. I. H. Al-Zughaibi, Nonlinear Dynamics 2018, Eqs. 1-12, 27-34 and the list of symbols.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..effect import Context
from ..engine.assembled import Inner, Surroundings, force, level
from ..engine.contact import CONTACT_FUNCTIONS, contact_step
from ..engine.kernel import kernel
from ..parameter import Parameter
from ..plant import Plant, Signal
from ..record import Array

__all__ = ["PLANT"]


@kernel
def own(c: Context, p: Any) -> float:
    return float(p[3] * c.position + p[4] * c.velocity)


@kernel
def bearing_load(p: Any, d: float, rate: float) -> float:
    """Normal force |F_nb| [N] of the bearings for a suspension compressed by ``d`` [m] that closes at ``rate`` [m/s]."""
    theta, length = p[7], p[8]
    # Eq. 12 ends where the strut would be half its length; nothing real comes near.
    shorter = min(max(d * math.sin(theta), -0.3 * length), 0.3 * length)
    force_on_body = p[3] * d + p[4] * rate
    return float(abs(force_on_body) / math.tan(theta - math.asin(shorter / (length - shorter))))


@kernel
def root(pressure: float) -> float:
    return math.copysign(math.sqrt(abs(pressure)), pressure)


@kernel
def volume(at_rest: float, change: float) -> float:
    """Oil volume [m^3]; the last twentieth stays in the chamber."""
    return max(at_rest + change, 0.05 * at_rest)


@kernel
def rates(p: Any, wanted: float, x_b: float, v_b: float, y: Any) -> Any:
    """Time derivatives of all states but the body's, ``y`` of length 9, while the body is at ``x_b`` with ``v_b``."""
    x_w, v_w, x_r, v_r, spool, p_1, p_2, integral, filtered = y
    _, m_w, m_r, k_s, b_d, k_t, b_t, _, _, _, gravity = p[:11]
    a_1, a_2, v_10, v_20, b_v, supply, leakage, flow, bulk, valve_time, k_p, k_i, filter_time = p[11:24]
    suspension = k_s * (x_w - x_b) + b_d * (v_w - v_b)
    tyre = k_t * (x_r - x_w) + b_t * (v_r - v_w)
    if spool >= 0.0:
        q_1 = flow * spool * root(supply - p_1)
        q_2 = flow * spool * root(p_2)
    else:
        q_1 = flow * spool * root(p_1)
        q_2 = flow * spool * root(supply - p_2)
    leak = (p_1 - p_2) / leakage
    error = filtered - x_r
    weight = (p[0] + m_w + m_r) * gravity
    return (
        v_w,
        (tyre - suspension) / m_w,
        v_r,
        (p_1 * a_1 - p_2 * a_2 - b_v * v_r - tyre - weight) / m_r,
        (k_p * error + k_i * integral - spool) / valve_time,
        bulk / volume(v_10, a_1 * x_r) * (q_1 - a_1 * v_r - leak),
        bulk / volume(v_20, -a_2 * x_r) * (a_2 * v_r + leak - q_2),
        error,
        (wanted - filtered) / filter_time,
    )


@kernel
def moved(y: Any, d: Any, h: float) -> Any:
    return (
        y[0] + h * d[0],
        y[1] + h * d[1],
        y[2] + h * d[2],
        y[3] + h * d[3],
        y[4] + h * d[4],
        y[5] + h * d[5],
        y[6] + h * d[6],
        y[7] + h * d[7],
        y[8] + h * d[8],
    )


@kernel
def oil_rate(p: Any, x_r: float) -> float:
    """Fastest rate of the cylinder [1/s]: the oil column on the tyre's mass, and the dampers there."""
    column = p[19] * (p[11] * p[11] / volume(p[13], p[11] * x_r) + p[12] * p[12] / volume(p[14], -p[12] * x_r))
    return float(math.sqrt((column + p[5]) / p[2]) + (p[15] + p[6]) / p[2])


@kernel
def others(p: Any, x: Any, x_b: float, wanted: float, h: float) -> None:
    """Lead all states of ``x`` but the body's over ``h`` [s], while the body glides on from ``x_b`` at its velocity."""
    n = int(h * oil_rate(p, x[4]) / 0.7) + 1
    h_n = h / n
    v_b = x[1]
    y = (x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10])
    for k in range(n):
        at = x_b + k * h_n * v_b
        middle = at + 0.5 * h_n * v_b
        d_1 = rates(p, wanted, at, v_b, y)
        d_2 = rates(p, wanted, middle, v_b, moved(y, d_1, 0.5 * h_n))
        d_3 = rates(p, wanted, middle, v_b, moved(y, d_2, 0.5 * h_n))
        d_4 = rates(p, wanted, at + h_n * v_b, v_b, moved(y, d_3, h_n))
        y = moved(moved(moved(moved(y, d_1, h_n / 6.0), d_2, h_n / 3.0), d_3, h_n / 3.0), d_4, h_n / 6.0)
    x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10] = y


@kernel
def load_in_step(p: Any, s: Inner, x: Any, h: float, around: Surroundings) -> float:
    """Normal load relative to the nominal one in the middle of the body's step of ``h`` [s]."""
    d = x[2] - x[0]
    load = float(around.load / p[9])
    if x[1] == 0.0:
        return load * bearing_load(p, d, x[3])
    # The body's velocity in the middle isn't known yet; its present acceleration leads there to first order, and what is
    # found for it to second.
    before = load * bearing_load(p, d, x[3] - x[1])
    side = 1.0 if x[1] > 0.0 else -1.0
    pull = p[3] * d + p[4] * (x[3] - x[1])
    c = Context(x[0], x[1], side, around.time, before, around.temperature, 0.0, h, s.memory, pull)
    gain = pull - force(c, p) - side * level(c, p)
    v = x[1] + 0.5 * h * gain / p[0]
    return load * bearing_load(p, d - 0.5 * h * x[1], x[3] - v)


@kernel
def step(p: Any, x: Any, x_next: Any, s: Inner, u: float, h: float, around: Surroundings) -> float:
    half = 0.5 * h
    wanted = min(max(u, p[24]), p[25])
    others(p, x, x[0], wanted, half)
    pull = p[3] * x[2] + p[4] * x[3]
    inside = Surroundings(around.time, load_in_step(p, s, x, h, around), around.temperature)
    friction = contact_step(p, p[0], x, x_next, s, pull, h, inside)
    for j in range(2, 11):
        x_next[j] = x[j]
    others(p, x_next, x_next[0] - half * x_next[1], wanted, half)
    return friction


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    return float(p[0] * a)


def _inertia(body_mass: float, *others: float) -> float:
    return body_mass


def _rate(body_mass: float, wheel_mass: float, tyre_mass: float, stiffness: float, *others: float) -> float:
    """Of the suspension between its two masses, by which the splitting couples them."""
    return math.sqrt(stiffness * (1.0 / body_mass + 1.0 / wheel_mass))


def _initial(values: Array, position: float, velocity: float) -> Array:
    """The cylinder in balance: the pressures carry the weight, and what leaks flows through the valve.

    In balance both flows equal the leakage, so the drop over the inlet is that over the outlet and P_1 + P_2 = P_s.
    """
    body, wheel, tyre = values[:3]
    a_1, a_2, supply, leakage, flow, integral_gain = values[[11, 12, 16, 17, 18, 22]]
    p_1 = min(max(((body + wheel + tyre) * values[10] + supply * a_2) / (a_1 + a_2), 0.0), supply)
    p_2 = supply - p_1
    outlet = max(p_2 if p_1 >= p_2 else p_1, 1e-6 * supply)
    spool = (p_1 - p_2) / (leakage * flow * math.sqrt(outlet))
    return np.array([position, velocity, position, 0.0, position, 0.0, spool, p_1, p_2, spool / integral_gain, position])


def _suspension_force(values: Array, states: Array, command: Array) -> Array:
    result: Array = values[3] * (states[:, 2] - states[:, 0]) + values[4] * (states[:, 3] - states[:, 1])
    return result


def _normal_load(values: Array, states: Array, command: Array) -> Array:
    of_one = getattr(bearing_load, "py_func", bearing_load)
    compression = states[:, 2] - states[:, 0]
    rate = states[:, 3] - states[:, 1]
    return np.array([of_one(values, d, v) for d, v in zip(compression.tolist(), rate.tolist(), strict=True)])


def _state(number: int) -> Any:
    return lambda values, states, command: states[:, number]


def _positive(name: str, symbol: str, dimension: str, doc: str, default: float, upper: float = math.inf) -> Parameter:
    return Parameter(name, symbol, dimension, doc, default=default, positive=True, upper=upper)


PLANT = Plant(
    id="quarter_car",
    title="quarter car on a hydraulic road simulator",
    equation="M_b X_b'' = k_s (X_w - X_b) + b_d (X_w' - X_b') - F_contact",
    source="Al-Zughaibi 2018, Eqs. 1-12, 27-34",
    parameters=(
        Parameter("body_mass", "M_b", "F s^2/x", "mass of the body on its rails", positive=True, linear=True, default=240.0),
        _positive("wheel_mass", "M_w", "F s^2/x", "mass of the wheel", 40.0),
        _positive("tyre_mass", "M_r", "F s^2/x", "mass of the tyre's lower half with the piston", 5.0),
        _positive("suspension_stiffness", "k_s", "F/x", "stiffness of the suspension spring", 2.89e4),
        Parameter("suspension_damping", "b_d", "F s/x", "viscous damping of the suspension", lower=0.0, default=260.0),
        _positive("tyre_stiffness", "k_t", "F/x", "stiffness of the tyre", 9.2e5),
        Parameter("tyre_damping", "b_t", "F s/x", "viscous damping of the tyre", lower=0.0, default=3886.0),
        Parameter("angle", "theta", "1", "angle of the strut from the horizontal [rad]", lower=0.5, upper=1.5, default=1.0472),
        _positive("strut_length", "L_d", "x", "free length of the strut", 0.342),
        _positive("nominal_load", "N_0", "F", "normal force of the bearings for which the terms give their values", 1000.0),
        Parameter("gravity", "g", "x/s^2", "gravitational acceleration", lower=0.0, upper=100.0, default=9.81),
        _positive("area_1", "A_1", "x^2", "piston area on the side that lifts", 1.96e-3),
        _positive("area_2", "A_2", "x^2", "piston area on the side of the rod", 0.94e-3),
        _positive("volume_1", "V_10", "x^3", "oil volume on side 1 at rest", 80e-6),
        _positive("volume_2", "V_20", "x^3", "oil volume on side 2 at rest", 167e-6),
        Parameter("actuator_damping", "B_v", "F s/x", "viscous damping of the piston", lower=0.0, default=500.0),
        _positive("supply_pressure", "P_s", "F/x^2", "pressure of the supply", 200e5),
        _positive("leakage_resistance", "R_i", "F s/x^5", "resistance of the leakage from side to side", 2.45e11),
        _positive("flow_constant", "K", "x^3/(s F^1/2)", "flow per spool displacement and root of the pressure drop", 0.99e-4),
        _positive("bulk_modulus", "beta", "F/x^2", "effective bulk modulus of the oil", 1.43e9),
        _positive("valve_time", "tau_r", "s", "time constant of the servo-valve", 0.003),
        _positive("proportional_gain", "K_p", "1", "spool displacement per position error", 0.3),
        _positive("integral_gain", "K_i", "1/s", "spool displacement per integral of the position error", 1.2),
        _positive("filter_time", "T_f", "s", "time constant of the filter of the displacement wanted", 0.15),
        Parameter("stroke_low", "X_min", "x", "least road displacement that the simulator takes", upper=0.0, default=-0.03),
        Parameter("stroke_high", "X_max", "x", "largest road displacement that the simulator takes", lower=0.0, default=0.16),
    ),
    states=(
        *("body_position", "body_velocity", "wheel_position", "wheel_velocity", "road_position", "road_velocity"),
        *("spool", "pressure_1", "pressure_2", "error_integral", "filtered_reference"),
    ),
    functions=(own, *CONTACT_FUNCTIONS, bearing_load, root, volume, rates, moved, oil_rate, others, load_in_step, step, drive),
    inertia=_inertia,
    initial=_initial,
    signals=(
        Signal("normal_load", "F", "normal force of the body's bearings", _normal_load),
        Signal("wheel_position", "x", "displacement of the wheel", _state(2)),
        Signal("road_position", "x", "displacement of the road simulator", _state(4)),
        Signal("pressure_1", "F/x^2", "pressure on the side that lifts", _state(7)),
        Signal("pressure_2", "F/x^2", "pressure on the side of the rod", _state(8)),
    ),
    effort=_suspension_force,
    command=Parameter("road_position", "X_rd", "x", "road displacement wanted"),
    rate=_rate,
)
