"""What an axis of other hands does: the motions of work, not those of an experiment.

Point-to-point moves with rests, sweeps to and fro at constant speeds, jogging (short moves at low speeds in which somebody
looks for a place), and a swept sine as of a commissioning. Speeds of moves are trapezoids behind a moving average, which
limits the jerk as motion controllers do. A recording is a random sequence of the four until its time is over; no force is
added to the controller's.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ....record import Array
from ..excitation import Axis

__all__ = ["drawn_motion"]

_REST = (0.1, 1.2)  # [s] between two moves
_ROUNDED = (0.01, 0.06)  # [s] of the moving average
_WITHIN = 0.45  # of the travel, on each side of its middle
_ENDS = 0.3  # [s] at rest, first and last

Way = list[Array]
"""Stretches of speed [m/s], one after the other."""


class _Walk:
    """A way that is being made: where it has come to, and what came so far."""

    def __init__(self, axis: Axis, random: np.random.Generator) -> None:
        self.axis = axis
        self.random = random
        self.way: Way = []
        self.place = 0.0
        self.time = 0.0

    def rest(self, time: float) -> None:
        self._add(np.zeros(max(round(time / self.axis.sample_time), 1)))

    def go(self, goal: float, speed: float, acceleration: float) -> None:
        """A trapezoid of the speed to ``goal`` [m]; a triangle where the way is short."""
        goal = float(np.clip(goal, -_WITHIN * self.axis.travel, _WITHIN * self.axis.travel))
        distance = abs(goal - self.place)
        if distance < 1e-4 * self.axis.travel:
            return
        h = self.axis.sample_time
        top = min(speed, float(np.sqrt(distance * acceleration)))
        ramp = max(round(top / acceleration / h), 1)
        level = max(round((distance / top - top / acceleration) / h), 0)
        shape = np.concatenate([(np.arange(ramp) + 0.5) / ramp, np.ones(level), (np.arange(ramp)[::-1] + 0.5) / ramp])
        width = min(max(round(float(self.random.uniform(*_ROUNDED)) / h), 1), 4 * ramp)
        shape = np.convolve(shape, np.full(width, 1.0 / width))
        self._add(shape * (goal - self.place) / (float(np.sum(shape)) * h))
        self.place = goal

    def swing(self, speed: Array) -> None:
        """This speed, less its mean: it ends where it began."""
        self._add(speed - float(np.mean(speed)))

    def _add(self, speed: Array) -> None:
        self.way.append(speed)
        self.time += speed.shape[0] * self.axis.sample_time


def _point_to_point(walk: _Walk) -> None:
    axis, random = walk.axis, walk.random
    for _ in range(int(random.integers(3, 7))):
        goal = float(random.uniform(-_WITHIN, _WITHIN)) * axis.travel
        quick = float(np.exp(random.uniform(np.log(0.15), 0.0)))
        walk.go(goal, quick * axis.top_speed, axis.acceleration * float(random.uniform(0.5, 2.0)))
        walk.rest(float(random.uniform(*_REST)))


def _sweeps(walk: _Walk) -> None:
    """To and fro around a place at a speed, then at another one."""
    axis, random = walk.axis, walk.random
    for quick in np.exp(random.uniform(np.log(0.04), np.log(0.8), int(random.integers(2, 4)))):
        speed = float(quick) * axis.top_speed
        half = min(0.5 * speed * float(random.uniform(0.6, 1.4)), 0.4 * axis.travel)
        middle = float(random.uniform(-1.0, 1.0)) * (_WITHIN * axis.travel - half)
        walk.go(middle - half, 0.5 * axis.top_speed, 0.6 * axis.acceleration)
        for _ in range(int(random.integers(1, 4))):
            walk.go(middle + half, speed, axis.acceleration)
            walk.go(middle - half, speed, axis.acceleration)


def _jogging(walk: _Walk) -> None:
    axis, random = walk.axis, walk.random
    side = float(random.choice([-1.0, 1.0]))
    for _ in range(int(random.integers(4, 10))):
        speed = axis.top_speed * float(np.exp(random.uniform(np.log(0.01), np.log(0.15))))
        walk.go(walk.place + side * speed * float(random.uniform(0.2, 0.9)), speed, 0.7 * axis.acceleration)
        walk.rest(float(random.uniform(0.05, 0.6)))
        if random.random() < 0.45:
            side = -side


def _swept_sine(walk: _Walk) -> None:
    """From a slow swing to a quick one (exponential sweep; Farina 2000), whose speed and acceleration stay usual."""
    axis, random = walk.axis, walk.random
    walk.go(0.2 * walk.place, 0.5 * axis.top_speed, axis.acceleration)
    time, low, high = float(random.uniform(3.0, 6.0)), 0.5, float(random.uniform(4.0, 8.0))
    n = round(time / axis.sample_time)
    ratio = np.log(high / low)
    at = np.arange(n) / n
    frequency = low * np.exp(ratio * at)
    phase = 2.0 * np.pi * time / ratio * (frequency - low)
    top = np.minimum(0.7 * axis.top_speed, 1.5 * axis.acceleration / (2.0 * np.pi * frequency))
    top = np.minimum(top, 0.15 * axis.travel * 2.0 * np.pi * frequency)
    speed = top * np.sin(phase) * np.minimum(1.0, np.minimum(at, 1.0 - at) * time / 0.3)
    walk.swing(speed)


_WORK: tuple[Callable[[_Walk], None], ...] = (_point_to_point, _sweeps, _jogging, _swept_sine)


def drawn_motion(axis: Axis, duration: float, random: np.random.Generator) -> tuple[Array, Array]:
    """Reference [m] of a recording of ``duration`` [s] or little more, and no added force [N]; of shape ``(n_samples,)``."""
    walk = _Walk(axis, random)
    walk.rest(_ENDS)
    while walk.time < duration:
        # Each of them once in every round, so that none is missing where they are long.
        for number in random.permutation(len(_WORK)):
            if walk.time < duration:
                _WORK[int(number)](walk)
    walk.rest(_ENDS)
    speed = np.concatenate(walk.way)
    path = np.concatenate([[0.0], np.cumsum(speed[:-1])]) * axis.sample_time
    return path, np.zeros_like(path)
