"""One very small step of the examiner's axis, from the command to the bodies, in the order in which a machine has it.

Semi-implicit Euler: velocities from forces, then positions from velocities. Everything that changes is in one array of states,
whose places have names below; delays keep their past in lines of their own.
"""

from __future__ import annotations

import math
from typing import Any

from .laws import compiled, given_force, level_before_lag, scaled, smooth_force

__all__ = ["N_STATES", "begin", "encoder", "stepped"]

_ATTRACTION = 5e-3  # [s], in which the force of a slipping element settles
_QUICK = 1e-3  # [s], over which the sign of the acceleration is taken

# Places in the array of states: body, motor, side that touches (-1, 0, 1), force of the drive, its rate and the last of three
# lags, heat, level behind the lag (twice), whether that has begun, age of the contact, acceleration, stretch of the bristles,
# structure of the grease, position of the chain, appendage ahead of the body and its velocity.
_Q, _V, _Y, _W, _SIDE, _F, _F_RATE, _F_LAST, _HEAT, _LAG, _LAG_2, _BEGUN = range(12)
_AGE, _RISING, _STRETCH, _GREASE, _CHAIN, _HUNG, _HUNG_RATE = range(12, 19)
N_STATES = 19


@compiled
def begin(p: Any, s: Any, position: float) -> None:
    """States at rest at ``position``."""
    s[_Q] = position
    s[_Y] = position
    s[_CHAIN] = position
    s[_GREASE] = 1.0


@compiled
def encoder(p: Any, s: Any) -> tuple[float, float]:
    """What the encoder sees without noise and rounding, and its rate."""
    two = p.load_share > 0.0
    q = s[_Y] if two else s[_Q]
    v = s[_W] if two else s[_V]
    wave = 2.0 * math.pi / p.eccentricity_period
    return q + p.eccentricity * math.sin(wave * q), v * (1.0 + p.eccentricity * wave * math.cos(wave * q))


@compiled
def _driven(p: Any, s: Any, late: Any, u: float, h: float, count: int, disturbed: float) -> float:
    """Force behind the command path."""
    f = given_force(p, u)
    n_delay = late.shape[0] - 1
    if n_delay > 0:
        slot = count % n_delay
        passed = late[slot]
        late[slot] = f
        f = passed
    if p.actuator == 1.0:
        s[_F] += h / (p.actuator_time + h) * (f - s[_F])
        f = s[_F]
    elif p.actuator == 2.0:
        # Two equal poles with the same lag at low frequency.
        a = 2.0 / p.actuator_time
        s[_F_RATE] += h * (a * a * (f - s[_F]) - 2.0 * a * s[_F_RATE])
        s[_F] += h * s[_F_RATE]
        f = s[_F]
    elif p.actuator == 3.0:
        # Three equal lags in a row.
        r = h / (p.actuator_time / 3.0 + h)
        s[_F] += r * (f - s[_F])
        s[_F_RATE] += r * (s[_F] - s[_F_RATE])
        s[_F_LAST] += r * (s[_F_RATE] - s[_F_LAST])
        f = s[_F_LAST]
    if p.heat > 0.0:
        s[_HEAT] += h / p.heat_time * ((u / p.heat_force) ** 2 - s[_HEAT])
        f /= 1.0 + p.heat * s[_HEAT]
    if p.gain_ripple != 0.0:
        f *= 1.0 + p.gain_ripple * math.sin(2.0 * math.pi * (s[_Y] if p.load_share > 0.0 else s[_Q]) / p.gain_ripple_period)
    f *= max(1.0 - p.fading * abs(s[_W] if p.load_share > 0.0 else s[_V]), 0.0)
    return float(f * (1.0 - p.dip * disturbed))


