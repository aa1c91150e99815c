"""Break-away force: the force at the onset of motion after rests.

A joint rests where its mean velocity stays below the limit for a while. It has started where its position leaves that rest by
more than the scatter there and doesn't come back. The break-away force is the largest from the sample before to the one after,
known no better than by half of what the force changes up to it from sample to sample.

Where a stiff drive leads the motion instead of the force, the joint moves at its full speed while the friction still builds up:
the break-away force is then the largest force on the way to settled motion.

Source: Armstrong-Helouvry, Dupont, Canudas de Wit 1994, break-away experiments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_closing

from ...record import Array, Record
from .parts import Motion, Part, runs
from .presliding import serial_mean

__all__ = ["BreakAway", "Onset", "break_aways", "onsets"]

_REST_TIME = 0.1  # [s]
_REST_SAMPLES = 5
_FAR = 0.02  # of all travel
_LED = 0.8  # of the settled force: a start below it at full speed is led by the drive


@dataclass(frozen=True)
class Onset:
    """One start.

    Attributes:
        time: [s].
        direction: 1 forward, -1 backward.
        force: break-away force [F], with its sign.
        resolution: how well the sampling shows it [F].
        rest: how long the joint had rested [s].
        led: by the drive's motion, see the module.
    """

    time: float
    direction: float
    force: float
    resolution: float
    rest: float
    led: bool


@dataclass(frozen=True)
class BreakAway:
    """Starts of one recording into one direction: force with standard error [F], ``n`` of them, mean rest before them [s]."""

    source: str
    load: float
    direction: float
    n: int
    force: tuple[float, float]
    rest: float
    resolution: float
    led: bool


def onsets(record: Record, motion: Motion, parts: Sequence[Part], force: Array) -> list[Onset]:
    """Every start after a rest; arguments as in :func:`.presliding.reversals`."""
    found = []
    direction, time, position = motion.direction, record.time, record.position
    # Jitter about the limit doesn't end a rest.
    resting_all = binary_closing(direction == 0.0, np.ones(motion.window))
    for first, last in runs(resting_all):
        if last >= record.n_samples - 2 or time[last - 1] - time[first] < _REST_TIME or last - first < _REST_SAMPLES:
            continue
        sign = float(direction[last])
        if sign == 0.0:
            continue
        inner = slice(first + (last - first) // 4, max(last - motion.window, first + (last - first) // 4 + 3))
        level = float(np.median(position[inner]))
        step = np.abs(np.diff(position[first : last + motion.window]))
        smallest = float(np.min(step[step > 0])) if np.any(step > 0) else 0.0
        limit = max(6.0 * float(np.std(position[inner])), 1.01 * min(smallest, 1e-3 * float(np.ptp(position))))
        end = min(last + motion.window, record.n_samples - 1)
        resting = np.flatnonzero(sign * (position[first:end] - level) <= limit)
        at = first + int(resting[-1]) if resting.size else last
        if not 1 <= at < record.n_samples - 1 or not np.all(record.mask[at - 1 : at + 2]):
            continue
        # Creep that comes to rest again is no start.
        moving = next((a, b) for a, b in runs(direction == sign) if b > last)
        if sign * (position[moving[1] - 1] - position[moving[0]]) < _FAR * float(np.ptp(position)):
            continue
        around = sign * force[at - 1 : at + 2]
        peak = int(np.argmax(around))
        size, led = float(around[peak]), False
        resolution = 0.5 * abs(float(force[at - 1 + peak] - force[max(at - 2 + peak, 0)]))
        following = [part for part in parts if part.first > at and part.direction == sign]
        if following and np.all(direction[at + motion.window : following[0].first] == sign):
            part = following[0]
            way = sign * force[at : part.first + 1]
            settled = sign * float(np.mean(force[part.first : part.last]))
            middle = at + int(np.argmax(way >= 0.5 * settled))
            if size < _LED * settled and abs(motion.velocity[middle]) > 0.5 * abs(part.velocity):
                size, led = float(np.max(way)), True
        found.append(Onset(float(time[at]), sign, sign * size, resolution, float(time[at] - time[first]), led))
    return found


def break_aways(record: Record, load: float, found: Sequence[Onset]) -> list[BreakAway]:
    """Means over the starts of one recording, by direction."""
    result = []
    for sign in (1.0, -1.0):
        own = [onset for onset in found if onset.direction == sign]
        led = [onset for onset in own if onset.led]
        if len(led) > len(own) / 2:
            own = led  # of the others no settled motion follows by which to tell that they are led too
        if not own:
            continue
        resolution = float(np.mean([onset.resolution for onset in own]))
        mean, error = serial_mean(np.array([onset.force for onset in own]))
        # Where the onset lies within its sample differs from start to start.
        error = float(np.hypot(error if np.isfinite(error) else 0.0, resolution / np.sqrt(3.0 * len(own))))
        rest = float(np.mean([onset.rest for onset in own]))
        result.append(BreakAway(record.source, load, sign, len(own), (mean, error), rest, resolution, any(o.led for o in own)))
    return result
