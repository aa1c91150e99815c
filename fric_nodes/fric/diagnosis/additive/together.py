"""A model grown by all laws at once that its components ask for, and pruned.

Each law is weighed beside flexible functions of all other components (:mod:`.forms`), so that it has only its own part to
explain, however many others are missing. Fitted alone it may explain little: what the others lack lies over it. So the most
probable law of every component comes at the same time, everything is fitted together, and then each has to earn its place: the
one that is missed least on unseen blocks goes, everything else is fitted anew, and so on (backward elimination). What is then
left is taken apart again, until nothing comes that stays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ...model import Model
from ..fitting import NOTHING, State, refit, without_term
from ..track import Track
from .forms import Form, forms_of
from .residual import additive

__all__ = ["BANDWIDTH", "grown_together", "middle_of", "without_place"]

BANDWIDTH = 140.0
"""Of the observer [rad/s]: about 22 Hz, where most axes' friction shows and their structures don't yet ring."""

_WORTH = 5.0  # statistical, nats: odds of about 150 to one, for a law to be fitted in full
_GAIN = 10.0  # statistical, nats on unseen blocks, for it to stay: beyond what four parameters take off by chance
_PLAUSIBLE = 0.3  # probability among the laws of its component
_ROUNDS = 4  # numerical: in each at least one term comes


def middle_of(tracks: Sequence[Track]) -> Track:
    """The one of ``tracks`` whose bandwidth is nearest to :data:`BANDWIDTH`."""
    return min(tracks, key=lambda each: abs(math.log(each.bandwidth / BANDWIDTH)))


def grown_together(track: Track, begin: State, tell: Callable[[str], None]) -> State:
    """The model of ``begin`` with the laws that its components ask for, fitted.

    Args:
        track: the recordings.
        begin: the fitted model that lacks something.
        tell: told what comes and goes.
    """
    state = begin
    for _ in range(_ROUNDS):
        if state.excess < NOTHING * state.floor:
            break
        taken = additive(track, state)
        independent = taken.dependence * taken.n_rows
        offered = list(_offered(state, forms_of(state, taken)))
        if not offered:
            break
        tell("trying together: " + ", ".join(f"{each.term.effect.title} ({each.nats:.0f} nats)" for each in offered))
        terms = (*state.fit.model.terms, *(each.term for each in offered))
        grown = _pruned(track, refit(track, state.fit.model.with_terms(terms), 20), begin, independent, tell)
        if _nats(state, grown, independent) < _GAIN:
            break
        tell(f"leaves {100.0 * grown.excess / max(begin.excess, 1e-300):.0f} % of what was missing")
        state = grown
    return state


def _offered(state: State, forms: list[Form]) -> Iterator[Form]:
    """The law with the most evidence of every component, as far as they can be in one model."""
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
            form.nats > _WORTH
            and form.probability >= _PLAUSIBLE
            and form.component not in taken
            and not (slips or moved or there)
        ):
            taken.add(form.component)
            held.append(effect)
            yield form


def _pruned(track: Track, state: State, begin: State, independent: float, tell: Callable[[str], None]) -> State:
    """``state`` without the terms that unseen blocks don't ask for."""
    keys = {held.effect.key for held in begin.fit.model.terms}
    while True:
        terms = state.fit.model.terms
        places = [k for k, held in enumerate(terms) if held.effect.key not in keys]
        if not places:
            return state
        without = {k: refit(track, without_place(state.fit.model, k)) for k in places}
        cost = {k: _nats(each, state, independent) for k, each in without.items()}
        least = min(places, key=lambda k: cost[k])
        if cost[least] >= _GAIN:
            return state
        tell(f"not needed: {terms[least].effect.title} ({cost[least]:.1f} nats)")
        state = without[least]


def without_place(model: Model, place: int) -> Model:
    """``model`` less its term number ``place``; of several of one effect the others stay."""
    effect = model.terms[place].effect.id
    if sum(held.effect.id == effect for held in model.terms) == 1:
        return without_term(model, effect)
    return model.with_terms(held for k, held in enumerate(model.terms) if k != place)


def _nats(before: State, after: State, independent: float) -> float:
    """Logarithm of the likelihood ratio on unseen blocks, of residuals whose variance each model has of its own."""
    if not np.isfinite(after.left) or after.left <= 0.0:
        return -math.inf
    return 0.5 * independent * math.log(max(before.left, 1e-300) / after.left)
