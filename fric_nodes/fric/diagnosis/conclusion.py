"""From a grown model to the verdict, judged on the recordings held back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..instrument import Finding as Check
from ..model import Model, Term
from ..record import Array, Record
from .candidates import Scales, scales_of
from .component import Signature
from .confidence import AS_LIKELY, LITTLE_LEFT, MANY, is_doubtful
from .findings import (
    finding_of,
    next_experiment,
    rejected_effects,
    reservations,
    signature_of,
    unknown_finding,
    unlearnt_finding,
    with_presences,
)
from .fitting import NOTHING
from .going_with_motion import only_noise
from .growth import Growth, without_nothings
from .held_back import OnlyThere, only_there
from .indifference import dearer
from .judging import (
    FLOOR_UNSURE,
    HARDLY,
    as_fast,
    difference_of,
    energy_left,
    floor_of,
    growth_told,
    interval_of,
    locating,
    mean_square,
    most_left,
    nominal_part,
    paired,
    predictions_of,
    shown,
    unless_worse,
    with_errors,
    withdrawn,
)
from .least_squares import Fit
from .limits import limits_of
from .locate import locate
from .other_laws import strained
from .presence import presences
from .price import FAR_OFF, mass_off
from .result import (
    Diagnosis,
    Finding,
    Unexplained,
    Validation,
)
from .settle import FLOOR_KNOWN
from .start import spread_of
from .track import Track

__all__ = ["concluded"]

_CONFIRMED = 0.15  # of the floor: less than this above it on recordings held back doesn't confirm one
_NEGLIGIBLE = 1e-4  # NOE [%]: a force within a thousandth is what steps of any simulation and sampling differ by

_TOO_LITTLE = (
    f"the refitted model gives the force to within a thousandth of it (an NOE below {_NEGLIGIBLE:g} %): physics that changes "
    "less is not looked for"
)
_NOISE = (
    "the refitted model leaves a little more than noise from sample to sample explains, and it doesn't go with the motion: "
    "taken for noise of the force at low frequencies"
)


@dataclass(frozen=True, eq=False)
class _Judged:
    """What the recordings held back say of a grown model.

    Attributes:
        growth: without what they speak against.
        held: these recordings, followed.
        track: those learnt from, followed as fast.
        begin, end: the nominal model and the grown one, fitted to those learnt from.
        left: missing force on those held back that each model leaves, by name [F].
        floor: what twins leave on them [F].
        scored: NOE of each model.
        told: whether more is missing than steps of any simulation differ by.
        learnt: whether something is missing in the recordings learnt from.
        missing: whether something is missing in either.
        seen_rest: share of it that stays in those held back.
        noise: whether something would be missing, if it weren't noise of the force at low frequencies.
    """

    growth: Growth
    held: Track
    track: Track
    begin: Fit
    end: Model
    left: Mapping[str, Array]
    floor: Sequence[Array]
    scored: Validation
    told: bool
    learnt: bool
    missing: bool
    seen_rest: float
    noise: bool = False

    @property
    def notes(self) -> list[str]:
        """On what is left, where that is no mismatch."""
        return [*([] if self.told else [_TOO_LITTLE]), *([_NOISE] if self.noise else [])]

    @property
    def rest(self) -> float:
        """Share of what is missing that stays, here or there, whichever is more."""
        return min(max(self.growth.rest, self.seen_rest), 1.0) if self.missing else 0.0


@dataclass(frozen=True, eq=False)
class _Doubts:
    """Why effects are no full explanation.

    Attributes:
        unknown: True where they are none.
        far_off: the mass comes out far from the given one.
        bent: terms whose law has run to the end of its form.
        likely: what the rest resembles, where that was asked.
        stand_in: whether one signature explains more than the effects do together.
    """

    unknown: bool
    far_off: bool
    bent: Sequence[Term]
    likely: Signature | None
    stand_in: bool


def concluded(
    train: Sequence[Record],
    validation: Sequence[Record],
    nominal: Model,
    checks: Sequence[Check],
    corrected: Sequence[str],
    whole: Sequence[Track],
    searched: Sequence[Track],
    growth: Growth,
) -> Diagnosis:
    """The verdict on a model that has been grown.

    Args:
        train: recordings learnt from.
        validation: recordings held back.
        nominal: the model as it was given.
        checks: of the instrument.
        corrected: notes on what was done to the recordings.
        whole: the recordings learnt from, followed at several bandwidths.
        searched: those parts of them that the model was grown on.
        growth: of the model.
    """
    seen = _judged(validation, whole, nominal, growth)
    fast = locating(validation, seen.held, seen.growth)
    seen, findings, doubts = _explained(seen, fast, searched)
    held, scales = seen.held, scales_of(seen.held)
    alone = None if seen.learnt or not seen.told else only_there(train, validation, held, seen.begin.model)
    unknown, unexplained, remains = _rest(seen, doubts, alone, findings, scales)
    seen, findings = _likely(seen, _surely(seen, unexplained, unknown, findings))
    growth = seen.growth
    everything = None if alone is None else unexplained.where
    if seen.missing:
        energy = difference_of(fast, seen.begin.model, seen.end)
        if remains is not None:
            energy = [explained + left_over for explained, left_over in zip(energy, remains, strict=True)]
        everything = locate(fast, energy, scales, seen.end)
    notes = reservations(growth, nominal, doubts.far_off and bool(growth.steps), doubts.bent)
    return Diagnosis(
        mismatch=seen.missing or alone is not None,
        where=everything,
        checks=tuple(checks),
        nominal=nominal_part(nominal, seen.begin),
        findings=tuple(findings),
        rejected=rejected_effects(growth, seen.begin.model, scales_of(seen.track), seen.learnt),
        validation=seen.scored,
        unexplained=unexplained,
        next_experiment=next_experiment(findings, alone is not None),
        model=seen.end,
        refit=seen.begin.model,
        given=nominal,
        prediction=tuple(predictions_of(validation, held, seen.left)),
        notes=(*corrected, *notes, *seen.notes),
        bandwidth=held.bandwidth,
        grown=growth_told(growth),
        only_held_back=alone is not None,
        limits=limits_of(growth.track, growth.end, growth.last, seen.end.units, anything=bool(growth.steps)),
        fitted_on=tuple(record.source for record in train),
        tested_on=tuple(record.source for record in validation),
    )


def _explained(seen: _Judged, fast: Track, searched: Sequence[Track]) -> tuple[_Judged, list[Finding], _Doubts]:
    """What is missing by effect, and whether they are a full explanation; nothing is missing where noise passes for it.

    Args:
        seen: of the recordings held back.
        fast: these, as an observer follows them that tells where something is missing.
        searched: recordings that the model was grown on.
    """
    growth, scales = seen.growth, scales_of(seen.held)
    findings = [finding_of(fast, seen.held, growth, seen.end, step, seen.scored, scales, seen.rest) for step in growth.steps]
    # What explains most comes first, as far as it is sure to: what mends the form of another's law may be as sure.
    findings.sort(key=lambda each: -each.confidence * each.share)
    doubts = _doubts(seen, searched, findings)
    if doubts.unknown and only_noise(seen.track, seen.begin.model):
        seen = replace(_nothing(seen, "what it explains doesn't go with the motion"), noise=True)
        return seen, [], _doubts(seen, searched, [])
    return seen, findings, doubts


def _rest(
    seen: _Judged, doubts: _Doubts, alone: OnlyThere | None, findings: Sequence[Finding], scales: Scales
) -> tuple[Finding | None, Unexplained, list[Array] | None]:
    """The finding of something unknown, if there is any, what stays unexplained, and the energy of that over time [F^2]."""
    share = max(seen.rest, seen.growth.beyond)
    unexplained = Unexplained(share, None, interval_of(share, seen.left, seen.floor) if seen.missing else None)
    if alone is not None:
        remains = energy_left(seen.held, seen.left["refit"], seen.floor)
        where = locate(seen.held, remains, scales, seen.begin.model)
        return unlearnt_finding(where, alone, seen.scored), Unexplained(1.0, where), remains
    if not seen.missing or not (doubts.unknown or seen.growth.end.excess > NOTHING * seen.growth.end.floor):
        return None, unexplained, None
    remains = energy_left(seen.held, seen.left["augmented"], seen.floor)
    where = locate(seen.held, remains, scales, seen.end)
    unexplained = replace(unexplained, where=where)
    if doubts.likely is None or not doubts.unknown or where is None:
        return None, unexplained, remains
    return (
        unknown_finding(where, doubts.likely, seen.growth, seen.scored, unexplained.share, doubts.stand_in),
        unexplained,
        remains,
    )


def _surely(seen: _Judged, unexplained: Unexplained, unknown: Finding | None, findings: list[Finding]) -> list[Finding]:
    """``findings`` with how sure each is there, whatever stays unexplained; behind what is ``unknown``, if anything is."""
    shares = {each.term: each.share for each in findings}
    steps = seen.growth.steps
    # What stays is known no better than the floor below it: where hardly more than that is missing, anything may explain it.
    floor = seen.scored.noise_floor
    unsure = FLOOR_KNOWN * floor / max(seen.scored.noe_refit - floor, 1e-300)
    stays = min(max(unexplained.share, unsure), 1.0)
    present = presences(seen.track, seen.end, steps, shares, stays, unknown is None)
    told = with_presences(present, findings)
    # Beside something unknown, what takes most off comes first.
    return told if unknown is None else [unknown, *sorted(told, key=lambda each: -each.share)]


def _judged(validation: Sequence[Record], whole: Sequence[Track], nominal: Model, growth: Growth) -> _Judged:
    """``growth`` held against the recordings ``validation``."""
    growth = unless_worse(validation, whole, growth)
    held = shown(validation, growth.track, growth.begin.fit.model, growth.slower)
    track, begin, end_fit = as_fast(whole, held, growth)
    growth, end = without_nothings(growth, with_errors(track, end_fit))
    left = {"nominal": held.residual(nominal), "refit": held.residual(begin.model), "augmented": held.residual(end)}
    spread = spread_of(held)
    floor = floor_of(held, begin.model, end, left["refit"])
    noe = {name: 100.0 * float(each @ each) / spread for name, each in left.items()}
    noise_floor = 100.0 * mean_square(floor) / spread
    scored = Validation(noe["nominal"], noe["refit"], noe["augmented"], noise_floor)
    told = noe["refit"] > _NEGLIGIBLE
    learnt = growth.stands_out or bool(growth.steps)
    # What the recordings held back don't show has been chance, or has been over before they were made.
    missing = (
        told
        and learnt
        and (noe["refit"] > (1.0 + _CONFIRMED) * noise_floor or (not held.unsure and paired(growth, noe, noise_floor)))
    )
    if not missing or noe["augmented"] > noe["refit"]:
        gone = (*growth.rejected, *withdrawn(growth, missing))
        growth = replace(growth, end=growth.begin, steps=(), rejected=gone, beyond=0.0)
        end, left["augmented"] = begin.model, left["refit"]
        scored = replace(scored, noe_augmented=noe["refit"])
    # Floors of few twins are known to a tenth or two of themselves, no better.
    sure = noise_floor * FLOOR_KNOWN + 200.0 * float(np.std([each @ each for each in floor])) / spread
    minded = dearer(held, end) * scored.noe_augmented
    seen_rest = max(minded - noise_floor - sure, 0.0) / max(scored.noe_refit - noise_floor, 1e-300)
    seen_rest *= held.unpaid(begin.model) if end.has_slip_dynamics else 1.0
    return _Judged(growth, held, track, begin, end, left, floor, scored, told, learnt, missing, seen_rest)


def _likely(seen: _Judged, findings: list[Finding]) -> tuple[_Judged, list[Finding]]:
    """The verdict and its findings; nothing is missing where that is hardly more than noise and no effect is likely there."""
    if seen.growth.stands_out or not findings or any(f.effect == "unknown" or f.confidence >= AS_LIKELY for f in findings):
        return seen, findings
    return _nothing(seen, "is less likely there than not, and hardly more than noise is missing"), []


def _nothing(seen: _Judged, why: str) -> _Judged:
    """The verdict ``seen`` with nothing missing and no effect; ``why`` those that came are none."""
    growth, noe = seen.growth, seen.scored.noe_refit
    gone = tuple((step.term.split("#")[0], why) for step in growth.steps)
    growth = replace(growth, end=growth.begin, steps=(), rejected=(*growth.rejected, *gone), beyond=0.0)
    left = {**seen.left, "augmented": seen.left["refit"]}
    scored = replace(seen.scored, noe_augmented=noe)
    return replace(seen, growth=growth, end=seen.begin.model, left=left, scored=scored, missing=False)


def _doubts(seen: _Judged, searched: Sequence[Track], findings: Sequence[Finding]) -> _Doubts:
    """Whether the effects ``findings`` are a full explanation."""
    growth, end, rest = seen.growth, seen.end, seen.rest
    likely, stand_in = None, False
    # What needs a mass twice or half as large as the given one is no explanation.
    far_off = mass_off(seen.track.masses, end) > FAR_OFF
    # What is more likely wrong than right is no explanation either.
    doubtful = is_doubtful([each.confidence for each in findings], rest)
    plain = growth.unhelped or growth
    beside = growth.beyond > 0.0 or plain is not growth
    # A law that has run to the end of its form stands in for another.
    bent = [term for term in (end.terms[list(end.prefixes).index(step.term)] for step in growth.steps) if strained(term)]
    # How well both shares are known depends on how far what is missing stands out, there and here.
    floor = seen.scored.noise_floor
    there = min(LITTLE_LEFT + FLOOR_UNSURE * floor / max(seen.scored.noe_refit - floor, 1e-300), HARDLY)
    much = rest > most_left(growth) or seen.seen_rest > there
    reserved = much or doubtful or far_off or beside or bool(bent)
    if seen.missing and (reserved or rest > LITTLE_LEFT or len(growth.steps) >= MANY):
        likely, of_all = signature_of(searched, plain, max(rest, plain.rest), [each.share for each in findings])
        # Where one signature explains more than several effects do together, these have only stood in for it: a force that
        # swings at one frequency goes with the motion it makes there as a delay, a mode and bristles might.
        stand_in = of_all and len(findings) > 1
    return _Doubts(seen.missing and (reserved or stand_in), far_off, bent, likely, stand_in)