@compiled
def _resisting(p: Any, s: Any, t: float, h: float, warmer: float) -> float:
    """All forces against the body but those of contact and transmission."""
    q, v = s[_Q], s[_V]
    if p.cable != 0.0:
        s[_CHAIN] = max(q - p.cable_play, min(q + p.cable_play, s[_CHAIN]))
    if p.thixotropy > 0.0:
        s[_GREASE] += h * ((1.0 - s[_GREASE]) / p.thixotropy_time - p.thixotropy_shear * abs(v) * s[_GREASE])
    f = smooth_force(p, q, v, t, warmer, s[_GREASE], s[_CHAIN])
    if p.appendage > 0.0:
        # The appendage moves first; what it feels, the body feels the other way round.
        a = 2.0 * math.pi * p.appendage_frequency
        pull = a * a * s[_HUNG] + 2.0 * p.appendage_damping * a * (s[_HUNG_RATE] - v)
        s[_HUNG_RATE] -= h * pull
        s[_HUNG] += h * (s[_HUNG_RATE] - v)
        f -= p.appendage * pull
    return float(f)


@compiled
def _passed_on(p: Any, s: Any, f: float) -> float:
    """Force that reaches the body: the drive's own, or what the transmission passes on."""
    if p.load_share == 0.0 or s[_SIDE] != 0.0:
        return f  # sides that touch rigidly are one body
    e = s[_Y] - s[_Q]
    half = 0.5 * p.gap
    beyond = 0.0 if abs(e) <= half else e - math.copysign(half, e)
    slip = s[_W] - s[_V]
    if p.shaft > 0.0:
        if p.gap > 0.0 and beyond == 0.0:
            return 0.0
        drive = p.shaft * beyond + p.shaft_square * abs(beyond) * beyond + p.shaft_cubic * beyond**3 + p.shaft_damping * slip
    elif p.stop_stiffness > 0.0 and beyond != 0.0:
        drive = p.stop_stiffness * beyond + p.stop_damping * slip
    else:
        return 0.0
    # A stop only pushes.
    return 0.0 if p.gap > 0.0 and drive * beyond < 0.0 else float(drive)


@compiled
def _lagging(p: Any, s: Any, history: Any, g: float, h: float, count: int) -> float:
    """The level after a lag."""
    if p.lag == 0.0:
        return g
    if p.lag == 3.0:
        n_lag = history.shape[0] - 1
        if n_lag == 0:
            return g
        passed = history[count % n_lag] if count >= n_lag else g
        history[count % n_lag] = g
        return float(passed)
    if s[_BEGUN] == 0.0:
        s[_BEGUN] = 1.0
        s[_LAG] = g
        s[_LAG_2] = g
    if p.lag == 4.0:
        # Two parts of the contact, one quicker than the other.
        s[_LAG] += h / (0.4 * p.lag_time + h) * (g - s[_LAG])
        s[_LAG_2] += h / (1.6 * p.lag_time + h) * (g - s[_LAG_2])
        return float(0.5 * (s[_LAG] + s[_LAG_2]))
    time = p.lag_time if p.lag == 1.0 else 0.5 * p.lag_time
    s[_LAG] += h / (time + h) * (g - s[_LAG])
    s[_LAG_2] += h / (time + h) * (s[_LAG] - s[_LAG_2])
    return float(s[_LAG] if p.lag == 1.0 else s[_LAG_2])


@compiled
def _slid(v: float, push: float, level: float, step_over_mass: float) -> float:
    """The velocity after a step of a body on a rigid contact, pushed by ``push``; exactly zero while it sticks."""
    if v == 0.0:
        if abs(push) <= level:
            return 0.0
        return step_over_mass * (push - math.copysign(level, push))
    after = v + step_over_mass * (push - math.copysign(level, v))
    # A turn needs a stop: whether the body goes on from there is the next step's question.
    return 0.0 if after * v < 0.0 else after


@compiled
def _bristles(p: Any, z: Any, elements: Any, v: float, h: float, level: float) -> float:
    """Friction [N] of a contact with pre-sliding over a step at ``v``; leads the forces ``z`` [N] on."""
    moved = v * h / p.displacement  # in pre-sliding displacements
    if p.presliding == 1.0:
        # dF/dt = K v (1 - F sgn(v)/g) with K = g/d.
        z[0] = (z[0] + level * moved) / (1.0 + abs(moved))
        return float(z[0])
    total = 0.0
    for k in range(elements.shape[0]):
        most = elements[k, 0] * level
        f = z[k] + elements[k, 1] * p.coulomb * moved
        if abs(f) > most:
            if p.presliding == 2.0 and f * v > 0.0:
                # While an element slips, its force is attracted by its share of the level.
                r = h / _ATTRACTION
                f = (z[k] + r * math.copysign(most, v)) / (1.0 + r) if abs(z[k]) > most else math.copysign(most, v)
            else:
                f = math.copysign(most, f)
        z[k] = f
        total += f
    return total


