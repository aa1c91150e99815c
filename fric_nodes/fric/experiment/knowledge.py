"""What the runs so far have shown of the axis, and what that lets one expect of the next run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from ..errors import InputError
from ..identification import METHODS
from ..identification.methods.forced_oscillation import MOST_RESTING
from ..identification.methods.log_decrement import log_decrement
from ..identification.oscillation.harmonics import harmonics_of
from ..identification.oscillation.recording import find_oscillation
from ..identification.oscillation_effort import at_stamps
from ..identification.result import Identification, Options
from ..identification.start import start_model
from ..model import Model
from ..record import Array, Record
from .motion import ExperimentError
from .runs import FREE, Setting

__all__ = ["Expectation", "Knowledge", "Run", "concluded", "learn", "structure"]

_SPRING = 5.0  # standard errors, and
_NOTICEABLE = 0.02  # part of the stiffest feedback, that a spring must have to be one
_UNEXPLAINED = 0.05  # part of the force's variance that a feedback may leave
_FEWEST_SAMPLES = 50
_BETTER = 0.95  # of the output error without them that more effects must come to
_FRICTION = ("viscous", "coulomb", "asymmetry", "bias")


@dataclass(frozen=True, eq=False)
class Run:
    """One run.

    Attributes:
        number: from 1 on.
        setting: what was asked for.
        origin: where the experiment began [x].
        record: the whole run, from where it began to be led away; efforts as measured, or as commanded.
        span: begin and end of the part that counts, in the record's time [s].
        problem: why it can't be used; empty when it can.
        frequency: natural or forced frequency found [rad/s]; NaN when not usable.
        damping: damping ratio found [1]; NaN in a forced run.
        gains: feedback that really acted: P [F/x] and D [F s/x], delay included; NaN when not usable.
    """

    number: int
    setting: Setting
    origin: float
    record: Record
    span: tuple[float, float]
    problem: str = ""
    frequency: float = float("nan")
    damping: float = float("nan")
    gains: tuple[float, float] = (float("nan"), float("nan"))

    @property
    def relative(self) -> Record:
        """The whole run with positions relative to the origin."""
        return replace(self.record, position=self.record.position - self.origin)

    @property
    def counted(self) -> Record:
        """The part that counts, with positions relative to the origin."""
        return self.relative.between(*self.span)


@dataclass(frozen=True)
class Expectation:
    """What is expected of the axis, roughly: enough to choose a setting by.

    Attributes:
        mass: [F s^2/x].
        viscous: [F s/x].
        stiffness: of its own spring [F/x]; 0 without one.
        coulomb: [F].
        delay: of the feedback [s]: it takes the damping P times this away.
    """

    mass: float
    viscous: float
    stiffness: float
    coulomb: float
    delay: float

    def frequency(self, proportional: float) -> float:
        """Natural frequency under P [rad/s]."""
        return math.sqrt(max(self.stiffness + proportional, 1e-300) / self.mass)

    def damping(self, proportional: float, derivative: float) -> float:
        """Viscous coefficient that is left under P and D [F s/x]."""
        return self.viscous + derivative - proportional * self.delay

    def reversals(self, proportional: float, derivative: float, deflection: float) -> int:
        """How often it turns, let go from ``deflection`` [x], before it rests; at most 100."""
        w = self.frequency(proportional)
        ratio = self.damping(proportional, derivative) / (2.0 * self.mass * w)
        if ratio >= 0.99:
            return 0
        kept = math.exp(-math.pi * ratio / math.sqrt(1.0 - ratio * ratio))
        offset = self.coulomb / max(self.stiffness + proportional, 1e-300)
        size, count = abs(deflection), 0
        while size > offset and count < 100:
            size = kept * (size - offset) - offset
            count += 1
        return max(count - 1, 0)


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What the runs so far have shown.

    Attributes:
        runs: all of them, judged.
        expectation: None before anything could be made of them.
        spring: whether the axis has one of its own.
        oscillation: de Marchi's parametric oscillation, or the forced one, over the usable runs; None before there is enough.
        dynamics: prediction error along the same runs, from the force alone; None before there is enough.
        trouble: why there is no ``oscillation``; empty when there is one.
    """

    runs: tuple[Run, ...] = ()
    expectation: Expectation | None = None
    spring: bool = True
    oscillation: Identification | None = None
    dynamics: Identification | None = None
    trouble: str = ""

    @property
    def best(self) -> Identification | None:
        """The result: by prediction error where the effort was measured, since that weighs friction at every speed."""
        found = self.dynamics
        if found is None or self.oscillation is None:
            return self.oscillation or found
        measured = all(run.record.effort_hold != "following" or not run.record.notes for run in self.runs)
        known = found.model.standard_errors.get("mass", math.inf) <= 0.02 * found.model.value("mass")
        return found if measured and known else self.oscillation

    @property
    def usable(self) -> list[Run]:
        """Runs of the present kind without a problem."""
        return [run for run in self.runs if not run.problem and run.setting.kind == self.runs[-1].setting.kind]

    def relative_errors(self) -> dict[str, float]:
        """Relative standard errors of inertia, damping and stiffness (of the stiffest setup, without a spring)."""
        found = self.oscillation
        if found is None:
            return {}
        model, errors = found.model, found.model.standard_errors
        names = {"inertia": "mass", "damping": "viscous.coefficient", "stiffness": "stiffness.stiffness"}
        return {
            what: errors.get(name, math.inf) / max(abs(model.value(name)), 1e-300)
            for what, name in names.items()
            if name in model.names
        }


