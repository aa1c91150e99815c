"""Axes on which methods of compensation are compared, how they are recorded, and what is identified from that.

Each seed draws all parameters of an axis within +-20 % of its nominal values. The axis is then recorded under a slow controller
that needs no more than a guess of its mass, and everything that a method may know comes from that recording. Optionally the
friction changes once more, within +-20 %, after the recording.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...axis import SimulatedAxis
from ...control.autotune import Timing
from ...control.feedbacks.pid import Pid, PidGains
from ...control.trial import Body, Course, Reference, follow
from ...friction.dnlrx import DnlrxModel
from ...identification import METHODS
from ...identification.methods.two_stage import TwoStageIdentification
from ...identification.result import IdentificationError, Options
from ...identification.start import start_model
from ...model import Model, build_model, term
from ...record import Record

__all__ = ["BenchAxis", "Known"]

_SPREAD = 0.2  # physical: of the parameters, as the comparison states
_HELD_ALIKE = ("exponent", "frequency", "restitution")  # shapes, which aren't drawn


@dataclass(frozen=True)
class Known:
    """What is identified from the recording of one axis.

    Attributes:
        record: from which.
        rigid: mass, Coulomb and viscous friction, bias.
        presliding: the same with the springs of pre-sliding; None where two-stage doesn't find them.
        dnlrx: None likewise.
    """

    record: Record
    rigid: Model
    presliding: Model | None
    dnlrx: DnlrxModel | None


@dataclass(frozen=True, eq=False)
class BenchAxis:
    """One axis of the comparison.

    Attributes:
        id: in a table.
        title: in a sentence.
        nominal: its truth before it is drawn.
        timing: of its loop; the delay is a whole number of periods.
        readings: of the encoder in a period.
        position_noise: of a reading [x].
        force_noise: of the force signal [F].
        excitation: motion of the recording.
        task: motion on which methods are compared.
        springs: of the DNLRX; 0: none is identified.
        quick: motion of a second recording, from which the rigid model is identified; None: from the first.
        rest: moves with rests between, for settling and hunting.
        tolerance: error of the position at which a move counts as settled [x].
        lag: share of the delay that lies in the axis itself, such as that of its force controller [s].
        fixed: parameters that aren't drawn, since a data sheet gives them.
        made: the axis in motion from its truth and a seed; None: a simulated axis with the sensors above.
    """

    id: str
    title: str
    nominal: Model
    timing: Timing
    excitation: Callable[[float], Reference] = field(repr=False)
    task: Callable[[float], Reference] = field(repr=False)
    readings: int = 1
    position_noise: float = 0.0
    force_noise: float = 0.0
    springs: int = 10
    quick: Callable[[float], Reference] | None = field(default=None, repr=False)
    rest: Callable[[float], Reference] = field(repr=False, kw_only=True)
    tolerance: float = field(kw_only=True)
    lag: float = 0.0
    fixed: tuple[str, ...] = ()
    made: Callable[[BenchAxis, Model, int], Body] | None = field(default=None, repr=False)

    @cached_property
    def reference(self) -> Reference:
        """Of the task."""
        return self.task(self.timing.period)

    @cached_property
    def resting(self) -> Reference:
        """Moves with rests."""
        return self.rest(self.timing.period)

    @property
    def delay(self) -> int:
        """Of the command, in periods."""
        return round((self.timing.delay - self.lag) / self.timing.period)

    @property
    def age(self) -> float:
        """Of a reading that is the mean of several, when it is reported [s]."""
        return 0.5 * (self.readings - 1) / self.readings * self.timing.period

    def drawn(self, seed: int, only: tuple[str, ...] = (), of: Model | None = None) -> Model:
        """The axis with its parameters drawn; those whose names begin with one of ``only``, where that is given."""
        random = np.random.default_rng(seed)
        model = self.nominal if of is None else of
        values = model.values
        for k, parameter in enumerate(model.parameters()):
            factor = random.uniform(1.0 - _SPREAD, 1.0 + _SPREAD)
            shape = parameter.declaration.shape or any(part in parameter.name for part in _HELD_ALIKE)
            shape = shape or parameter.name in self.fixed
            if not shape and (not only or parameter.name.startswith(only)):
                values[k] *= factor
        return model.with_values(values)

    def body(self, truth: Model, seed: int) -> Body:
        """The axis with its sensors."""
        if self.made is not None:
            return self.made(self, truth, seed)
        return SimulatedAxis(
            truth,
            resolution=self.timing.resolution,
            position_noise=self.position_noise,
            readings=self.readings,
            force_noise=self.force_noise,
            force_limit=self.timing.force_limit,
            seed=seed,
        )

    def recorded(self, truth: Model, seed: int) -> tuple[Record, Record]:
        """The axis along its excitations, under a loop as slow as a guess of the mass allows; for pre-sliding, and the rest."""
        graded = self._along(self.excitation, truth, seed)
        return graded, graded if self.quick is None else self._along(self.quick, truth, seed + 1)

    def _along(self, excitation: Callable[[float], Reference], truth: Model, seed: int) -> Record:
        mass, period = self.nominal.total_inertia, self.timing.period
        w = 0.08 / (period + self.timing.delay)  # numerical: a crossover that leaves more than 60 degrees
        slow = Pid(PidGains(mass * w * w, 0.3 * mass * w**3, 1.5 * mass * w, period), self.timing.force_limit)
        course = follow(self.body(truth, seed), slow, excitation(period), delay=self.delay)
        return replace(record_of(course), units=self.nominal.units, joint=self.nominal.joint)

    def identified(self, graded: Record, quick: Record) -> Known:
        """What the recordings tell.

        Raises:
            IdentificationError: not even the rigid model can be identified.
        """
        units, joint = self.nominal.units, self.nominal.joint
        start = start_model(["coulomb", "viscous", "bias"], joint, units)
        rigid = METHODS["inverse-dynamics"].fit(start, [quick], Options()).model
        found = None
        if self.springs:
            ones = {f"{name}_{k}": 1.0 for k in range(1, self.springs + 1) for name in ("stiffness", "limit")}
            springs = build_model(
                "rigid",
                {"mass": 1.0},
                [term("viscous", coefficient=0.0), term("bias", force=0.0), term("presliding", "maxwell_slip", **ones)],
                joint=joint,
                units=units,
            )
            try:
                found = METHODS["two-stage"].fit(springs, [graded], Options())
            except IdentificationError:
                found = None
        dnlrx = found.dnlrx.model if isinstance(found, TwoStageIdentification) and found.dnlrx is not None else None
        presliding = None if found is None else found.model
        if presliding is not None and self.quick is not None:
            # Slow strokes leave the mass to chance.
            presliding = presliding.with_value("mass", rigid.value("mass"))
            presliding = presliding.with_value("viscous.coefficient", rigid.value("viscous.coefficient"))
        return Known(graded, rigid, presliding, dnlrx)


def record_of(course: Course) -> Record:
    """What a log of ``course`` holds: position as read, and the mean force since the last sample."""
    return Record(
        course.reference.time,
        course.seen,
        course.effort,
        reference=course.reference.position,
        source="recording of the comparison",
        effort_hold="preceding",
    )
