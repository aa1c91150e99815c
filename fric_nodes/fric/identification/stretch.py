"""A contiguous part of a recording at full rate, with its filtered motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from ..record import Array
from ..signals.instrument_noise import level_of
from .differences import differentiated

__all__ = ["FINER", "Motion", "Stretch"]

FINER = 4
"""Steps per sample of the motion that friction states are led along."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion sampled at even steps; arrays of shape ``(n,)``, or one value for load and temperature.

    Attributes:
        time: [s].
        step: [s].
        position: [x].
        velocity: [x/s].
        acceleration: [x/s^2].
        load: relative normal load [1].
        temperature: [K] from reference.
    """

    time: Array
    step: float
    position: Array
    velocity: Array
    acceleration: Array
    load: Array
    temperature: Array


@dataclass(frozen=True, eq=False)
class Stretch:
    """One contiguous, evenly sampled, valid part of a recording at full rate; arrays of shape ``(n,)``.

    Attributes:
        time: [s] from the start of the recording.
        sample_time: [s].
        raw_position: as recorded [x].
        position: filtered [x].
        velocity: [x/s].
        acceleration: [x/s^2].
        effort: force as recorded [F].
        force: mean force about each sample, as of the motion, see :mod:`.differences` [F].
        hold: how the recording holds its force.
        timing_error: standard error of when the force acts [s].
        load: relative normal load [1], one value or ``(n,)``.
        temperature: [K] from reference, one value or ``(n,)``.
        smooth: the filter that the position went through.
        level: standard deviation of the errors of a position that was sampled unevenly [x]; None: as ``raw_position`` shows.
    """

    time: Array
    sample_time: float
    raw_position: Array
    position: Array
    velocity: Array
    acceleration: Array
    effort: Array
    force: Array
    hold: str
    timing_error: float
    load: Array
    temperature: Array
    smooth: Callable[[Array], Array]
    level: float | None = None

    def along(self, raw_position: Array) -> Stretch:
        """The same with another position signal [x], shape ``(n,)``."""
        position, velocity, acceleration = differentiated(self.smooth(raw_position), self.sample_time)
        return replace(self, raw_position=raw_position, position=position, velocity=velocity, acceleration=acceleration)

    @cached_property
    def position_error(self) -> float:
        """Standard deviation of the errors of the recorded position [x]."""
        return level_of(self.raw_position) if self.level is None else self.level

    @cached_property
    def motion(self) -> Motion:
        """The motion at the samples."""
        parts = (self.position, self.velocity, self.acceleration, self.load, self.temperature)
        return Motion(self.time, self.sample_time, *parts)

    @cached_property
    def fine_motion(self) -> Motion:
        """The motion at the middle of each of :data:`FINER` steps per interval between samples, for what depends on its path.

        Between two samples a contact may turn from one direction to the other; a velocity held around a sample would take that
        away.
        """
        h = self.sample_time
        fine = h / FINER
        path = CubicSpline(self.time, self.position)
        edges = self.time[0] + fine * np.arange((self.time.shape[0] - 1) * FINER + 1)
        load, temperature = (
            np.repeat(each[:-1], FINER) if each.shape[0] > 1 else each for each in (self.load, self.temperature)
        )
        middle = edges[:-1] + 0.5 * fine
        return Motion(
            middle, fine, path(middle), np.diff(path(edges)) / fine, np.diff(path(edges, 1)) / fine, load, temperature
        )
