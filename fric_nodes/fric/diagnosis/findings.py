"""What the report says of each effect: findings, effects that were rejected, reservations, the next experiment."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..effect import Effect, Place
from ..effects import EFFECTS
from ..model import Model, Term
from .candidates import FRICTION, Scales, candidates, place_of
from .component import Signature, agreed, signatures
from .confidence import MANY, confidence_of, unknown_confidence
from .differences import Contradiction
from .fitting import refit
from .growth import Growth
from .held_back import OnlyThere
from .judging import HARDLY, difference_of
from .locate import Where, locate
from .motor_side import MOTOR_FRICTION
from .presence import Presence
from .result import (
    Diagnosis,
    Estimate,
    Finding,
    Rejected,
    RunnerUp,
    Validation,
    percent,
)
from .rival import Rival
from .screen import Tried
from .settle import CLEARLY, Step
from .start import FIRST_FIT
from .track import Track

__all__ = [
    "contradicted",
    "finding_of",
    "next_experiment",
    "rejected_effects",
    "reservations",
    "signature_of",
    "unknown_finding",
    "unlearnt_finding",
    "with_presences",
]

_SHARED = 1.0 / 3.0  # of what is missing: where effects are missed by less altogether, each can stand in for the others
_IN_PART = 0.6  # of what several explain: where they are missed by less, they stand in for each other in part, and
_AS_MUCH = 0.9  # of what they explain is as much
_FEW = 16  # coefficients, by which a signature is simpler than so many effects
_MOSTLY = 0.5  # of what a grown model leaves, for a signature to say what that is
_UNDECIDED = 0.45  # confidence at most, where no parameter of an effect is as large as its own standard error


def with_presences(present: Mapping[str, Presence], findings: Sequence[Finding]) -> list[Finding]:
    """``findings``, each as sure as what speaks for its term makes it (:mod:`.presence`)."""
    held = []
    for each in findings:
        found = present[each.term]
        sure = min(found.probability, _UNDECIDED) if _undecided(each.parameters) else found.probability
        runner = each.runner_up
        if runner is not None:
            runner = replace(runner, confidence=round(min(1.0 - sure, sure), 4))
        held.append(replace(each, confidence=sure, runner_up=runner, reproduced=found.halves, weighed=found.evidence))
    return held


def _undecided(parameters: Mapping[str, Estimate]) -> bool:
    """True where no parameter of an effect is as large as its own standard error."""
    return bool(parameters) and all(each.std is not None and abs(each.value) < each.std for each in parameters.values())


def reservations(growth: Growth, nominal: Model, far_off: bool, bent: Sequence[Term]) -> list[str]:
    """Why the effects named are no full explanation, where the share that is left doesn't say it."""
    notes = []
    if growth.beyond > 0.0:
        notes.append(
            f"the effects named explain what is missing up to about {growth.track.bandwidth:.3g} rad/s; of what a faster "
            f"observer sees {100.0 * growth.beyond:.3g} % stays unexplained"
        )
    if far_off:
        fitted = growth.end.fit.model.total_inertia
        notes.append(
            f"with the effects named the mass comes out at {fitted:.3g}, given was {nominal.total_inertia:.3g}: they are no "
            "explanation, unless the given one is off by more than two"
        )
    notes += [
        f"{held.effect.title} fits best at the very end of what its law can be: it stands in for something else"
        for held in bent
    ]
    return notes


def finding_of(
    fast: Track,
    held: Track,
    growth: Growth,
    end: Model,
    step: Step,
    scored: Validation,
    scales: Scales,
    rest: float,
) -> Finding:
    """What the report says of one effect that is missing in the nominal model.

    Args:
        fast: the recordings held back, followed fast enough to say when it acts.
        held: these, followed as they are judged.
        growth: of the model.
        end: the grown model.
        step: by which the effect came.
        scored: on the recordings held back.
        scales: of the machine.
        rest: share of what is missing that stays unexplained.
    """
    place = list(end.prefixes).index(step.term)
    effect = end.terms[place].effect
    without = end.with_terms(term for k, term in enumerate(end.terms) if k != place)
    shown = growth.begin.fit.model if len(growth.steps) == 1 else without
    where = locate(fast, difference_of(fast, shown, end), scales, end)
    excess = max(step.missing, 1e-300)
    share = min(max((step.before - step.after) / max(excess, growth.begin.excess), 0.0), 1.0)
    rival = next((each for each in step.rivals if effect.id not in {name.split("#")[0] for name in each.names}), None)
    sure = confidence_of(rest, step, share)
    parameters = {
        p.name: Estimate(p.value, end.standard_errors.get(p.name), p.declaration.unit(end.units))
        for p in end.parameters()
        if p.name.startswith(f"{step.term}.")
    }
    if _undecided(parameters):
        sure = min(sure, _UNDECIDED)
    runner = RunnerUp(rival.effect.id, round(min(1.0 - sure, sure), 4)) if rival is not None else None
    return Finding(
        effect=effect.id,
        law=effect.law,
        title=effect.title,
        confidence=sure,
        runner_up=runner,
        where=where,
        component=place_of(effect),
        share=share,
        evidence=_evidence(effect, step, rival, excess, len(growth.steps) == 1),
        parameters=parameters | _of_motor(effect, end),
        noe_before=scored.noe_refit,
        noe_after=scored.noe_augmented,
        term=step.term,
    )


