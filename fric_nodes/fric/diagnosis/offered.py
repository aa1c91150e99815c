"""Which candidates of a screening are fitted in full, and from which values their fits begin."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..effect import Effect
from ..model import ModelError
from ..threads import mapped
from .along import Along
from .candidates import Scales
from .fitting import Beginning, State, begun
from .least_squares import Fit
from .price import OF_EXCESS
from .rival import brings_slip
from .screen import Screening, Tried
from .track import Track

__all__ = ["offered"]

_PAIRS_FITTED = 2
_PAIR_BETTER = 0.5  # of what the best single effect leaves, for a pair to be tried
_FIRST_ORDER = 2  # candidates that are fitted in full because they are the best at first order,
_NEARLY = 0.5  # of what the best takes off: another that does is fitted, too,
_NEARLY_DRIVEN = 0.25  # or a transmission, which lacks much where its fit begins, whatever the machine does,
_FITTED = 4  # and at most because they lack least where their fit begins,
_LAWS = 3  # of them laws of one effect


def offered(track: Track, state: State, found: Screening, scales: Scales, far: bool) -> dict[tuple[Tried, ...], Beginning]:
    """The candidates to fit in full, each with the model at which its fit begins.

    These are the best at first order and those that leave least where their fit begins. The first order alone fails where a
    contact sticks in the model and slides in the machine, where friction has to become smaller before something else can come,
    and between the laws of one effect.

    Args:
        track: of the recordings.
        state: what they come to.
        found: the screening beside it.
        scales: of the recordings.
        far: False to take fewer of them.
    """
    along = Along(track)
    begins = _begun(track, state.fit, [(each,) for each in (*found.tried, *found.laws)], scales, along)
    lacks = float(state.fit.residual @ state.fit.residual)
    most = found.tried[0].gain if found.tried else 0.0
    enough = [_NEARLY * most if most > OF_EXCESS * state.excess else math.inf] * _FITTED
    enough[:_FIRST_ORDER] = [0.0] * _FIRST_ORDER
    offers: list[tuple[Tried, ...]] = [
        (each,)
        for each, least in zip(found.tried, enough, strict=False)
        if each.gain > least * (_NEARLY_DRIVEN / _NEARLY if _parts_bodies(each.column.term.effect) else 1.0)
    ]
    laws: dict[str, int] = {}
    for offer in sorted(begins, key=lambda one: begins[one].lacks * (found.unpaid if brings_slip(one) else 1.0)):
        if offer in offers or begins[offer].lacks > lacks:
            continue
        effect = offer[0].column.term.effect
        laws[effect.id] = laws.get(effect.id, 0) + 1
        if laws[effect.id] <= (_LAWS if far else 1) and sum(laws.values()) <= (_FITTED if far else _FITTED // 2):
            offers.append(offer)
    offers += [(law,) for law in _laws_of_forms(found, offers) if (law,) not in offers]
    if found.tried and found.pairs:
        single = max(found.tried[0].left - state.floor, 0.05 * state.excess)
        foremost = found.pairs[:_PAIRS_FITTED]
        pairs: list[tuple[Tried, ...]] = [
            (one, other) for one, other, left in foremost if left - state.floor < _PAIR_BETTER * single
        ]
        begins |= _begun(track, state.fit, pairs, scales, along)
        offers += pairs
    return {offer: begins[offer] for offer in offers if offer in begins}


def _laws_of_forms(found: Screening, offers: Sequence[tuple[Tried, ...]]) -> list[Tried]:
    """The trials of the laws that ``offers`` hold forms of: what a form explains its law may explain nearly as well."""
    forms = {
        (each.column.term.effect.id, each.column.term.effect.form_of) for (each,) in offers if each.column.term.effect.form_of
    }
    return [each for each in (*found.tried, *found.laws) if (each.column.term.effect.id, each.column.term.effect.law) in forms]


def _begun(
    track: Track, fit: Fit, offers: Sequence[tuple[Tried, ...]], scales: Scales, along: Along
) -> dict[tuple[Tried, ...], Beginning]:
    """Where the fits of ``offers`` begin; those that can't be combined with the model are left out."""

    def one(offer: tuple[Tried, ...]) -> Beginning | None:
        try:
            return begun(track, fit, offer, scales, along)
        except ModelError:
            return None

    found = mapped(one, offers)
    return {offer: beginning for offer, beginning in zip(offers, found, strict=True) if beginning is not None}


def _parts_bodies(effect: Effect) -> bool:
    return effect.link is not None or effect.play is not None
