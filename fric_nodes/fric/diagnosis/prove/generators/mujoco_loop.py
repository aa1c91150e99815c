"""What surrounds MuJoCo's step: controller, drive, and the laws that MuJoCo doesn't have, set before each step.

First-order parts are discretised exactly (drive, heat) or implicitly (age of the contact, bristles, grease). A level is that of
the velocity at the beginning of the step. Laws: Stribeck 1902 in Gaussian form, hysteresis with the sign of the acceleration
(Hess, Soom 1990), ageing (Dieterich 1979), lag of the level (Hess, Soom 1990), bristles (Canudas de Wit 1995).
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba.experimental.function_type  # noqa: F401  # lets compiled code be handed a function of another library
import numpy as np
from numba import njit, types

__all__ = ["Foreign", "run"]

_TWO_PI = 2.0 * math.pi
_QUICK = 1e-3  # [s], over which the sign of the acceleration is taken
_CREEP = 1e-3  # of the speed that a step gives at the level's acceleration: ten times what a constraint creeps at

# Memory from step to step: force of the drive, heat, level behind its lag, whether that has begun, age, mean acceleration,
# stretch of the bristles, structure of the grease, place of the chain; of the controller: command, position before, speed,
# integral, whether it has begun.
_FORCE, _HEAT, _LEVEL, _BEGUN, _AGE, _RISE, _BENT, _GREASE, _CHAIN, _U, _BEFORE, _SPEED, _SUM, _RUNS = range(14)

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """``function`` in machine code that is kept on disk."""
    return cast(Function, njit(error_model="numpy", nogil=True, cache=True)(function))


class Foreign(types.WrapperAddressProtocol):
    """A C function of two addresses that gives nothing back."""

    def __init__(self, function: Any) -> None:
        self._address = ctypes.cast(function, ctypes.c_void_p).value

    def __wrapper_address__(self) -> Any:
        return self._address

    def signature(self) -> Any:
        """For numba."""
        return types.void(types.intp, types.intp)


@compiled
def _read(p: Any, at: Any, rate: Any) -> tuple[float, float]:
    """Encoder: position [m] and its rate [m/s]."""
    q, v = at[0], rate[0]
    if p.load_share > 0.0:
        q, v = q + at[1], v + rate[1]
    if p.eccentricity == 0.0:
        return q, v
    k = _TWO_PI / p.eccentricity_period
    return q + p.eccentricity * math.sin(k * q), v + v * k * p.eccentricity * math.cos(k * q)


@compiled
def _controlled(
    gains: Any, m: Any, place: float, speed: float, wanted: float, rate: float, ahead: float, every: float
) -> float:
    """Command [N] of this sample; an analogue loop (``every`` = 0) has the speed itself."""
    kp, kd, ki, smoothing, most, resolution = gains
    if every > 0.0:
        if resolution > 0.0:
            place = resolution * np.rint(place / resolution)
        if m[_RUNS] == 0.0:
            m[_BEFORE], m[_RUNS] = place, 1.0
        m[_SPEED] += ((place - m[_BEFORE]) / every - m[_SPEED]) * every / (every + smoothing)
        m[_BEFORE] = place
        speed = m[_SPEED]
    pull = kp * (wanted - place) + kd * (rate - speed)
    u = ahead + pull + ki * m[_SUM]
    if -most < u < most or u * pull < 0.0:  # an integral waits while the command is limited
        m[_SUM] += every * pull
    return float(max(-most, min(most, u)))


@compiled
def _driving(p: Any, m: Any, line: Any, u: float, q: float, v: float, disturbed: bool, h: float, count: int) -> float:
    """Force [N] of the motor."""
    f = u
    if p.limit > 0.0:
        f = max(-p.limit, min(p.limit, f))
    if p.dead_zone > 0.0:
        f = math.copysign(max(abs(f) - p.dead_zone, 0.0), f)
    size = line.shape[0] - 1
    if size > 0:
        place = count % size
        f, line[place] = line[place], f
    if p.actuator == 1.0:
        m[_FORCE] -= math.expm1(-h / p.actuator_time) * (f - m[_FORCE])
        f = m[_FORCE]
    if p.heat > 0.0:
        m[_HEAT] -= math.expm1(-h / p.heat_time) * ((u / p.heat_force) ** 2 - m[_HEAT])
        f = f / (1.0 + p.heat * m[_HEAT])
    f *= 1.0 + p.gain_ripple * math.sin(_TWO_PI * q / p.gain_ripple_period)
    f *= max(1.0 - p.fading * abs(v), 0.0)
    if disturbed:
        f -= p.dip * f
    return float(f)


@compiled
def _braking(p: Any, m: Any, q: float, v: float, t: float) -> float:
    """Forces [N] against the body that MuJoCo's damping and friction are not."""
    size = abs(v)
    f = p.bias + p.asymmetry_viscous * size + p.drag * size * v
    if p.shear > 0.0:
        f += math.copysign(p.shear * (1.0 - math.exp(-size / p.shear_velocity)), v)
    turn = _TWO_PI * q / p.ripple_period
    f += p.ripple_cosine * math.cos(turn) + p.ripple_sine * math.sin(turn)
    away = q - p.cubic_position
    f += p.stiffness * (q - p.stiffness_position) + p.cubic * away * away * away
    if p.cable > 0.0:
        m[_CHAIN] += max(q - p.cable_play - m[_CHAIN], 0.0) - max(m[_CHAIN] - q - p.cable_play, 0.0)
        f += p.cable * max(m[_CHAIN] - p.cable_position, 0.0)
    return float(f + p.floor * math.sin(_TWO_PI * p.floor_frequency * t))


