"""The equations of an axis between two events, written for the generator ``events``: each mode a smooth right-hand side.

A *mode* says which side of every inequality holds: the body sticks (0) or slides forward (1) or backward (-1); the motor
presses on the load's front side (1) or back side (-1) or touches none (0); and where the drag chain has come to. Within a
mode nothing jumps, so that a Runge-Kutta pair keeps its order; :mod:`.events_steps` finds where a mode ends.

Laws: Stribeck 1902 in Gaussian form (Bo, Pavelescu 1982), logarithmic ageing of a contact that is renewed by sliding (Dieterich
1979 and Ruina 1983), first-order lag of the level (Hess, Soom 1990), bristles (Canudas de Wit 1995), a thixotropic structure
(Barnes 1997), plastic impact. Positive against positive motion: friction and all other forces on the body.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit

from ..physics import Physics
from .generator import ANY, Honoured

__all__ = ["HONOURED", "N_STATES", "compiled", "encoder", "first_state", "margins", "numbers", "settled", "slopes"]

_USUAL: tuple[float, ...] = (0.0,)
_FIRST = (0.0, 1.0)
_EVERY = (
    *("mass", "load_share", "coulomb", "viscous", "bias", "stribeck", "stribeck_velocity", "asymmetry", "asymmetry_viscous"),
    *("drag", "drag_velocity", "shear", "shear_velocity", "displacement", "presliding_damping", "lag_time"),
    *("dwell", "dwell_time", "dwell_length", "load", "temperature", "temperature_viscous", "drift", "drift_time"),
    *("spot", "spot_position", "spot_width", "wave_cosine", "wave_sine", "wave_period"),
    *("ripple_cosine", "ripple_sine", "ripple_period", "stiffness", "stiffness_position", "cubic", "cubic_position"),
    *("gap", "stop_stiffness", "stop_damping", "shaft", "shaft_damping"),
    *("appendage", "appendage_frequency", "appendage_damping", "limit", "dead_zone", "delay", "actuator_time"),
    *("payload", "payload_time", "heat", "heat_time", "heat_force", "dip", "cable", "cable_play", "cable_position", "dirt"),
    *("floor", "floor_frequency", "gear", "gain_ripple", "gain_ripple_period", "fading"),
    *("thixotropy", "thixotropy_time", "thixotropy_shear", "eccentricity", "eccentricity_period"),
)
# ``gear_driven`` acts in another form alone. A level that jumps with the sign of the acceleration (``acceleration``) isn't
# among these: it has no smooth modes, but would switch infinitely often.
HONOURED: Honoured = {
    **dict.fromkeys(_EVERY, ANY),
    **{"gear_driven": ANY, "gear_form": _USUAL, "dwell_form": _FIRST},
    **{"presliding": _FIRST, "lag": _FIRST, "actuator": _FIRST},
}
"""What this generator honours; forms of a law but the usual one are left out."""

_USED = [*_EVERY, "presliding", "lag", "actuator"]

# States: body, motor, force of the drive, heat, level behind its lag, age of the contact, stretch of the bristles, structure
# of the grease, appendage ahead of the body and its rate, integral of the command.
_Q, _V, _Y, _W, _F, _HEAT, _LEVEL, _AGE, _STRETCH, _GREASE, _HUNG, _HUNG_RATE, _IMPULSE = range(13)
N_STATES = 13
# Modes.
_SLIP, _SIDE, _CHAIN = range(3)
# What holds between two instants: command that has arrived [N], relative load, temperature less nominal, whether disturbed,
# mass that joined; for a continuous controller its reference, that one's rate, since when, its feedforward, and its gains;
# last the command that was given, which may still be on its way.
_U, _LOAD, _WARMER, _DIRTY, _JOINED, _WANTED, _RATE, _SINCE, _AHEAD, _KP, _KD, _MOST, _GIVEN = range(13)

_TURN = 2.0 * math.pi
Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """``function`` in machine code that is kept on disk."""
    return cast(Function, njit(error_model="numpy", nogil=True, cache=True)(function))


def numbers(physics: Physics) -> Any:
    """What the equations use, as one record: compiled code is handed its address instead of each number."""
    held = np.zeros(1, dtype=[(name, np.float64) for name in _USED])
    for name in _USED:
        held[name] = getattr(physics, name)
    return held[0]


@compiled
def first_state(p: Any, x: Any, mode: Any, place: float) -> None:
    """At rest at ``place``, the contact as young as can be."""
    for i in range(N_STATES):
        x[i] = 0.0
    x[_Q] = x[_Y] = place
    x[_GREASE] = 1.0
    x[_LEVEL] = p.coulomb + p.stribeck
    mode[_SLIP] = 1.0 if p.presliding > 0.0 else 0.0
    mode[_SIDE] = 0.0
    mode[_CHAIN] = place


@compiled
def encoder(p: Any, x: Any) -> tuple[float, float]:
    """Position [m] that the encoder turns with, and its rate [m/s]: the motor's where there is one."""
    place, rate = (x[_Y], x[_W]) if p.load_share > 0.0 else (x[_Q], x[_V])
    if p.eccentricity != 0.0:
        turn = _TURN * place / p.eccentricity_period
        rate *= 1.0 + p.eccentricity * _TURN / p.eccentricity_period * math.cos(turn)
        place += p.eccentricity * math.sin(turn)
    return place, rate


