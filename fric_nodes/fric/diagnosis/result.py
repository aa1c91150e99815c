"""What a diagnosis says: plain data, and the report that other programs read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..instrument import Finding as Check
from ..model import Model
from ..record import Array
from .additive.told import ComponentFinding
from .calibration import Evidence
from .confidence import AS_LIKELY, FAINT
from .differences import Contradiction
from .halves import Half
from .limits import Limit
from .locate import Where

__all__ = [
    "Diagnosis", "Estimate", "Finding", "Grown", "NominalPart", "Prediction", "Rejected", "RunnerUp", "Unexplained",
    "Validation", "listed", "percent",
]  # fmt: skip

FORMAT = "fric-report/1"

_HARDLY_ANY = 0.05  # of what is missing


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error, None where it isn't known, and its unit."""

    value: float
    std: float | None
    unit: str


@dataclass(frozen=True)
class RunnerUp:
    """The effect that comes closest to a finding, and its probability."""

    effect: str
    confidence: float


@dataclass(frozen=True)
class Finding:
    """One thing that is missing.

    Attributes:
        effect: id from the vocabulary, or ``unknown``.
        law: which law fits, where an effect has several.
        title: the effect in a sentence.
        confidence: probability that it is this effect.
        runner_up: the next best, or None.
        where: when and in which regime.
        component: part of the machine.
        share: of the mismatch's energy.
        evidence: one sentence.
        parameters: of the effect, by name.
        noe_before: NOE of the refitted nominal model on unseen recordings [%].
        noe_after: NOE of the grown model on them [%].
        reproduced: what each half of the recordings says of it by itself; empty where that wasn't asked.
        weighed: what speaks for it; None of something unknown.
        term: name of its term in the grown model, which tells two of one effect apart; empty where it has none.
    """

    effect: str
    law: str
    title: str
    confidence: float
    runner_up: RunnerUp | None
    where: Where
    component: str
    share: float
    evidence: str
    parameters: Mapping[str, Estimate]
    noe_before: float
    noe_after: float
    reproduced: tuple[Half, ...] = ()
    weighed: Evidence | None = None
    term: str = ""


@dataclass(frozen=True)
class NominalPart:
    """Values of the nominal model as given and as refitted, and how far the given ones were off [%]."""

    parameters: Mapping[str, float]
    refit_parameters: Mapping[str, float]
    parameter_error_percent: Mapping[str, float]


@dataclass(frozen=True)
class Rejected:
    """An effect that isn't there, and why."""

    effect: str
    why: str


@dataclass(frozen=True)
class Grown:
    """A term that came, what it left of the missing force's energy above the floor, and what its best rival would have left."""

    term: str
    left: float
    beside: str


@dataclass(frozen=True)
class Validation:
    """NOE on recordings that no fit has seen [%], and what noise alone leaves."""

    noe_nominal: float
    noe_refit: float
    noe_augmented: float
    noise_floor: float

    @property
    def stands_out(self) -> float:
        """What the refitted model lacks beyond the noise, over that [1]."""
        return max(self.noe_refit - self.noise_floor, 0.0) / max(self.noise_floor, 1e-300)


