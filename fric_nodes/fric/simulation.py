"""What a model does: motion from force (simulation) and force from motion (prediction), in compiled loops.

Fixed step, exact sticking, and as many sub-steps as the fastest rate of the model asks for. Long runs are one call; a node
that goes sample by sample keeps a :class:`Simulator` or a :class:`Predictor`, whose state lives from call to call.

A structure of a model is compiled into loops of its own where it runs for long or again and again (``fused``); else it runs on
loops that serve all structures (:mod:`fric.engine.linked`), whose steps take longer but need no seconds of compiling first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .engine.compile import Loops
from .engine.linked import Linked
from .model import Model
from .record import Array

__all__ = ["Motion", "Predictor", "Simulator", "intervals", "predict_force", "respond", "simulate"]

_STEP_OF_RATE = 0.04  # largest product of step and fastest rate; keeps forces to 1e-4 of their range
_MAX_SUBSTEPS = 2000
_WORTH_COMPILING = 50_000_000  # steps of one run: what they take longer on loops for all structures is what compiling takes
_NOMINAL_LOAD = np.array([1.0])
_NOMINAL_TEMPERATURE = np.array([0.0])


@dataclass(frozen=True)
class Motion:
    """Result of a simulation; every array has shape ``(n_samples,)``.

    Attributes:
        position: [x].
        velocity: [x/s].
        friction: contact's mean friction force over the interval that ends at the sample [F], 0 at the first.
        applied: what came out of the command path, mean over the interval that ends at the sample; 0 at the first.
        states: all mechanical states, shape ``(n_samples, n_states)``.
    """

    position: Array
    velocity: Array
    friction: Array
    applied: Array
    states: Array


def intervals(effort: Array, hold: str) -> Array:
    """The constant force of each interval between samples, shape ``(n_samples - 1,)``, from forces at the samples.

    Args:
        effort: force at each sample [F], shape ``(n_samples,)``.
        hold: ``following``, ``preceding`` or ``linear``, see :attr:`fric.record.Record.effort_hold`.
    """
    if hold == "following":
        return effort[:-1]
    if hold == "preceding":
        return effort[1:]
    if hold == "linear":
        return 0.5 * (effort[:-1] + effort[1:])
    raise ValueError(f"hold is '{hold}', must be following, preceding or linear")


def substeps(model: Model, sample_time: float, step_of_rate: float = _STEP_OF_RATE) -> int:
    """Steps per sample that the fastest rate of the model asks for: their product with it stays below ``step_of_rate``."""
    wanted = math.ceil(sample_time * model.max_rate() / step_of_rate)
    return min(max(wanted, 1), _MAX_SUBSTEPS)


def _running(model: Model, fused: bool) -> tuple[Loops, Array | Linked]:
    """The loops on which ``model`` runs, and its values as they take them."""
    return (model.loops, model.values) if fused else (model.linked_loops, model.linked)


class Simulator:
    """A model in motion, step by step.

    Args:
        model: what moves.
        position: start [x], as the sensor sees it.
        velocity: start [x/s].
        fused: True to compile loops for this structure, where many models of it run; False leaves that to single long runs.

    Attributes:
        states: the plant's, shape ``(n_states,)``.
        friction_state: of the slip dynamics, shape ``(n_friction_states,)``.
        memory: of the terms that have one, shape ``(n_memory,)``.
        applied: what came out of the command path in the last interval, its mean [F].
        time: [s].
    """

    def __init__(self, model: Model, position: float = 0.0, velocity: float = 0.0, *, fused: bool = False) -> None:
        self._fused = fused
        self._running = _running(model, fused)
        self._model = model
        self._encoder = model.plant.encoder
        plant_values = np.array(model.plant_values)
        self.states = np.ascontiguousarray(model.plant.start(plant_values, position, velocity), dtype=np.float64)
        self.friction_state, self.memory = model.inner_states(velocity)
        self.applied = 0.0
        self.time = 0.0

    @property
    def position(self) -> float:
        """As the sensor sees it [x]."""
        return float(self.states[self._encoder[0]])

    @property
    def velocity(self) -> float:
        """As the sensor sees it [x/s]."""
        return float(self.states[self._encoder[1]])

    def memory_of(self, number: int) -> Array:
        """The part of :attr:`memory` that belongs to term ``number``, a view; its effect says what stands in it."""
        first = sum(held.effect.n_memory for held in self._model.terms[:number])
        return self.memory[first : first + self._model.terms[number].effect.n_memory]

    def run(
        self,
        effort: Array,
        sample_time: float,
        n_substeps: int | None = None,
        load: Array = _NOMINAL_LOAD,
        temperature: Array = _NOMINAL_TEMPERATURE,
    ) -> tuple[Array, Array]:
        """Lead the model over ``len(effort)`` intervals of ``sample_time`` [s], each under its constant command [F].

        Returns:
            States at the end of each interval, shape ``(n_intervals, n_states)``, and mean friction force, ``(n_intervals,)``.
        """
        states, friction, _ = self.follow(effort, sample_time, n_substeps, load, temperature)
        return states, friction

    def follow(
        self,
        effort: Array,
        sample_time: float,
        n_substeps: int | None = None,
        load: Array = _NOMINAL_LOAD,
        temperature: Array = _NOMINAL_TEMPERATURE,
    ) -> tuple[Array, Array, Array]:
        """As :meth:`run`, and what came out of the command path over each interval, ``(n_intervals,)``."""
        n_substeps = substeps(self._model, sample_time) if n_substeps is None else n_substeps
        states = np.empty((effort.shape[0], self.states.shape[0]))
        friction = np.empty(effort.shape[0])
        applied = np.empty(effort.shape[0])
        if not self._fused and effort.shape[0] * n_substeps > _WORTH_COMPILING:
            self._fused, self._running = True, _running(self._model, True)
        loops, values = self._running
        loops.simulate(
            values, np.ascontiguousarray(effort), sample_time, n_substeps, self.time, load, temperature,
            self.states, self.friction_state, self.memory, states, friction, applied,
        )  # fmt: skip
        self.time += effort.shape[0] * sample_time
        if applied.size:
            self.applied = float(applied[-1])
        return states, friction, applied

    def step(self, effort: float, duration: float) -> float:
        """Lead the model over ``duration`` [s] under the constant force ``effort`` [F]; mean friction force [F]."""
        _, friction = self.run(np.array([effort]), duration)
        return float(friction[0])


def simulate(
    model: Model,
    effort: Array,
    sample_time: float,
    *,
    position: float = 0.0,
    velocity: float = 0.0,
    hold: str = "following",
    n_substeps: int | None = None,
    load: Array = _NOMINAL_LOAD,
    temperature: Array = _NOMINAL_TEMPERATURE,
    fused: bool = False,
) -> Motion:
    """Free run of ``model`` under the forces ``effort``.

    Args:
        model: what moves.
        effort: force at each sample [F], shape ``(n_samples,)``.
        sample_time: [s].
        position: start [x].
        velocity: start [x/s].
        hold: how a sample's force relates to the intervals beside it, see :func:`intervals`.
        n_substeps: steps per sample; None takes what the model's fastest rate asks for.
        load: normal load relative to nominal, one value or one per interval.
        temperature: difference from the reference temperature [K], one value or one per interval.
        fused: True to compile loops for this structure, see :class:`Simulator`.
    """
    simulator = Simulator(model, position, velocity, fused=fused)
    start = simulator.states.copy()
    states, friction, applied = simulator.follow(intervals(effort, hold), sample_time, n_substeps, load, temperature)
    states = np.vstack([start, states])
    q, v = model.plant.encoder
    return Motion(
        position=states[:, q].copy(),
        velocity=states[:, v].copy(),
        friction=np.concatenate([[0.0], friction]),
        applied=np.concatenate([[0.0], applied]),
        states=states,
    )


def respond(model: Model, effort: Array, sample_time: float) -> Array:
    """The force that the command path of ``model`` gives over each interval of ``sample_time`` [s], shape ``(n_intervals,)``.

    Args:
        model: its command path is what counts.
        effort: command over each interval [F], shape ``(n_intervals,)``.
        sample_time: [s].
    """
    if not model.has_command_path:
        return effort
    # Friction needs no steps here: a contact may be a thousand times faster than a drive.
    path = model.with_terms([held for held in model.terms if held.effect.command is not None])
    applied = np.empty(effort.shape[0])
    _, memory = path.inner_states()
    loops, values = _running(path, False)
    loops.respond(values, np.ascontiguousarray(effort), sample_time, substeps(path, sample_time), memory, applied)
    return applied


class Predictor:
    """The force that a model needs along a motion; ``friction_state`` and ``memory`` are kept from call to call.

    It is the force that has to come out of the command path; :meth:`fric.model.Model.uncommand` gives the command for it.

    Args:
        model: what is to be moved.
        fused: True to compile loops for this structure, see :class:`Simulator`.
    """

    def __init__(self, model: Model, *, fused: bool = False) -> None:
        self._running = _running(model, fused)
        self.friction_state, self.memory = model.inner_states()

    def run(
        self,
        time: Array,
        position: Array,
        velocity: Array,
        acceleration: Array,
        sample_time: float,
        load: Array = _NOMINAL_LOAD,
        temperature: Array = _NOMINAL_TEMPERATURE,
    ) -> tuple[Array, Array]:
        """Force needed at each sample and its friction part [F], each of shape ``(n_samples,)``."""
        effort = np.empty(position.shape[0])
        friction = np.empty(position.shape[0])
        loops, values = self._running
        loops.predict(
            values, time, position, velocity, acceleration, sample_time, load, temperature,
            self.friction_state, self.memory, effort, friction,
        )  # fmt: skip
        return effort, friction

    def step(self, time: float, position: float, velocity: float, acceleration: float, duration: float) -> float:
        """Force needed at one sample that stands for ``duration`` [s] of motion [F]."""
        effort, _ = self.run(np.array([time]), np.array([position]), np.array([velocity]), np.array([acceleration]), duration)
        return float(effort[0])


def predict_force(
    model: Model,
    time: Array,
    position: Array,
    velocity: Array,
    acceleration: Array,
    sample_time: float,
    load: Array = _NOMINAL_LOAD,
    temperature: Array = _NOMINAL_TEMPERATURE,
) -> Array:
    """Force that ``model`` needs for a given motion [F], shape ``(n_samples,)``.

    Without slip dynamics there is no friction in it where the velocity is zero: at rest it isn't determined by the motion.
    """
    effort, _ = Predictor(model).run(time, position, velocity, acceleration, sample_time, load, temperature)
    return effort
