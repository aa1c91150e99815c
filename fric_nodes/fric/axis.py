"""A simulated axis for a controller: a model moved by a drive of limited force, measured by an encoder and a force signal.

The force is held between commands; the position is the encoder's, a whole number of its steps; the velocity is the difference
quotient of encoder positions that a drive would report; the effort is the mean force that really acted since the last
measurement, with the noise of a current measurement on it. Where the command isn't a force (a valve's voltage, a road), the
effort is what the plant says of the force on its contact, by the trapezoidal rule.

A sensor that is read more often than the loop runs (an interferometer at 25 kHz behind a controller at 6.25 kHz) averages: each
position is the mean of the readings since the last one, evenly spaced, the newest at the time of measurement. That takes the
noise down by the root of their number n, and delays the position by (n - 1)/(2 n) of the time between two measurements.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .errors import InputError
from .model import Model
from .record import Array
from .simulation import Simulator, substeps

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
        position_noise: standard deviation of a reading of the encoder [x], before it is rounded to its step.
        readings: of the encoder in each stretch between two measurements, or commands; their mean is what is reported.
        force_noise: standard deviation of the force signal [F].
        force_limit: largest force of the drive [F], or largest command where the command isn't a force.
        seed: of the noise.
        position: where it begins, at rest [x].

    Attributes:
        saturated: number of intervals in which the drive could not give the force wanted.
        signal_names: names of what :meth:`signals` gives.
    """

    def __init__(
        self,
        model: Model,
        *,
        resolution: float = 0.0,
        position_noise: float = 0.0,
        readings: int = 1,
        force_noise: float = 0.0,
        force_limit: float = math.inf,
        seed: int = 0,
        position: float = 0.0,
    ) -> None:
        self._model = model
        self._plant = model.plant
        self._plant_values: Array = np.array(model.plant_values, dtype=np.float64)
        self._simulator = Simulator(model, position)
        self._resolution = resolution
        self._position_noise = position_noise
        self._readings = readings
        self._force_noise = force_noise
        self._force_limit = force_limit
        self._random = np.random.default_rng(seed)
        self._substeps: dict[float, int] = {}
        self._command = 0.0
        self._impulse = 0.0
        self._elapsed = 0.0
        self._read = 0.0
        self._n_read = 0
        self._seen = self._encoder(self._simulator.position)
        self.saturated = 0
        self.signal_names = tuple(signal.name for signal in self._plant.signals)

    @property
    def position(self) -> float:
        """True position [x]."""
        return self._simulator.position

    def set_states(self, states: Sequence[float]) -> None:
        """Begin with these states of the plant, of the shape and in the order that it declares."""
        self._simulator.states[:] = states

    def become(self, model: Model) -> None:
        """Go on with other values, from where the axis is and as it moves.

        Raises:
            InputError: ``model`` has another structure.
        """
        before, simulator = self._simulator, self._successor(model)
        simulator.states, simulator.friction_state, simulator.memory = before.states, before.friction_state, before.memory
        simulator.applied, simulator.time = before.applied, before.time
        self._model, self._simulator = model, simulator
        self._plant_values = np.array(model.plant_values, dtype=np.float64)
        self._substeps.clear()

    def accepts(self, model: Model) -> None:
        """Find out if the axis can go on with ``model``, and leave it as it is.

        Raises:
            InputError: ``model`` has another structure.
        """
        self._successor(model)

    def _successor(self, model: Model) -> Simulator:
        same = [held.effect for held in model.terms] == [held.effect for held in self._model.terms]
        simulator = Simulator(model) if same and model.plant is self._plant else None
        if simulator is None or simulator.friction_state.shape != self._simulator.friction_state.shape:
            raise InputError("model", "has another plant or other terms than the axis", "change values only")
        return simulator

    def _encoder(self, position: float) -> float:
        """One reading of the encoder at ``position`` [x]."""
        if self._position_noise > 0.0:
            position += self._position_noise * float(self._random.standard_normal())
        return position if self._resolution == 0.0 else self._resolution * round(position / self._resolution)

    def _steps_for(self, duration: float) -> int:
        n_substeps = self._substeps.get(duration)
        if n_substeps is None:
            n_substeps = substeps(self._model, duration)
            if len(self._substeps) < 64:
                self._substeps[duration] = n_substeps
        return n_substeps

    def advance(self, force: float, duration: float) -> None:
        """Lead the axis over ``duration`` [s] under the commanded force [F], which must be finite."""
        if duration <= 0.0:
            return
        limited = min(max(force, -self._force_limit), self._force_limit)
        if limited != force:
            self.saturated += 1
        self._command = limited
        n, simulator = self._readings, self._simulator
        piece = duration / n
        before = self._contact_force()
        states, _, applied = simulator.follow(np.full(n, limited), piece, self._steps_for(piece))
        if before is None:
            self._impulse += float(applied.sum()) * piece
        else:
            assert self._plant.effort is not None
            after = self._plant.effort(self._plant_values, states, np.full(n, limited))
            self._impulse += (float(np.sum(after)) - 0.5 * (float(after[-1]) - before)) * piece
        if n > 1:
            seen = self._plant.encoder[0]
            self._read += sum(self._encoder(position) for position in states[:, seen].tolist())
            self._n_read += n
        self._elapsed += duration

    def _contact_force(self) -> float | None:
        """Force on the contact now [F]; None where it is what the command path gives."""
        effort = self._plant.effort
        if effort is None:
            return None
        return float(effort(self._plant_values, self._simulator.states[None, :], np.array([self._command]))[0])

    def measure(self) -> Measurement:
        """What the drive reports now, about the time since it was last asked."""
        position = self._read / self._n_read if self._n_read else self._encoder(self._simulator.position)
        velocity = effort = 0.0
        if self._elapsed > 0.0:
            velocity = (position - self._seen) / self._elapsed
            effort = self._impulse / self._elapsed
        elif self._plant.effort is not None:
            effort = self._contact_force() or 0.0
        self._seen = position
        self._impulse = self._elapsed = self._read = 0.0
        self._n_read = 0
        if self._force_noise > 0.0:
            effort += self._force_noise * float(self._random.standard_normal())
        return Measurement(position, velocity, effort)

    def signals(self) -> list[float]:
        """What the plant measures besides, now, in the order of :attr:`signal_names`; without noise."""
        if not self._plant.signals:
            return []
        states, command = self._simulator.states[None, :], np.array([self._command])
        return [float(signal.of(self._plant_values, states, command)[0]) for signal in self._plant.signals]
