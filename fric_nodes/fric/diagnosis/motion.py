"""The measured motion of a run, smoothed, and the force that a model needs along it.

The position x [x] at the ends of the intervals is low-passed forward and backward (Butterworth of second order, no phase) and
differentiated: in the middle of each interval of length h [s]

    v_k = (x_k+1 - x_k) / h,     a_k = (v_k+1 - v_k-1) / 2h

A model that is put on this motion gives the force that it needs for it [F]. That is the equation error's way. It does without a
simulation whose motion is the model's own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.signal import butter, sosfiltfilt

from ..identification.innovations import Run
from ..model import Model
from ..record import Array

__all__ = ["SMOOTH", "Motion", "Past", "along", "friction_along", "motion_of", "smooth"]

SMOOTH = 4.0
"""Numerical, times the observer's bandwidth [rad/s]: cutoff of the motion along which a model is led."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The measured motion of one run, smoothed, in the middle of each interval.

    Attributes:
        position: [x], shape ``(n,)`` as the next two.
        velocity: [x/s].
        acceleration: [x/s^2].
        step: between them [s].
    """

    position: Array
    velocity: Array
    acceleration: Array
    step: float


@dataclass(frozen=True, eq=False)
class Past:
    """The part of a recording before a run, along which a model comes to the states that it has where the run begins.

    Attributes:
        run: the intervals before it.
        time: at their ends [s].
        cutoff: at which their motion is smoothed [rad/s].
    """

    run: Run
    time: Array
    cutoff: float

    @cached_property
    def motion(self) -> Motion:
        """The measured motion, smoothed."""
        return motion_of(self.run, self.cutoff)

    @cached_property
    def raw_motion(self) -> Motion:
        """The measured motion, as the encoder gives it."""
        return motion_of(self.run, math.inf)


def along(
    model: Model,
    run: Run,
    time: Array,
    motion: Motion,
    velocity: Array,
    states: tuple[Array, Array],
) -> Array:
    """The force [F] that ``model`` needs along a ``motion``, shape ``(n,)``.

    Args:
        model: put on the motion.
        run: the intervals, with their load and temperature.
        time: at their ends [s], shape ``(n,)``.
        motion: positions and accelerations in their middle.
        velocity: there [x/s], shape ``(n,)``; it may differ from that of ``motion``, for example in its sign at rest.
        states: the model's inner states at the beginning; they are updated in place to those at the end.
    """
    return _predicted(model, run, time, motion, velocity, states)[0]


def friction_along(model: Model, run: Run, time: Array, motion: Motion, states: tuple[Array, Array]) -> Array:
    """The part of that force that comes from the slip levels [F], shape ``(n,)``; arguments as those of :func:`along`.

    Without slip dynamics it is their sum in the direction of motion, also where that is below zero.
    """
    return _predicted(model, run, time, motion, motion.velocity, states)[1]


def _predicted(
    model: Model, run: Run, time: Array, motion: Motion, velocity: Array, states: tuple[Array, Array]
) -> tuple[Array, Array]:
    needed, friction = np.empty_like(velocity), np.empty_like(velocity)
    model.linked_loops.predict(
        model.linked, time - 0.5 * motion.step, motion.position, velocity, motion.acceleration,
        motion.step, run.load, run.temperature, *states, needed, friction,
    )  # fmt: skip
    return needed, friction


def smooth(signal: Array, step: float, cutoff: float) -> Array:
    """``signal`` without what is faster than ``cutoff`` [rad/s], without phase."""
    edge = cutoff * step / math.pi
    if edge >= 0.9:
        return signal
    # scipy hands back a view that runs backwards: compiled loops would be compiled for that once more.
    return np.ascontiguousarray(sosfiltfilt(butter(2, edge, output="sos"), signal))


def motion_of(run: Run, cutoff: float) -> Motion:
    """The measured motion of ``run`` without what is faster than ``cutoff`` [rad/s]."""
    step = run.sample_time
    position = smooth(np.concatenate([[run.start[0]], run.position]), step, cutoff)
    velocity = np.diff(position) / step
    return Motion(0.5 * (position[1:] + position[:-1]), velocity, np.gradient(velocity, step), step)