@compiled
def _between(p: Any, at: Any, rate: Any, f: float, extra: Any) -> float:
    """Force [N] that reaches the load; ``extra[1]`` is what the stops' damping adds to MuJoCo's spring."""
    if p.load_share == 0.0:
        return f
    ahead, slip = at[1], rate[1]
    if p.shaft > 0.0:
        return float(p.shaft * ahead + p.shaft_damping * slip)
    toward = 1.0 if ahead > 0.0 else -1.0
    deep = toward * ahead - 0.5 * p.gap
    if p.stop_stiffness > 0.0:
        if deep <= 0.0:
            return 0.0
        spring = p.stop_stiffness * deep
        both = max(spring + p.stop_damping * slip * toward, 0.0)  # a stop only pushes
        extra[1] -= toward * (both - spring)
        return float(toward * both)
    return f if deep > -1e-4 * p.gap else 0.0


@compiled
def _level(
    p: Any, m: Any, q: float, v: float, way: float, t: float, load: float, warmer: float, disturbed: bool, h: float
) -> float:
    """Level [N] of the contact, but for what a gear adds."""
    g = p.coulomb + p.stribeck * math.exp(-v * v / (p.stribeck_velocity * p.stribeck_velocity))
    if p.acceleration > 0.0 and way * m[_RISE] >= 0.0:
        r = v / p.acceleration_velocity
        g += p.acceleration / (1.0 + r * r)
    if p.dwell > 0.0:
        g += p.dwell * math.log(1.0 + m[_AGE] / p.dwell_time)
    if p.lag == 1.0:
        if m[_BEGUN] == 0.0:
            m[_LEVEL], m[_BEGUN] = g, 1.0
        m[_LEVEL] -= math.expm1(-h / p.lag_time) * (g - m[_LEVEL])
        g = m[_LEVEL]
    g += way * p.asymmetry
    factor = 1.0 + p.load * (load - 1.0)
    factor *= 1.0 + p.temperature * warmer
    if p.spot != 0.0:
        off = (q - p.spot_position) / p.spot_width
        factor *= 1.0 + p.spot * math.exp(-off * off / 2.0)
    turn = _TWO_PI * q / p.wave_period
    factor *= 1.0 + p.wave_cosine * math.cos(turn) + p.wave_sine * math.sin(turn)
    grown = t if p.drift_time == 0.0 else 1.0 - math.exp(-t / p.drift_time)
    factor *= 1.0 + p.drift * grown
    if disturbed:
        factor *= 1.0 + p.dirt
    return max(float(g * factor), 0.0)