@compiled
def _command(p: Any, x: Any, now: Any, t: float) -> float:
    """Command [N]: the one that is held, or that of an analogue loop."""
    if now[_KP] == 0.0 and now[_KD] == 0.0:
        return float(now[_U])
    place, rate = encoder(p, x)
    wanted = now[_WANTED] + now[_RATE] * (t - now[_SINCE])
    u = now[_AHEAD] + now[_KP] * (wanted - place) + now[_KD] * (now[_RATE] - rate)
    return float(min(max(u, -now[_MOST]), now[_MOST]))


@compiled
def _amplified(p: Any, u: float) -> float:
    if p.limit > 0.0:
        u = min(max(u, -p.limit), p.limit)
    if p.dead_zone > 0.0:
        u = 0.0 if abs(u) <= p.dead_zone else u - math.copysign(p.dead_zone, u)
    return u


@compiled
def _motor_force(p: Any, x: Any, now: Any, u: float) -> float:
    """Force [N] of the motor."""
    f = x[_F] if p.actuator == 1.0 else _amplified(p, u)
    f /= 1.0 + p.heat * x[_HEAT]
    if p.gain_ripple != 0.0:
        at = x[_Y] if p.load_share > 0.0 else x[_Q]
        f += f * p.gain_ripple * math.sin(_TURN * at / p.gain_ripple_period)
    if p.fading > 0.0:
        f -= f * min(p.fading * abs(x[_W] if p.load_share > 0.0 else x[_V]), 1.0)
    return float(f * (1.0 - p.dip) if now[_DIRTY] > 0.0 else f)


@compiled
def _elastic(p: Any, x: Any, side: float) -> float:
    """Force [N] that a soft stop on this side would pass on."""
    deep = x[_Y] - x[_Q] - 0.5 * side * p.gap
    return float(p.stop_stiffness * deep + p.stop_damping * (x[_W] - x[_V]))


@compiled
def _transmitted(p: Any, x: Any, mode: Any, f: float) -> float:
    """Force [N] that drives the body."""
    if p.load_share == 0.0:
        return f
    if p.shaft > 0.0:
        return float(p.shaft * (x[_Y] - x[_Q]) + p.shaft_damping * (x[_W] - x[_V]))
    if mode[_SIDE] == 0.0:
        return 0.0
    return _elastic(p, x, mode[_SIDE]) if p.stop_stiffness > 0.0 else f


@compiled
def _hung(p: Any, x: Any) -> float:
    """Acceleration [m/s^2] that pulls the appendage back to the body."""
    a = _TURN * p.appendage_frequency
    return float(a * a * x[_HUNG] + 2.0 * p.appendage_damping * a * (x[_HUNG_RATE] - x[_V]))