def structure(spring: bool, record: Record, more: Sequence[str] = ()) -> Model:
    """What is fitted: the friction that an oscillation can show, a spring if there is one, and ``more`` effects."""
    return start_model((*(("stiffness",) if spring else ()), *_FRICTION, *more), record.joint, record.units)


def concluded(known: Knowledge, more: Sequence[str]) -> Knowledge:
    """``known`` with ``more`` effects fitted to its usable runs too, by prediction error, where they explain them better."""
    plain = known.dynamics
    if not more or plain is None:
        return known
    model = structure(known.spring, known.usable[0].record, more)
    found, _ = _fit("prediction-error", model, [run.counted for run in known.usable])
    if found is None or found.train.noe > _BETTER * plain.train.noe or "mass" not in found.model.standard_errors:
        return known
    return replace(known, dynamics=_about(found, known.runs[-1].origin))


def _acting(record: Record, setting: Setting) -> tuple[float, float]:
    """P [F/x] and D [F s/x] that acted in ``record``, which begins with the release, by regression of its force.

    Raises:
        InputError: it holds no oscillation, or the force follows no such law.
    """
    found = find_oscillation(record, (0.0, 0.0))
    if setting.proportional == 0.0 and setting.derivative == 0.0:
        return 0.0, 0.0
    first, last = int(found.turns[0]), int(found.turns[-1]) + 1
    even = record.uniform()
    window = max(int(found.half_period / found.sample_time / 8) | 1, 5)
    velocity = signal.savgol_filter(even.position, window, 2, deriv=1, delta=even.sample_time)[first:last]
    position, force = even.position[first:last], even.effort[first:last]
    columns = np.stack([np.ones_like(position), -position, -velocity], axis=1)
    answer, *_ = np.linalg.lstsq(columns, force, rcond=None)
    left = float(np.var(force - columns @ answer))
    if left > _UNEXPLAINED * float(np.var(force)):
        raise ExperimentError(record.source, "the force is not that of the feedback", "see that nothing else drives the axis")
    return float(answer[1]), float(answer[2])


def _judged(run: Run) -> Run:
    """``run`` with what it shows by itself, or with why it shows nothing."""
    if run.problem:
        return run
    try:
        if run.setting.kind != FREE:
            steady = harmonics_of(run.counted, run.setting.frequency)
            if steady.resting > MOST_RESTING:
                return replace(run, problem=f"the joint rests for {100 * steady.resting:.0f} % of the time")
            return replace(run, frequency=run.setting.frequency)
        record = at_stamps(run.counted)
        gains = _acting(record, run.setting)
        shown = log_decrement(find_oscillation(record, gains))
    except InputError as error:
        return replace(run, problem=error.problem)
    return replace(run, frequency=shown.natural.frequency, damping=shown.natural.damping, gains=gains)