@compiled
def _moved(p: Any, s: Any, z: Any, elements: Any, push: float, g: float, inertia: float, h: float) -> float:
    """Lead the body over the step; its velocity before."""
    before = s[_V]
    if p.presliding == 0.0:
        s[_V] = _slid(before, push, g, h / inertia)
    else:
        contact = _bristles(p, z, elements, before, h, g)
        # Damping acts on the rate at which the contact is being stretched.
        stretch = p.displacement * contact / max(g, 1e-12 * p.mass)
        s[_V] += h / inertia * (push - contact - p.presliding_damping * (stretch - s[_STRETCH]) / h)
        s[_STRETCH] = stretch
    s[_Q] += h * s[_V]
    s[_RISING] = 0.0 if s[_V] == 0.0 else s[_RISING] + h / _QUICK * ((s[_V] - before) / h - s[_RISING])
    if p.dwell > 0.0:
        s[_AGE] = (s[_AGE] + h) / (1.0 + abs(s[_V]) * h / p.dwell_length)
    return float(before)


@compiled
def _motor_moved(p: Any, s: Any, f: float, drive: float, before: float, mass: float, h: float) -> None:
    """Lead the motor over the step, and let rigid sides meet or part."""
    motor = p.mass * (1.0 - p.load_share)
    if s[_SIDE] != 0.0:
        s[_W] = s[_V]
        s[_Y] = s[_Q] + s[_SIDE] * 0.5 * p.gap
        # They part when the motor no longer presses on the load.
        if (f - motor * (s[_V] - before) / h) * s[_SIDE] < 0.0:
            s[_SIDE] = 0.0
        return
    s[_W] += h / motor * (f - drive)
    s[_Y] += h * s[_W]
    if p.gap > 0.0 and p.stop_stiffness == 0.0 and p.shaft == 0.0:
        e = s[_Y] - s[_Q]
        if abs(e) >= 0.5 * p.gap and e * (s[_W] - s[_V]) > 0.0:
            # Fully plastic: momentum is kept.
            s[_SIDE] = math.copysign(1.0, e)
            s[_V] = (motor * s[_W] + mass * s[_V]) / (motor + mass)
            s[_W] = s[_V]
            s[_Y] = s[_Q] + s[_SIDE] * 0.5 * p.gap


@compiled
def stepped(
    p: Any, s: Any, z: Any, elements: Any, late: Any, history: Any,
    u: float, t: float, h: float, count: int, load: float, warmer: float, disturbed: float,
) -> float:  # fmt: skip
    """Lead everything over one step; the sign of the velocity that the encoder sees."""
    two = p.load_share > 0.0
    mass = p.mass * p.load_share if two else p.mass
    if p.payload_time > 0.0 and t >= p.payload_time:
        mass += p.payload
    f = _driven(p, s, late, u, h, count, disturbed)
    resisting = _resisting(p, s, t, h, warmer)
    drive = _passed_on(p, s, f)
    push = drive - resisting
    direction = math.copysign(1.0, s[_V]) if s[_V] != 0.0 else math.copysign(1.0, push)
    g = _lagging(p, s, history, level_before_lag(p, s[_V], direction, s[_RISING], s[_AGE]), h, count)
    share = p.gear_driven if p.gear_form == 1.0 and drive * direction < 0.0 else p.gear
    g = scaled(p, g, s[_Q], direction, t, load, warmer, disturbed) + share * abs(drive)
    inertia = mass + p.mass * (1.0 - p.load_share) if two and s[_SIDE] != 0.0 else mass
    before = _moved(p, s, z, elements, push, g, inertia, h)
    if two:
        _motor_moved(p, s, f, drive, before, mass, h)
    seen = s[_W] if two else s[_V]
    return 1.0 if seen > 0.0 else (-1.0 if seen < 0.0 else 0.0)
