"""One excitation tried on the model: the motion that a controller makes of it, within which limits, and what it is worth.

A planned motion is followed by a PID controller tuned for the model's inertia and viscous damping
(:mod:`fric.control.tuning`), a force excitation acts as it is. The axis is simulated sample by sample with exact
sticking or its pre-sliding law, so that what friction makes of a slow motion (stick-slip, a reference that is never reached)
is part of the trial. The recording is seen as the fit will see it; its noise is drawn as the instruments make it, so that a
motion below the noise of the position signal is worth as little as it will be.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from ...control.feedbacks.pid import Pid, PidGains
from ...control.tuning import TuningError, tune
from ...excitation.sequence import Sequence as Parts
from ...excitation_kind import Excitation, Feedback, Trajectory
from ...model import Model
from ...record import Array, Record
from ...simulation import Simulator, substeps
from ..free_parameters import FreeParameters
from ..result import IdentificationError, Options
from ..sensitivity import VIEWS, Information, information, sensitivities, settled
from .limits import Limits, Rig

__all__ = [
    "DELAY",
    "OVERHEAD",
    "PAUSE",
    "SEED",
    "Choice",
    "Motion",
    "gains_for",
    "judged",
    "recorded",
    "sequence_of",
    "simulated",
]

DELAY = 0.5
"""Rest before the first excitation [s]."""

PAUSE = 0.2
"""Rest after each [s]."""

OVERHEAD = DELAY + 2.0 * PAUSE
"""Time that two excitations take besides their own [s]."""

SEED = 0
"""Of what is random in the excitations, as the excitation node has it."""

_DRAWS = 2  # of the instruments' noise
_SEED = 1


@dataclass(frozen=True, eq=False)
class Choice:
    """One excitation with values of its parameters.

    Attributes:
        kind: which.
        values: of all its parameters, by name.
        plan: the motion or the feedback.
    """

    kind: Excitation
    values: Mapping[str, float]
    plan: Trajectory | Feedback = field(repr=False)

    @classmethod
    def of(cls, kind: Excitation, values: Mapping[str, float]) -> Choice:
        """The choice with its plan; what is random in it has a fixed seed, the excitation node's own default.

        Raises:
            InputError: it can't be planned.
        """
        return cls(kind, dict(values), _part(kind, values, np.random.default_rng(SEED)))

    @property
    def duration(self) -> float:
        """From its start to its end [s]."""
        return float(self.plan.duration)

    @property
    def output(self) -> str:
        """As what it is published."""
        return self.kind.outputs[0]


@dataclass(frozen=True, eq=False)
class Motion:
    """What the axis does; arrays of shape ``(n,)``.

    Attributes:
        time: [s].
        position: without noise [x].
        speed: largest [x/s].
        effort: command [F].
        reference: position wanted [x]; NaN under a force.
        clipped: share of samples at which the controller wanted more force than it may have.
    """

    time: Array
    position: Array
    speed: float
    effort: Array
    reference: Array
    clipped: float

    def trouble(self, limits: Limits) -> str:
        """Which limit the motion breaks, or nothing."""
        low, high = float(np.min(self.position)), float(np.max(self.position))
        if not np.all(np.isfinite(self.position)):
            return "the axis runs away"
        if low < limits.position[0] or high > limits.position[1]:
            return f"position {low:.3g} to {high:.3g}"
        if self.speed > limits.speed:
            return f"speed {self.speed:.3g}"
        weak, strong = float(np.min(self.effort)), float(np.max(self.effort))
        if weak < limits.force[0] or strong > limits.force[1] or self.clipped > 0.0:
            return f"force {weak:.3g} to {strong:.3g}"
        return ""


def _part(kind: Excitation, values: Mapping[str, float], random: np.random.Generator) -> Trajectory | Feedback:
    return kind.part(values, {text.name: text.default for text in kind.texts}, random)


def sequence_of(choices: tuple[Choice, ...]) -> Parts:
    """``choices`` one after the other, as the excitation node plays them: what is random comes from one generator."""
    random = np.random.default_rng(SEED)
    return Parts([_part(choice.kind, choice.values, random) for choice in choices], delay=DELAY, pause=PAUSE)


@lru_cache(maxsize=64)
def _tuned(mass: float, damping: float, period: float) -> PidGains:
    try:
        return tune(mass, damping, period, delay=0.25 * period, filter_time=0.25 * period)[0]
    except TuningError:
        crossover = 0.3 / period
        return PidGains(mass * crossover**2, 0.0, mass * crossover)


def gains_for(model: Model, period: float) -> PidGains:
    """The gains that a trial follows a planned motion with."""
    inertia = float(f"{model.plant.inertia(*model.plant_values):.3g}")
    damping = sum(max(p.value, 0.0) for p in model.parameters() if p.declaration.dimension == "F s/x" and p.declaration.linear)
    return _tuned(inertia, float(f"{damping:.3g}"), period)


def simulated(model: Model, choices: tuple[Choice, ...], rig: Rig, limits: Limits, gains: PidGains, finer: int = 1) -> Motion:
    """The motion of ``model`` when ``choices`` follow each other; all must have the same output.

    Args:
        model: what moves.
        choices: what excites it.
        rig: its period.
        limits: the force limit is the controller's.
        gains: of the controller.
        finer: times as many steps as a simulation usually takes.
    """
    sequence = sequence_of(choices)
    n = int(np.ceil(sequence.duration / rig.period)) + 1
    time: Array = rig.period * np.arange(n, dtype=np.float64)
    simulator = Simulator(model)
    n_substeps = finer * substeps(model, rig.period)
    planned = sequence.at(time)
    follows = choices[0].output == "reference"
    force = _following(planned.position, gains, limits.push, rig.period) if follows else _forcing(sequence, time)
    positions, efforts = np.empty(n), np.empty(n)
    speed, wild = 0.0, 0
    given = np.empty(1)
    for k in range(n):
        position = simulator.position
        positions[k] = position
        efforts[k] = given[0] = force(k, position)
        simulator.run(given, rig.period, n_substeps)
        speed = max(speed, abs(simulator.velocity))
        if not abs(position) < 100.0 * limits.way:
            positions[k:] = np.nan
            efforts[k:] = 0.0
            wild = n - k
            break
    clipped = 0.0 if not follows else float(np.mean(np.abs(efforts) >= limits.push)) + wild / n
    reference = planned.position if follows else np.full(n, np.nan)
    return Motion(time, positions, speed, efforts, reference, clipped)


def _following(reference: Array, gains: PidGains, push: float, period: float) -> Callable[[int, float], float]:
    pid = Pid(gains, push)
    wanted = reference.tolist()
    return lambda k, position: pid.step(wanted[k], position, period)


def _forcing(sequence: Parts, time: Array) -> Callable[[int, float], float]:
    if not sequence.has_feedback:
        planned = sequence.at(time).position.tolist()
        return lambda k, position: planned[k]
    instants = time.tolist()
    return lambda k, position: sequence.force(instants[k], position)


def recorded(motion: Motion, rig: Rig, random: np.random.Generator | None, name: str = "trial") -> Record:
    """What the instruments record of a motion; without ``random`` as it is."""
    position, effort = motion.position, motion.effort
    if random is not None:
        n = position.shape[0]
        position = position + rig.position_noise * random.standard_normal(n)
        effort = effort + rig.force_noise * random.standard_normal(n)
        if rig.resolution > 0.0:
            position = np.round(position / rig.resolution) * rig.resolution
    return Record(motion.time, position, effort, effort_hold="following", source=name)


def judged(
    model: Model, free: FreeParameters, motion: Motion, rig: Rig, options: Options, size: Array, predicts: str, index: float
) -> Information | None:
    """What a recording of ``motion`` is worth to a fit of ``free``; None when nothing of it can be used.

    Args:
        model: with the values at which it is judged.
        free: parameters that are fitted.
        motion: without noise.
        rig: instruments, whose noise is drawn.
        options: of the fit.
        size: of each parameter, shape ``(n_free,)``.
        predicts: what the method predicts, a key of :data:`fric.identification.sensitivity.VIEWS`.
        index: tracking index of a prediction from sample to sample; 0 lets the recording choose.
    """
    random = np.random.default_rng(_SEED)
    view_of = VIEWS[predicts]
    try:
        first = view_of(model, [recorded(motion, rig, random)], options, index)
        # The same filter and rows for all of them.
        options = settled(first, options)
        noisy = [first, *(view_of(model, [recorded(motion, rig, random)], options, index) for _ in range(_DRAWS - 1))]
        clean = view_of(model, [recorded(motion, rig, None)], options, noisy[0].index)
    except IdentificationError:
        return None
    use = np.logical_and.reduce([view.rows() for view in (clean, *noisy)])
    if np.sum(use) < 2 * free.index.shape[0]:
        return None
    true = clean.errors(model)
    errors = [(view.errors(model) - true)[use] for view in noisy]
    jacobian = sensitivities(clean, model, free, size)[use]
    return information(jacobian, errors, clean.starts(use), size, true[use] if clean.drifts else None)