def _of_motor(effect: Effect, end: Model) -> dict[str, Estimate]:
    """Friction of the motor itself, which a transmission shows, where there is any."""
    if effect.place is not Place.TRANSMISSION:
        return {}
    return {
        p.name: Estimate(p.value, end.standard_errors.get(p.name), p.declaration.unit(end.units))
        for p in end.parameters()
        if p.name in MOTOR_FRICTION and p.value != 0.0
    }


def _evidence(effect: Effect, step: Step, rival: Rival | None, excess: float, alone: bool) -> str:
    """How much an effect explains, ``alone`` or beside others, and its best rival, in a sentence."""
    beside = (
        f"; the runner-up, {rival.effect.title}, explains {_percent(step.before - rival.left, excess)}"
        if rival is not None
        else ""
    )
    missing = "the missing force's energy" if alone else "the energy of the force that is missing beside the other effects"
    return (
        f"{effect.title} explains {_percent(step.before - step.after, excess)} of {missing}, on blocks of the recordings left "
        f"out of the fit{beside}"
    )


def _percent(part: float, whole: float) -> str:
    return f"{percent(min(max(part / whole, 0.0), 1.0), 3)} %"


def unknown_finding(
    where: Where, likely: Signature, growth: Growth, scored: Validation, rest: float, stand_in: bool
) -> Finding:
    """The finding that something is missing which no effect explains.

    Args:
        where: it shows.
        likely: signature that resembles it most.
        growth: of the model.
        scored: on the recordings held back.
        rest: share of what is missing that no effect explains.
        stand_in: whether several effects only imitate that signature.
    """
    best = min(growth.last, key=lambda each: each.left, default=None)
    beside = f"; the best of them, {best.column.term.effect.title}, doesn't explain it" if best is not None else ""
    evidence = (
        f"every combination of known effects leaves at least {100 * rest:.3g} % of the missing force's energy{beside}; "
        f"{likely.title} resembles it most: with {likely.n_coefficients} free values it would explain "
        f"{100 * likely.share:.3g} %"
    )
    if stand_in:
        evidence = (
            f"{likely.title} alone, with {likely.n_coefficients} free values, would explain {100 * likely.share:.3g} % of the "
            f"missing force's energy; known effects imitate it only where several of them correct each other, and leave "
            f"{100 * rest:.3g} %"
        )
    return _by_none("something that no known effect explains", where, likely, best, rest, evidence, scored)


def contradicted(found: Diagnosis, contradiction: Contradiction) -> Diagnosis:
    """``found``, where the recordings learnt from contradict each other: that is no effect, and leaves none of them sure."""
    first = contradiction.differs[0]
    first_sentence = contradiction.sentence.removesuffix(".")
    explains = f"values of their own in each recording explain {percent(contradiction.share)} % of the missing force's energy"
    rest = [each for each in found.findings if each.effect != "unknown"]
    where = next((each.where for each in found.findings), found.where) or Where((), 0.0, "everywhere", "", (0.0, 0.0), 1.0)
    unknown = Finding(
        effect="unknown",
        law="",
        title="recordings that contradict each other",
        confidence=unknown_confidence(contradiction.share, found.validation.stands_out),
        runner_up=None,
        where=where,
        component=first.component,
        share=contradiction.share,
        evidence=f"{first_sentence}; {explains}, all effects that grew {percent(max(contradiction.by_effects, 0.0))} %",
        parameters={},
        noe_before=found.validation.noe_refit,
        noe_after=found.validation.noe_augmented,
    )
    number, source = first.recording
    again = f"make recording {number} ({source}) again under the conditions of the others, or diagnose it by itself"
    if not first.others_agree:
        again = "make the recordings again under the same conditions, or diagnose each by itself"
    return replace(
        found,
        mismatch=True,
        findings=(unknown, *(replace(each, confidence=min(each.confidence, _UNDECIDED)) for each in rest)),
        next_experiment=(
            f"{again}, with the model of its own load, lubricant and sensor; or record what differs (a load, pressure or "
            "temperature) as a signal, so that its effect can be found"
        ),
        notes=(*found.notes, f"{contradiction.sentence} One model can't hold for all of them; its values are averages."),
        contradiction=contradiction,
    )


def unlearnt_finding(where: Where, alone: OnlyThere, scored: Validation) -> Finding:
    """What only the recordings held back show."""
    evidence = (
        f"the model explains the training recordings down to their noise; on the one held back its NOE is "
        f"{scored.noe_refit:.3g} %, still {alone.noe:.3g} % after a fit to that one, and noise alone would be "
        f"{scored.noise_floor:.3g} %; "
        f"{alone.likely.title} resembles it most, and would explain {100 * alone.likely.share:.3g} % of it"
    )
    title = "something that only the recording held back shows"
    return _by_none(title, where, alone.likely, alone.best, 1.0, evidence, scored)