@dataclass(frozen=True)
class Unexplained:
    """What is left.

    Attributes:
        share: of the mismatch's energy.
        where: it sits; None when it isn't above the floor.
        interval: 95 % of it by resampling blocks of the recordings held back; None where none can be had.
    """

    share: float
    where: Where | None
    interval: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class Prediction:
    """Forces of one validation recording, ``(n,)`` each [F], over ``time`` [s], low-passed as the observer sees them."""

    source: str
    time: Array
    force_measured: Array
    force_nominal: Array
    force_refit: Array
    force_augmented: Array


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The whole verdict.

    Attributes:
        mismatch: True when something is missing in the nominal model.
        where: all of it sits, what was found and what is left, in the validation recordings; None when nothing is missing.
        checks: of the instrument.
        nominal: its values, given and refitted.
        findings: what is missing, what explains most first.
        rejected: the other effects, with reasons.
        validation: NOE on unseen recordings.
        unexplained: what is left.
        next_experiment: what to record next.
        model: the grown model.
        refit: the refitted nominal model.
        given: the nominal model as it came.
        prediction: forces of each validation recording.
        notes: what was corrected or left out before.
        bandwidth: of the observer that tells the missing force [rad/s]; 0 where means were compared.
        grown: how the model grew, for the report: the refitted nominal first, its term empty.
        only_held_back: True where the recordings learnt from lack nothing, and those held back do.
        by_means: True where means of runs at constant speeds were compared, not samples.
        components: what the grown model still lacks, by component of the machine, in the recordings learnt from; empty where
            nothing unknown is left.
        limits: of every effect that was not found, the smallest that would have shown in the recordings learnt from.
        fitted_on: sources of the recordings learnt from.
        tested_on: of those held back.
        contradiction: how the recordings learnt from contradict each other; None where they don't.
    """

    mismatch: bool
    where: Where | None
    checks: tuple[Check, ...]
    nominal: NominalPart
    findings: tuple[Finding, ...]
    rejected: tuple[Rejected, ...]
    validation: Validation
    unexplained: Unexplained
    next_experiment: str
    model: Model
    refit: Model
    given: Model
    prediction: tuple[Prediction, ...]
    notes: tuple[str, ...]
    bandwidth: float
    grown: tuple[Grown, ...]
    only_held_back: bool = False
    by_means: bool = False
    components: tuple[ComponentFinding, ...] = ()
    limits: tuple[Limit, ...] = ()
    fitted_on: tuple[str, ...] = ()
    tested_on: tuple[str, ...] = ()
    contradiction: Contradiction | None = None

    @property
    def limits_in_words(self) -> str:
        """What would have shown; empty where no limit is known."""
        known = [each.sentence for each in self.limits if each.size is not None]
        return f"Not found, but would have shown in these recordings: {listed(known)}." if known else ""

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        v = self.validation
        if self.contradiction is not None:
            return self.contradiction.sentence
        if not self.mismatch and self.by_means:
            return (
                f"No term of the friction curve is missing: the refitted one leaves an NOE of {v.noe_refit:.3g} % of the "
                f"means, of which {v.noise_floor:.3g} % are their own errors; the rest scatters and does not hang on the speed."
            )
        if not self.mismatch:
            return (
                f"Nothing is missing: the refitted model leaves an NOE of {v.noe_refit:.3g} %, and the instruments alone leave "
                f"{v.noise_floor:.3g} %."
            )
        first = self.findings[0] if self.findings else None
        if first is None or first.effect == "unknown":
            where = first.where.regime if first is not None else "not located"
            if self.only_held_back:
                return (
                    f"Something is missing that only the recording held back shows: the refitted model leaves an NOE of "
                    f"{v.noe_refit:.3g} % there, and the instruments alone leave {v.noise_floor:.3g} %; it sits here: {where}."
                )
            present = [each for each in self.findings[1:] if each.confidence >= AS_LIKELY]
            if first and present:
                return (
                    f"Missing: {_with_odds(present)}; they don't explain all: {percent(first.share)} % of the missing force's "
                    f"energy stays, and no known effect explains it; it sits here: {where}."
                )
            helpful = listed([each.title for each in self.findings[1:]])
            left = ""
            if first and len(self.findings) == 2 and first.share < _HARDLY_ANY:
                left = f" What explains it, {helpful}, does so hardly better than something else would."
            elif first and helpful and first.share < _HARDLY_ANY:
                left = f" Several effects explain it only together, each doing part of the others' work: {helpful}."
            elif first and helpful:
                left = f" Of its energy {percent(first.share)} % stay beside what helps: {helpful}."
            why = "no known effect explains it"
            if v.stands_out < FAINT:
                why = "it is too faint beside the noise to tell what"
            return f"Something is missing, and {why}; it sits here: {where}.{left}"
        names = _with_odds([each for each in self.findings if each.effect != "unknown"])
        return f"Missing: {names}; with it the NOE on unseen data falls from {v.noe_refit:.3g} % to {v.noe_augmented:.3g} %."

    @property
    def force_errors(self) -> tuple[float, float] | None:
        """Root mean square of the force missing on unseen recordings [F], refitted and grown; None where means are compared."""
        if self.by_means or not any(p.time.size for p in self.prediction):
            return None
        refit, grown = (
            math.sqrt(float(np.mean(np.concatenate(parts) ** 2)))
            for parts in (
                [p.force_measured - p.force_refit for p in self.prediction],
                [p.force_measured - p.force_augmented for p in self.prediction],
            )
        )
        return refit, grown

    @property
    def force_errors_in_words(self) -> str:
        """What :attr:`force_errors` says, or nothing where nothing was added or they don't exist."""
        errors = self.force_errors
        if errors is None or not self.findings or len(self.model.terms) == len(self.refit.terms):
            return ""
        refit, grown = errors
        less = 100.0 * (1.0 - grown / refit) if refit > 0.0 else 0.0
        unit = self.given.units.force
        return f"Force error on held-back data: {refit:.3g} {unit} refitted, {grown:.3g} {unit} grown, {less:.3g} % less."

    def report(self) -> dict[str, Any]:
        """The contents of ``report.json``; numbers that aren't finite become null."""
        errors = self.force_errors or (None, None)
        report = {
            "format": FORMAT,
            "verdict": self.sentence,
            "mismatch": self.mismatch,
            "where": _where(self.where),
            "checks": [
                {"check": c.check, "verdict": c.verdict, "value": c.value, "detail": c.detail, "remedy": c.remedy}
                for c in self.checks
            ],
            "nominal": {
                "parameters": dict(self.nominal.parameters),
                "refit_parameters": dict(self.nominal.refit_parameters),
                "parameter_error_percent": dict(self.nominal.parameter_error_percent),
            },
            "findings": [_finding(each) for each in self.findings],
            "rejected": [{"effect": each.effect, "why": each.why} for each in self.rejected],
            "validation": {
                "noe_nominal": self.validation.noe_nominal,
                "noe_refit": self.validation.noe_refit,
                "noe_augmented": self.validation.noe_augmented,
                "noise_floor": self.validation.noise_floor,
                "force_error_refit": errors[0],
                "force_error_augmented": errors[1],
            },
            "unexplained": {
                "share": self.unexplained.share,
                "interval": None if self.unexplained.interval is None else list(self.unexplained.interval),
                "where": _where(self.unexplained.where),
                "components": {each.component: each.share for each in self.components if each.is_there},
            },
            "limits": [each.as_json() for each in self.limits],
            "contradiction": None if self.contradiction is None else self.contradiction.as_json(),
            "data": {
                "fitted": list(self.fitted_on),
                "selected": "blocks and halves of the fitted recordings, each left out in turn",
                "tested": list(self.tested_on),
                "withdrawn": "effects that make the tested recordings worse or do not show there; what stays there counts",
            },
            "components": [each.as_json() for each in self.components],
            "next_experiment": self.next_experiment,
            "notes": list(self.notes),
            "observer_bandwidth": None if self.by_means else self.bandwidth,
        }
        found: dict[str, Any] = _finite(report)
        return found


