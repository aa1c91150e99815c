"""The controlled stop: a braking force as a function of speed, and a bound on the time and distance that it takes.

Braking law, with the force limit F_b, the rate r, the least inertia m and the time constant T_b:

    F(v) = -sgn(v) min(F_b, sqrt(r m |v|), m |v| / T_b)

On the square root an axis of inertia m or more loses speed so that the force changes by at most r/2, which leaves room for
latency; on the straight line speed decays with T_b. The force therefore never has to change faster than r, and the speed keeps
its sign.

Bounds from speed v > 0 under the force F_0. Until the force has come from F_0 to F(v), which takes t_1 = t_l + (F_0 + F(v))/r
with the latency t_l, the speed grows at most to v_1 = v + (F_0 t_l + F_0^2 / 2 r + L t_1) / m, with the largest load L. From
there an axis of the largest inertia M is stopped; since 1/min(a, b, c) <= 1/a + 1/b + 1/c,

    distance <= v_1 t_1 + M v_1^2 / (2 (F_b - L)) + 2 M v_1^(3/2) / (3 sqrt(r m)) + M T_b v_1 / m
    time     <= t_1 + M v_1 / (F_b - L) + 2 M sqrt(v_1 / (r m)) + (M T_b / m) ln(v_c / v_rest),  v_c = min(v_1, r T_b^2 / m)

Under a load that drives the axis these hold up to the slow motion in which load and law balance, |v| <= L T_b / m, which the
hold after the stop takes away.
Source: elementary; the square root is the switching curve of a double integrator (Athans and Falb 1966, Optimal Control,
section 7-2) applied to a force that is limited in rate.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from .limits import Limits, SafetyError

__all__ = ["Stop", "brake_force", "stop_from"]


class Stop(NamedTuple):
    """Bounds on a stop: time until the axis rests [s] and distance [x]."""

    time: float
    distance: float


def brake_force(limits: Limits, speed: float) -> float:
    """Size of the braking force [F] at ``speed`` >= 0 [x/s]."""
    inertia = limits.inertia_min
    return min(limits.force, math.sqrt(limits.force_rate * inertia * speed), inertia * speed / limits.brake_time)


def braking_distance(limits: Limits, speed: float, force: float) -> float:
    """Bound on the way [x] until a stop from ``speed`` >= 0 [x/s] under ``force`` [F], positive in the direction of motion."""
    time, peak = _until_braking(limits, speed, force)
    light, heavy = limits.inertia_min, limits.inertia_max
    distance = peak * time + heavy * peak * peak / (2.0 * (limits.force - limits.load))
    distance += heavy * peak * math.sqrt(peak / (limits.force_rate * light)) * (2.0 / 3.0)
    return distance + heavy * limits.brake_time * peak / light


def _until_braking(limits: Limits, speed: float, force: float) -> tuple[float, float]:
    """Time until the braking force has been built up [s], and the largest speed until then [x/s]."""
    rate = limits.force_rate
    time = limits.latency + max(force + brake_force(limits, speed), 0.0) / rate
    pushing = max(force, 0.0)
    gained = pushing * (limits.latency + 0.5 * pushing / rate) + limits.load * time
    return time, speed + gained / limits.inertia_min


def stop_from(limits: Limits, speed: float, force: float) -> Stop:
    """Bounds on the stop of an axis that moves at ``speed`` [x/s] of either sign under ``force`` [F].

    The law acts on a speed that is as old as the latency, the difference quotient included.

    Raises:
        SafetyError: the inertia isn't known, so that a stop only takes the force away.
    """
    if not limits.brakes:
        raise SafetyError("safety limits", "without inertia_min a stop doesn't brake", "give inertia_min and inertia_max")
    if speed < 0.0:
        speed, force = -speed, -force
    until, peak = _until_braking(limits, speed, force)
    light, heavy, rate = limits.inertia_min, limits.inertia_max, limits.force_rate
    time = until + heavy * peak / (limits.force - limits.load) + 2.0 * heavy * math.sqrt(peak / (rate * light))
    straight = min(peak, rate * limits.brake_time**2 / light)
    if straight > limits.at_rest:
        time += heavy / light * limits.brake_time * math.log(straight / limits.at_rest)
    return Stop(time, braking_distance(limits, speed, force))
