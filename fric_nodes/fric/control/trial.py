"""A closed loop with everything between controller and axis: encoder, noise, delay of whole samples, limited force.

What autotuning, benchmarks and verifications run. The axis is one of :class:`fric.axis.SimulatedAxis`; the reading of sample k
is answered by a force that acts ``delay`` samples later over one period.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from ..axis import Measurement
from ..excitation_kind import Trajectory
from ..record import Array
from .controller import Law, Setpoint
from .feedforward_kind import Force

__all__ = ["Body", "Course", "Reference", "follow", "planned", "point_to_point", "sine"]

_FAR = 1e6  # numerical: times the reference's range, beyond which a loop is unstable


class Body(Protocol):
    """What is controlled."""

    @property
    def position(self) -> float:
        """True position [x]."""

    def advance(self, force: float, duration: float) -> None:
        """Lead it over ``duration`` [s] under ``force`` [F]."""

    def measure(self) -> Measurement:
        """What the sensors say now."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A motion wanted, sample by sample; every array has shape ``(n_samples,)``.

    Attributes:
        period: [s].
        position: [x].
        velocity: [x/s].
        acceleration: [x/s^2].
    """

    period: float
    position: Array
    velocity: Array
    acceleration: Array

    @property
    def time(self) -> Array:
        """[s], shape ``(n_samples,)``."""
        return self.period * np.arange(self.position.shape[0], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Course:
    """What a loop did; every array has shape ``(n_samples,)``.

    Attributes:
        reference: what was wanted.
        position: true, at the readings [x].
        seen: as measured [x].
        force: command that was answered to each reading [F].
        effort: mean force since the last reading, as measured [F].
        feedforward: share of the force [F].
        saturated: number of samples whose force was limited.
        stable: False when the loop was given up.
    """

    reference: Reference
    position: Array
    seen: Array
    force: Array
    effort: Array
    feedforward: Array
    saturated: int
    stable: bool

    @property
    def error(self) -> Array:
        """Reference less true position [x], shape ``(n_samples,)``."""
        return self.reference.position - self.position


def sine(period: float, amplitude: float, frequency: float, duration: float, fade: float = 1.0) -> Reference:
    """A sine that fades in over ``fade`` [s] with two continuous derivatives."""
    t = period * np.arange(round(duration / period), dtype=np.float64)
    w = 2.0 * math.pi * frequency
    s = np.clip(t / fade, 0.0, 1.0)
    g = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    dg = 30.0 * s**2 * (1.0 - s) ** 2 / fade
    ddg = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / fade**2
    sin, cos = np.sin(w * t), np.cos(w * t)
    return Reference(
        period,
        amplitude * g * sin,
        amplitude * (dg * sin + g * w * cos),
        amplitude * (ddg * sin + 2.0 * dg * w * cos - g * w * w * sin),
    )


def planned(motion: Trajectory, period: float) -> Reference:
    """The motion of an excitation, sample by sample."""
    time = np.minimum(period * np.arange(round(motion.duration / period) + 1, dtype=np.float64), motion.duration)
    points = motion.at(time)
    return Reference(period, points.position, points.velocity, points.acceleration)


def point_to_point(
    period: float, points: Sequence[float], move: float, rest: float = 0.0, speed: float = math.inf
) -> Reference:
    """From point to point by moves of least jerk.

    Args:
        period: [s].
        points: where it begins and goes [x].
        move: least duration of a move [s].
        rest: after each move [s].
        speed: largest, for which a move takes longer [x/s].
    """
    n_rest = round(rest / period)
    parts: list[Array] = [np.array([[points[0]], [0.0], [0.0]])]
    for a, b in pairwise(points):
        n = round(max(move, 1.875 * abs(b - a) / speed) / period)  # 1.875: peak over mean speed of least jerk
        s, took = np.arange(1, n + 1) / n, n * period
        position = a + (b - a) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        velocity = (b - a) / took * 30.0 * s**2 * (1.0 - s) ** 2
        parts.append(np.array([position, velocity, (b - a) / took**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)]))
        parts.append(np.array([np.full(n_rest, b), np.zeros(n_rest), np.zeros(n_rest)]))
    whole = np.concatenate(parts, axis=1)
    return Reference(period, whole[0], whole[1], whole[2])


def follow(
    body: Body, law: Law, reference: Reference, forward: Force | None = None, delay: int = 0, age: float = 0.0
) -> Course:
    """Lead ``body`` along ``reference``.

    Args:
        body: what is controlled, at rest where the reference begins.
        law: the controller.
        reference: what is wanted.
        forward: feedforward, already with the preview that the delay asks for.
        delay: of the command, in samples.
        age: of a reading when it is reported, such as that of a mean of several; the law compares it with what was wanted
            then [s].
    """
    n, h = reference.position.shape[0], reference.period
    position, seen, force, effort, ahead = (np.zeros(n) for _ in range(5))
    wanted = np.stack([reference.position, reference.velocity, reference.acceleration], axis=1).tolist()
    then = wanted
    if age > 0.0:
        r, v, a = reference.position, reference.velocity, reference.acceleration
        then = np.stack([r - age * (v - 0.5 * age * a), v - age * a, a], axis=1).tolist()
    late: deque[float] = deque([0.0] * delay)
    # The first motion of a reference at 0 may be of any size: its own range is the scale.
    far = _FAR * max(float(np.ptp(reference.position)), 1e-12)
    stable = True
    for k in range(n):
        said = body.measure()
        position[k], seen[k], effort[k] = body.position, said.position, said.effort
        if not abs(position[k]) < far:
            stable = False
            position[k:] = seen[k:] = math.inf
            break
        now = wanted[k]
        if forward is not None:
            ahead[k] = forward.step(k * h, *now)
        force[k] = law.answer(Setpoint(*then[k]), said.position, h, float(ahead[k]))
        late.append(float(force[k]))
        body.advance(late.popleft(), h)
    return Course(reference, position, seen, force, effort, ahead, law.saturated, stable)
