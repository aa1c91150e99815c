"""From recordings and a nominal model to a verdict: what is missing, where, how sure, and what unseen data say.

In this order: faults of the instrument; parameters before structure; is anything missing at all, beside what a twin leaves;
which effects, grown and pruned on blocks that no fit has seen; and then, once and for the record, the validation recordings,
which no fit has touched. They bring nothing in, but they can take away: what they speak against is withdrawn, and what they
show to be left makes a finding unsure or ``unknown``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..effect import Effect
from ..effects import EFFECTS
from ..identification.equations import nominal_conditions
from ..identification.statistics import sandwich_covariance
from ..instrument import Correction, inspect
from ..instrument import Finding as Check
from ..model import Model, Term
from ..record import Array, Record
from ..signals.resolution import noise_of
from ..signals.stamps import evened
from ..threads import linear_algebra_in_one
from .additive.told import by_component
from .at_once import by_parts, helped, surpassing, together
from .blocks import one_sided
from .by_means import concluded_by_means
from .candidates import FRICTION, Scales, candidates, place_of, scales_of
from .component import Signature, agreed, signatures
from .confidence import LITTLE_LEFT, MANY, UNEXPLAINED, confidence_of, is_doubtful, unknown_confidence
from .excerpt import confirmed, excerpt
from .fitting import best_track, bounds_of, refit
from .grow import first_terms, grow, leaves_much, with_moves
from .growth import Growth, without_nothings
from .held_back import OnlyThere, only_there
from .ladder import ladder_of
from .least_squares import Fit
from .limits import limits_of
from .locate import Where, locate, moved_back, steady
from .other_laws import strained
from .presence import Presence, presences
from .price import FAR_OFF, implausible, mass_off
from .result import (
    Diagnosis,
    Estimate,
    Finding,
    Grown,
    NominalPart,
    Prediction,
    Rejected,
    RunnerUp,
    Unexplained,
    Validation,
    percent,
)
from .screen import Tried
from .settle import FLOOR_KNOWN, Step
from .start import (
    BANDWIDTHS,
    FAST,
    FIRST_FIT,
    DiagnosisError,
    held_as,
    lateness,
    refuse_other_plant,
    spread_of,
    started,
    tracks_of,
)
from .track import Track
from .twin import twins

__all__ = ["DiagnosisError", "diagnose", "refit_noe"]

_MISMATCH = 0.35  # of the floor: less than this above it is no mismatch
_CONFIRMED = 0.15  # of the floor: less than this above it on recordings held back doesn't confirm one
_KEPT = 0.4  # of what a grown model took off where it was fitted, to be found on the recordings held back
_FLOOR_UNSURE = 0.6  # of a floor, by which that may be more: what little is missing is known the worse
_SHARED = 1.0 / 3.0  # of what is missing: where so many are missed by less altogether, each does the work of the others
_IN_PART = 0.6  # of what several explain: where they are missed by less, they do each other's work in part, and
_AS_MUCH = 0.9  # of what they explain is as much
_FEW = 16  # coefficients, by which a signature is simpler than so many effects
_HARDLY = 0.6  # with more than this left, something unknown remains however little is known of the floor
_TWINS = 5
_AS_FAST = 8  # iterations of a fit by a faster observer
_DECIDED = 0.5  # of what the refitted nominal model lacks: with more, twins of the grown one say nothing
_MOSTLY = 0.5  # of what a grown model leaves, for a signature to say what that is
_LEFT_UNSEEN = 0.05  # of what is missing in the recordings held back: what has the right structure leaves less there
_STANDS_OUT = 3.0  # times the floor: with less, noise is more than a quarter of what there is to explain
_LOCATING = 600.0  # [rad/s], for spans of time
_NEGLIGIBLE = 1e-4  # NOE [%]: a force within a thousandth is what steps of any simulation and sampling differ by
_ANY_JOINT = "axis"  # of a model that says nothing of it
_UNDECIDED = 0.45  # confidence at most, where no parameter of an effect is as large as its own standard error
_STILL = 12.0  # times the noise of a position, that hardly any sample of an hour is off by to either side
_FLICKERS = 3  # values
_LOOKED_AT = 2000  # samples
_RESAMPLED = 20  # blocks, each longer than what is left hangs together
_DRAWS = 1000  # of them, with replacement
_PASSES = 0.05  # of the force's energy: what lets less pass to the body doesn't move it by this force
_LIGHTEST = 0.02  # of the given mass: what fits less of it isn't the force that moves the body


_TOO_LITTLE = (
    f"the refitted model gives the force to within a thousandth of it (an NOE below {_NEGLIGIBLE:g} %): physics that changes "
    "less is not looked for"
)


@linear_algebra_in_one()
def diagnose(
    train: Sequence[Record], validation: Sequence[Record], nominal: Model, progress: Callable[[str], None] | None = None
) -> Diagnosis:
    """What ``nominal`` leaves out of what the recordings show.

    Args:
        train: recordings to learn from.
        validation: recordings that nothing is learnt from.
        nominal: model whose physics is in question; its values are a start.
        progress: told what goes on.

    Raises:
        DiagnosisError: nothing can be compared.
    """
    tell = progress or (lambda _: None)
    _refuse(train, validation)
    (train, left_out), (validation, left_out_too) = _of_use(train), _of_use(validation)
    tell("checking the instrument")
    checks = inspect(train, nominal)
    train, validation, corrected = _corrected(train, validation, nominal, checks)
    corrected = [*left_out, *left_out_too, *corrected]
    if nominal.joint not in (_ANY_JOINT, train[0].joint):
        corrected.append(
            f"the model is of the joint '{nominal.joint}', the recordings of '{train[0].joint}': taken for the same"
        )
    nominal = replace(nominal, joint=train[0].joint)
    apart = one_sided(train, validation)
    if apart:
        corrected.append(f"{apart}: what the one shows there the other can't judge")
    ladder = ladder_of(train, validation, nominal)
    if ladder is not None:
        tell("every recording is at one speed: comparing the means of the runs")
        return concluded_by_means(ladder, validation, nominal, checks, corrected)
    conditions = nominal_conditions(train) | dict(nominal.nominal)
    train, validation = ([replace(record, nominal=conditions) for record in held] for held in (train, validation))
    tell("refitting the nominal model")
    train, validation = ([evened(record) for record in held] for held in (train, validation))
    corrected += [f"{record.source}: {note}" for record in (*train, *validation) for note in record.notes if "jitter" in note]
    tracks, start = started(nominal, train)
    refuse_other_plant(train, tracks[0], start)
    corrected += held_as(tracks[0])
    massless = start.total_inertia < _LIGHTEST * nominal.total_inertia
    if massless:  # at first: beside much that is left out inertia may drown
        tracks, start = started(nominal, train, as_given=True)
    parts = excerpt(tracks, start)
    searched = list(tracks if parts is None else parts.tracks)
    growth = _grown_by_all(searched, start, tell)
    if growth.beyond > 0.0 or growth.rest > _most_left(growth):
        growth = helped(searched, growth, tell)
    if parts is not None:
        tell("fitting what was found to all samples")
        growth, note = confirmed(parts, growth)
        corrected.append(note)
    tell("judging on the validation recordings")
    found = _concluded(train, validation, nominal, checks, corrected, tracks, searched, growth)
    if any(each.effect == "unknown" for each in found.findings):
        tell("weighing what is left by the components of the machine")
        found = replace(found, components=by_component(searched, found.model))
    if massless and not _holds_inertia(found, nominal, train):
        raise DiagnosisError(
            train[0].source,
            f"the force doesn't hold the inertia of the model's mass {nominal.total_inertia:.3g}",
            "where the force is measured at the contact, make its plant 'contact'; else look at unit and sign (fric doctor)",
        )
    return found


def _grown_by_all(tracks: Sequence[Track], start: Model, tell: Callable[[str], None]) -> Growth:
    """``start`` grown: by all at once where that explains it, else one after the other, or by the better of both."""
    begun = first_terms(tracks, start, tell)
    proposed = together(tracks, start, tell) if leaves_much(begun[1]) else None
    complete = by_parts(tracks, proposed, tell) if proposed is not None else None
    if complete is not None:
        return with_moves(complete, tell)
    better = surpassing(tracks, proposed, begun[1]) if proposed is not None else None
    if better is not None:
        return better
    growth = with_moves(grow(tracks, start, tell, begun), tell)
    if growth.beyond > 0.0 or growth.rest > _most_left(growth):
        return by_parts(tracks, proposed or together(tracks, start, tell), tell, growth) or growth
    return growth


def refit_noe(model: Model, train: Sequence[Record], validation: Sequence[Record], bandwidth: float) -> float:
    """NOE of ``model``, fitted to ``train``, on ``validation`` [%], as an observer of ``bandwidth`` [rad/s] sees it."""
    conditions = nominal_conditions(train) | dict(model.nominal)
    train, validation = ([replace(record, nominal=conditions) for record in held] for held in (train, validation))
    track, state = best_track(tracks_of(train, model, lateness(train, model)), model)
    held = replace(Track.of(validation, bandwidth, model, track.late), mass=track.mass)
    left = held.residual(state.fit.model)
    return 100.0 * float(left @ left) / spread_of(held)


def _refuse(train: Sequence[Record], validation: Sequence[Record]) -> None:
    if not train or not validation:
        raise DiagnosisError("diagnose", "needs recordings to learn from and one held back", "give TRAIN and --validate")
    for held in validation:
        for other in train:
            same = held.n_samples == other.n_samples and np.array_equal(held.position, other.position)
            if same and np.array_equal(held.effort, other.effort) and np.any(held.mask & other.mask):
                raise DiagnosisError(
                    held.source, "is the recording that is learnt from, too", "hold another recording back for --validate"
                )


def _of_use(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Those of ``records`` in which a force moves the axis, and a note for each that is left out.

    Raises:
        DiagnosisError: there is none.
    """
    held, notes = [], []
    refusal: DiagnosisError | None = None
    for record in records:
        if _rests(record.position):
            problem, remedy = "holds nothing but rest", "record the axis in motion"
        elif float(np.ptp(record.effort)) == 0.0:
            problem, remedy = "has no force signal: it never changes", "record the effort, or give --topic"
        else:
            held.append(record)
            continue
        refusal = refusal or DiagnosisError(record.source, problem, remedy)
        notes.append(f"{record.source} {problem}: left out")
    if not held and refusal is not None:
        raise refusal
    return held, notes


