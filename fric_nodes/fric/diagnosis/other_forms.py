"""The same rival in other forms: another shape or law of its effect, one that goes further, a spring or stops for a gap.

Effects are compared by the form that suits the recording best. Held against each other by the wrong form, a rival could lose to
another effect that only mends that form.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ..effect import Effect
from ..model import Term
from .candidates import Scales
from .exchange import exchanged_at
from .fitting import State, bounds_of, free_names
from .least_squares import FROM_NEAR
from .other_laws import laws_beside, laws_further, told
from .price import OF_FLOOR, price_of
from .rival import Rival, rival_of
from .screen import Screening
from .track import Track

__all__ = ["extended", "is_stop", "shaped", "that_give", "with_play"]

_GIVES = (0.03, 0.3, 3.0)  # of the gap, that stops give under the typical force
_FURTHER = 12  # iterations of a fit by a law that goes further


def shaped(track: Track, state: State, rival: Rival, found: Screening, scales: Scales) -> Rival:
    """``rival`` with the shapes and laws of its terms that leave least, where they take off more than they cost.

    What a wrong shape leaves would be taken for another effect.
    """
    best = rival
    for each in rival.offer:
        begun = best.fit.model
        own = [k for k, held in enumerate(begun.terms) if held.effect is each.column.term.effect]
        if not own or rival.left < (1.0 + OF_FLOOR) * state.floor:
            continue
        held = begun.terms[own[-1]]
        for term in laws_beside(held, scales):
            if term.effect.slip is not None and term.effect is not held.effect:
                continue  # is tried when the effect has come
            model, place = exchanged_at(begun, own[-1], term)
            fit = track.fit(model, free_names(model), 8, bounds_of(model, scales))
            other = rival_of(track, state, rival.offer, fit, found)
            dearer = rival.dear + price_of(term.effect, state.excess) - price_of(held.effect, state.excess) - best.dear
            if best.left - other.left > max(OF_FLOOR * state.floor, dearer) and told(fit.model.terms[place], scales):
                fair = other.left * rival.fair / max(rival.left, 1e-300)
                best = replace(other, fair=fair, dear=best.dear + dearer)
    return best


def extended(track: Track, state: State, rival: Rival, found: Screening, scales: Scales) -> Rival:
    """``rival``, or the same by a more general law of its effect, where that leaves much less.

    A spring that hardens resembles a gap with soft stops more than a linear spring. Compared by the linear law alone, the
    spring would be taken for the gap.
    """
    best = rival
    for place, held in enumerate(rival.fit.model.terms):
        if held.effect not in [each.column.term.effect for each in rival.offer]:
            continue
        for term in laws_further(held, scales):
            model = rival.fit.model.with_terms(term if k == place else each for k, each in enumerate(rival.fit.model.terms))
            fit = track.fit(model, free_names(model), _FURTHER, bounds_of(model, scales))
            other = rival_of(track, state, rival.offer, fit, found)
            dearer = price_of(term.effect, state.excess) - price_of(held.effect, state.excess)
            if best.left - other.left > max(OF_FLOOR * state.floor, dearer):
                best = replace(other, dear=other.dear + dearer)
    return best


def with_play(track: Track, state: State, rivals: list[Rival], found: Screening, scales: Scales) -> list[Rival]:
    """``rivals`` without stops whose play comes out at nothing, where a spring explains as much."""
    kept = []
    for rival in rivals:
        if not _closed(rival, scales):
            kept.append(rival)
            continue
        springs = [each for each in rivals if all(_is_spring(one.column.term.effect) for one in each.offer)]
        springs = springs or _as_springs(track, state, rival, found, scales)
        kept += [each for each in springs if each not in rivals]
        if min((each.left for each in springs), default=math.inf) - rival.left > OF_FLOOR * state.floor:
            kept.append(rival)
    return kept


def _as_springs(track: Track, state: State, rival: Rival, found: Screening, scales: Scales) -> list[Rival]:
    """``rival`` with a spring in place of its stops without play; empty where no spring was screened."""
    tried = next((each for each in (*found.tried, *found.laws) if _is_spring(each.column.term.effect)), None)
    stops = [each for each in rival.fit.model.terms if is_stop(each.effect)]
    if tried is None or len(stops) != 1:
        return []
    # What was offered beside the stops stays beside the spring.
    offer = tuple(tried if is_stop(each.column.term.effect) else each for each in rival.offer)
    effect = tried.column.term.effect
    given = stops[0].by_name
    if not {p.name for p in effect.parameters} <= set(given):
        return []
    spring = Term(effect, tuple(given[p.name] for p in effect.parameters))
    model = rival.fit.model.with_terms(spring if each is stops[0] else each for each in rival.fit.model.terms)
    fit = track.fit(model, free_names(model), FROM_NEAR, bounds_of(model, scales))
    return [rival_of(track, state, offer, fit, found)]


def that_give(track: Track, state: State, rival: Rival, found: Screening, scales: Scales) -> list[Rival]:
    """``rival`` with elastic stops in place of hard ones, fitted from several stiffnesses; empty where it has no hard stops.

    Unless it begins near their stiffness, a fit of elastic stops begins with much that is missing. Then hard stops would be
    offered instead.
    """
    gaps = [each for each in rival.fit.model.terms if each.effect.play is not None and each.effect.link is None]
    offer = next(((each,) for each in (*found.tried, *found.laws) if is_stop(each.column.term.effect)), None)
    if len(rival.offer) != 1 or rival.effect.play is None or offer is None or len(gaps) != 1:
        return []
    effect = offer[0].column.term.effect
    if effect.id in [each.effect.id for each in rival.fit.model.terms]:
        return []
    given, screened = gaps[0].by_name, offer[0].column.term.by_name
    gap = next(given[p.name] for p in gaps[0].effect.parameters if p.dimension == "x")
    fits = []
    for give in _GIVES:
        values = [
            scales.level / (give * gap) if p.dimension == "F/x" else given.get(p.name, screened[p.name])
            for p in effect.parameters
        ]
        terms = [Term(effect, tuple(values)) if each is gaps[0] else each for each in rival.fit.model.terms]
        model = rival.fit.model.with_terms(terms)
        fits.append(track.fit(model, free_names(model), _FURTHER, bounds_of(model, scales)))
    best = min(fits, key=lambda fit: float(fit.residual @ fit.residual))
    return [rival_of(track, state, offer, best, found)]


def is_stop(effect: Effect) -> bool:
    """True for stops that give: play and spring in one."""
    return effect.link is not None and effect.play is not None


def _is_spring(effect: Effect) -> bool:
    return effect.link is not None and effect.play is None


def _closed(rival: Rival, scales: Scales) -> bool:
    """True where the largest play of ``rival`` comes out below the resolution of the sensor."""
    gaps = [
        value
        for held in rival.fit.model.terms
        if held.effect in [each.column.term.effect for each in rival.offer] and held.effect.play is not None
        for p, value in zip(held.effect.parameters, held.values, strict=True)
        if p.dimension == "x"
    ]
    return bool(gaps) and max(gaps) < scales.grain
