"""Friction over velocity from stick-slip: acceleration integrated, force less inertia.

A slip is where the acceleration, averaged where it is noisy, leaves its noise, on to where nothing of it is left. The joint
rests before and after it, so that the velocity, the integral of the acceleration, is zero at both ends; what the integral
leaves there is the accelerometer's offset, which is taken out as a straight line. The friction is the driving force less m a.
While the joint speeds up it goes along one branch over velocity, while it slows down along another: the loop between them is
what friction remembers (frictional lag, Szell's hysteresis), and no curve of velocity alone has it. Both branches are
averaged over all slips at common velocities, with the standard error of these means.

The driving force is the recorded effort; from pressures it is A_a p_a - A_b p_b.

Source: Szell, Sec. 4.2, Figs. 5 to 9.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from ...record import Array
from .parts import runs
from .presliding import serial_mean

__all__ = ["Slip", "StickSlip", "slips", "stick_slip"]

_LOUD = 6.0  # noise levels of the averaged acceleration at which it is a slip's
_STILL = 2.0  # noise levels below which nothing is left of a slip
_SMALL = 0.02  # of the largest acceleration: averaged until the noise is as small
_LONGEST = 0.004  # [s] of an average
_WINDOW = 20  # samples in which a rest shows its noise
_TOGETHER = 0.02  # [s] a slip may be quiet in its middle, where its acceleration changes sign
_FEWEST = 8  # samples of a slip
_LEVELS = 14


@dataclass(frozen=True, eq=False)
class Slip:
    """One slip: arrays of shape ``(n,)`` from rest to rest, ``direction`` of its motion, friction at its ``onset`` [F].

    Attributes:
        time: [s].
        velocity: [x/s].
        acceleration: less the sensor's offset [x/s^2].
        friction: [F].
        direction: 1 forward, -1 backward.
        onset: friction as it breaks away [F].
    """

    time: Array
    velocity: Array
    acceleration: Array
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


def _rest(acceleration: Array) -> tuple[float, float]:
    """Mean and standard deviation of the acceleration at rest [x/s^2], from the quietest fifth of it."""
    n = acceleration.shape[0] // _WINDOW
    if n < 5:
        return float(np.median(acceleration)), 1.4826 * float(np.median(np.abs(acceleration - np.median(acceleration))))
    windows = acceleration[: n * _WINDOW].reshape(n, _WINDOW)
    spread = np.std(windows, axis=1, ddof=1)
    quiet = spread <= np.quantile(spread, 0.2)
    # The quietest are so by chance too: less than a tenth with this many samples each.
    return float(np.mean(windows[quiet])), float(np.sqrt(np.mean(spread[quiet] ** 2))) * 1.15


def slips(time: Array, acceleration: Array, force: Array, mass: float) -> list[Slip]:
    """The slips of a recording.

    Args:
        time: [s], shape ``(n,)``.
        acceleration: as measured, offset and all [x/s^2].
        force: that drives the joint [F].
        mass: [F s^2/x].
    """
    step = float(np.median(np.diff(time)))
    offset, noise = _rest(acceleration)
    away = acceleration - offset
    top = float(np.quantile(np.abs(away), 0.99))
    # Averaged until the noise is small beside a slip, so that the slow beginning and end of one are seen too.
    width = int(np.clip((noise / (_SMALL * top)) ** 2, 1, max(_LONGEST / step, 1.0))) if top > 0.0 else 1
    smooth = np.abs(uniform_filter1d(away, width))
    quiet = noise / np.sqrt(width)
    loud = smooth > max(_LOUD * quiet, 0.02 * top)
    gap = max(round(_TOGETHER / step), 2)
    for first, last in list(runs(~loud)):
        if first > 0 and last < loud.shape[0] and last - first <= gap:
            loud[first:last] = True
    lasting = smooth > _STILL * quiet
    found = []
    for first, last in runs(loud):
        # On to where nothing is left of it, so that the joint rests at both ends.
        before, after = lasting[:first][::-1], lasting[last:]
        low = first - (int(np.argmin(before)) if not before.all() else first) - width - 2
        high = last + (int(np.argmin(after)) if not after.all() else after.shape[0]) + width + 2
        low, high = max(low, 0), min(high, time.shape[0])
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
        # The last samples before it is seen were quiet by their noise: the first two have none that was chosen.
        found.append(Slip(t, velocity, a - drift, friction, sign, float(np.mean(friction[:2]))))
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