def _fit(
    method: str, model: Model, records: Sequence[Record], gains: Sequence[tuple[float, float]] = ()
) -> tuple[Identification | None, str]:
    held = ("stiffness.position",) if "stiffness.position" in model.names else ()
    try:
        return METHODS[method].fit(model, records, Options(held=held, gains=tuple(gains))), ""
    except InputError as error:
        return None, error.problem
    except np.linalg.LinAlgError as error:
        return None, f"the equations can't be solved ({error})"


def _with_spring(found: Identification | None, stiffest: float) -> bool:
    """True when ``found``, fitted with a spring, shows one."""
    if found is None or "stiffness.stiffness" not in found.model.names:
        return False
    value = found.model.value("stiffness.stiffness")
    error = found.model.standard_errors.get("stiffness.stiffness", math.inf)
    return value > max(_SPRING * error, _NOTICEABLE * stiffest)


def learn(runs: Sequence[Run], spring: bool | None = None) -> Knowledge:
    """What ``runs`` show together; a spring of its own is taken to be relaxed where the experiment began.

    Args:
        runs: at least one.
        spring: whether the axis has a spring of its own; None: found out.
    """
    judged = tuple(run if math.isfinite(run.frequency) else _judged(run) for run in runs)
    kind, origin = judged[-1].setting.kind, judged[-1].origin
    usable = [run for run in judged if not run.problem and run.setting.kind == kind]
    stiffest = max(abs(run.setting.proportional) for run in judged)
    everything = [run.relative for run in judged if run.record.n_samples > _FEWEST_SAMPLES]
    rough = None
    if everything:
        # Where nothing oscillates yet, the way to the deflection tells friction all the same.
        if spring is None:
            trial, _ = _fit("inverse-dynamics", structure(True, everything[0]), everything)
            spring = _with_spring(trial, stiffest)
        rough, _ = _fit("inverse-dynamics", structure(spring, everything[0]), everything)
    oscillation, dynamics, trouble = None, None, "no usable run yet"
    if usable:
        model, counted = structure(bool(spring), usable[0].record), [run.counted for run in usable]
        if kind == FREE:
            oscillation, trouble = _fit("parametric-oscillation", model, counted, [run.gains for run in usable])
        else:
            oscillation, trouble = _fit("forced-oscillation", model, counted)
        dynamics, _ = _fit("prediction-error", model, counted)
    expected = _expected(oscillation, rough, usable)
    return Knowledge(judged, expected, bool(spring), _about(oscillation, origin), _about(dynamics, origin), trouble)


def _about(found: Identification | None, origin: float) -> Identification | None:
    """``found``, from positions relative to ``origin`` [x], for absolute ones."""
    if found is None or "stiffness.position" not in found.model.names:
        return found
    values: Array = found.model.values
    values[found.model.names.index("stiffness.position")] = origin
    return replace(found, model=found.model.with_values(values, found.model.standard_errors))


def _expected(oscillation: Identification | None, rough: Identification | None, usable: Sequence[Run]) -> Expectation | None:
    """Values of the first that there is, and the delay that the runs show."""
    best = oscillation or rough
    if best is None:
        return None
    model = best.model
    stiffness = model.value("stiffness.stiffness") if "stiffness.stiffness" in model.names else 0.0
    delays = [
        (run.setting.derivative - run.gains[1]) / run.setting.proportional
        for run in usable
        if run.setting.kind == FREE and run.setting.proportional > 0.0 and run.setting.derivative == 0.0
    ]
    delay = float(np.median(delays)) if delays else 0.5 * (usable[0].record.sample_time if usable else 0.0)
    return Expectation(model.value("mass"), model.value("viscous.coefficient"), stiffness, model.value("coulomb.force"), delay)
