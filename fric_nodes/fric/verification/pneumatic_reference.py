"""The pneumatic cylinder's equations typed a second time, for an integration by another method, and a measured-like stick-slip.

Written from the paper with its own symbols; nothing here is shared with :mod:`fric.plants.pneumatic` but the numbers of
the apparatus.

The measured-like friction has the paper's values, but not the sudden change of branch of Models B and C:

    F = F_C + F_v v + b (F_S - F_C)/(1 + (v/v_s)^2),   tau b' = B(a) - b,   B(a) = 1 for a >= 0, else 1/(1 + (a/a_0)^2)

so that the loop over velocity has round corners as in Fig. 9, and no table over v can hold all of it: tau = 1.5 ms is a few per
cent of a slip. On the signals lies the noise of sensors, white. That of the accelerometer is chosen so that Model B is off by
about the share of the range that Table 1 gives it (2.65 %); how far the other models are off then follows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.integrate import cumulative_trapezoid, solve_ivp

from ..record import Array

__all__ = ["FRICTION", "Slip", "free_motion", "slips", "stick_slip"]

KAPPA, R, T = 1.4, 287.0, 293.0
AREA, STROKE, DEAD = 3.14159e-4, 0.1, 1e-6
MASS, SUPPLY, EXHAUST = 0.102, 7e5, 1.01325e5
VALVE, OVERLAP = 1.6e-6, 0.02

FRICTION = {"F_C": 2.447, "F_S": 3.7, "F_v": 15.0, "v_s": 0.019}
"""The paper's parameters of Model A [N, N, N s/m, m/s]."""

_TAU = 1.5e-3  # [s]
_BEND = 0.05  # a_0 [m/s^2]
ACCELERATION_NOISE = 0.11  # [m/s^2]
FORCE_NOISE = 4e-3  # [N]; a pressure difference of 13 Pa


def _mass_flow(area: float, up: float, down: float) -> float:
    """Through ``area`` from ``up`` to ``down`` [kg/s]."""
    if down > up:
        return -_mass_flow(area, down, up)
    ratio = down / up
    straight = min(ratio, 0.999)  # a line from there to 1, as in a laminar gap
    if straight <= (2 / (KAPPA + 1)) ** (KAPPA / (KAPPA - 1)):
        psi = (2 / (KAPPA + 1)) ** (1 / (KAPPA - 1)) * np.sqrt(KAPPA / (KAPPA + 1))
    else:
        psi = np.sqrt(KAPPA / (KAPPA - 1) * (straight ** (2 / KAPPA) - straight ** (1 + 1 / KAPPA)))
    if ratio > 0.999:
        psi *= (1 - ratio) * 1000
    return float(area * psi * up * np.sqrt(2 / (R * T)))


def _pressure_rates(x: float, v: float, p_a: float, p_b: float, u: float) -> tuple[float, float]:
    """Eqs. 13 and 14."""
    inlet, outlet = VALVE * max(abs(u) - OVERLAP, 0.0) / (1 - OVERLAP), VALVE * abs(u)
    if u > 0:
        m_a, m_b = _mass_flow(inlet, SUPPLY, p_a), -_mass_flow(outlet, p_b, EXHAUST)
    else:
        m_a, m_b = -_mass_flow(outlet, p_a, EXHAUST), _mass_flow(inlet, SUPPLY, p_b)
    return (
        KAPPA * (R * T * m_a - AREA * v * p_a) / (DEAD + AREA * x),
        KAPPA * (R * T * m_b + AREA * v * p_b) / (DEAD + AREA * (STROKE - x)),
    )


def free_motion(
    start: Array, times: Array, command: Callable[[float], float], steps: tuple[float, ...], damping: float
) -> Array:
    """States (x, v, p_a, p_b) at ``times``, ``(n, 4)``, with viscous friction alone; ``command`` jumps at ``steps``."""

    def rates(t: float, y: Array, u: float) -> list[float]:
        x, v, p_a, p_b = y
        a, b = _pressure_rates(x, v, p_a, p_b, u)
        return [v, (AREA * (p_a - p_b) - damping * v) / MASS, a, b]

    found = [start[None, :]]
    ends = [times[0], *steps, times[-1]]
    scale = np.array([1e-12, 1e-11, 1e-5, 1e-5])
    for first, last in pairwise(ends):
        inside = times[(times > first) & (times <= last)]
        u = command(0.5 * (first + last))
        part = solve_ivp(rates, (first, last), found[-1][-1], "Radau", inside, rtol=1e-9, atol=scale, args=(u,))
        found.append(part.y.T)
    return np.concatenate(found)


@dataclass(frozen=True, eq=False)
class Slip:
    """One stick-slip; arrays of shape ``(n_samples,)``.

    Attributes:
        time: [s].
        force: pressure difference times piston area [N].
        acceleration: [m/s^2].
        velocity: [m/s].
        n_rest: samples at rest behind the slip.
    """

    time: Array
    force: Array
    acceleration: Array
    velocity: Array
    n_rest: int

    @property
    def friction(self) -> Array:
        """What force and acceleration leave for friction [N]."""
        return self.force - MASS * self.acceleration

    def recorded(self, random: np.random.Generator) -> Slip:
        """The slip as sensors give it.

        Noise on force and acceleration; velocity as the integral of the acceleration, as in the paper, less the straight line
        that brings it to 0 over the rest at the end.
        """
        n = self.time.shape[0]
        force = self.force + FORCE_NOISE * random.standard_normal(n)
        acceleration = self.acceleration + ACCELERATION_NOISE * random.standard_normal(n)
        velocity = cumulative_trapezoid(acceleration, self.time, initial=0.0)
        drift = float(np.mean(velocity[-self.n_rest :])) / (n - 0.5 * self.n_rest)
        return replace(self, force=force, acceleration=acceleration, velocity=velocity - drift * np.arange(n))


