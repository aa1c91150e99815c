"""Speed limit and position range: the force that keeps the axis inside, instead of one that would drive it beyond.

Speed: while the force comes down from F to zero at the rate r, the speed still grows by at most F^2 / (2 r m). So with w the
largest speed that the axis may have by now and the speed limit V, a force above sqrt(2 r m (V - w)) - L is cut to it. The cut
comes down with at most the rate r.

Position: a force under which the axis couldn't be stopped inside the range any more, by the bound of
:mod:`fric.control.safety.stopping`, gives way to the braking force.
"""

from __future__ import annotations

import math

from .limits import Limits
from .stopping import brake_force, braking_distance

__all__ = ["guarded"]


def guarded(limits: Limits, wanted: float, position: float, velocity: tuple[float, float], ahead: float) -> tuple[float, str]:
    """The force that may take the place of ``wanted`` [F], and the limit that changed it (empty: none).

    Args:
        limits: of the axis.
        wanted: force within force and rate limits [F].
        position: newest reading [x].
        velocity: bounds on the velocity now, lower and upper [x/s].
        ahead: time from the newest reading until the next force can act [s].
    """
    upper, hit_above = _held(limits, wanted, limits.position_max - position, velocity[1], ahead)
    lower, hit_below = _held(limits, -wanted, position - limits.position_min, -velocity[0], ahead)
    if hit_above and hit_below:
        return 0.0, hit_above  # pressed from both sides: the readings are too uncertain for either
    if hit_above:
        return upper, hit_above
    return (-lower, hit_below) if hit_below else (wanted, "")


def _held(limits: Limits, force: float, room: float, speed: float, ahead: float) -> tuple[float, str]:
    """The same for one direction: ``force`` and ``speed`` positive towards the limit, which is ``room`` [x] away."""
    if not limits.brakes:
        if force > 0.0 and room <= max(speed, 0.0) * ahead:
            return 0.0, "position limit"
        return (0.0, "speed limit") if force > 0.0 and speed >= limits.speed else (force, "")
    hit = ""
    inertia = limits.inertia_min
    if speed > 0.0 or force > 0.0:
        left = limits.speed - speed - max(force, 0.0) * limits.latency / inertia
        if left < math.inf:
            most = math.sqrt(2.0 * limits.force_rate * inertia * left) if left > 0.0 else inertia * left / limits.brake_time
            most = max(most - limits.load, -limits.force)
            if force > most:
                force, hit = most, "speed limit"
        if room < math.inf:
            moving = max(speed, 0.0)
            room -= moving * ahead
            if room < braking_distance(limits, moving, max(force, 0.0)):
                brake = -brake_force(limits, moving)
                if force > brake:
                    force, hit = brake, "position limit"
    return force, hit