@compiled
def _bent(p: Any, m: Any, v: float, level: float, h: float) -> float:
    """Force [N] of the bristles at the end of the step."""
    before = m[_BENT]
    m[_BENT] = (before + h * v) / (1.0 + h * abs(v) / p.displacement)
    return float(level * m[_BENT] / p.displacement + p.presliding_damping * (m[_BENT] - before) / h)


@compiled
def _remembered(p: Any, m: Any, before: float, v: float, rest: float, h: float) -> None:
    """What the contact remembers of this step."""
    if abs(v) <= rest:
        m[_RISE] = 0.0
    else:
        m[_RISE] += h / _QUICK * ((v - before) / h - m[_RISE])
    if p.dwell > 0.0:
        m[_AGE] = (m[_AGE] + h) / (1.0 + abs(v) * h / p.dwell_length)
    if p.thixotropy > 0.0:
        fresh = h / p.thixotropy_time
        m[_GREASE] = (m[_GREASE] + fresh) / (1.0 + fresh + h * p.thixotropy_shear * abs(v))


@compiled
def _within(windows: Any, t: float) -> bool:
    inside = False
    for j in range(windows.shape[0]):
        inside = inside or windows[j, 0] <= t < windows[j, 1]
    return inside


@compiled
def run(
    step: Any, model: int, data: int, p: Any, gains: Any, every: float, line: Any, h: float, per: int,
    at: Any, rate: Any, applied: Any, frictionloss: Any, damping: Any, masses: Any, inertia: Any,
    reference: Any, feedforward: Any, load: Any, warmer: Any, windows: Any, noise: Any, out: Any,
) -> None:  # fmt: skip
    """Lead MuJoCo's ``model`` and ``data`` (addresses) through a recording of ``per`` steps of ``h`` [s] for each sample."""
    m = np.zeros(14)
    m[_GREASE], m[_CHAIN] = 1.0, at[0]
    n, count, ticks = reference.shape[0], 0, 0
    before, own, alone = 0.0, masses[1], inertia[0]
    rest = _CREEP * h * (p.coulomb + p.stribeck) / masses[1]
    for k in range(n):
        seen, speed = _read(p, at, rate)
        out[2, k], out[3, k] = seen, speed
        out[1, k] = seen + noise[k]
        if gains[5] > 0.0:
            out[1, k] = gains[5] * np.rint(out[1, k] / gains[5])
        ahead = (reference[min(k + 1, n - 1)] - reference[k]) / (per * h)
        disturbed = False
        for i in range(per):
            t = count * h
            if windows.shape[0] > 0:
                disturbed = _within(windows, t)
            if every == 0.0 or t >= ticks * every - 1e-9:
                place, speed = _read(p, at, rate)
                wanted = reference[k] + ahead * i * h
                m[_U] = _controlled(gains, m, place + noise[k], speed, wanted, ahead, feedforward[k], every)
                ticks += 1
            if p.payload_time > 0.0 and t >= p.payload_time:
                # MuJoCo keeps the inertia of a joint with nothing beyond it ready, and makes the others from the masses.
                masses[1], inertia[0] = own + p.payload, alone + p.payload
            q, v = at[0], rate[0]
            _remembered(p, m, before, v, rest, h)
            before = v
            motor = q + at[1] if p.load_share > 0.0 else q
            applied[:] = 0.0
            f = _driving(p, m, line, m[_U], motor, v + rate[1] if p.load_share > 0.0 else v, disturbed, h, count)
            drive = _between(p, at, rate, f, applied)
            braking = _braking(p, m, q, v, t)
            way = math.copysign(1.0, v) if abs(v) > rest else math.copysign(1.0, drive - braking)
            level = _level(p, m, q, v, way, t, load[k], warmer[k], disturbed, h) + p.gear * abs(drive)
            applied[0] += f - braking
            if p.load_share > 0.0:
                applied[1] += f
            if p.presliding == 1.0:
                applied[0] -= _bent(p, m, v, level, h)
                level = 0.0
            frictionloss[0] = level
            damping[0] = p.viscous + p.temperature_viscous * warmer[k] + p.thixotropy * m[_GREASE]
            out[0, k] += m[_U] / per
            step(model, data)
            count += 1
            turning = rate[0] + rate[1] if p.load_share > 0.0 else rate[0]
            if abs(turning) > rest:
                out[4, k] += math.copysign(1.0 / per, turning)