def _sticking(start: Array, u: float, until: float) -> tuple[float, Callable[[float], Array]]:
    """When the force on the resting piston reaches ``until`` [N], and the pressures until then as a function of time."""
    x = float(start[0])

    def reached(t: float, p: Array) -> float:
        return float(AREA * (p[0] - p[1]) - until)

    def rates(t: float, p: Array) -> tuple[float, float]:
        return _pressure_rates(x, 0.0, p[0], p[1], u)

    reached.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(
        rates, (0.0, 10.0), start[2:], "Radau", events=reached, rtol=1e-9, atol=1e-4, max_step=0.01, dense_output=True
    )
    return float(found.t[-1]), found.sol


def surplus(v: Array | float) -> Array | float:
    """Of friction while speeding up [N]."""
    return (FRICTION["F_S"] - FRICTION["F_C"]) / (1 + (v / FRICTION["v_s"]) ** 2)


def _slipping(start: Array, u: float) -> tuple[float, Callable[[float], Array]]:
    """When the piston stops after break-away, and its states (x, v, p_a, p_b, b) until then as a function of time."""

    def acceleration(y: Array) -> float:
        return float((AREA * (y[2] - y[3]) - FRICTION["F_C"] - FRICTION["F_v"] * y[1] - y[4] * surplus(y[1])) / MASS)

    def rates(t: float, y: Array) -> list[float]:
        a = acceleration(y)
        goal = 1 / (1 + (min(a, 0.0) / _BEND) ** 2)
        return [y[1], a, *_pressure_rates(y[0], y[1], y[2], y[3], u), (goal - y[4]) / _TAU]

    def stops(t: float, y: Array) -> float:
        return float(y[1])

    stops.terminal, stops.direction = True, -1.0  # type: ignore[attr-defined]
    scale = np.array([1e-12, 1e-11, 1e-5, 1e-5, 1e-9])
    found = solve_ivp(rates, (0.0, 1.0), start, "Radau", events=stops, rtol=1e-8, atol=scale, max_step=1e-3, dense_output=True)
    return float(found.t[-1]), found.sol


def stick_slip(position: float, command: float, sample_time: float, rest: float) -> Slip:
    """One stick-slip with the measured-like friction, without noise.

    Args:
        position: where the piston sticks at first [m], both chambers at the pressure of the exhaust.
        command: of the valve, constant.
        sample_time: of the recording [s].
        rest: at the beginning and at the end of the recording [s].
    """
    sticks, before = _sticking(np.array([position, 0.0, EXHAUST, EXHAUST]), command, FRICTION["F_S"])
    # A velocity to begin with, since the law says nothing on how a body in balance leaves it.
    slips, moving = _slipping(np.array([position, 1e-9, *before(sticks), 1.0]), command)
    _, after = _sticking(moving(slips)[:4], command, FRICTION["F_S"])
    time = np.arange(0.0, 2 * rest + slips, sample_time)
    force, velocity, friction = np.empty((3, time.shape[0]))
    for k, t in enumerate(time - rest):
        if 0.0 <= t <= slips:
            y = moving(t)
            pressure, velocity[k] = y[2:4], y[1]
            friction[k] = FRICTION["F_C"] + FRICTION["F_v"] * y[1] + y[4] * surplus(y[1])
            force[k] = AREA * (pressure[0] - pressure[1])
        else:
            pressure = before(sticks + t) if t < 0.0 else after(t - slips)
            velocity[k] = 0.0
            force[k] = friction[k] = AREA * (pressure[0] - pressure[1])
    return Slip(time, force, (force - friction) / MASS, velocity, round(rest / sample_time))


def slips(position: float, commands: Sequence[float], sample_time: float) -> tuple[Array, Array]:
    """Position [m] and force of the pressures [N] at each sample of stick-slips one after the other, without noise.

    Args:
        position: where the piston sticks at first [m], both chambers at the pressure of the exhaust.
        commands: of the valve, one for each rest and the slip that ends it.
        sample_time: of the recording [s].
    """
    state = np.array([position, 0.0, EXHAUST, EXHAUST])
    positions, forces, begun, n = [], [], 0.0, 0
    for command in commands:
        sticks, before = _sticking(state, command, FRICTION["F_S"])
        slipping, moving = _slipping(np.array([state[0], 1e-9, *before(sticks), 1.0]), command)
        while n * sample_time < begun + sticks + slipping:
            t = n * sample_time - begun
            x, p_a, p_b = (state[0], *before(t)) if t < sticks else moving(t - sticks)[[0, 2, 3]]
            positions.append(x)
            forces.append(AREA * (p_a - p_b))
            n += 1
        begun += sticks + slipping
        state = np.array([moving(slipping)[0], 0.0, *moving(slipping)[2:4]])
    return np.array(positions), np.array(forces)
