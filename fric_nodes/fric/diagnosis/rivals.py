"""Rivals: the most promising candidates of a screening, fitted in full together with all that is there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..effect import Effect
from ..model import Model, ModelError, Term
from ..threads import mapped
from .along import Along
from .candidates import Scales
from .fitting import Beginning, State, begun, bounds_of, free_names, is_driven, shaken, unseen
from .least_squares import Fit
from .other_laws import laws_beside, laws_further, told
from .screen import Screening, Tried
from .track import Track

__all__ = [
    "BY_CHANCE",
    "FAR_OFF",
    "OF_EXCESS",
    "OF_FLOOR",
    "PER_PARAMETER",
    "Rival",
    "earns",
    "implausible",
    "is_stop",
    "mass_off",
    "name_of",
    "price_of",
    "rivals_of",
    "worth",
]

FAR_OFF = 0.1  # of what is missing, for a mass twice or half the one that was given
_NEAR = 1.2  # times as large or small as the given one, or less
_LEAST_SHARE = 0.1  # of the mass behind a spring: half of it counts as much as a mass twice the given one
_PAIRS_FITTED = 2
_PAIR_BETTER = 0.5  # of what the best single effect leaves, for a pair to be tried
PER_PARAMETER = 0.012  # of what is missing
_FIRST_ORDER = 2  # candidates that are fitted in full because they are the best at first order,
_NEARLY = 0.5  # of what the best takes off: another that does is fitted, too,
_NEARLY_DRIVEN = 0.25  # or a transmission, which lacks much where its fit begins, whatever the machine does,
_FITTED = 4  # and at most because they lack least where their fit begins,
_LAWS = 3  # of them laws of one effect
_REFINED = 2  # the best, with more iterations,
_ALSO_REFINED = 0.9  # of what the best takes off: the first of another effect that does is refined, too
_SHARES = (0.5, 0.3, 0.7)  # of the mass behind a transmission, from which fits begin
_IN_REACH = 0.6  # of what is to be beaten, a rough fit takes off before it is worth more iterations
_CLOSE = 0.98  # of what the best takes off: so close it may not be the best
_AS_A_SPRING = 8  # iterations
_FITTED_OUT = 3  # of such rivals
_FACTORS = (0.25, 0.5, 2.0, 4.0)  # by which values are moved, from which they are fitted again
_AGAIN = 4  # iterations
_SHAPED = 3  # of the best, whose shapes and laws are compared, too
_GIVES = (0.03, 0.3, 3.0)  # of the gap, that stops give under the typical force
_FURTHER = 12  # iterations of a fit by a law that goes further
_ROUGH = 0.02  # of what is missing: with more left, the best fits are begun again from around them
OF_FLOOR = 0.15  # what a term has to take off, as a share of the floor
OF_EXCESS = 0.12  # and of what is missing: less is no explanation
BY_CHANCE = 6.0  # and times what candidates take off twins


@dataclass(frozen=True, eq=False)
class Rival:
    """A candidate, or a pair of them, fitted in full.

    Attributes:
        effect: the first one.
        left: sum of squares on unseen blocks [F^2].
        fit: of the model with it.
        fair: ``left`` as it is held against that of other rivals [F^2].
        dear: price of its parameters, and of what is implausible about it [F^2]; what is small beside the rest must not decide
            between effects.
        offer: the trials that it was fitted from.
        names: of its terms in the fitted model.
        halfway: what the first of a pair leaves alone [F^2].
        screened: all candidates at first order then, the best first.
    """

    effect: Effect
    left: float
    fit: Fit
    fair: float
    dear: float
    offer: tuple[Tried, ...]
    names: tuple[str, ...]
    halfway: float
    screened: tuple[Tried, ...]

    @property
    def slips(self) -> bool:
        """True where it brings slip dynamics."""
        return _slips(self.offer)

    @property
    def score(self) -> float:
        """What it leaves and what it costs [F^2]."""
        return self.fair + self.dear


def rivals_of(track: Track, state: State, found: Screening, scales: Scales, to_beat: float = math.inf) -> list[Rival]:
    """The most promising candidates, and pairs where these promise far more, fitted in full; the best first.

    Args:
        track: of the recordings.
        state: what they come to.
        found: the screening beside it.
        scales: of the recordings.
        to_beat: what something else leaves in their place [F^2]: where that is hardly anything, nobody looks far, and what is
            far from it is not refined.
    """
    fitted: list[Rival] = []
    much = state.floor + max(_ROUGH * state.excess, OF_FLOOR * state.floor)
    for offer, beginning in _offered(track, state, found, scales, to_beat > much).items():
        fit = _first_fit(track, state, beginning.model, scales)
        fitted.append(_rival(track, state, offer, fit, found))
    fitted = _side_by_side(track, fitted, found.unpaid)
    for k in _worth_refining(state, fitted):
        rival = fitted[k]
        if state.left - rival.left < _IN_REACH * (state.left - to_beat):
            continue
        bounds = bounds_of(rival.fit.model, scales)
        fit = track.fit(rival.fit.model, rival.fit.names, 8, bounds)
        if to_beat > much and _steps(rival) and unseen(track, fit, fit.residual) > much:
            fit = shaken(track, fit, bounds, (1.0 + OF_FLOOR) * state.floor)
        fitted[k] = _rival(track, state, rival.offer, fit, found)
        if fitted[k].left > much:
            fitted[k] = _extended(track, state, fitted[k], found, scales)
    fitted = _with_play(track, state, fitted, found, scales)
    fitted = _side_by_side(track, fitted, found.unpaid)
    if to_beat > much and fitted and fitted[0].left > much:
        giving = _that_give(track, state, fitted[0], found, scales)
        fitted = _side_by_side(track, [*fitted, *giving], found.unpaid) if giving else fitted
    if to_beat > much:
        fitted = _side_by_side(track, _fitted_out(track, state, fitted, found, scales), found.unpaid)
    n_shaped = _SHAPED if to_beat > much else 1
    shaped = [_shaped(track, state, rival, found, scales) for rival in fitted[:n_shaped]]
    return _side_by_side(track, [*shaped, *fitted[n_shaped:]], found.unpaid)


def _fitted_out(track: Track, state: State, fitted: list[Rival], found: Screening, scales: Scales) -> list[Rival]:
    """``fitted``, of which the best of several effects that explain nearly as much are fitted again from other values.

    The right one would leave the floor alone: while none does, which leaves less says how far its fit has come.
    """
    floor = (1.0 + OF_FLOOR) * state.floor
    close: dict[str, int] = {}
    for k, rival in enumerate(fitted):
        if len(rival.offer) == 1 and state.left - rival.left > _CLOSE * (state.left - fitted[0].left):
            close.setdefault(rival.effect.id, k)
    if len(close) < 2 or min(rival.left for rival in fitted) < floor:
        return fitted
    result = list(fitted)
    for k in list(close.values())[:_FITTED_OUT]:
        rival = fitted[k]
        bounds = bounds_of(rival.fit.model, scales)
        begun_again = [rival.fit, *(track.fit(m, rival.fit.names, _AGAIN, bounds) for m in _elsewhere(rival, scales))]
        best = min(begun_again, key=lambda each: float(each.residual @ each.residual))
        other = _rival(track, state, rival.offer, track.fit(best.model, best.names, 8, bounds), found)
        if other.left < rival.left:
            result[k] = replace(other, dear=rival.dear)
    return result


def _elsewhere(rival: Rival, scales: Scales) -> list[Model]:
    """The model of ``rival`` with other values of what its effect brings but for amplitudes: from these it may come further.

    Beside friction that sticks, what is left has one valley per width of a Stribeck curve, say.
    """
    model, effect = rival.fit.model, rival.effect
    bounds = bounds_of(model, scales)
    found = []
    for p in effect.parameters:
        if p.linear or p.shape or p.name in effect.amplitudes:
            continue
        name = f"{name_of(model, effect)}.{p.name}"
        low, high = bounds.get(name, (p.lower, math.inf))
        for factor in _FACTORS:
            value = model.value(name) * factor
            if low < value < high:
                found.append(model.with_value(name, value))
    return found


def _worth_refining(state: State, fitted: Sequence[Rival]) -> list[int]:
    """Numbers of the rivals, of which the best is the first, that get more iterations."""
    best = list(range(min(_REFINED, len(fitted))))
    effects = {fitted[k].effect.id for k in best}
    for k, rival in enumerate(fitted):
        if rival.effect.id not in effects and state.left - rival.left > _ALSO_REFINED * (state.left - fitted[0].left):
            return [*best, k]
    return best


def _first_fit(track: Track, state: State, model: Model, scales: Scales) -> Fit:
    """``model`` fitted roughly; where a transmission comes, from several shares of the mass behind it.

    Between two bodies all else depends on that share, and what is left is no smooth function of it.
    """
    starts = [model]
    if is_driven(model) and not is_driven(state.fit.model):
        starts = [model.with_value("load_share", share) for share in _SHARES]
    fits = [track.fit(start, free_names(start), 4, bounds_of(start, scales)) for start in starts]
    return min(fits, key=lambda fit: float(fit.residual @ fit.residual))


def _shaped(track: Track, state: State, rival: Rival, found: Screening, scales: Scales) -> Rival:
    """``rival`` with those shapes and laws of its terms that leave least, as far as they are worth their price.

    What a wrong shape leaves would be taken for another effect.
    """
    best = rival
    for each in rival.offer:
        own = [k for k, held in enumerate(best.fit.model.terms) if held.effect is each.column.term.effect]
        if not own or rival.left < (1.0 + OF_FLOOR) * state.floor:
            continue
        held = best.fit.model.terms[own[-1]]
        for term in laws_beside(held, scales):
            if term.effect.slip is not None and term.effect is not held.effect:
                continue  # is tried when the effect has come
            model = best.fit.model.with_terms(term if k == own[-1] else one for k, one in enumerate(best.fit.model.terms))
            fit = track.fit(model, free_names(model), 8, bounds_of(model, scales))
            other = _rival(track, state, rival.offer, fit, found)
            dearer = rival.dear + price_of(term.effect, state.excess) - price_of(held.effect, state.excess) - best.dear
            if best.left - other.left > max(OF_FLOOR * state.floor, dearer) and told(fit.model.terms[own[-1]], scales):
                fair = other.left * rival.fair / max(rival.left, 1e-300)
                best = replace(other, fair=fair, dear=best.dear + dearer)
    return best


def _n_free(effect: Effect) -> int:
    return sum(not p.shape for p in effect.parameters)


def _extended(track: Track, state: State, rival: Rival, found: Screening, scales: Scales) -> Rival:
    """``rival``, or the same by a law that goes further than its own, where that leaves much less.

    A spring that hardens lies nearer to a gap with soft stops than to a linear spring: held against other effects by its usual
    law alone it would lose what is its own.
    """
    best = rival
    for place, held in enumerate(rival.fit.model.terms):
        if held.effect not in [each.column.term.effect for each in rival.offer]:
            continue
        for term in laws_further(held, scales):
            model = rival.fit.model.with_terms(term if k == place else each for k, each in enumerate(rival.fit.model.terms))
            fit = track.fit(model, free_names(model), _FURTHER, bounds_of(model, scales))
            other = _rival(track, state, rival.offer, fit, found)
            dearer = price_of(term.effect, state.excess) - price_of(held.effect, state.excess)
            if best.left - other.left > max(OF_FLOOR * state.floor, dearer):
                best = replace(other, dear=other.dear + dearer)
    return best


def _with_play(track: Track, state: State, rivals: list[Rival], found: Screening, scales: Scales) -> list[Rival]:
    """``rivals`` without stops between which no play comes out, where the spring that they are explains as much."""
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
    """Stops without play as the spring that was screened; nothing where none was."""
    offer = next(((each,) for each in (*found.tried, *found.laws) if _is_spring(each.column.term.effect)), None)
    stops = [each for each in rival.fit.model.terms if is_stop(each.effect)]
    if offer is None or len(stops) != 1:
        return []
    effect = offer[0].column.term.effect
    given = stops[0].by_name
    if not {p.name for p in effect.parameters} <= set(given):
        return []
    spring = Term(effect, tuple(given[p.name] for p in effect.parameters))
    model = rival.fit.model.with_terms(spring if each is stops[0] else each for each in rival.fit.model.terms)
    fit = track.fit(model, free_names(model), _AS_A_SPRING, bounds_of(model, scales))
    return [_rival(track, state, offer, fit, found)]


def _that_give(track: Track, state: State, rival: Rival, found: Screening, scales: Scales) -> list[Rival]:
    """The gap of ``rival`` between stops that give, fitted from several stiffnesses; nothing where it has none, or they do.

    A fit of such stops begins with much that is missing unless their stiffness is near: hard ones would be offered instead.
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
    return [_rival(track, state, offer, best, found)]