@compiled
def _resistance(p: Any, x: Any, mode: Any, now: Any, t: float) -> float:
    """Forces [N] on the body but contact friction and drive."""
    q, v = x[_Q], x[_V]
    speed, way = abs(v), 1.0 if v >= 0.0 else -1.0
    damping = p.viscous + p.temperature_viscous * now[_WARMER] + p.thixotropy * x[_GREASE]
    f = p.bias + damping * v + p.asymmetry_viscous * speed
    f += way * p.drag * speed * speed
    if p.shear > 0.0:
        f -= way * p.shear * math.expm1(-speed / p.shear_velocity)
    if p.ripple_cosine != 0.0 or p.ripple_sine != 0.0:
        turn = _TURN * q / p.ripple_period
        f += p.ripple_cosine * math.cos(turn) + p.ripple_sine * math.sin(turn)
    f += p.stiffness * (q - p.stiffness_position) + p.cubic * (q - p.cubic_position) ** 3
    if p.cable > 0.0:
        # Exact while the body goes one way, as it does within a mode.
        chain = min(max(mode[_CHAIN], q - p.cable_play), q + p.cable_play)
        f += p.cable * max(chain - p.cable_position, 0.0)
    f += p.floor * math.sin(_TURN * p.floor_frequency * t)
    if p.appendage > 0.0:
        f -= p.appendage * _hung(p, x)
    return float(f)


@compiled
def _raw_level(p: Any, speed: float, age: float) -> float:
    """Level [N] of Coulomb, Stribeck and rest."""
    level = p.coulomb + p.stribeck * math.exp(-((speed / p.stribeck_velocity) ** 2))
    return float(level + p.dwell * math.log1p(max(age, 0.0) / p.dwell_time) if p.dwell > 0.0 else level)


@compiled
def _level(p: Any, x: Any, now: Any, t: float, way: float, drive: float) -> float:
    """Level [N] of a contact that slides, or would slide, this ``way``."""
    level = x[_LEVEL] if p.lag > 0.0 else _raw_level(p, abs(x[_V]), x[_AGE])
    level += way * p.asymmetry
    level *= (1.0 + p.load * (now[_LOAD] - 1.0)) * (1.0 + p.temperature * now[_WARMER])
    if p.spot != 0.0:
        level *= 1.0 + p.spot * math.exp(-0.5 * ((x[_Q] - p.spot_position) / p.spot_width) ** 2)
    turn = _TURN * x[_Q] / p.wave_period
    level *= 1.0 + p.wave_cosine * math.cos(turn) + p.wave_sine * math.sin(turn)
    if p.drift_time > 0.0:
        level *= 1.0 - p.drift * math.expm1(-t / p.drift_time)
    else:
        level *= 1.0 + p.drift * t
    if now[_DIRTY] > 0.0:
        level *= 1.0 + p.dirt
    return float(max(level, 0.0) + p.gear * abs(drive))


@compiled
def _over(p: Any, x: Any, now: Any, t: float, drive: float, push: float) -> float:
    """By how much the push on a body at rest is beyond the break-away force [N], either way."""
    way = 1.0 if push >= 0.0 else -1.0
    return float(abs(push) - _level(p, x, now, t, way, drive))


@compiled
def _coupled(p: Any, mode: Any) -> bool:
    """Whether motor and load are one body for now."""
    return bool(p.gap > 0.0 and p.stop_stiffness == 0.0 and p.shaft == 0.0 and mode[_SIDE] != 0.0)


@compiled
def slopes(p: Any, x: Any, mode: Any, now: Any, t: float, dx: Any) -> None:
    """Rates of all states within a mode."""
    u = _command(p, x, now, t)
    f = _motor_force(p, x, now, u)
    drive = _transmitted(p, x, mode, f)
    push = drive - _resistance(p, x, mode, now, t)
    v, way = x[_V], mode[_SLIP]
    two = p.load_share > 0.0
    motor = p.mass * (1.0 - p.load_share)
    together = _coupled(p, mode)
    inertia = (p.mass if not two or together else p.mass * p.load_share) + now[_JOINED]
    dx[_STRETCH] = 0.0
    a = 0.0
    if way != 0.0:
        friction = way * _level(p, x, now, t, way, drive)
        if p.presliding > 0.0:
            # The level belongs to the way in which the bristles are bent.
            share = x[_STRETCH] / p.displacement
            dx[_STRETCH] = v * (1.0 - way * share)
            friction = abs(friction) * share + p.presliding_damping * dx[_STRETCH]
        a = (push - friction) / inertia
    dx[_Q], dx[_V] = v, a
    dx[_Y], dx[_W] = x[_W], 0.0
    if two:
        dx[_W] = a if together else (f - drive) / motor
    dx[_F] = (_amplified(p, u) - x[_F]) / p.actuator_time if p.actuator == 1.0 else 0.0
    given = u if now[_KP] != 0.0 or now[_KD] != 0.0 else now[_GIVEN]
    dx[_HEAT] = ((given / p.heat_force) ** 2 - x[_HEAT]) / p.heat_time
    dx[_LEVEL] = (_raw_level(p, abs(v), x[_AGE]) - x[_LEVEL]) / p.lag_time if p.lag > 0.0 else 0.0
    dx[_AGE] = 1.0 - x[_AGE] * abs(v) / p.dwell_length if p.dwell > 0.0 else 0.0
    dx[_GREASE] = (1.0 - x[_GREASE]) / p.thixotropy_time - p.thixotropy_shear * abs(v) * x[_GREASE]
    dx[_HUNG], dx[_HUNG_RATE] = 0.0, 0.0
    if p.appendage > 0.0:
        dx[_HUNG], dx[_HUNG_RATE] = x[_HUNG_RATE] - v, -_hung(p, x)
    dx[_IMPULSE] = given


