"""End stop: the joint stands at one end of its travel although the force pushes outward harder than it has to anywhere else.

Harder than the force that moved it outward anywhere, less inertia, the moments before it broke away included, and than the
spring that the rest of the recording shows would explain. A joint that was brought to rest there by its controller, or is
held against a spring, is at no stop: it must have been stopped abruptly, or take a force that changes without giving way.

Nor is a joint that is held against gravity, which may be heavier there than anywhere else. A joint that friction F holds
rests under any force from R to R + 2 F, R being the force under which it moves back from that place: gravity and friction are
the same then. So a stop is where the push exceeds R by more than sliding and break-away force together. Where the reference
goes no farther than the joint, it was held. Where the joint never comes back and no reference was recorded, that can't be
told, and nothing is left out. The value is the time spent at stops.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation, maximum_filter1d, uniform_filter1d

from ...record import Array, Mask
from ..check import Check, Evidence, Finding, each
from ..view import View, balance_on, friction_along, runs

__all__ = ["CHECK", "Stop", "stops"]

_SHORTEST = 0.05  # [s]
_SLOPE_TIME = 0.05  # [s] over which speed is taken: slow enough for encoder steps, fast enough to see the stop
_BREAK_AWAY = 0.05  # [s] before motion that still belong to it
_STANDS = 0.02  # of the high speed
_NEAR = 0.002  # of the travel
_HARDER = 0.1  # of the force range
_CHANGES = 0.3  # of the force range, within a stand
_BREAKS = 1.5  # break-away force over sliding friction, at most
_RETURNS = 0.05  # [s] over which the force of the motion back is taken
_FOLLOWS = 3.0  # times the usual distance to the reference
_ABRUPT = 0.15  # of the high speed, lost within a few samples before a stand


class Stop(NamedTuple):
    """A stand at an end stop: first sample, the one after the last, where [x], ``lowest`` or ``highest``, and the push [F]."""

    first: int
    last: int
    position: float
    end: str
    push: float


def _speed(position: Array, time: Array, step: float, width_time: float) -> Array:
    width = max(round(width_time / step), 1)
    velocity = np.zeros_like(position)
    if position.shape[0] > 2 * width:
        velocity[width:-width] = (position[2 * width :] - position[: -2 * width]) / (time[2 * width :] - time[: -2 * width])
    return velocity


def _spring(position: Array, effort: Array, away: Mask) -> Array:
    """The force of a spring, as the motion away from the ends shows it, ``(n,)``; zero where there is none."""
    if np.sum(away) < 40:
        return np.zeros_like(position)
    q, u = position[away], effort[away]
    middle = float(np.mean(q))
    slope = float(np.sum((q - middle) * (u - np.mean(u)))) / max(float(np.sum((q - middle) ** 2)), 1e-300)
    explained = slope**2 * float(np.var(q)) / max(float(np.var(u)), 1e-300)
    return slope * (position - middle) if slope > 0.0 and explained > 0.3 else np.zeros_like(position)


def _inertial(view: View) -> tuple[float, Array]:
    """Sign that the effort should have, and what of it accelerates the axis, as far as that is known, ``(n_samples,)`` [F].

    The mass is that of the motion away from the ends: at a stop it is the stop that brings the joint to rest, not the force.
    """
    friction, error, _ = friction_along(view)
    position = view.even.position
    near = max(_NEAR * view.travel, 1.5 * view.resolution)
    ends = (position - np.min(position) < near) | (np.max(position) - position < near)
    width = round((_SLOPE_TIME + 1.0 / view.cutoff) / view.h)
    apart = view.sliding & ~maximum_filter1d(ends, 2 * width + 1)
    balance = balance_on(view, np.flatnonzero(apart))
    if not balance.value("mass") > 4.0 * balance.error("mass"):
        balance = view.balance
    mass, mass_error = balance.value("mass"), balance.error("mass")
    side = -1.0 if friction < -4.0 * error and mass < 0.0 else 1.0
    if not side * mass > 4.0 * mass_error:
        return side, np.zeros(view.record.n_samples)
    grid = np.arange(view.n) * view.h
    return side, np.asarray(side * mass * np.interp(view.record.time, grid, view.acceleration))


def stops(view: View) -> list[Stop]:
    """Where the joint of ``view`` stands at a stop."""
    return _stands(view)[0]


def _held(view: View, stand: slice, outward: float, near: float) -> bool | None:
    """Whether the reference goes no farther out than the joint stands; None where there is none, or it is not much farther."""
    reference = view.record.reference
    if reference is None:
        return None
    off = outward * (reference - view.record.position)
    usual = float(np.median(np.abs(off)))
    beyond = float(np.median(off[stand]))
    return True if beyond <= max(near, usual) else None if beyond <= _FOLLOWS * usual else False


def _back(against: Array, back: Mask, last: int, step: float) -> float | None:
    """Outward force under which it moves back for the first time after ``last`` [F]; None where it never does."""
    later = np.flatnonzero(back[last:])
    if later.size == 0:
        return None
    first = last + int(later[0])
    return float(np.median(against[first : first + max(round(_RETURNS / step), 1)]))


def _stands(view: View) -> tuple[list[Stop], list[Stop]]:
    """Where the joint of ``view`` stands at a stop; and where it may."""
    record = view.record
    position, time = record.position, record.time
    side, inertial = _inertial(view)
    effort = side * record.effort
    travel, spread = float(np.ptp(position)), float(np.ptp(effort))
    if travel == 0.0 or spread == 0.0 or not view.moves:
        return [], []
    step = record.sample_time
    velocity = _speed(position, time, step, _SLOPE_TIME)
    quick = _speed(position, time, step, 0.2 * _SLOPE_TIME)
    high = float(np.quantile(np.abs(velocity), 0.98))
    limit = _STANDS * high
    near = max(_NEAR * travel, 1.5 * view.resolution)
    slow = np.abs(velocity) <= max(limit, 1.5 * view.resolution / _SLOPE_TIME)
    friction = max(float(np.nan_to_num(friction_along(view)[0])) * side, 0.0)
    unsure = 2.0 * float(np.nan_to_num(view.balance.residual))
    found: list[Stop] = []
    unclear: list[Stop] = []
    for outward, end, name in ((-1.0, float(np.min(position)), "lowest"), (1.0, float(np.max(position)), "highest")):
        there = np.abs(position - end) < near
        moving = velocity * outward > limit
        if not np.any(moving):
            continue
        # The moments before it moves are when it breaks away, and may take the most.
        width = max(round(_BREAK_AWAY / step), 1)
        moving = binary_dilation(moving, structure=np.arange(2 * width + 1) <= width) & ~there
        push = outward * (effort - _spring(position, effort, moving))
        if not np.any(moving):
            continue
        # Means over the shortest stand: what lasts for less, a reversal or an inertia a sample off, holds nothing still.
        lasting = max(round(_SHORTEST / step), 1)
        push, against = (uniform_filter1d(part, lasting) for part in (push, push - outward * inertial))
        apart = moving & ~maximum_filter1d(there, lasting + 1)
        needed = float(np.quantile(against[apart if np.any(apart) else moving], 0.995)) + _HARDER * spread
        for first, last in runs(there & slow):
            most = float(np.max(push[first:last]))
            if time[last - 1] - time[first] < _SHORTEST or most < needed:
                continue
            before = slice(max(first - round(2.0 * _SLOPE_TIME / step), 0), first + 1)
            abrupt = float(np.max(outward * quick[before])) > _ABRUPT * high and _hard(outward * quick, before, high)
            changes = float(np.ptp(effort[first:last])) > _CHANGES * spread
            held = _held(view, slice(first, last), outward, near)
            if held or not (abrupt or changes):
                continue
            stop = Stop(first, last, end, name, side * outward * float(np.max(outward * effort[first:last])))
            force = _back(against, velocity * outward < -limit, last, step)
            if force is None and held is None:
                unclear.append(stop)
            elif force is None or most > force + (1.0 + _BREAKS) * friction + unsure:
                found.append(stop)
    return found, unclear


def _hard(speed: Array, before: slice, high: float) -> bool:
    """Whether the speed falls from much to next to nothing within a fifth of the time that is looked at."""
    part = speed[before]
    width = max(part.shape[0] // 5, 2)
    return bool(np.any(part[:-width] - part[width:] > _ABRUPT * high)) if part.shape[0] > width else False


def _judge(view: View, evidence: Evidence) -> Finding:
    if not view.moves:
        return Finding("end_stop", "unknown", "it does not move")
    found, unclear = _stands(view)
    if not found and unclear:
        places = ", ".join(f"{stop.position:.4g}" for stop in {stop.end: stop for stop in unclear}.values())
        detail = f"it stands at {places} {view.record.units.position} under a force until the end: at a stop, or held there"
        return Finding("end_stop", "unknown", detail, remedy="record the reference, and the way back")
    if not found:
        return Finding("end_stop", "ok", "the joint rests nowhere under a force that would move it elsewhere", 0.0, "s")
    time, units = view.record.time, view.record.units
    spans = tuple((float(time[stop.first]), float(time[stop.last - 1])) for stop in found)
    total = sum(b - a for a, b in spans)
    places = ", ".join(f"{stop.position:.4g}" for stop in {stop.end: stop for stop in found}.values())
    push = f"{found[0].push:+.3g} {units.force}"
    detail = f"it stands at {places} {units.position} for {total:.3g} s while the force pushes on, up to {push}"
    remedy = "stay away from the end stops (less travel, another starting point); these parts are left out of a fit"
    return Finding("end_stop", "fault", detail, total, "s", remedy=remedy, time=spans)


CHECK = Check("end_stop", "end stops", "motion", each(_judge))
