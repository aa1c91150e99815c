"""What a check of a recording is: its evidence, what it finds, and how a fault can be corrected.

Every check is one file of this package with a constant ``CHECK``. It looks at the recordings alone, and at a model where one is
given; it never fits a friction law. A verdict is one of four:

``ok``       nothing wrong within what can be seen;
``warning``  something limits what can be identified, or may be meant so;
``fault``    the recording differs from what the axis did: a fit would be wrong;
``unknown``  these recordings don't decide it; the detail gives the reason.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from ..model import Model
from ..record import Array, Record
from .lines import PositionError
from .view import View

__all__ = ["Check", "Correction", "Evidence", "Finding", "Verdict", "each"]

Verdict = Literal["ok", "warning", "fault", "unknown"]


@dataclass(frozen=True)
class Correction:
    """What makes a faulty recording right again, as far as that is possible.

    Attributes:
        position_factor: of position and reference [1].
        effort_factor: of the effort [1].
        velocity_factor: of the recorded velocity [1].
        effort_offset: added to the effort after its factor [F].
        effort_shift: time by which the effort has to come earlier [s].
        effort_stretch: further such time per time of the recording [s/s].
        position_error: that is taken off the position as recorded, or None.
    """

    position_factor: float = 1.0
    effort_factor: float = 1.0
    velocity_factor: float = 1.0
    effort_offset: float = 0.0
    effort_shift: float = 0.0
    effort_stretch: float = 0.0
    position_error: PositionError | None = None

    def apply(self, record: Record) -> Record:
        """``record`` as it would be without the fault, with a note of what was done."""
        shift = self.effort_shift + self.effort_stretch * record.time
        effort = self.effort_factor * np.interp(record.time + shift, record.time, record.effort) + self.effort_offset
        # Where the shifted effort would come from outside the recording, nobody knows it.
        inside = (record.time + shift >= 0.0) & (record.time + shift <= record.time[-1])
        error = self.position_error
        position = record.position if error is None else error.taken_off(record.position)
        return replace(
            record,
            position=self.position_factor * position,
            reference=None if record.reference is None else self.position_factor * record.reference,
            velocity=None if record.velocity is None else self.velocity_factor * record.velocity,
            effort=np.asarray(effort, dtype=np.float64),
            valid=record.valid if bool(np.all(inside)) else record.mask & inside,
            notes=(*record.notes, f"corrected: {self.text}"),
        )

    @property
    def text(self) -> str:
        """What it does, in words."""
        parts = []
        for name, factor in (
            ("position", self.position_factor),
            ("effort", self.effort_factor),
            ("velocity", self.velocity_factor),
        ):
            if factor != 1.0:
                parts.append(f"{name} times {factor:.6g}")
        if self.effort_offset:
            parts.append(f"effort plus {self.effort_offset:.4g}")
        if self.effort_shift:
            parts.append(f"effort {1e3 * self.effort_shift:+.4g} ms earlier")
        if self.effort_stretch:
            parts.append(f"effort's clock by {1e6 * self.effort_stretch:+.4g} ppm")
        if self.position_error is not None:
            error = self.position_error
            parts.append(f"position without an error of {error.amplitude:.3g} within lines of {error.pitch:.4g}")
        return ", ".join(parts) or "nothing"


@dataclass(frozen=True)
class Finding:
    """What one check found.

    Attributes:
        check: id of the check.
        verdict: see the module.
        detail: one sentence.
        value: the number that it was judged by, in ``unit``; NaN where there is none.
        unit: of value and interval.
        interval: 95 % interval of ``value``, where one can be given.
        remedy: what to record instead, or which option corrects it.
        recording: index of the recording; None when the finding is about all of them together.
        time: spans concerned [s], ``(first, last)`` each.
        correction: what makes it right, where that can be done.
    """

    check: str
    verdict: Verdict
    detail: str
    value: float = math.nan
    unit: str = ""
    interval: tuple[float, float] | None = None
    remedy: str = ""
    recording: int | None = None
    time: tuple[tuple[float, float], ...] = ()
    correction: Correction | None = None

    def as_json(self) -> dict[str, object]:
        """For programs; numbers that are not known are null."""
        return {
            "check": self.check,
            "verdict": self.verdict,
            "value": self.value if math.isfinite(self.value) else None,
            "unit": self.unit,
            "interval": None if self.interval is None else list(self.interval),
            "detail": self.detail,
            "remedy": self.remedy,
            "recording": self.recording,
            "time": [list(span) for span in self.time],
            "correction": None if self.correction is None else self.correction.text,
        }


@dataclass(frozen=True, eq=False)
class Evidence:
    """What checks look at.

    Attributes:
        records: recordings of one joint.
        model: nominal model whose given values are taken as right, or None.
        settings: known numbers, such as ``gear_ratio`` [1].
    """

    records: Sequence[Record]
    model: Model | None = None
    settings: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def views(self) -> tuple[View, ...]:
        """Every recording, filtered and differentiated."""
        return tuple(View(record) for record in self.records)

    @cached_property
    def inertia(self) -> float:
        """Mass that the model gives [F s^2/x]; NaN without a model."""
        if self.model is None:
            return math.nan
        bare = self.model.with_terms(held for held in self.model.terms if held.effect.link is not None)
        return _force(bare, 0.0, 1.0) - _force(bare, 0.0, 0.0)

    def friction(self, speed: float) -> float:
        """Steady friction that the model gives at ``speed`` [F], mean of both directions; NaN without a model."""
        if self.model is None:
            return math.nan
        static = self.model.with_terms(held for held in self.model.terms if held.effect.slip is None)
        return 0.5 * (_force(static, speed, 0.0) - _force(static, -speed, 0.0))


@dataclass(frozen=True, eq=False)
class Check:
    """One check.

    Attributes:
        id: its name in tables and files.
        title: what is checked, as a heading.
        needs: what it can't judge without.
        run: the check.
    """

    id: str
    title: str
    needs: str
    run: Callable[[Evidence], list[Finding]]


def _force(model: Model, velocity: float, acceleration: float) -> float:
    """Force that ``model`` needs at position 0 [F]."""
    from ..simulation import predict_force

    def one(value: float) -> Array:
        return np.array([value])

    return float(predict_force(model, one(0.0), one(0.0), one(velocity), one(acceleration), 1e-3)[0])


def each(judge: Callable[[View, Evidence], Finding]) -> Callable[[Evidence], list[Finding]]:
    """A check that judges every recording by itself."""

    def run(evidence: Evidence) -> list[Finding]:
        return [replace(judge(view, evidence), recording=k) for k, view in enumerate(evidence.views)]

    return run