def is_stop(effect: Effect) -> bool:
    """True for stops that give: play and spring in one."""
    return effect.link is not None and effect.play is not None


def _parts_bodies(effect: Effect) -> bool:
    return effect.link is not None or effect.play is not None


def _is_spring(effect: Effect) -> bool:
    return effect.link is not None and effect.play is None


def _closed(rival: Rival, scales: Scales) -> bool:
    """True where a play of ``rival`` comes out at less than the sensor tells."""
    gaps = [
        value
        for held in rival.fit.model.terms
        if held.effect in [each.column.term.effect for each in rival.offer] and held.effect.play is not None
        for p, value in zip(held.effect.parameters, held.values, strict=True)
        if p.dimension == "x"
    ]
    return bool(gaps) and max(gaps) < scales.grain


def _offered(track: Track, state: State, found: Screening, scales: Scales, far: bool) -> dict[tuple[Tried, ...], Beginning]:
    """What is fitted in full, and from where: the best at first order, and what lacks least where its fit begins.

    Less is where nobody looks ``far``.

    First order fails where a contact sticks in the model and slides in the machine, and where friction has to leave first for
    something else to come; and it is no judge between the laws of one effect.
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
    for offer in sorted(begins, key=lambda one: begins[one].lacks * (found.unpaid if _slips(one) else 1.0)):
        if offer in offers or begins[offer].lacks > lacks:
            continue
        effect = offer[0].column.term.effect
        laws[effect.id] = laws.get(effect.id, 0) + 1
        if laws[effect.id] <= (_LAWS if far else 1) and sum(laws.values()) <= (_FITTED if far else _FITTED // 2):
            offers.append(offer)
    if found.tried and found.pairs:
        single = max(found.tried[0].left - state.floor, 0.05 * state.excess)
        foremost = found.pairs[:_PAIRS_FITTED]
        pairs: list[tuple[Tried, ...]] = [
            (one, other) for one, other, left in foremost if left - state.floor < _PAIR_BETTER * single
        ]
        begins |= _begun(track, state.fit, pairs, scales, along)
        offers += pairs
    return {offer: begins[offer] for offer in offers if offer in begins}


def _begun(
    track: Track, fit: Fit, offers: Sequence[tuple[Tried, ...]], scales: Scales, along: Along
) -> dict[tuple[Tried, ...], Beginning]:
    """Where the fits of ``offers`` begin, but of those that make no model."""

    def one(offer: tuple[Tried, ...]) -> Beginning | None:
        try:
            return begun(track, fit, offer, scales, along)
        except ModelError:
            return None

    found = mapped(one, offers)
    return {offer: beginning for offer, beginning in zip(offers, found, strict=True) if beginning is not None}


def _side_by_side(track: Track, fitted: Sequence[Rival], unpaid: float) -> list[Rival]:
    """Rivals, the best first, those with slip dynamics held against the best of the others as the same observer sees both.

    How much less is seen to be missing where the position is set depends on what is missing: after a fit it is no more what it
    was before, ``unpaid`` [1].
    """
    pushed = [rival for rival in fitted if not rival.slips]
    if len(pushed) < len(fitted) and pushed and unpaid > 1.0:
        now = min(track.unpaid(min(pushed, key=lambda rival: rival.score).fit.model), unpaid)
        fitted = [replace(rival, fair=rival.left * now / unpaid) if rival.slips else rival for rival in fitted]
    return sorted(fitted, key=lambda rival: rival.score)


def _rival(track: Track, state: State, offer: tuple[Tried, ...], fit: Fit, found: Screening) -> Rival:
    effects = [each.column.term.effect for each in offer]
    left = unseen(track, fit, fit.residual) * (found.unpaid if _slips(offer) else 1.0)
    dear = sum(price_of(effect, state.excess) for effect in effects) + state.excess * implausible(track.masses, fit.model)
    names = [name_of(fit.model, effect) for effect in effects]
    halfway = min((each.left for each in offer), default=left)
    return Rival(effects[0], left, fit, left, dear, offer, tuple(names), max(halfway, left), found.tried)


def _steps(rival: Rival) -> bool:
    """True where sticking, gaps or limits make steps in what is left."""
    effects = [each.column.term.effect for each in rival.offer]
    return is_driven(rival.fit.model) or any(not p.linear for effect in effects for p in effect.parameters if not p.shape)


def _slips(offer: Sequence[Tried]) -> bool:
    return any(each.column.term.effect.slip is not None for each in offer)


def price_of(effect: Effect, excess: float) -> float:
    """What the parameters of ``effect`` cost [F^2]."""
    return PER_PARAMETER * excess * _n_free(effect)


def implausible(masses: Sequence[float], model: Model) -> float:
    """What speaks against ``model`` whatever it explains, as a share of what is missing.

    That is a mass far from all ``masses`` [F s^2/x] that were given, and a transmission with hardly any mass behind it: between
    a spring that ends at a body and one that ends at friction, the first micrometres of a contact, no recording decides there.
    """
    share = model.value("load_share") if is_driven(model) else 1.0
    return mass_off(masses, model) + FAR_OFF * max(math.log2(_LEAST_SHARE / share), 0.0) ** 2


def mass_off(masses: Sequence[float], model: Model) -> float:
    """What it speaks against ``model`` to be far from all ``masses`` [F s^2/x] that were given, as a share of what is missing.

    A body that is far too light under a force that is taken away from it lacks little, whatever the machine does. A mass that
    is near speaks against nothing: it was fitted by a model that lacks something.
    """
    appended = sum(p.value for p in model.parameters() if "." in p.name and p.declaration.dimension == "F s^2/x")
    off = min(math.log2((model.total_inertia + appended) / mass) ** 2 for mass in masses)
    near = math.log2(_NEAR) ** 2
    return FAR_OFF * max(off - near, 0.0) / (1.0 - near)


def name_of(model: Model, effect: Effect) -> str:
    """The prefix of the newest term of ``effect``, by whatever law."""
    of_it = [prefix for prefix, held in zip(model.prefixes, model.terms, strict=True) if held.effect.id == effect.id]
    own = [prefix for prefix, held in zip(model.prefixes, model.terms, strict=True) if held.effect is effect]
    return (own or of_it)[-1]


def worth(state: State, tried: Sequence[Tried], of_excess: float = OF_EXCESS) -> bool:
    """True when a screened candidate promises a real gain although nothing much is left."""
    return bool(tried) and earns(state, tried[0].left, tried[:1], of_excess)


def earns(state: State, left: float, tried: Sequence[Tried], of_excess: float = OF_EXCESS) -> bool:
    """True when leaving ``left`` is more than what ``tried`` takes off by chance, and the part ``of_excess`` of it all."""
    gain = state.left - left
    chance = max((each.by_chance for each in tried), default=0.0)
    return gain > max(OF_FLOOR * state.floor, of_excess * state.excess, BY_CHANCE * chance)
