"""Friction over velocity from stick-slip: acceleration integrated, force less inertia.

A slip is where the acceleration leaves its noise. The joint rests before and after it, so that the velocity, the integral of
the acceleration, is zero at both ends; what the integral leaves there is the accelerometer's offset, which is taken out as a
straight line. The friction is the driving force less m a. While the joint speeds up it goes along one branch over velocity,
while it slows down along another: the loop between them is what friction remembers (frictional lag, Szell's hysteresis), and
no curve of velocity alone has it. Both branches are averaged over all slips at common velocities, with the standard error of
these means.

The driving force is the recorded effort; from pressures it is A_a p_a - A_b p_b.

Source: Szell, Sec. 4.2, Figs. 5 to 9.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...record import Array
from .parts import runs
from .presliding import serial_mean

__all__ = ["Slip", "StickSlip", "slips", "stick_slip"]

_LOUD = 8.0  # noise levels of the acceleration at which it is a slip's
_TOGETHER = 0.02  # [s] a slip may be quiet in its middle, where its acceleration changes sign
_FEWEST = 8  # samples of a slip
_LEVELS = 14


@dataclass(frozen=True, eq=False)
class Slip:
    """One slip: arrays of shape ``(n,)`` from rest to rest, ``direction`` of its motion, friction at its ``onset`` [F]."""

    time: Array
    velocity: Array
    friction: Array
    direction: float
    onset: float


@dataclass(frozen=True, eq=False)
class StickSlip:
    """Branches over velocity, averaged over slips of one direction; arrays of shape ``(n_levels,)``.

    Attributes:
        direction: 1 forward, -1 backward.
        n: number of slips.
        speed: [x/s].
        rising: friction while speeding up, in the direction of motion [F].
        rising_error: its standard error [F].
        falling: friction while slowing down [F].
        falling_error: its standard error [F].
        loop: mean difference of the branches over the speeds and its standard error [F].
        break_away: friction at the onset and its standard error [F].
    """

    direction: float
    n: int
    speed: Array
    rising: Array
    rising_error: Array
    falling: Array
    falling_error: Array
    loop: tuple[float, float]
    break_away: tuple[float, float]


def slips(time: Array, acceleration: Array, force: Array, mass: float) -> list[Slip]:
    """The slips of a recording.

    Args:
        time: [s], shape ``(n,)``.
        acceleration: as measured, offset and all [x/s^2].
        force: that drives the joint [F].
        mass: [F s^2/x].
    """
    step = float(np.median(np.diff(time)))
    quiet = acceleration - float(np.median(acceleration))
    noise = 1.4826 * float(np.median(np.abs(quiet)))
    loud = np.abs(quiet) > max(_LOUD * noise, 0.02 * float(np.max(np.abs(quiet))))
    gap = max(round(_TOGETHER / step), 2)
    for first, last in list(runs(~loud)):
        if first > 0 and last < loud.shape[0] and last - first <= gap:
            loud[first:last] = True
    found = []
    for first, last in runs(loud):
        low, high = max(first - 3, 0), min(last + 3, time.shape[0])
        if last - first < _FEWEST or low == 0 or high == time.shape[0]:
            continue
        t, a = time[low:high], acceleration[low:high]
        velocity = np.concatenate([[0.0], np.cumsum(0.5 * (a[1:] + a[:-1]) * np.diff(t))])
        drift = velocity[-1] / (t[-1] - t[0])
        velocity = velocity - drift * (t - t[0])
        peak = float(velocity[np.argmax(np.abs(velocity))])
        sign = float(np.sign(peak))
        if peak == 0.0 or float(np.min(sign * velocity)) < -0.1 * abs(peak):
            continue
        friction = force[low:high] - mass * (a - drift)
        found.append(Slip(t, velocity, friction, sign, float(friction[2])))
    return found


def _branches(slip: Slip, speed: Array) -> tuple[Array, Array]:
    """Friction in the direction of motion at ``speed`` while speeding up and while slowing down."""
    v, f = slip.direction * slip.velocity, slip.direction * slip.friction
    top = int(np.argmax(v))
    up, down = np.maximum.accumulate(v[: top + 1]), np.maximum.accumulate(v[top:][::-1])
    return np.interp(speed, up, f[: top + 1]), np.interp(speed, down, f[top:][::-1])


def stick_slip(found: Sequence[Slip]) -> list[StickSlip]:
    """Branches by direction; three slips at least."""
    result = []
    for sign in (1.0, -1.0):
        own = [slip for slip in found if slip.direction == sign]
        if len(own) < 3:
            continue
        tops = np.array([float(np.max(np.abs(slip.velocity))) for slip in own])
        # Slips much smaller than the others don't reach the speeds at which branches are compared.
        own = [slip for slip, top in zip(own, tops, strict=True) if top >= 0.7 * float(np.median(tops))]
        speed = np.linspace(0.08, 0.9, _LEVELS) * min(float(np.max(np.abs(slip.velocity))) for slip in own)
        pairs = [_branches(slip, speed) for slip in own]
        rising, falling = np.stack([pair[0] for pair in pairs]), np.stack([pair[1] for pair in pairs])
        up = np.array([serial_mean(rising[:, k]) for k in range(_LEVELS)])
        down = np.array([serial_mean(falling[:, k]) for k in range(_LEVELS)])
        result.append(
            StickSlip(
                direction=sign,
                n=len(own),
                speed=speed,
                rising=up[:, 0],
                rising_error=up[:, 1],
                falling=down[:, 0],
                falling_error=down[:, 1],
                loop=serial_mean(np.mean(rising - falling, axis=1)),
                break_away=serial_mean(np.array([sign * slip.onset for slip in own])),
            )
        )
    return result