def _rests(position: Array) -> bool:
    """True where a position shows nothing but its noise, or flickers between neighbouring steps of its encoder."""
    return float(np.ptp(position)) <= _STILL * noise_of(position) or np.unique(position).size <= _FLICKERS


def _holds_inertia(found: Diagnosis, nominal: Model, train: Sequence[Record]) -> bool:
    """Whether the force is the one that moves the body, where hardly any mass fitted it as it was: with all that is found.

    Observers count what a body lacks in the force that moves it: one without mass never lacks anything. And a limit or a dead
    zone that swallows nearly all of the force says the same in other words.
    """
    named = bool(found.findings) and found.findings[0].effect != "unknown"
    if not named or implausible((nominal.total_inertia,), found.model) > FAR_OFF:
        return False
    effort = np.concatenate([record.effort[record.mask] for record in train])
    passed = effort[:: max(effort.shape[0] // _LOOKED_AT, 1)]
    whole = float(passed @ passed)
    for held in found.model.terms:
        if held.effect.command is not None and held.effect.uncommand is not None:
            command = held.effect.command
            passed = np.array([command(u, 1.0, np.zeros(0), 0, *held.values) for u in passed])
    return float(passed @ passed) > _PASSES * whole


def _corrected(
    train: Sequence[Record], validation: Sequence[Record], nominal: Model, checks: Sequence[Check]
) -> tuple[list[Record], list[Record], list[str]]:
    """The recordings without the faults of sign, unit and clock that can be taken out of them.

    What all recordings learnt from have is taken out of those held back alike, unless these are seen not to have it; what these
    alone have is taken out of them. A delay is left in: it may belong to the axis, and is a candidate like others.
    """
    held, kept_apart, notes = list(train), list(validation), []
    wrong = [(check, correction) for check in checks if (correction := _correction_of(check)) is not None]
    for check, correction in wrong:
        for k in range(len(held)) if check.recording is None else [check.recording]:
            held[k] = correction.apply(held[k])
        notes.append(f"corrected before anything was fitted: {correction.text} ({check.detail})")
    of_all: dict[str, Correction] = {}
    for check, correction in wrong:
        if check.recording is None or sum(each.check == check.check for each, _ in wrong) == len(held):
            of_all.setdefault(check.check, correction)
    for k, record in enumerate(validation):
        seen = inspect([record], nominal)
        right = {check.check for check in seen if check.verdict == "ok"}
        for name, correction in of_all.items():
            if name in right:
                notes.append(f"{record.source} is right as it is: not corrected by {correction.text}")
            else:
                kept_apart[k] = correction.apply(kept_apart[k])
        for check in seen:
            own = _correction_of(check)
            if own is not None and check.check not in of_all:
                kept_apart[k] = own.apply(kept_apart[k])
                notes.append(f"corrected in {record.source} alone: {own.text} ({check.detail})")
    return held, kept_apart, notes


def _correction_of(check: Check) -> Correction | None:
    """What takes the fault out that ``check`` has found, or None."""
    delayed = check.correction is None or check.correction.effort_shift != 0.0
    return None if delayed or check.verdict != "fault" else check.correction


def _concluded(
    train: Sequence[Record],
    validation: Sequence[Record],
    nominal: Model,
    checks: Sequence[Check],
    corrected: Sequence[str],
    whole: Sequence[Track],
    searched: Sequence[Track],
    growth: Growth,
) -> Diagnosis:
    growth = _unless_worse(validation, whole, growth)
    held = _shown(validation, growth.track, growth.begin.fit.model, growth.beyond > 0.0)
    track, begin_fit, end_fit = _as_fast(whole, held, growth)
    begin, end = begin_fit.model, _with_errors(track, end_fit)
    growth, end = without_nothings(growth, end)
    left = {"nominal": held.residual(nominal), "refit": held.residual(begin), "augmented": held.residual(end)}
    spread = spread_of(held)
    floor = _floor(held, begin, end, left["refit"])
    noe = {name: 100.0 * float(each @ each) / spread for name, each in left.items()}
    noise_floor = 100.0 * _mean_square(floor) / spread
    scored = Validation(noe["nominal"], noe["refit"], noe["augmented"], noise_floor)
    told = noe["refit"] > _NEGLIGIBLE
    learnt = growth.begin.excess > _MISMATCH * growth.begin.floor or bool(growth.steps)
    # What the recordings held back don't show has been chance, or has been over before they were made.
    missing = (
        told
        and learnt
        and (noe["refit"] > (1.0 + _CONFIRMED) * noise_floor or (not held.unsure and _paired(growth, noe, noise_floor)))
    )
    if not missing or noe["augmented"] > noe["refit"]:
        gone = (*growth.rejected, *_withdrawn(growth, missing))
        growth = replace(growth, end=growth.begin, steps=(), rejected=gone, beyond=0.0)
        end, left["augmented"] = begin, left["refit"]
        scored = replace(scored, noe_augmented=noe["refit"])
    scales = scales_of(held)
    # Floors of few twins are known to a tenth or two of themselves, no better.
    sure = noise_floor * FLOOR_KNOWN + 200.0 * float(np.std([each @ each for each in floor])) / spread
    seen_rest = max(scored.noe_augmented - noise_floor - sure, 0.0) / max(scored.noe_refit - noise_floor, 1e-300)
    seen_rest *= held.unpaid(begin) if end.has_slip_dynamics else 1.0
    rest = min(max(growth.rest, seen_rest), 1.0) if missing else 0.0
    fast = _locating(validation, held, growth)
    findings = [_finding(fast, held, growth, end, step, scored, scales, rest) for step in growth.steps]
    # What explains most comes first, as far as it is sure to: what mends the form of another's law may be as sure.
    findings.sort(key=lambda each: -each.confidence * each.share)
    likely, stand_in = None, False
    # What needs a mass twice or half as large as the given one is no explanation.
    far_off = mass_off(track.masses, end) > FAR_OFF
    # What is more likely wrong than right is no explanation either.
    doubtful = is_doubtful([each.confidence for each in findings], rest)
    plain = growth.unhelped or growth
    beside = growth.beyond > 0.0 or plain is not growth
    # A law that has run to the end of its form stands in for another.
    bent = [term for term in (end.terms[list(end.prefixes).index(step.term)] for step in growth.steps) if strained(term)]
    if missing and (rest > LITTLE_LEFT or doubtful or far_off or beside or bent or len(growth.steps) >= MANY):
        likely, of_all = _signature_of(searched, plain, max(rest, plain.rest), [each.share for each in findings])
        # Where one signature explains more than several effects do together, these have only stood in for it: a force that
        # swings at one frequency goes with the motion it makes there as a delay, a mode and bristles might.
        stand_in = of_all and len(findings) > 1
    # How well both shares are known depends on how far what is missing stands out, there and here.
    there = min(_LEFT_UNSEEN + _FLOOR_UNSURE * noise_floor / max(scored.noe_refit - noise_floor, 1e-300), _HARDLY)
    much = rest > _most_left(growth) or seen_rest > there
    unknown = missing and (much or doubtful or stand_in or far_off or beside or bool(bent))
    unexplained = Unexplained(max(rest, growth.beyond), None)
    remains = None
    alone = None if learnt or not told else only_there(train, validation, held, begin)
    if alone is not None:
        remains = _left(held, left["refit"], floor)
        where = locate(held, remains, scales, begin)
        unexplained, findings = Unexplained(1.0, where), [_unlearnt(where, alone, scored)]
    elif missing and (unknown or growth.end.excess > _MISMATCH * growth.end.floor):
        remains = _left(held, left["augmented"], floor)
        where = locate(held, remains, scales, end)
        unexplained = replace(unexplained, where=where)
        if likely is not None and unknown:
            nobody = _unknown(where, likely, growth, scored, unexplained.share, stand_in)
            findings = [
                nobody,
                *_beside(presences(track, end, growth.steps, min(unexplained.share, 1.0)), findings, growth.steps),
            ]
    everything = None if alone is None else unexplained.where
    if missing:
        unexplained = replace(unexplained, interval=_interval(unexplained.share, left, floor))
        energy = _difference(fast, begin, end)
        if remains is not None:
            energy = [explained + left_over for explained, left_over in zip(energy, remains, strict=True)]
        everything = locate(fast, energy, scales, end)
    return Diagnosis(
        mismatch=missing or alone is not None,
        where=everything,
        checks=tuple(checks),
        nominal=_nominal_part(nominal, begin_fit),
        findings=tuple(findings),
        rejected=_rejected(growth, begin, scales_of(track), learnt),
        validation=scored,
        unexplained=unexplained,
        next_experiment=_next(findings, alone is not None),
        model=end,
        refit=begin,
        given=nominal,
        prediction=tuple(_predictions(validation, held, left)),
        notes=(
            *corrected,
            *_reservations(growth, nominal, far_off and bool(growth.steps), bent),
            *([] if told else [_TOO_LITTLE]),
        ),
        bandwidth=held.bandwidth,
        grown=_grown(growth),
        only_held_back=alone is not None,
        limits=limits_of(growth.track, growth.end, growth.last, end.units),
        fitted_on=tuple(record.source for record in train),
        tested_on=tuple(record.source for record in validation),
    )


def _beside(sure: Mapping[str, Presence], findings: Sequence[Finding], steps: Sequence[Step]) -> list[Finding]:
    """What helps beside something unknown, as sure as it is there whatever that is; what takes most off first."""
    by_effect = {step.term.split("#")[0]: sure[step.term] for step in steps}
    held = []
    for each in findings:
        found = by_effect[each.effect]
        runner = each.runner_up
        if runner is not None:
            runner = replace(runner, confidence=round(min(1.0 - found.probability, found.probability), 4))
        held.append(replace(each, confidence=found.probability, runner_up=runner, reproduced=found.halves))
    return sorted(held, key=lambda each: -each.share)


def _most_left(growth: Growth) -> float:
    """Share of what is missing that an explanation leaves at most, as well as both are known."""
    most = UNEXPLAINED if len(growth.steps) < MANY else LITTLE_LEFT
    return min(most + _FLOOR_UNSURE * growth.begin.floor / max(growth.begin.excess, 1e-300), _HARDLY)


def _unless_worse(validation: Sequence[Record], whole: Sequence[Track], growth: Growth) -> Growth:
    """``growth`` without the terms that only help, where the recordings held back speak against them."""
    plain = growth.unhelped
    if plain is None:
        return growth
    held = _shown(validation, growth.track, growth.begin.fit.model, growth.beyond > 0.0)
    left = [held.residual(_as_fast(whole, held, each)[2].model) for each in (growth, plain)]
    return growth if float(left[0] @ left[0]) < float(left[1] @ left[1]) else plain


def _grown(growth: Growth) -> tuple[Grown, ...]:
    """How the model grew, on blocks of the learning recordings left out in turn."""
    excess = max(growth.begin.excess, 1e-300)
    found = [Grown("", 1.0, "")]
    for step in growth.steps:
        own = step.term.split("#")[0]
        rival = next((each for each in step.rivals if each.effect.id != own), None)
        beside = "" if rival is None else f"{rival.effect.id}: {100 * max(rival.left - growth.begin.floor, 0.0) / excess:.3g} %"
        found.append(Grown(step.term, max(step.after - growth.begin.floor, 0.0) / excess, beside))
    return tuple(found)


def _paired(growth: Growth, noe: dict[str, float], noise_floor: float) -> bool:
    """True when the grown model takes off the recordings held back what it took off the others: the noise is the same in both.

    Beside the floor itself so little could not be seen.
    """
    promised = (growth.begin.left - growth.end.left) / max(growth.begin.floor, 1e-300)
    return bool(growth.steps) and noe["refit"] - noe["augmented"] > _KEPT * promised * noise_floor


def _reservations(growth: Growth, nominal: Model, far_off: bool, bent: Sequence[Term]) -> list[str]:
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


def _withdrawn(growth: Growth, missing: bool) -> list[tuple[str, str]]:
    """Terms that the recordings held back speak against, with the reason."""
    why = "makes the recordings held back worse" if missing else "the recordings held back show no mismatch"
    return [(step.term.split("#")[0], why) for step in growth.steps]


def _shown(validation: Sequence[Record], track: Track, begin: Model, as_track: bool) -> Track:
    """The validation recordings, followed as fast as what is missing still stands out from the floor, or ``as_track`` is."""
    step = max(record.sample_time for record in validation)
    tried = (track.bandwidth,) if as_track else (*BANDWIDTHS, track.bandwidth)
    for bandwidth in sorted({min(w, FAST / step) for w in tried}, reverse=True):
        held = replace(Track.of(validation, bandwidth, begin, track.late), mass=track.mass)
        if not held.runs:
            raise DiagnosisError(validation[0].source, "has no valid part of 200 samples", "record for longer")
        left = held.residual(begin)
        floor = [held.residual(begin, twin) for twin in twins(held, begin, 2)]
        if bandwidth <= track.bandwidth or float(left @ left) > 3.0 * _mean_square(floor):
            break
    return held


def _as_fast(whole: Sequence[Track], held: Track, growth: Growth) -> tuple[Track, Fit, Fit]:
    """A track as fast as that of the recordings held back, and the refitted nominal and the grown model fitted to it.

    What a slow observer can't tell from nothing, such as how stops are damped, shows to a fast one.
    """
    fits = growth.begin.fit, growth.end.fit
    track = next((each for each in whole if each.bandwidth == held.bandwidth), None)
    if track is None or held.bandwidth <= growth.track.bandwidth:
        return growth.track, *fits
    bounds = [bounds_of(fit.model, scales_of(track)) for fit in fits]
    begin, end = (track.fit(fit.model, fit.names, _AS_FAST, among) for fit, among in zip(fits, bounds, strict=True))
    return track, begin, end if growth.steps else begin


def _floor(held: Track, begin: Model, end: Model, lacking: Array) -> list[Array]:
    """What twins of the grown model ``end`` leave [F], shape ``(n,)`` each.

    Where blows and sticking are decided by the noise, that is more than twins of the refitted nominal ``begin`` leave, and no
    physics left out. But where it comes near all that this lacks, the model sticks and slips where the axis doesn't, and its
    twins say nothing: then the quieter ones count.
    """
    own = [held.residual(end, twin) for twin in twins(held, end, _TWINS)]
    if end is begin or float(np.median([each @ each for each in own])) < _DECIDED * float(lacking @ lacking):
        return own
    return min(own, [held.residual(begin, twin) for twin in twins(held, begin, _TWINS)], key=_mean_square)


def _interval(share: float, left: Mapping[str, Array], floor: Sequence[Array]) -> tuple[float, float]:
    """95 % of the ``share`` that is left, by resampling blocks of the recordings held back."""
    blocks = [np.array_split(each, _RESAMPLED) for each in (left["augmented"], left["refit"])]
    chance = np.mean([[float(part @ part) for part in np.array_split(each, _RESAMPLED)] for each in floor], axis=0)
    end, begin = (np.array([float(part @ part) for part in parts]) - chance for parts in blocks)
    drawn = np.random.default_rng(0).integers(0, _RESAMPLED, (_DRAWS, _RESAMPLED))
    shares = np.clip(np.sum(end[drawn], axis=1) / np.maximum(np.sum(begin[drawn], axis=1), 1e-300), 0.0, 1.0)
    low, high = (float(each) for each in np.quantile(shares, [0.025, 0.975]))
    return min(low, share), max(high, share)


def _mean_square(residuals: Sequence[Array]) -> float:
    """Mean over ``residuals`` of their sums of squares [F^2]."""
    return float(np.mean([each @ each for each in residuals]))


def _with_errors(track: Track, fit: Fit) -> Model:
    """The fitted model with standard errors, residual correlation taken into account."""
    covariance = sandwich_covariance(fit.jacobian, fit.residual, np.ones(fit.residual.shape[0]), track.starts)
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0)) * fit.scale
    known = {name: float(error) for name, error in zip(fit.names, errors, strict=True) if math.isfinite(error) and error > 0.0}
    return replace(fit.model, standard_errors=known, provenance={"method": "diagnosis, fitted as a whole to what is missing"})