def _by_none(
    title: str, where: Where, likely: Signature, best: Tried | None, share: float, evidence: str, scored: Validation
) -> Finding:
    """The finding that no effect explains a ``share`` of what is missing, ``best`` being the one that comes closest."""
    sure = unknown_confidence(share, scored.stands_out)
    return Finding(
        effect="unknown",
        law="",
        title=title,
        confidence=sure,
        runner_up=None if best is None else RunnerUp(best.column.term.effect.id, round(1.0 - sure, 4)),
        where=where,
        component=likely.component,
        share=share,
        evidence=evidence,
        parameters={},
        noe_before=scored.noe_refit,
        noe_after=scored.noe_augmented,
    )


def signature_of(tracks: Sequence[Track], growth: Growth, rest: float, shares: Sequence[float]) -> tuple[Signature, bool]:
    """The signature of what is missing, and True where it is to be believed rather than what was grown.

    It is to be believed where it explains more, and where it is simple and the effects do each other's work, which take
    ``shares`` away beside each other: where of three or more none would be missed much and it explains most by itself, and
    where two take far less than they explain together and it explains nearly as much.

    The signature is that of all that is missing, by the observers to which it stands out; or that of what is left, where the
    grown model explains more and the signature most of what that leaves.
    """
    # Shares are held against those of the grown model, which are as its own observer sees them: that one is asked first.
    ordered = sorted(tracks, key=lambda each: (each.bandwidth != growth.track.bandwidth, each.bandwidth))
    looks = [(track, refit(track, growth.begin.fit.model, max_iterations=FIRST_FIT)) for track in ordered]
    clear = [(track, state) for track, state in looks if state.excess > CLEARLY * state.floor]
    clear = clear or looks[:1]
    whole = agreed([signatures(track, state.fit, () if growth.steps else growth.last) for track, state in clear])
    # What hardly explains anything has no say in what is left either.
    # Whatever is missing in friction goes with the force that it balances: that says nothing.
    least = 1.0
    if len(shares) > 1 and sum(shares) < _IN_PART * (1.0 - rest):
        least = _AS_MUCH * (1.0 - rest)
    if len(shares) >= MANY and sum(shares) < _SHARED:
        least = _MOSTLY
    simple = whole.component != FRICTION and whole.share > least and whole.n_coefficients <= _FEW
    if not growth.steps or whole.share > 1.0 - rest or rest > HARDLY or simple:
        return whole, True
    track = clear[0][0]
    left = signatures(track, refit(track, growth.end.fit.model, max_iterations=FIRST_FIT).fit, growth.last)[0]
    return (left if left.share > _MOSTLY else whole), False


def rejected_effects(growth: Growth, begin: Model, scales: Scales, learnt: bool) -> tuple[Rejected, ...]:
    """Every effect that isn't in the grown model, and why; without ``learnt`` the recordings learnt from lack nothing."""
    there = {held.effect.id for held in growth.end.fit.model.terms}
    found: dict[str, str] = dict(growth.rejected)
    excess = max(growth.begin.excess, 1e-300)
    first: Sequence[Tried] = growth.steps[0].screened if growth.steps else growth.last
    for each in first:
        name = each.column.term.effect.id
        if name not in there and name not in found and learnt:
            found[name] = f"takes {_percent(each.gain, excess)} away at first order where it was not fitted"
    most: dict[str, float] = {}  # what each has taken off at best
    for step in growth.steps:
        for rival in step.rivals:
            name, took = rival.effect.id, step.before - rival.left
            if name not in there and name not in dict(growth.rejected) and took > most.get(name, -math.inf):
                most[name] = took
                found[name] = f"fitted in full it takes {_percent(took, excess)} away, {step.term} more"
    offered = {candidate.effect.id for candidate in candidates(begin, scales)}
    tried = {each.column.term.effect.id for each in first}
    for effect in EFFECTS.values():
        if effect.id in there or effect.id in found:
            continue
        if not learnt and effect.id in tried:
            found[effect.id] = "nothing is missing that it could explain"
            continue
        found[effect.id] = (
            "nothing in these recordings would show it"
            if effect.id in offered
            else "this plant, or the model's other terms, leave no room for it"
        )
    return tuple(Rejected(name, why) for name, why in found.items())


def next_experiment(findings: Sequence[Finding], only_held_back: bool) -> str:
    """The experiment that tells most, in words."""
    if only_held_back:
        return "learn from the recording held back, too, and hold another one back that goes where it went"
    for finding in findings:
        effect: Effect | None = next((each for each in EFFECTS.values() if each.id == finding.effect), None)
        if effect is not None and finding.runner_up is not None and finding.runner_up.effect in effect.looks_like:
            return f"to tell {effect.id} from {finding.runner_up.effect}: {effect.looks_like[finding.runner_up.effect]}"
        if finding.effect == "unknown":
            return (
                f"repeat the motion and vary one thing at a time where the mismatch sits ({finding.where.regime}): speed, "
                "place, load, the rest before it"
            )
    if not findings:
        return "none needed: what is left is what the instruments leave"
    return "none needed to tell the cause from its rivals; a recording with other speeds and places would narrow its values"
