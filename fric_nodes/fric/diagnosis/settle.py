"""A grown model settles: each term earns its place again, against nothing and against its rivals, with all the others there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model import Model, Term
from .candidates import Scales, candidates, scales_of
from .costs import law_of_form
from .deadline import is_over
from .fitting import State, bounds_of, free_names, refit, without_place
from .indifference import dearer
from .other_forms import is_stop
from .price import OF_FLOOR, implausible, price_of
from .rival import Rival, name_of
from .rivals import rivals_of
from .screen import Tried, screen
from .track import Track, Twin
from .twin import twins
from .worth_trying import worth_trying

__all__ = [
    "CLEARLY",
    "FLOOR_KNOWN",
    "HOPELESS",
    "NEARLY_ALL",
    "TO_STAY",
    "Settled",
    "Step",
    "audit",
    "by_simpler_laws",
    "compared",
    "exchanged",
    "is_nothing",
    "merged",
    "renamed",
    "settled",
]

HOPELESS = 0.5
"""Statistical, of what is missing: with more left, no exchange of a term or of its law makes an explanation."""
TO_STAY = 0.004
"""Statistical, of what is missing at the start: less is no gain beside all other terms."""
NEARLY_ALL = 0.9  # of what little is left: what takes that is an effect, and not what laws that differ in form leave,
CLEARLY = 3.0  # if it is more than so many floors
_AUDITED = 0.04  # of what is missing: with more left, it is looked at whether halves of the recordings tell the parameters
FLOOR_KNOWN = 0.1  # of itself, how well a floor is known
_TWINS = 2
_COMPARABLE = 0.5  # of what a term explains, for a rival to take its place, however plausible that is
_A_LITTLE = 0.1
_WORSE = "made what it was not fitted to worse"


@dataclass(frozen=True, eq=False)
class Step:
    """A term that came.

    Attributes:
        term: its name in the grown model.
        before: sum of squares on unseen blocks without it [F^2].
        after: with it [F^2].
        floor: what twins left then [F^2].
        missing: what was missing then, above the floor [F^2].
        rivals: what was fitted in its place, the best first.
        screened: all candidates at first order, the best first.
        price: of its parameters [F^2], as rivals pay it.
    """

    term: str
    before: float
    after: float
    floor: float
    missing: float
    rivals: tuple[Rival, ...]
    screened: tuple[Tried, ...]
    price: float = 0.0


@dataclass(frozen=True, eq=False)
class Settled:
    """The grown model after each of its terms has earned its place again.

    Attributes:
        begin: the refitted nominal model.
        state: the grown one.
        steps: the terms that stayed.
        rest: share of what is missing that the grown model lacks too, where it was not fitted.
        gone: terms that went, with the reason.
    """

    begin: State
    state: State
    steps: tuple[Step, ...]
    rest: float
    gone: tuple[tuple[str, str], ...]


def settled(track: Track, begin: State, state: State, steps: list[Step]) -> Settled:
    """Take away what isn't needed of the terms that ``steps`` brought, and audit the rest.

    What did the work of the others where it was fitted, and makes worse what it was not fitted to, goes in their place.
    """
    begin = refit(track, begin.fit.model, max_iterations=6)
    pruned, kept, gone = _pruned(track, begin, state, steps)
    rest = audit(track, begin.fit.model, pruned.fit.model) if kept else 1.0
    back = [step for step, _ in gone]
    if rest > 1.0 and back:
        culprits = {step.term.split("#")[0] for step in kept}
        honest = [held for held in state.fit.model.terms if held.effect.id not in culprits]
        done = settled(track, begin, refit(track, state.fit.model.with_terms(honest)), back)
        worse = [(step.term.split("#")[0], _WORSE) for step in kept]
        return replace(done, gone=(*worse, *done.gone))
    return _unless_worse(Settled(begin, pruned, tuple(kept), rest, _by_effect(gone)))


def exchanged(track: Track, done: Settled) -> Settled:
    """Each term against its rivals with all the others there, where several explain most together."""
    if is_over() or len(done.steps) < 2 or done.rest > HOPELESS:
        return done
    state, steps = _exchanged(track, done.begin, done.state, list(done.steps), scales_of(track))
    state, steps, gone = _pruned(track, done.begin, state, steps)
    rest = audit(track, done.begin.fit.model, state.fit.model)
    return _unless_worse(Settled(done.begin, state, tuple(steps), rest, (*done.gone, *_by_effect(gone))))


def compared(track: Track, begin: State, state: State, steps: Sequence[Step]) -> tuple[Step, ...]:
    """``steps`` to ``state``, where there are none yet with what their rivals come to in the place of each; all steps stay."""
    if is_over():
        return tuple(steps)
    return tuple(_exchanged(track, begin, state, list(steps), scales_of(track), stay=True)[1])


def _unless_worse(done: Settled) -> Settled:
    """``done``, or nothing grown where that made worse what it was not fitted to."""
    if done.rest <= 1.0:
        return done
    gone = [(step.term, _WORSE) for step in done.steps]
    return Settled(done.begin, done.begin, (), 1.0, (*done.gone, *gone))


def merged(track: Track, begin: State, state: State, steps: list[Step]) -> tuple[State, list[Step]]:
    """A play and a spring beside each other as the one effect that is both, where that explains as much."""
    transmission = [held for held in state.fit.model.terms if held.effect.play is not None or held.effect.link is not None]
    both = [each for each in worth_trying() if is_stop(each)]
    if len(transmission) != 2 or all(held.effect.play is None for held in transmission):
        return state, steps
    given: dict[str, float] = {}
    for held in transmission:
        for name, value in held.by_name.items():
            given[name] = given.get(name, 0.0) + value  # two plays in a row are one
    effect = next((each for each in both if {p.name for p in each.parameters} == set(given)), None)
    if effect is None:
        return state, steps
    others = [held for held in state.fit.model.terms if held not in transmission]
    one = refit(track, state.fit.model.with_terms([*others, Term(effect, tuple(effect.values(given)))]))
    if one.left - state.left > max(OF_FLOOR * state.floor, TO_STAY * begin.excess):
        return state, steps
    gone = {held.effect.id for held in transmission}
    old = [step for step in steps if step.term.split("#")[0] in gone]
    if not old:
        return state, steps
    step = replace(old[0], term=name_of(one.fit.model, effect), after=_after_both(old[0], old[-1]))
    return one, [*(each for each in steps if each not in old), step]


def by_simpler_laws(track: Track, begin: State, state: State, steps: list[Step]) -> tuple[State, list[Step]]:
    """``state`` with the laws that its terms are forms of, where these leave as much; and ``steps``, whose names stay.

    A form came while something else was missing; beside that, what it has beyond its law may be nothing.
    """
    for step in steps:
        model = state.fit.model
        if step.term not in model.prefixes:
            continue
        place = model.prefixes.index(step.term)
        held, law = model.terms[place], law_of_form(model.terms[place].effect)
        if law is None:
            continue
        simpler = Term(law, tuple(law.values(held.by_name)))
        one = refit(track, model.with_terms(simpler if k == place else each for k, each in enumerate(model.terms)))
        if one.left - state.left <= max(OF_FLOOR * state.floor, TO_STAY * begin.excess):
            state = one
    return state, steps


def _after_both(first: Step, last: Step) -> float:
    """What two steps that are one leave to the observer of the first [F^2]: another one may have seen the last."""
    if last is first:
        return first.after
    stays = max(last.after - last.floor, 0.0) / max(last.before - last.floor, 1e-300)
    return first.floor + max(first.after - first.floor, 0.0) * min(stays, 1.0)


def audit(track: Track, begin: Model, end: Model) -> float:
    """Share of what ``begin`` lacks that ``end`` lacks too, both fitted to one half of the recordings and judged on the other.

    Half of the recordings may tell a parameter badly, such as the period of a ripple; what that costs is no physics left out,
    and is found on twins, which are treated alike. What ``end`` leaves counts the more, the less it minds the effort
    (:mod:`.indifference`). Above 1 the grown model is the worse one.
    """
    made = twins(track, end, _TWINS)
    floor = float(np.mean([float(np.sum(track.residual(end, twin) ** 2)) for twin in made]))
    lacking, left = _on_other_half(track, begin), _on_other_half(track, end)
    unpaid = track.unpaid(begin) if end.has_slip_dynamics else 1.0
    missing = max(lacking - floor, 1e-300)
    if left - floor > _AUDITED * missing:
        of_twins = float(np.mean([_on_other_half(track, end, twin) for twin in made]))
        left -= max(of_twins - floor, 0.0)
    return unpaid * max(dearer(track, end) * left - (1.0 + FLOOR_KNOWN) * floor, 0.0) / missing


def _on_other_half(track: Track, model: Model, twin: Twin | None = None) -> float:
    """Sum of squares that ``model`` lacks in each half of the recordings, or of their twin, when fitted to the other [F^2].

    What one half tells a hundredth as well as the other, such as friction at a place to which it hardly goes, the other half
    says: ``_A_LITTLE`` of its residual counts. It is no fault of the physics.

    The halves interleave: first and third quarter against second and fourth. The model follows the recordings from begin to
    end both times: where a play or a contact stands at the start of a quarter, only what came before can tell.
    """
    n = track.residual(model).shape[0]
    first = (np.arange(n) * 4 // n) % 2 == 0
    bounds = bounds_of(model, scales_of(track))
    lacking = 0.0
    for rows in (first, ~first):
        weights = np.where(rows, 1.0, _A_LITTLE)
        fitted = track.fit(model, free_names(model), 6, bounds, weights, twin).model
        lacking += float(np.sum(track.residual(fitted, twin)[~rows] ** 2))
    return lacking


def _price(track: Track, model: Model, name: str, excess: float) -> float:
    """What the term ``name`` of ``model`` costs, as rivals pay it [F^2]."""
    effect = model.terms[list(model.prefixes).index(name)].effect
    return price_of(effect, excess) + excess * implausible(track, model)


def _takes_its_place(track: Track, begin: State, without: State, state: State, own: float, rival: Rival) -> bool:
    """Whether ``rival`` explains more than the term that it would replace, which scores ``own``; see :class:`Rival`.

    However plausible it is, it must explain something like as much; and an axis of another mass speaks against it by all that
    is missing, not only by what this term has of it.
    """
    if without.left - rival.left < _COMPARABLE * (without.left - state.left):
        return False
    stranger = implausible(track, rival.fit.model) - implausible(track, state.fit.model)
    more = max(stranger, 0.0) * max(begin.excess - without.excess, 0.0)
    # Twins that stick and slip each in its own way leave more than a recording does: no floor is higher than what is left.
    floor = min(state.floor, state.left, rival.left)
    return own - rival.score - more > max(OF_FLOOR * floor, TO_STAY * without.excess)


def _exchanged(
    track: Track, begin: State, state: State, steps: list[Step], scales: Scales, stay: bool = False
) -> tuple[State, list[Step]]:
    """Each term against its rivals with all the others there: what came first was chosen while the others were missing.

    If the terms are to ``stay``, those that have no rivals yet are compared with theirs.
    """
    for k in range(len(steps)):
        step, model = steps[k], state.fit.model
        if step.term not in model.prefixes or (stay and step.rivals):
            continue
        place = model.prefixes.index(step.term)
        effect_id = model.terms[place].effect.id
        without = refit(track, without_place(model, place), max_iterations=8)
        found = screen(track, without.fit, candidates(without.fit.model, scales), without.chance, in_pairs=False)
        fitted = rivals_of(track, without, found, scales, state.left)
        rivals = [rival for rival in fitted if rival.effect.id != effect_id]
        own = state.left + _price(track, state.fit.model, step.term, without.excess)
        term = step.term
        if rivals and not stay and _takes_its_place(track, begin, without, state, own, rivals[0]):
            other = refit(track, rivals[0].fit.model, max_iterations=6)
            # What leaves something is not the simpler explanation beside one that leaves nothing.
            if state.excess > OF_FLOOR * state.floor or other.left - state.left < OF_FLOOR * state.floor:
                state, term = other, rivals[0].names[0]
                # What gives way is now a rival itself, and often the nearest.
                rivals = [rival for rival in fitted if rival.effect.id != rivals[0].effect.id]
                steps[:] = [each if each is step else renamed(each, model, place) for each in steps]
        price = _price(track, state.fit.model, term, without.excess)
        beside = without.left, state.left, without.floor, without.excess
        steps[k] = Step(term, *beside, tuple(rivals), found.tried, price)
    return state, steps


def renamed(step: Step, model: Model, place: int) -> Step:
    """``step`` by the name that its term has where the term number ``place`` of ``model`` is gone."""
    others = (name for k, name in enumerate(model.prefixes) if k != place)
    now = dict(zip(others, without_place(model, place).prefixes, strict=True))
    return replace(step, term=now.get(step.term, step.term))


def is_nothing(held: Term) -> bool:
    """True for a term whose amplitudes are those of its absence."""
    neutral = held.effect.neutral
    names = [p.name for p in held.effect.parameters]
    return neutral is not None and all(
        held.values[k] == neutral[k] for k, name in enumerate(names) if name in held.effect.amplitudes
    )


def _by_effect(gone: Sequence[tuple[Step, str]]) -> tuple[tuple[str, str], ...]:
    """The effects of steps that went, with the reason."""
    return tuple((step.term.split("#")[0], why) for step, why in gone)


def _pruned(track: Track, begin: State, state: State, steps: list[Step]) -> tuple[State, list[Step], list[tuple[Step, str]]]:
    """Terms taken away again, everything else fitted anew, while hardly anything is lost: first the one that is missed least.

    The steps that went come last, with the reason.

    Of two that do the same work either could go, but not both.
    """
    gone: list[tuple[Step, str]] = []
    while len(steps) > 1:
        left_out: list[tuple[float, State, Step, str]] = []
        model = state.fit.model
        for step in steps:
            if step.term not in model.prefixes:
                continue
            place = model.prefixes.index(step.term)
            without = refit(track, without_place(model, place), max_iterations=8)
            nothing = is_nothing(model.terms[place])
            # What leaves an axis of another mass behind has only changed what stands in for what.
            stranger = implausible(track, without.fit.model) - implausible(track, state.fit.model)
            lost = without.left - state.left + begin.excess * max(stranger, 0.0)
            alone = lost > NEARLY_ALL * without.excess and without.excess > CLEARLY * without.floor
            little = OF_FLOOR * state.floor if alone else max(OF_FLOOR * state.floor, TO_STAY * begin.excess)
            if nothing or lost < little:
                why = "comes out at nothing" if nothing else "not needed any more"
                left_out.append((-math.inf if nothing else lost, without, step, f"{why} beside the other terms"))
        if not left_out:
            break
        _, state, least, why = min(left_out, key=lambda each: each[0])
        place = model.prefixes.index(least.term)
        steps = [renamed(each, model, place) for each in steps if each is not least]
        gone.append((least, why))
    return state, steps, gone