def _nominal_part(nominal: Model, fit: Fit) -> NominalPart:
    given = {p.name: p.value for p in nominal.parameters()}
    found = {p.name: p.value for p in fit.model.parameters()}
    off = {name: 100.0 * (given[name] - value) / value for name, value in found.items() if name in given and value != 0.0}
    return NominalPart(given, found, off)


def _finding(
    fast: Track,
    held: Track,
    growth: Growth,
    end: Model,
    step: Step,
    scored: Validation,
    scales: Scales,
    rest: float,
) -> Finding:
    place = list(end.prefixes).index(step.term)
    effect = end.terms[place].effect
    without = end.with_terms(term for k, term in enumerate(end.terms) if k != place)
    shown = growth.begin.fit.model if len(growth.steps) == 1 else without
    where = locate(fast, _difference(fast, shown, end), scales, end)
    excess = max(step.missing, 1e-300)
    share = min(max((step.before - step.after) / max(excess, growth.begin.excess), 0.0), 1.0)
    rival = next((each for each in step.rivals if effect.id not in {name.split("#")[0] for name in each.names}), None)
    sure = confidence_of(rest, step, share)
    parameters = {
        p.name: Estimate(p.value, end.standard_errors.get(p.name), p.declaration.unit(end.units))
        for p in end.parameters()
        if p.name.startswith(f"{step.term}.")
    }
    if parameters and all(each.std is not None and abs(each.value) < each.std for each in parameters.values()):
        sure = min(sure, _UNDECIDED)
    runner = RunnerUp(rival.effect.id, round(min(1.0 - sure, sure), 4)) if rival is not None else None
    beside = f"; the next best, {rival.effect.title}, {_percent(step.before - rival.left, excess)}" if rival is not None else ""
    evidence = (
        f"{effect.title} takes {_percent(step.before - step.after, excess)} of the missing force's energy away, on blocks of "
        f"the recordings that its fit has not seen{beside}"
    )
    return Finding(
        effect=effect.id,
        law=effect.law,
        title=effect.title,
        confidence=sure,
        runner_up=runner,
        where=where,
        component=place_of(effect),
        share=share,
        evidence=evidence,
        parameters=parameters,
        noe_before=scored.noe_refit,
        noe_after=scored.noe_augmented,
    )


