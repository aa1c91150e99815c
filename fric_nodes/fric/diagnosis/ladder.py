"""Recordings at constant speeds, one each: what a nominal model leaves out of their mean forces.

Within such a run only what the axis does besides shows (a ripple of the screw, the controller), and an observer of the motion
sees that and nothing else. What the friction does over speed shows between the runs. So each run gives a mean force with its
error, and what can be missing is a term of the friction curve: :mod:`fric.identification.static_maps.curve` chooses
among all that hold the nominal model's, by the recordings to learn from, with the scatter from run to run that no single run
shows. Each term that comes then has to make the means held back better.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..effects import EFFECTS
from ..identification.methods.static_map import curve_terms, settled_means
from ..identification.result import Options
from ..identification.static_maps.curve import STRIBECK_LAWS, Candidate, Choice, Curve, Points, choose, fitted
from ..identification.static_maps.load import MeanForce
from ..identification.static_maps.smoothness import structure_of
from ..identification.static_maps.weighted import as_normal
from ..instrument import Finding as Check
from ..model import Model, Term
from ..record import Array, Mask, Record
from .candidates import FRICTION, place_of
from .confidence import AS_LIKELY, UNEXPLAINED, unknown_confidence
from .locate import Where, direction
from .result import Diagnosis, Estimate, Finding, Grown, NominalPart, Prediction, Rejected, RunnerUp, Unexplained, Validation

__all__ = ["Ladder", "concluded_by_means", "ladder_of"]

_FEWEST_SPEEDS = 4
_ONE_WAY = 0.05  # of the way, beyond its ends
_SETTLED = 0.75  # of the recordings, at least
_ENERGY = 0.8  # of what is missing, by the range of speeds named
_MOST = 0.99  # sure of anything
_FLAGS = {"viscous": "viscous", "stribeck": "stribeck", "quadratic_drag": "quadratic", "asymmetry": "asymmetry"}


@dataclass(frozen=True, eq=False)
class Ladder:
    """Means to learn from and means held back, and why runs have none."""

    train: list[MeanForce]
    validation: list[MeanForce]
    notes: tuple[str, ...]


def ladder_of(train: Sequence[Record], validation: Sequence[Record], nominal: Model) -> Ladder | None:
    """The means of the recordings, where each is one speed and nothing else tells more; else None."""
    have = {held.effect.id for held in nominal.terms}
    if not all(held.effect.usual or held.effect.law in ("", *STRIBECK_LAWS) for held in nominal.terms):
        return None
    if nominal.plant.id not in ("rigid", "contact") or not {"coulomb", "bias"} <= have <= {"coulomb", "bias", *_FLAGS}:
        return None
    if not all(_one_way(record) for record in (*train, *validation)):
        return None
    means, notes = settled_means(train, Options())
    held, others = settled_means(validation, Options())
    several = any(len({mean.source for mean in each}) < len(each) for each in (means, held))
    if several or not held or len(means) + len(held) < _SETTLED * (len(train) + len(validation)):
        return None
    points = _points(means) if means else None
    if points is None or points.n_speeds < _FEWEST_SPEEDS or np.all(points.velocity > 0.0) or np.all(points.velocity < 0.0):
        return None
    return Ladder(means, held, tuple(dict.fromkeys([*notes, *others])))


def _one_way(record: Record) -> bool:
    """Whether it hardly ever is elsewhere than between its first and its last place; an encoder may flicker."""
    where = record.position[record.mask]
    return bool(where.size) and float(np.ptp(where)) <= (1.0 + _ONE_WAY) * abs(float(where[-1] - where[0]))


def _points(means: Sequence[MeanForce]) -> Points:
    columns = zip(*((mean.velocity, mean.friction, mean.force[1]) for mean in means), strict=True)
    return Points(*(np.array(column) for column in columns))


def _base(nominal: Model) -> Candidate:
    """The nominal model's terms as a candidate."""
    laws = {held.effect.id: held.effect.law for held in nominal.terms}
    return Candidate("viscous" in laws, laws.get("stribeck", ""), "quadratic_drag" in laws, "asymmetry" in laws)


def _terms(candidate: Candidate, base: Candidate) -> list[str]:
    """Effects of ``candidate`` that ``base`` lacks."""
    return [effect for effect, flag in _FLAGS.items() if getattr(candidate, flag) and not getattr(base, flag)]


def _without(candidate: Candidate, effect: str) -> Candidate:
    return _with(candidate, effect, Candidate())


def _with(candidate: Candidate, effect: str, other: Candidate) -> Candidate:
    """``candidate`` with or without one effect, as ``other`` has it or not."""
    return Candidate(
        other.viscous if effect == "viscous" else candidate.viscous,
        other.stribeck if effect == "stribeck" else candidate.stribeck,
        other.quadratic if effect == "quadratic_drag" else candidate.quadratic,
        other.asymmetry if effect == "asymmetry" else candidate.asymmetry,
    )


