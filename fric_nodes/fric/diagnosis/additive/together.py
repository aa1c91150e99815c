"""A model grown by all laws at once that its components ask for, and pruned.

Each law is weighed beside flexible functions of all other components (:mod:`.forms`), so that it has only its own part to
explain, however many others are missing. Fitted alone it may explain little: what the others lack lies over it. So the most
probable law of every component comes at the same time, everything is fitted together, and then each has to earn its place: the
one that is missed least goes, everything else is fitted anew, and so on (backward elimination). A law is missed by what unseen
blocks lack without it, where all together leave hardly anything. Where they leave more, it is the evidence for it beside
flexible functions of the other components: of a law that is small beside what none explains, nothing can be seen otherwise.
What is then left is taken apart again, until nothing comes that stays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from ...model import Model
from ...threads import mapped
from ..costs import EVIDENCE
from ..deadline import is_over
from ..fitting import NOTHING, State, added, left_beside, refit, unseen, without_place
from ..growth import LITTLE
from ..least_squares import FROM_NEAR
from ..settle import CLEARLY
from ..track import Track
from .asked import Asked
from .forms import Form, forms_of
from .residual import additive

__all__ = ["grown_together", "middle_of"]

Weighed = Callable[[State], Callable[[int], tuple[float, Model]]]
"""For a fitted model and the place of a term: the nats that speak for the term, and the model without it."""

_BANDWIDTH = 140.0  # physical [rad/s]: about 22 Hz, where most axes' friction shows and their structures don't yet ring
_WORTH = 5.0  # statistical, nats: odds of about 150 to one, for a law to be fitted in full
_LESSER = 0.05  # statistical, of the evidence for the strongest law: how well first order tells what others there are
_PLAUSIBLE = 0.3  # probability among the laws of its component
_ROUNDS = 6  # numerical: in each at least one term comes
_ROUNDS_BESIDE = 3  # numerical: what comes later mends what the first has taken for something else


def middle_of(tracks: Sequence[Track]) -> Track:
    """The one of ``tracks`` whose bandwidth is nearest to 140 rad/s."""
    return min(tracks, key=lambda each: abs(math.log(each.bandwidth / _BANDWIDTH)))


def grown_together(
    track: Track, begin: State, tell: Callable[[str], None], beside_unknown: bool = False, state: State | None = None
) -> State:
    """The model of ``begin`` with the laws that its components ask for, fitted.

    Args:
        track: the recordings.
        begin: the fitted model that lacks something.
        tell: told what comes and goes.
        beside_unknown: what is left is known to be explained by no law.
        state: the same with laws that have come before and have to earn their place, too; None: without.
    """
    state = state or begin
    for _ in range(_ROUNDS_BESIDE if beside_unknown else _ROUNDS):
        if is_over() or state.excess < NOTHING * state.floor:
            break
        taken = additive(track, state)
        independent = taken.dependence * taken.n_rows
        offered = list(_offered(state, forms_of(state, taken)))
        if not offered:
            break
        whole = _fitted(track, state, offered, tell)
        partial = beside_unknown or whole.excess > max(LITTLE * begin.excess, CLEARLY * whole.floor)
        weighed = _beside_functions(track) if partial else _by_unseen_blocks(track, independent)
        worth = 0.0 if partial else EVIDENCE
        grown = _pruned(track, whole, begin, weighed, tell)
        if _nats(state.left, grown.left, independent) < worth and added(grown.fit.model, state.fit.model):
            # A term that came before has gone for others that don't make up for it: it stays, and they have to help beside it.
            grown = _pruned(track, whole, state, weighed, tell)
        if _nats(state.left, grown.left, independent) < worth or _same(state, grown):
            break
        tell(f"leaves {100.0 * grown.excess / max(begin.excess, 1e-300):.0f} % of what was missing")
        state = grown
    return state


def _fitted(track: Track, state: State, offered: Sequence[Form], tell: Callable[[str], None]) -> State:
    """``state`` with the laws ``offered``, fitted together, or with as many of the strongest of them as leave least.

    Each was weighed by itself: of laws that do the same work all together may overshoot so far that no fit comes back, and one
    that minds the effort little takes from a stronger one what could lead its fit. So the strongest is fitted first, and the
    others come to what it has come to, twice as many each time; beside that, all are fitted at once.
    """
    tell("trying together: " + ", ".join(f"{each.term.effect.title} ({each.nats:.0f} nats)" for each in offered))
    everything = state.fit.model.with_terms((*state.fit.model.terms, *(each.term for each in offered)))
    fitted = [refit(track, everything, max_iterations=20)]
    model, there = state.fit.model, 0
    while len(offered) > 1 and there < len(offered):
        coming = offered[there : max(2 * there, 1)]
        fitted.append(refit(track, model.with_terms((*model.terms, *(each.term for each in coming))), FROM_NEAR))
        model, there = fitted[-1].fit.model, there + len(coming)
    return min(fitted, key=lambda each: each.left)


def _offered(state: State, forms: list[Form]) -> Iterator[Form]:
    """The law with the most evidence of every component, as far as they can be in one model.

    What the strongest is short of at first order shows as something small in other components: it has to come first.
    """
    worth = max(_WORTH, _LESSER * max((form.nats for form in forms), default=0.0))
    taken: set[str] = set()
    held = [term.effect for term in state.fit.model.terms]
    for form in forms:
        effect = form.term.effect
        slips = effect.slip is not None and any(each.slip is not None for each in held)
        moved = (effect.play is not None or effect.link is not None) and any(
            each.play is not None or each.link is not None for each in held
        )
        there = any(each.id == effect.id for each in held) and not effect.repeatable
        if (
            form.nats > worth
            and form.probability >= _PLAUSIBLE
            and form.component not in taken
            and not (slips or moved or there)
        ):
            taken.add(form.component)
            held.append(effect)
            yield form


def _same(one: State, other: State) -> bool:
    return [held.effect.key for held in one.fit.model.terms] == [held.effect.key for held in other.fit.model.terms]


def _pruned(track: Track, state: State, begin: State, weighed: Weighed, tell: Callable[[str], None]) -> State:
    """``state`` without the terms for which ``weighed`` finds too little, the least needed at first order first."""
    going = True
    while going:
        going = False
        weigh = weighed(state)
        places = added(begin.fit.model, state.fit.model)
        left = dict(zip(places, mapped(partial(_left_without, track, state), places), strict=True))
        for place in sorted(left, key=lambda k: left[k]):
            nats, without = weigh(place)
            if nats < EVIDENCE:
                tell(f"not needed: {state.fit.model.terms[place].effect.title} ({nats:.1f} nats)")
                state, going = refit(track, without, FROM_NEAR), True
                break
    return state


def _by_unseen_blocks(track: Track, independent: float) -> Weighed:
    """Weighs a term by what unseen blocks lack without it, of ``independent`` values."""

    def of(state: State) -> Callable[[int], tuple[float, Model]]:
        def weigh(place: int) -> tuple[float, Model]:
            without = refit(track, without_place(state.fit.model, place), FROM_NEAR)
            left = left_beside(track, without, state.fit.model.has_slip_dynamics)
            return _nats(left, state.left, independent), without.fit.model

        return weigh

    return of


def _beside_functions(track: Track) -> Weighed:
    """Weighs a term by the evidence for it beside flexible functions of the other components."""

    def of(state: State) -> Callable[[int], tuple[float, Model]]:
        asked = Asked(track, state)
        return lambda place: (asked.nats(place), asked.without(place).model)

    return of


def _left_without(track: Track, state: State, place: int) -> float:
    """What the model leaves on unseen blocks without its term number ``place``, everything else fitted anew at first order."""
    residual = track.residual(without_place(state.fit.model, place))
    return unseen(track, state.fit, residual, f"{state.fit.model.prefixes[place]}.")


def _nats(before: float, after: float, independent: float) -> float:
    """Logarithm of the likelihood ratio on unseen blocks, of what two models leave there [F^2], each with its own variance."""
    if not np.isfinite(after) or after <= 0.0:
        return -math.inf
    return 0.5 * independent * math.log(max(before, 1e-300) / after)