def _percent(part: float, whole: float) -> str:
    return f"{percent(min(max(part / whole, 0.0), 1.0), 3)} %"


def _locating(validation: Sequence[Record], held: Track, growth: Growth) -> Track:
    """The validation recordings, followed as fast as spans of time ask for."""
    return Track.of(validation, min(_LOCATING, FAST / held.runs[0].step[0]), growth.begin.fit.model, held.late)


def _difference(fast: Track, before: Model, after: Model) -> list[Array]:
    """Energy of the force in which two models differ, without the noise of either [F^2], per run, one value per interval."""
    change = fast.padded(fast.residual(before) - fast.residual(after))
    return [moved_back(part, run.sample_time, fast.bandwidth) ** 2 for run, part in zip(fast.runs, change, strict=True)]


def _left(held: Track, residual: Array, floor: Sequence[Array]) -> list[Array]:
    """Energy of the rest above what twins leave at the same speed [F^2], per run, one value per interval."""
    level = _mean_square(floor) / residual.shape[0]
    energy = []
    for run, part in zip(held.runs, held.padded(residual), strict=True):
        h = run.sample_time
        energy.append(np.maximum(steady(moved_back(part, h, held.bandwidth) ** 2, h) - 2.0 * level, 0.0))
    return energy


def _unknown(where: Where, likely: Signature, growth: Growth, scored: Validation, rest: float, stand_in: bool) -> Finding:
    best = min(growth.last, key=lambda each: each.left, default=None)
    beside = f"; the best of them, {best.column.term.effect.title}, doesn't explain it" if best is not None else ""
    evidence = (
        f"{100 * rest:.3g} % of the missing force's energy is left by every combination of known effects{beside}; "
        f"it looks most like {likely.title}, which would take {100 * likely.share:.3g} % of it"
    )
    if stand_in:
        evidence = (
            f"it looks most like {likely.title}, which by itself takes {100 * likely.share:.3g} % of the energy away that "
            f"is missing; known effects leave {100 * rest:.3g} % of it, but only several that do each other's work"
        )
    return _by_none("something that no known effect explains", where, likely, best, rest, evidence, scored)