@compiled
def margins(p: Any, x: Any, mode: Any, now: Any, t: float, dx: Any) -> tuple[float, float]:
    """By how much the contact and the transmission are beyond the end of their mode: no more than zero within it."""
    f = _motor_force(p, x, now, _command(p, x, now, t))
    drive = _transmitted(p, x, mode, f)
    if mode[_SLIP] == 0.0:
        contact = _over(p, x, now, t, drive, drive - _resistance(p, x, mode, now, t))
    else:
        contact = -x[_V] * mode[_SLIP]
    if p.load_share == 0.0 or p.gap == 0.0:
        return contact, -1.0
    ahead, closing, side = x[_Y] - x[_Q], x[_W] - x[_V], mode[_SIDE]
    toward = 1.0 if ahead >= 0.0 else -1.0
    if p.stop_stiffness > 0.0:
        if side != 0.0:
            return contact, -side * _elastic(p, x, side)
        return contact, min(abs(ahead) - 0.5 * p.gap, toward * _elastic(p, x, toward))
    if side != 0.0:
        slopes(p, x, mode, now, t, dx)
        return contact, -side * (f - p.mass * (1.0 - p.load_share) * dx[_V])
    return contact, abs(ahead) - 0.5 * p.gap if closing * toward > 0.0 else -1.0


@compiled
def _stopped(p: Any, x: Any, mode: Any, now: Any, t: float) -> None:
    """A body that has come to rest: it sticks, or is pushed on either way."""
    x[_V] = 0.0
    if _coupled(p, mode):
        x[_W] = 0.0
    mode[_SLIP] = 0.0
    f = _motor_force(p, x, now, _command(p, x, now, t))
    drive = _transmitted(p, x, mode, f)
    push = drive - _resistance(p, x, mode, now, t)
    if _over(p, x, now, t, drive, push) > 0.0:
        mode[_SLIP] = 1.0 if push > 0.0 else -1.0


@compiled
def settled(p: Any, x: Any, mode: Any, now: Any, t: float, contact: float, side: float) -> None:
    """The mode after those that these margins end."""
    if side > 0.0:
        toward = 1.0 if x[_Y] >= x[_Q] else -1.0
        if mode[_SIDE] != 0.0:
            mode[_SIDE] = 0.0
        elif p.stop_stiffness > 0.0:
            mode[_SIDE] = toward
        else:
            # Fully plastic: the momentum is kept, and whatever stuck goes along.
            mode[_SIDE] = toward
            motor, body = p.mass * (1.0 - p.load_share), p.mass * p.load_share + now[_JOINED]
            x[_V] = x[_W] = (motor * x[_W] + body * x[_V]) / (motor + body)
            x[_Y] = x[_Q] + 0.5 * toward * p.gap
            if p.presliding == 0.0 and x[_V] != 0.0:
                mode[_SLIP] = 1.0 if x[_V] > 0.0 else -1.0
                return
    if contact > 0.0:
        if p.presliding > 0.0:
            mode[_SLIP] = -mode[_SLIP]
        else:
            _stopped(p, x, mode, now, t)
