"""The axis as a controller sees it: a model moved by a drive of limited force, seen through an encoder and a force signal.

The force is held between commands; the position is the encoder's, a whole number of its steps; the velocity is the difference
quotient of encoder positions that a drive would report; the effort is the mean force that really acted since the last
measurement, with the noise of a current measurement on it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .model import Model
from .simulate import Simulator, substeps

__all__ = ["Measurement", "SimulatedAxis"]


class Measurement(NamedTuple):
    """What the drive reports: position [x], velocity [x/s], effort [F]."""

    position: float
    velocity: float
    effort: float


class SimulatedAxis:
    """A model in motion with its drive and its sensors.

    Args:
        model: what moves.
        resolution: step of the encoder [x]; 0 for an ideal one.
        force_noise: standard deviation of the force signal [F].
        force_limit: largest force of the drive [F].
        seed: of the noise.

    Attributes:
        saturated: number of intervals in which the drive could not give the force wanted.
    """

    def __init__(
        self, model: Model, *, resolution: float = 0.0, force_noise: float = 0.0, force_limit: float = math.inf, seed: int = 0
    ) -> None:
        self._model = model
        self._simulator = Simulator(model)
        self._resolution = resolution
        self._force_noise = force_noise
        self._force_limit = force_limit
        self._random = np.random.default_rng(seed)
        self._substeps: dict[float, int] = {}
        self._impulse = 0.0
        self._elapsed = 0.0
        self._seen = self._encoder()
        self.saturated = 0

    @property
    def position(self) -> float:
        """True position [x]."""
        return self._simulator.position

    def _encoder(self) -> float:
        position = self._simulator.position
        return position if self._resolution == 0.0 else self._resolution * round(position / self._resolution)

    def advance(self, force: float, duration: float) -> None:
        """Lead the axis over ``duration`` [s] under the commanded force [F], which must be finite."""
        if duration <= 0.0:
            return
        limited = min(max(force, -self._force_limit), self._force_limit)
        if limited != force:
            self.saturated += 1
        n_substeps = self._substeps.get(duration)
        if n_substeps is None:
            n_substeps = substeps(self._model, duration)
            if len(self._substeps) < 64:
                self._substeps[duration] = n_substeps
        self._simulator.run(np.array([limited]), duration, n_substeps)
        self._impulse += self._simulator.applied * duration
        self._elapsed += duration

    def measure(self) -> Measurement:
        """What the drive reports now, about the time since it was last asked."""
        position = self._encoder()
        velocity = effort = 0.0
        if self._elapsed > 0.0:
            velocity = (position - self._seen) / self._elapsed
            effort = self._impulse / self._elapsed
        self._seen = position
        self._impulse = self._elapsed = 0.0
        if self._force_noise > 0.0:
            effort += self._force_noise * float(self._random.standard_normal())
        return Measurement(position, velocity, effort)