def _refitted(candidate: Candidate, points: Points, scatter: float) -> Curve:
    """The curve of ``candidate``; what would come out negative is zero."""
    for stripped in (candidate, replace(candidate, quadratic=False), replace(candidate, viscous=False, quadratic=False)):
        curve = fitted(stripped, points, scatter)
        if curve is not None:
            return curve
    plain = fitted(Candidate(), points, scatter)
    assert plain is not None
    return plain


def _cost(curve: Curve, points: Points) -> float:
    """Weighted sum of squares of the points about a curve, which they needn't have made."""
    left = points.force - curve.force(points.velocity)
    return float(np.sum(left**2 / (points.error**2 + curve.scatter**2)))


def _kept(choice: Choice, base: Candidate, points: Points, apart: Points) -> tuple[Curve, list[tuple[str, str]]]:
    """The chosen curve without the terms that the means held back speak against, and those, with the reason."""
    best = choice.best
    gone: list[tuple[str, str]] = []
    while True:
        poorer = {
            name: _refitted(_without(best.candidate, name), points, best.scatter) for name in _terms(best.candidate, base)
        }
        worst = min(poorer, key=lambda name: _cost(poorer[name], apart), default=None)
        if worst is None or _cost(poorer[worst], apart) > _cost(best, apart):
            return best, gone
        gone.append((worst, "makes the recordings held back worse"))
        best = poorer[worst]


def _sure(choice: Choice, effect: str) -> float:
    """Weight of the candidates with ``effect`` (Burnham and Anderson 2002), beside the test for a Stribeck effect."""
    weights = np.array([math.exp(-0.5 * (curve.criterion - choice.all[0].criterion)) for curve in choice.all])
    have = np.array([bool(getattr(curve.candidate, _FLAGS[effect])) for curve in choice.all])
    sure = float(np.sum(weights[have]) / np.sum(weights))
    return min(sure, 1.0 - choice.p_value) if effect == "stribeck" and math.isfinite(choice.p_value) else sure


def _rival(choice: Choice, base: Candidate, best: Candidate, effect: str) -> RunnerUp | None:
    """What stands in the place of ``effect`` in the best curve that lacks it."""
    for curve in choice.all:
        if not getattr(curve.candidate, _FLAGS[effect]):
            others = [name for name in _terms(curve.candidate, base) if name not in _terms(best, base)]
            return RunnerUp(others[0], round(max(1.0 - _sure(choice, effect), 1e-4), 4)) if others else None
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


@dataclass(frozen=True, eq=False)
class _Judged:
    """The curves, and the means held back as they see them.

    Attributes:
        choice: of the curve.
        base: the nominal model's terms.
        best: the curve that the means held back don't speak against.
        start: the nominal model's terms, refitted.
        points: the means learnt from.
        apart: those held back.
        place: tells where an energy, one value per mean held back, sits.
    """

    choice: Choice
    base: Candidate
    best: Curve
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
    """The verdict from the means alone."""
    points, apart = _points(ladder.train), _points(ladder.validation)
    base = _base(nominal)
    choice = choose(points, at_least=base)
    best, gone = _kept(choice, base, points, apart)
    start = _refitted(base, points, best.scatter)
    order = [record.source for record in validation]
    spans = {record.source: (float(record.time[record.mask][0]), float(record.time[record.mask][-1])) for record in validation}
    judged = _Judged(
        choice,
        base,
        best,
        start,
        points,
        apart,
        partial(_where, means=ladder.validation, spans=spans, order=order, unit=nominal.units.position),
    )
    force = {
        "nominal": _static(nominal, apart.velocity),
        "refit": start.force(apart.velocity),
        "augmented": best.force(apart.velocity),
    }
    scored, rest = _scored(apart, force)
    shown, refit = _model(nominal, best, choice), _model(nominal, start, choice)
    findings = _findings(judged, shown, scored)
    notes = [
        *corrected,
        "every recording is at one speed: the means of the runs were compared, not their samples",
        *ladder.notes,
    ]
    why = structure_of(points.velocity, points.force - best.force(points.velocity), points.error).why
    if best.scatter > 2.0 * float(np.median(points.error)) and not why:
        notes.append(
            f"the means scatter by {best.scatter:.2g} {nominal.units.force} from run to run, beyond their own errors of "
            f"{float(np.median(points.error)):.2g} {nominal.units.force}: temperature, lubricant or the place, "
            "which constant speeds don't tell"
        )
    if why:
        why += ", which chance does in less than one of a hundred: friction depends on speed in a way that no curve here has"
    if why and rest <= UNEXPLAINED:
        notes.append(f"of the {100.0 * rest:.2g} % that stay, {why}")
        why = ""
    elif not why and findings and all(each.confidence < AS_LIKELY for each in findings):
        why = "several curves bring the means nearer, and none of them surely: more speeds would tell"
    if why:
        nobody = _unknown(why, judged.place(judged.left**2), scored, rest)
        found = [replace(each, confidence=min(each.confidence, round(1.0 - nobody.confidence, 4))) for each in findings]
        findings = [nobody, *found]
    everything = remains = None
    if findings:
        energy = (force["augmented"] - force["refit"]) ** 2 + np.maximum(judged.left**2 - apart.error**2, 0.0)
        everything = judged.place(energy)
        remains = judged.place(judged.left**2) if rest > UNEXPLAINED else None
    return Diagnosis(
        mismatch=bool(findings),
        where=everything,
        checks=tuple(checks),
        nominal=_part(nominal, refit),
        findings=tuple(findings),
        rejected=_rejected(choice, base, best, gone),
        validation=scored,
        unexplained=Unexplained(rest if findings else 0.0, remains),
        next_experiment="record speeds that change (a chirp, reversals): constant ones don't show what acts at reversals, with "
        "the acceleration or at a place",
        model=shown,
        refit=refit,
        given=nominal,
        prediction=tuple(_predictions(validation, ladder.validation, force)),
        notes=tuple(notes),
        bandwidth=0.0,
        grown=(Grown("", 1.0, ""), *_grown(judged, findings)),
        by_means=True,
    )


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
    gain = {name: _gain(name, best, judged.points) for name in _terms(best.candidate, judged.base)}
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
                confidence=round(min(_sure(choice, effect), _MOST), 4),
                runner_up=_rival(choice, judged.base, best.candidate, effect),
                where=judged.place(_of_term(effect, best, judged.apart.velocity) ** 2),
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
    for effect in (each.effect for each in findings if each.effect in _FLAGS):
        candidate = _with(candidate, effect, judged.best.candidate)
        curve = _refitted(candidate, judged.points, judged.best.scatter)
        yield Grown(effect, max(curve.cost - judged.best.freedom, 0.0) / judged.excess, "")