def _unlearnt(where: Where, alone: OnlyThere, scored: Validation) -> Finding:
    """What only the recordings held back show."""
    evidence = (
        f"the recordings learnt from lack nothing, and the one held back leaves an NOE of {scored.noe_refit:.3g} %, "
        f"{alone.noe:.3g} % when the model is fitted to it, too, where the instruments leave {scored.noise_floor:.3g} %; "
        f"it looks most like {alone.likely.title}, which would take {100 * alone.likely.share:.3g} % of it"
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


def _signature_of(tracks: Sequence[Track], growth: Growth, rest: float, shares: Sequence[float]) -> tuple[Signature, bool]:
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
    clear = [(track, state) for track, state in looks if state.excess > _STANDS_OUT * state.floor]
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
    if not growth.steps or whole.share > 1.0 - rest or rest > _HARDLY or simple:
        return whole, True
    track = clear[0][0]
    left = signatures(track, refit(track, growth.end.fit.model, max_iterations=FIRST_FIT).fit, growth.last)[0]
    return (left if left.share > _MOSTLY else whole), False


def _rejected(growth: Growth, begin: Model, scales: Scales, learnt: bool) -> tuple[Rejected, ...]:
    """Every effect that isn't in the grown model, and why; without ``learnt`` the recordings learnt from lack nothing."""
    there = {held.effect.id for held in growth.end.fit.model.terms}
    found: dict[str, str] = dict(growth.rejected)
    excess = max(growth.begin.excess, 1e-300)
    first: Sequence[Tried] = growth.steps[0].screened if growth.steps else growth.last
    for each in first:
        name = each.column.term.effect.id
        if name not in there and name not in found and learnt:
            found[name] = f"takes {_percent(each.gain, excess)} away at first order where it was not fitted"
    for step in growth.steps:
        for rival in step.rivals:
            if rival.effect.id not in there:
                found[rival.effect.id] = (
                    f"fitted in full it takes {_percent(step.before - rival.left, excess)} away, {step.term} more"
                )
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


def _next(findings: Sequence[Finding], only_held_back: bool) -> str:
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


def _predictions(validation: Sequence[Record], held: Track, left: dict[str, Array]) -> list[Prediction]:
    """Measured and predicted force of each validation recording at its samples."""
    found = []
    for number, record in enumerate(validation):
        columns: dict[str, list[Array]] = {"time": [], "measured": [], "nominal": [], "refit": [], "augmented": []}
        split = {name: held.split(each) for name, each in left.items()}
        for k, run in enumerate(held.runs):
            if held.record[k] != number:
                continue
            n = split["refit"][k].shape[0]
            columns["time"].append(held.time[k][-n:])
            columns["measured"].append(run.effort[-n:])
            for name in left:
                columns[name].append(run.effort[-n:] + split[name][k])
        joined = {name: np.concatenate(parts) if parts else np.zeros(0) for name, parts in columns.items()}
        found.append(
            Prediction(
                record.source, joined["time"], joined["measured"], joined["nominal"], joined["refit"], joined["augmented"]
            )
        )
    return found