def percent(share: float, digits: int = 2) -> str:
    """A share in percent, so many ``digits`` of it; all of it is 100 and not 1e+02."""
    text = f"{100.0 * share:.{digits}g}"
    return f"{100.0 * share:.0f}" if "e+" in text else text


def listed(names: Sequence[str]) -> str:
    """A, B and C."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _with_odds(findings: Sequence[Finding]) -> str:
    return listed([f"{each.title} ({min(round(100 * each.confidence), 99)} % sure)" for each in findings])


def _where(where: Where | None) -> dict[str, Any]:
    if where is None:
        return {"time": [], "regime": ""}
    first = where.time[0] if where.time else ()
    return {
        "time": [list(span) for span in first],
        "time_by_recording": [[list(span) for span in spans] for spans in where.time],
        "regime": where.regime,
        "quantity": where.quantity,
        "range": list(where.range),
        "share_in_time": where.share,
    }


def _finding(each: Finding) -> dict[str, Any]:
    return {
        "effect": each.effect,
        "law": each.law,
        "confidence": each.confidence,
        "runner_up": None
        if each.runner_up is None
        else {"effect": each.runner_up.effect, "confidence": each.runner_up.confidence},
        "where": {**_where(each.where), "component": each.component, "share_of_mismatch": each.share},
        "evidence": each.evidence,
        "parameters": {name: {"value": e.value, "std": e.std, "unit": e.unit} for name, e in each.parameters.items()},
        "noe_before": each.noe_before,
        "noe_after": each.noe_after,
        "reproduced": [{"nats": half.nats, "parameters": dict(half.parameters)} for half in each.reproduced],
        "weighed": None if each.weighed is None else asdict(each.weighed),
    }


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(held) for key, held in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(held) for held in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
