"""From recordings and a nominal model to a verdict: what is missing, where, how sure, and what unseen data say.

In this order: faults of the instrument; parameters before structure; is anything missing at all, beside what a twin leaves;
which effects, grown and pruned on blocks that no fit has seen; and then, once and for the record, the validation recordings,
which no fit has touched. They bring nothing in, but they can take away: what they speak against is withdrawn, and what they
show to be left makes a finding unsure or ``unknown``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..identification.equations import nominal_conditions
from ..instrument import inspect
from ..model import Model
from ..record import Record
from ..signals.stamps import evened
from ..threads import linear_algebra_in_one
from .additive.told import by_component
from .at_once import by_parts, helped, surpassing, together
from .blocks import one_sided
from .by_means import concluded_by_means
from .conclusion import concluded
from .contradiction import contradiction_of, without_stand_ins
from .deadline import is_over, within
from .excerpt import confirmed, excerpt
from .findings import contradicted
from .fitting import NOTHING, best_track
from .grow import first_terms, grow, leaves_much, with_moves
from .growth import Growth
from .intake import of_use, refuse, without_faults
from .judging import most_left
from .ladder import ladder_of
from .price import FAR_OFF, strange
from .reproduced import reproduced
from .result import Diagnosis
from .settle import audit
from .start import (
    DiagnosisError,
    held_as,
    lateness,
    refuse_other_plant,
    spread_of,
    started,
    tracks_of,
)
from .track import Track

__all__ = ["DiagnosisError", "diagnose", "refit_noe"]

_ANY_JOINT = "axis"  # of a model that says nothing of it
_LOOKED_AT = 2000  # samples
_PASSES = 0.05  # of the force's energy: what lets less pass to the body doesn't move it by this force
_LIGHTEST = 0.02  # of the given mass: what fits less of it isn't the force that moves the body


@linear_algebra_in_one()
def diagnose(
    train: Sequence[Record],
    validation: Sequence[Record],
    nominal: Model,
    progress: Callable[[str], None] | None = None,
    at_most: float | None = None,
) -> Diagnosis:
    """What ``nominal`` leaves out of what the recordings show.

    Args:
        train: recordings to learn from.
        validation: recordings that nothing is learnt from.
        nominal: model whose physics is in question; its values are a start.
        progress: told what goes on.
        at_most: time after which no further effects are looked for [s]; None: the search ends by itself.

    Raises:
        DiagnosisError: nothing can be compared.
        InputError: ``at_most`` is no time.
    """
    with within(at_most):
        return _diagnosed(train, validation, nominal, progress or (lambda _: None))


def _diagnosed(train: Sequence[Record], validation: Sequence[Record], nominal: Model, tell: Callable[[str], None]) -> Diagnosis:
    """As :func:`diagnose`."""
    refuse(train, validation)
    (train, left_out), (validation, left_out_too) = of_use(train), of_use(validation)
    tell("checking the instrument")
    checks = inspect(train, nominal)
    train, validation, corrected = without_faults(train, validation, nominal, checks)
    corrected = [*left_out, *left_out_too, *corrected]
    corrected += _for_the_same(train, validation, nominal)
    nominal = replace(nominal, joint=train[0].joint)
    ladder = ladder_of(train, validation, nominal)
    if ladder is not None:
        tell("every recording is at one speed: comparing the means of the runs")
        return concluded_by_means(ladder, validation, nominal, checks, corrected)
    conditions = nominal_conditions(train) | dict(nominal.nominal)
    train, validation = ([replace(record, nominal=conditions) for record in held] for held in (train, validation))
    tell("refitting the nominal model")
    train, validation = ([evened(record) for record in held] for held in (train, validation))
    jitter = [f"{record.source}: {note}" for record in (*train, *validation) for note in record.notes if "jitter" in note]
    corrected += dict.fromkeys(jitter)  # parts of one recording may say the same
    tracks, start = started(nominal, train)
    refuse_other_plant(train, tracks[0], start)
    corrected += held_as(tracks[0])
    massless = start.total_inertia < _LIGHTEST * nominal.total_inertia
    if massless:  # at first: beside much that is left out inertia may drown
        tracks, start = started(nominal, train, as_given=True)
    parts = excerpt(tracks, start)
    searched = list(tracks if parts is None else parts.tracks)
    growth = reproduced(_grown_by_all(searched, start, tell), tell)
    if growth.stands_out and (growth.beyond > 0.0 or growth.rest > most_left(growth)):
        growth = helped(searched, growth, tell)
        if growth.unhelped is not None and growth.rest <= most_left(growth):
            # With what was to help beside something unknown, nothing unknown is left.
            growth = with_moves(replace(growth, unhelped=None), tell)
    if is_over():
        corrected.append("the search was ended after the time that was asked for: further effects may be missing")
    if parts is not None:
        tell("fitting what was found to all samples")
        sufficed = growth.end.excess < NOTHING * growth.end.floor and growth.unhelped is None
        growth, note = confirmed(parts, growth)
        corrected.append(note)
        if sufficed and growth.end.excess >= NOTHING * growth.end.floor:
            # All samples show what the excerpt holds too little of.
            rest = audit(growth.track, growth.begin.fit.model, growth.end.fit.model)
            growth = with_moves(replace(growth, rest=rest), tell)
    contradiction = contradiction_of(growth, train)
    tell("judging on the validation recordings")
    if contradiction is not None:
        growth = without_stand_ins(growth, contradiction)
    found = concluded(train, validation, nominal, checks, corrected, tracks, searched, growth)
    if contradiction is not None:
        found = contradicted(found, contradiction)
    elif not is_over() and any(each.effect == "unknown" for each in found.findings):
        tell("weighing what is left by the components of the machine")
        found = replace(found, components=by_component(searched, found.model))
    return _with_inertia(found, nominal, train) if massless else found


def _for_the_same(train: Sequence[Record], validation: Sequence[Record], nominal: Model) -> Iterator[str]:
    """Notes on a model of another joint, and on recordings held back that move elsewhere than those learnt from."""
    if nominal.joint not in (_ANY_JOINT, train[0].joint):
        yield f"the model is of the joint '{nominal.joint}', the recordings of '{train[0].joint}': taken for the same"
    apart = one_sided(train, validation)
    if apart:
        yield f"{apart}: what the one shows there the other can't judge"


def _grown_by_all(tracks: Sequence[Track], start: Model, tell: Callable[[str], None]) -> Growth:
    """The model ``start`` with what is missing added to it.

    All effects are tried together first. Where these are no full explanation, effects are added one after the other, and the
    model that leaves less to the fastest observer is taken.
    """
    begun = first_terms(tracks, start, tell)
    proposed = together(tracks, start, tell) if begun[0].stands_out and leaves_much(begun[1]) else None
    complete = by_parts(tracks, proposed, tell) if proposed is not None else None
    if complete is not None:
        return with_moves(complete, tell)
    better = surpassing(tracks, proposed, begun[1]) if proposed is not None else None
    if better is not None:
        return with_moves(better, tell)
    growth = with_moves(grow(tracks, start, tell, begun), tell)
    if growth.stands_out and (growth.beyond > 0.0 or growth.rest > most_left(growth)):
        other = by_parts(tracks, proposed or together(tracks, start, tell), tell, growth)
        return growth if other is None or other is growth else with_moves(other, tell)
    return growth


def refit_noe(model: Model, train: Sequence[Record], validation: Sequence[Record], bandwidth: float) -> float:
    """NOE of ``model``, fitted to ``train``, on ``validation`` [%], as an observer of ``bandwidth`` [rad/s] sees it."""
    conditions = nominal_conditions(train) | dict(model.nominal)
    train, validation, _ = without_faults(train, validation, model, inspect(train, model))
    train, validation = ([evened(replace(record, nominal=conditions)) for record in held] for held in (train, validation))
    track, state = best_track(tracks_of(train, model, lateness(train, model)), model)
    held = replace(Track.of(validation, bandwidth, model, track.late), mass=track.mass)
    left = held.residual(state.fit.model)
    return 100.0 * float(left @ left) / spread_of(held)


def _with_inertia(found: Diagnosis, nominal: Model, train: Sequence[Record]) -> Diagnosis:
    """What was found where hardly any mass fitted the force as it was; with a note, where something unknown hides the inertia.

    Raises:
        DiagnosisError: nothing is missing, or it is fully explained, but of no force that moves the body.
    """
    what = f"the force doesn't hold the inertia of the model's mass {nominal.total_inertia:.3g}"
    do = "where the force is measured at the contact, make its plant 'contact'; else look at unit and sign (fric doctor)"
    if found.findings and found.findings[0].effect == "unknown":
        return replace(found, notes=(*found.notes, f"refitted without what is missing, {what}; {do}"))
    if not found.findings or not _holds_inertia(found, nominal, train):
        raise DiagnosisError(train[0].source, what, do)
    return found


def _holds_inertia(found: Diagnosis, nominal: Model, train: Sequence[Record]) -> bool:
    """Whether the force is the one that moves the body, with all that is found.

    Observers count what a body lacks in the force that moves it: one without mass never lacks anything. And a limit or a dead
    zone that swallows nearly all of the force says the same in other words.
    """
    if strange((nominal.total_inertia,), found.model) > FAR_OFF:
        return False
    effort = np.concatenate([record.effort[record.mask] for record in train])
    passed = effort[:: max(effort.shape[0] // _LOOKED_AT, 1)]
    whole = float(passed @ passed)
    for held in found.model.terms:
        if held.effect.command is not None and held.effect.uncommand is not None:
            command = held.effect.command
            passed = np.array([command(u, 1.0, np.zeros(0), 0, *held.values) for u in passed])
    return float(passed @ passed) > _PASSES * whole