def _gain(effect: str, best: Curve, points: Points) -> float:
    return _refitted(_without(best.candidate, effect), points, best.scatter).cost - best.cost


def _of_term(effect: str, curve: Curve, velocity: Array) -> Array:
    """The force of one term of ``curve`` [F], shape ``(n,)``."""
    alone = np.array(
        [
            value if name.split(".")[0] == effect else 0.0
            for name, value in zip(curve.candidate.names, curve.values.tolist(), strict=True)
        ]
    )
    return replace(curve, values=alone).force(velocity)


def _static(model: Model, velocity: Array) -> Array:
    """Force at constant ``velocity`` by a model's terms [F], shape ``(n,)``."""
    values = {p.name: p.value for p in model.parameters()}
    candidate = _base(model)
    own = np.array([values[name] for name in candidate.names])
    return Curve(candidate, own, np.zeros((1, 1)), 0.0, 0.0, 0.0, 1).force(velocity)


def _model(nominal: Model, curve: Curve, choice: Choice) -> Model:
    """The nominal model's plant with the curve's terms, its own first, and their standard errors."""
    found = {held.effect.id: held for held in curve_terms(curve)}
    own = [found.pop(held.effect.id, Term(held.effect, (0.0,) * len(held.values))) for held in nominal.terms]
    model = nominal.with_terms([*own, *found.values()])
    wide = as_normal(curve.freedom) * (choice.widening if curve is choice.best else 1.0)
    errors = np.sqrt(np.maximum(np.diag(curve.covariance), 0.0)) * wide
    known = {name: float(error) for name, error in zip(curve.candidate.names, errors, strict=True)}
    return replace(model, standard_errors=known, provenance={"method": "diagnosis, from the mean forces at constant speeds"})


def _part(nominal: Model, refit: Model) -> NominalPart:
    given = {p.name: p.value for p in nominal.parameters()}
    found = {p.name: p.value for p in refit.parameters() if p.name in given}
    off = {name: 100.0 * (given[name] - value) / value for name, value in found.items() if value != 0.0}
    return NominalPart(given, found, off)


def _rejected(choice: Choice, base: Candidate, best: Curve, gone: Sequence[tuple[str, str]]) -> tuple[Rejected, ...]:
    there = {"coulomb", "bias", *_terms(best.candidate, Candidate())}
    why = dict(gone)
    for effect in _FLAGS:
        if effect in there or effect in why:
            continue
        weight = f"candidates with it carry {100.0 * _sure(choice, effect):.2g} % of the weight"
        chance = f"; as much of it comes by chance in {100.0 * choice.p_value:.2g} % of recordings"
        why[effect] = weight + (chance if effect == "stribeck" and math.isfinite(choice.p_value) else "")
    for each in EFFECTS.values():
        if each.id not in there and each.id not in why:
            why[each.id] = "constant speeds don't show it"
    return tuple(Rejected(effect, reason) for effect, reason in why.items())


def _unknown(why: str, where: Where, scored: Validation, rest: float) -> Finding:
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
