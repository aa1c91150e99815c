"""The verdict on recordings at constant speeds, one each, from their mean forces.

Such recordings are those that :mod:`fric.diagnosis.ladder` takes. A term can be found that the friction curve over speed may
have (:mod:`fric.diagnosis.curve_terms`). It is chosen on the means to learn from, and has to make the means held back better.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..effects import EFFECTS
from ..identification.methods.static_map import curve_terms
from ..identification.static_maps.curve import Candidate, Choice, Curve, Points, choose
from ..identification.static_maps.load import MeanForce
from ..identification.static_maps.smoothness import structure_of
from ..identification.static_maps.weighted import as_normal
from ..instrument import Finding as Check
from ..model import Model
from ..record import Array, Mask, Record
from .candidates import FRICTION, place_of
from .confidence import AS_LIKELY, UNEXPLAINED, unknown_confidence
from .curve_terms import (
    FLAGS,
    base_of,
    force_of_term,
    gain_of,
    kept,
    points_of,
    refitted,
    static_force,
    terms_beyond,
    weight_of,
    with_effect,
)
from .fitting import with_amplitudes
from .ladder import Ladder
from .locate import Where, direction
from .result import Diagnosis, Estimate, Finding, Grown, NominalPart, Prediction, Rejected, RunnerUp, Unexplained, Validation

__all__ = ["concluded_by_means"]

_ENERGY = 0.8  # statistical: of what is missing, by the range of speeds named
_MOST = 0.99  # statistical: the largest confidence
_MEANS_ONLY = "every recording is at one speed: the means of the runs were compared, not their samples"
_NEXT = (
    "record speeds that change (a chirp, reversals): constant ones don't show what acts at reversals, with "
    "the acceleration or at a place"
)


@dataclass(frozen=True, eq=False)
class _Judged:
    """The curves, and the means that they are fitted to and compared with.

    Attributes:
        choice: of the curve.
        base: the nominal model's terms.
        best: the curve that the means held back don't speak against.
        gone: the chosen terms that they do speak against, each with the reason.
        start: the nominal model's terms, refitted.
        points: the means learnt from.
        apart: those held back.
        place: tells where an energy, one value per mean held back, sits.
    """

    choice: Choice
    base: Candidate
    best: Curve
    gone: tuple[tuple[str, str], ...]
    start: Curve
    points: Points
    apart: Points
    place: Callable[[Array], Where]

    @property
    def excess(self) -> float:
        """Weighted squares by which the means learnt from miss the refitted curve, above what chance leaves."""
        return max(self.start.cost - self.best.freedom, 1e-300)

    @property
    def left(self) -> Array:
        """What the best curve leaves of the means held back [F], shape ``(n,)``."""
        return self.apart.force - self.best.force(self.apart.velocity)


def concluded_by_means(
    ladder: Ladder,
    validation: Sequence[Record],
    nominal: Model,
    checks: Sequence[Check],
    corrected: Sequence[str],
) -> Diagnosis:
    """The verdict from the means alone.

    Args:
        ladder: means to learn from and means held back.
        validation: the recordings held back.
        nominal: the model that is examined.
        checks: of the instrument, as far as they were made.
        corrected: remarks on what was corrected in the recordings.
    """
    judged = _judged(ladder, validation, nominal)
    force = {
        "nominal": static_force(nominal, judged.apart.velocity),
        "refit": judged.start.force(judged.apart.velocity),
        "augmented": judged.best.force(judged.apart.velocity),
    }
    scored, rest = _scored(judged.apart, force)
    shown, refit = _model(nominal, judged.best, judged.choice), _model(nominal, judged.start, judged.choice)
    findings = _findings(judged, shown, scored)
    why, remarks = _open(judged, findings, rest, nominal.units.force)
    if why:
        nobody = _unknown(why, judged.place(judged.left**2), scored, rest)
        found = [replace(each, confidence=min(each.confidence, round(1.0 - nobody.confidence, 4))) for each in findings]
        findings = [nobody, *found]
    everything = remains = None
    if findings:
        energy = (force["augmented"] - force["refit"]) ** 2 + np.maximum(judged.left**2 - judged.apart.error**2, 0.0)
        everything = judged.place(energy)
        remains = judged.place(judged.left**2) if rest > UNEXPLAINED else None
    return Diagnosis(
        mismatch=bool(findings),
        where=everything,
        checks=tuple(checks),
        nominal=_part(nominal, refit),
        findings=tuple(findings),
        rejected=_rejected(judged),
        validation=scored,
        unexplained=Unexplained(rest if findings else 0.0, remains),
        next_experiment=_NEXT,
        model=shown,
        refit=refit,
        given=nominal,
        prediction=tuple(_predictions(validation, ladder.validation, force)),
        notes=(*corrected, _MEANS_ONLY, *ladder.notes, *remarks),
        bandwidth=0.0,
        grown=(Grown("", 1.0, ""), *_grown(judged, findings)),
        by_means=True,
    )


def _judged(ladder: Ladder, validation: Sequence[Record], nominal: Model) -> _Judged:
    """The curves for the means of ``ladder``; ``validation`` tells the spans of time at each speed."""
    points, apart = points_of(ladder.train), points_of(ladder.validation)
    base = base_of(nominal)
    choice = choose(points, at_least=base)
    best, gone = kept(choice, base, points, apart)
    start = refitted(base, points, best.scatter)
    order = [record.source for record in validation]
    spans = {record.source: (float(record.time[record.mask][0]), float(record.time[record.mask][-1])) for record in validation}
    place = partial(_where, means=ladder.validation, spans=spans, order=order, unit=nominal.units.position)
    return _Judged(choice, base, best, tuple(gone), start, points, apart, place)


def _open(judged: _Judged, findings: Sequence[Finding], rest: float, unit: str) -> tuple[str, list[str]]:
    """Why something unknown remains, empty where nothing does; and remarks on what else the means tell.

    Args:
        judged: the curves.
        findings: the terms that came.
        rest: share of what is missing that stays.
        unit: of the force.
    """
    points, best = judged.points, judged.best
    remarks = []
    why = structure_of(points.velocity, points.force - best.force(points.velocity), points.error).why
    if best.scatter > 2.0 * float(np.median(points.error)) and not why:
        remarks.append(
            f"the means scatter by {best.scatter:.2g} {unit} from run to run, beyond their own errors of "
            f"{float(np.median(points.error)):.2g} {unit}: temperature, lubricant or the place, "
            "which constant speeds don't tell"
        )
    if why:
        why += ", which chance does in less than one of a hundred: friction depends on speed in a way that no curve here has"
    if why and rest <= UNEXPLAINED:
        remarks.append(f"of the {100.0 * rest:.2g} % that stay, {why}")
        why = ""
    elif not why and findings and all(each.confidence < AS_LIKELY for each in findings):
        why = "several curves bring the means nearer, and none of them surely: more speeds would tell"
    return why, remarks


def _scored(apart: Points, force: Mapping[str, Array]) -> tuple[Validation, float]:
    """NOE of the means held back, and the share that stays of what is missing beyond their own errors."""
    spread = max(float(np.sum((apart.force - np.mean(apart.force)) ** 2)), 1e-300)
    left = {name: float(np.sum((apart.force - each) ** 2)) for name, each in force.items()}
    floor = float(np.sum(apart.error**2))
    noe = {name: 100.0 * each / spread for name, each in left.items()}
    rest = min(max(left["augmented"] - floor, 0.0) / max(left["refit"] - floor, 1e-300), 1.0)
    return Validation(noe["nominal"], noe["refit"], noe["augmented"], 100.0 * floor / spread), rest


def _findings(judged: _Judged, shown: Model, scored: Validation) -> list[Finding]:
    """Each term that came, what explains most first."""
    best, choice = judged.best, judged.choice
    gain = {name: gain_of(name, best, judged.points) for name in terms_beyond(best.candidate, judged.base)}
    found = []
    for effect in sorted(gain, key=lambda name: -gain[name]):
        held = next(held for held in shown.terms if held.effect.id == effect)
        share = min(max(gain[effect], 0.0) / judged.excess, 1.0)
        tested = f" (by chance in {100.0 * choice.p_value:.2g} % of recordings at most)" if effect == "stribeck" else ""
        evidence = (
            f"{held.effect.title} takes {100.0 * share:.3g} % of the weighted squares away by which the means of "
            f"{judged.points.force.size} runs miss the refitted curve{tested}, and brings the {judged.apart.force.size} "
            "held back nearer"
        )
        found.append(
            Finding(
                effect=effect,
                law=held.effect.law,
                title=held.effect.title,
                confidence=round(min(weight_of(choice, effect), _MOST), 4),
                runner_up=_rival(choice, judged.base, best.candidate, effect),
                where=judged.place(force_of_term(effect, best, judged.apart.velocity) ** 2),
                component=place_of(held.effect),
                share=share,
                evidence=evidence,
                parameters={
                    p.name: Estimate(p.value, shown.standard_errors.get(p.name), p.declaration.unit(shown.units))
                    for p in shown.parameters()
                    if p.name.startswith(f"{effect}.")
                },
                noe_before=scored.noe_refit,
                noe_after=scored.noe_augmented,
            )
        )
    return found


def _grown(judged: _Judged, findings: Sequence[Finding]) -> Iterator[Grown]:
    """What stays of the missing squares as one term after the other comes, what explains most first."""
    candidate = judged.base
    for effect in (each.effect for each in findings if each.effect in FLAGS):
        candidate = with_effect(candidate, effect, judged.best.candidate)
        curve = refitted(candidate, judged.points, judged.best.scatter)
        yield Grown(effect, max(curve.cost - judged.best.freedom, 0.0) / judged.excess, "")


def _rival(choice: Choice, base: Candidate, best: Candidate, effect: str) -> RunnerUp | None:
    """What stands in the place of ``effect`` in the best curve that lacks it."""
    for curve in choice.all:
        if not getattr(curve.candidate, FLAGS[effect]):
            others = [name for name in terms_beyond(curve.candidate, base) if name not in terms_beyond(best, base)]
            return RunnerUp(others[0], round(max(1.0 - weight_of(choice, effect), 1e-4), 4)) if others else None
    return None


def _where(
    energy: Array, means: Sequence[MeanForce], spans: dict[str, tuple[float, float]], order: list[str], unit: str
) -> Where:
    """The shortest range of speeds that holds most of ``energy``, one value per mean, and the runs in it."""
    speed = np.abs([mean.velocity for mean in means])
    total = max(float(np.sum(energy)), 1e-300)
    levels = np.sort(speed)
    ranges = [
        (math.log(high / low), low, high)
        for k, low in enumerate(levels.tolist())
        for high in levels[k:].tolist()
        if float(np.sum(energy[(speed >= low) & (speed <= high)])) >= _ENERGY * total
    ]
    _, low, high = min(ranges, default=(0.0, float(levels[0]), float(levels[-1])))
    inside: Mask = (speed >= low) & (speed <= high)
    ahead = float(np.sum(energy[np.array([mean.velocity > 0.0 for mean in means])])) / total
    named = {mean.source for mean, within in zip(means, inside, strict=True) if within}
    time = tuple((spans[source],) if source in named and source in spans else () for source in order)
    words = f"|v| < {high:.3g} {unit}/s" if low == levels[0] else f"|v| from {low:.3g} to {high:.3g} {unit}/s"
    share = float(np.sum(energy[inside])) / total
    return Where(time, share, f"{words}, {direction(ahead)}", "speed", (low, high), float(np.mean(inside)))


def _model(nominal: Model, curve: Curve, choice: Choice) -> Model:
    """The nominal model's plant with the curve's terms, its own first, and their standard errors."""
    found = {held.effect.id: held for held in curve_terms(curve)}
    nothing = [with_amplitudes(held, held.effect.amplitudes, [0.0] * len(held.effect.amplitudes)) for held in nominal.terms]
    own = [found.pop(held.effect.id, held) for held in nothing]
    model = nominal.with_terms([*own, *found.values()])
    wide = as_normal(curve.freedom) * (choice.widening if curve is choice.best else 1.0)
    errors = np.sqrt(np.maximum(np.diag(curve.covariance), 0.0)) * wide
    known = {name: float(error) for name, error in zip(curve.candidate.names, errors, strict=True)}
    return replace(model, standard_errors=known, provenance={"method": "diagnosis, from the mean forces at constant speeds"})


def _part(nominal: Model, refit: Model) -> NominalPart:
    """The parameters of ``nominal``, their refitted values, and by how much each is off [%]."""
    given = {p.name: p.value for p in nominal.parameters()}
    found = {p.name: p.value for p in refit.parameters() if p.name in given}
    off = {name: 100.0 * (given[name] - value) / value for name, value in found.items() if value != 0.0}
    return NominalPart(given, found, off)


def _rejected(judged: _Judged) -> tuple[Rejected, ...]:
    """The effects that did not come, each with the reason."""
    there = {"coulomb", "bias", *terms_beyond(judged.best.candidate, Candidate())}
    why = dict(judged.gone)
    for effect in FLAGS:
        if effect in there or effect in why:
            continue
        weight = f"candidates with it carry {100.0 * weight_of(judged.choice, effect):.2g} % of the weight"
        chance = f"; as much of it comes by chance in {100.0 * judged.choice.p_value:.2g} % of recordings"
        why[effect] = weight + (chance if effect == "stribeck" and math.isfinite(judged.choice.p_value) else "")
    for each in EFFECTS.values():
        if each.id not in there and each.id not in why:
            why[each.id] = "constant speeds don't show it"
    return tuple(Rejected(effect, reason) for effect, reason in why.items())


def _unknown(why: str, where: Where, scored: Validation, rest: float) -> Finding:
    """The finding that no known effect explains what is left, with the reason ``why``."""
    return Finding(
        effect="unknown",
        law="",
        title="something that no known effect explains",
        confidence=unknown_confidence(rest),
        runner_up=None,
        where=where,
        component=FRICTION,
        share=rest,
        evidence=why,
        parameters={},
        noe_before=scored.noe_refit,
        noe_after=scored.noe_augmented,
    )


def _predictions(validation: Sequence[Record], means: Sequence[MeanForce], force: dict[str, Array]) -> list[Prediction]:
    """Measured force of each recording held back, and what the curves have at its speed."""
    found = []
    for record in validation:
        number = next((k for k, mean in enumerate(means) if mean.source == record.source), None)
        use = record.mask if number is not None else np.zeros_like(record.mask)
        one = np.ones(int(np.sum(use)))
        held = {name: one * float(each[number or 0]) for name, each in force.items()}
        found.append(
            Prediction(record.source, record.time[use], record.effort[use], held["nominal"], held["refit"], held["augmented"])
        )
    return found
