"""Growing a model: terms come and go by what they leave on unseen blocks, never by what they leave where they were fitted.

At each step every candidate is screened at first order (:mod:`fric_nodes.diagnosis.screen`), the most promising are fitted in
full, together with all that is there, and the best stays if what it takes off the missing force on unseen blocks is more than a
candidate takes off a twin by chance, and a real part of what is missing. Afterwards each term has to earn its place again:
without it, and with each rival in its place, everything is fitted anew. It ends when what is left is what a twin leaves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..effect import Effect
from ..model import Model, ModelError, Term
from ..plants import PLANTS
from ..record import Array
from .along import Along
from .candidates import Scales, candidates, scales_of
from .screen import Gram, Screening, Tried, blocks_of, restraint, screen
from .track import Bounds, Fit, Track
from .twin import twins
from .universe import worth_trying

__all__ = ["Growth", "Rival", "State", "Step", "audit", "best_track", "bounds_of", "free_names", "grow", "refit"]

_TWINS = 3
_PAIRS_FITTED = 2
_PAIR_BETTER = 0.5  # of what the best single effect leaves, for a pair to be tried
_PER_PARAMETER = 0.012  # of what is missing
_OTHER_LAWS = 2  # of the most promising effects are fitted in another law, too
_FITTED = 4  # candidates that are fitted in full at each step
_AGAIN = 0.05  # of what is missing: with more left, other beginnings are tried
_BEGINNINGS = 1  # of them
_HOPELESS = 0.5  # of what is missing: with more left, no exchange of a term makes an explanation
_MOST_TERMS = 4
_OF_FLOOR = 0.15  # what a term has to take off, as a share of the floor
_OF_EXCESS = 0.12  # and of what is missing: less is no explanation
_TO_STAY = 0.004  # of what is missing at the start, beside all other terms
_LITTLE = 0.004  # of what is missing at the start: laws that differ in form only leave as much
_CLEAR = 25.0  # times the floor
_BY_CHANCE = 6.0  # and times what candidates take off twins
_INFLATION = 2.0
_LIGHTEST = 0.3  # of the mass that a fit began with
_LOWEST_LIMIT = 0.3  # of the largest recorded force
_MOST_FORCE = 2.0  # of the largest recorded force, a term's
_SAME = 0.35  # of the floor: nothing is missing when less than this is left above it


@dataclass(frozen=True, eq=False)
class State:
    """A fitted model and what it leaves.

    Attributes:
        fit: to all blocks.
        left: sum of squares on unseen blocks [F^2].
        floor: the same on twins of the model, their mean [F^2].
        chance: residuals of the twins, shape ``(n,)`` each [F].
    """

    fit: Fit
    left: float
    floor: float
    chance: tuple[Array, ...]

    @property
    def excess(self) -> float:
        """What is missing, above the floor [F^2]."""
        return max(self.left - self.floor, 0.0)


@dataclass(frozen=True, eq=False)
class Rival:
    """A candidate, or a pair of them, fitted in full.

    Attributes:
        effect: the first one.
        left: sum of squares on unseen blocks [F^2].
        fit: of the model with it.
        score: ``left`` and a price for each parameter [F^2]; what is small beside the rest must not decide between effects.
        offer: the trials that it was fitted from.
        names: of its terms in the fitted model.
        halfway: what the first of a pair leaves alone [F^2].
        screened: all candidates at first order then, the best first.
    """

    effect: Effect
    left: float
    fit: Fit
    score: float
    offer: tuple[Tried, ...]
    names: tuple[str, ...]
    halfway: float
    screened: tuple[Tried, ...]


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
class Growth:
    """How a model grew.

    Attributes:
        track: the observer that it ended with; ``begin`` and ``end`` are as it sees them.
        begin: the refitted nominal model.
        end: the grown model.
        steps: the terms that stayed, in the order in which they came.
        last: the last screening, of what did not come.
        rest: share of what is missing that the grown model lacks too, where it was not fitted.
        rejected: terms that came and went, with the reason.
        beginnings: what the first term was chosen from, the best first.
    """

    track: Track
    begin: State
    end: State
    steps: tuple[Step, ...]
    last: tuple[Tried, ...]
    rest: float
    rejected: tuple[tuple[str, str], ...] = field(default=())
    beginnings: tuple[Rival, ...] = field(default=())

    @property
    def price(self) -> float:
        """What is left, and a price for each parameter, by which grown models are compared."""
        n = sum(not p.shape for held in self.end.fit.model.terms for p in held.effect.parameters)
        return self.rest + _PER_PARAMETER * n


def is_driven(model: Model) -> bool:
    """True when the model has two bodies because it has a transmission."""
    return model.plant is PLANTS[model.plant.id].driven


def free_names(model: Model) -> tuple[str, ...]:
    """The parameters that a fit moves: all but shapes, and the share of the mass behind a transmission."""
    return tuple(p.name for p in model.parameters() if not p.declaration.shape or (p.name == "load_share" and is_driven(model)))


def refit(track: Track, model: Model, max_iterations: int = 12) -> State:
    """``model`` fitted to the track, and what it leaves."""
    fit = track.fit(model, free_names(model), max_iterations, bounds_of(model, scales_of(track)))
    made = twins(track, fit.model, _TWINS)
    chance = tuple(track.residual(fit.model, twin) for twin in made)
    floor = float(np.mean([_within_reason(track, fit, each) for each in chance]))
    return State(fit, _within_reason(track, fit, fit.residual), floor, chance)


def _within_reason(track: Track, fit: Fit, residual: Array) -> float:
    """:func:`unseen`, for a model that is there: more than twice what it leaves where it was fitted is first order's fault."""
    return min(unseen(track, fit, residual), _INFLATION * float(residual @ residual))


def unseen(track: Track, fit: Fit, residual: Array) -> float:
    """Sum of squares of ``residual`` on blocks left out of the fit in turn [F^2]."""
    columns = np.concatenate([residual[:, None], fit.jacobian], axis=1)
    held = np.full(columns.shape[1], restraint(track, fit))
    gram = Gram(columns, blocks_of(track, columns.shape[0]), held)
    return gram.left(0, range(1, columns.shape[1]))


def fitted_with(
    track: Track, fit: Fit, tried: Sequence[Tried], scales: Scales, max_iterations: int = 12, along: Along | None = None
) -> Fit:
    """The fitted model with the candidates, everything fitted together.

    It begins where it lacks least: at the screening's values for the candidates, at its values for all parameters, or, where
    the motion tells, at values fitted along it.
    """
    grown = fit.model.with_terms((*fit.model.terms, *(_start(each) for each in tried)))
    names, bounds = free_names(grown), bounds_of(grown, scales)
    starts = [grown, _moved(grown, fit, tried[0])]
    along = along or Along(track)
    if along.can(grown):
        starts.append(along.fitted(grown, names, track.scale(grown, names), bounds))
    best = min(starts, key=lambda model: float(np.sum(track.residual(model) ** 2)))
    return track.fit(best, names, max_iterations, bounds)


def _moved(grown: Model, fit: Fit, tried: Tried) -> Model:
    """``grown`` with the refit's parameters where the screening would have them, within their bounds."""
    values = grown.values
    declared = {p.name: p.declaration for p in grown.parameters()}
    names = grown.names
    for name, change, scale in zip(fit.names, tried.moved, fit.scale, strict=True):
        if name not in declared:
            continue
        k = names.index(name)
        lowest = 0.1 * abs(float(values[k])) if declared[name].positive else declared[name].lower
        values[k] = float(np.clip(values[k] + change * scale, lowest, declared[name].upper))
    return grown.with_values(values)


def _start(tried: Tried) -> Term:
    held = tried.column.term
    values = list(held.values)
    names = [p.name for p in held.effect.parameters]
    if tried.column.amplitudes:
        for name, value in zip(tried.column.amplitudes, tried.coefficients, strict=True):
            k = names.index(name)
            p = held.effect.parameters[k]
            values[k] = float(np.clip(value, p.lower, p.upper))
    elif held.effect.neutral is not None:
        for k, p in enumerate(held.effect.parameters):
            if p.name in held.effect.amplitudes and p.dimension in ("s",):
                values[k] *= float(np.clip(tried.coefficients[0], 0.3, 3.0))
    return Term(held.effect, tuple(values))


def bounds_of(model: Model, scales: Scales) -> Bounds:
    """Where nonlinear parameters make sense on this recording."""
    ranges = {
        "x/s": (0.3 * scales.slow, 2.0 * scales.speed),
        "s": (0.02 * scales.step, 2.0 * scales.duration),
        "1/s": (2.0, 0.5 / scales.step),
    }
    scale_of = {  # of parameters that aren't the strength of an effect: shorter ones can't be told from none
        "x": (2.0 * scales.grain, 2.0 * scales.travel),
        "s": (2.0 * scales.step, 2.0 * scales.duration),
    }
    found: Bounds = {}
    for prefix, held in zip(model.prefixes, model.terms, strict=True):
        for p, value in zip(held.effect.parameters, held.values, strict=True):
            if p.dimension == "F" and p.linear and not p.shape:
                # A surplus at speeds that the recording doesn't hold could grow for ever.
                found[f"{prefix}.{p.name}"] = (-_MOST_FORCE * scales.most, _MOST_FORCE * scales.most)
            if p.linear or p.shape:
                continue
            if p.dimension == "F" and p.positive:
                found[f"{prefix}.{p.name}"] = (_LOWEST_LIMIT * scales.most, math.inf)
            strength = p.name in held.effect.amplitudes or held.effect.play is not None
            places = p.dimension == "x" and not p.positive
            around = ranges if strength or places else ranges | scale_of
            if p.dimension in around:
                low, high = around[p.dimension]
                found[f"{prefix}.{p.name}"] = (min(low, value), max(high, value))
    for held_by_plant in model.parameters():
        if "." not in held_by_plant.name and held_by_plant.declaration.dimension == "F s^2/x":
            # Nothing moves a body without mass under no force: a model of nothing lacks little, too.
            found[held_by_plant.name] = (_LIGHTEST * scales.mass, scales.mass / _LIGHTEST)
    if is_driven(model):
        found["load_share"] = (0.05, 0.95)
    return found


def best_track(tracks: Sequence[Track], model: Model, max_iterations: int = 12) -> tuple[Track, State]:
    """The fastest observer to which what ``model`` lacks stands out clearly, or the one to which it does most."""
    best: tuple[float, Track, State] | None = None
    for track in sorted(tracks, key=lambda each: -each.bandwidth):
        state = refit(track, model, max_iterations=max_iterations)
        quality = state.excess / max(state.floor, 1e-300)
        if best is None or quality > best[0]:
            best = (quality, track, state)
        if quality > _CLEAR:
            return track, state
    assert best is not None
    return best[1], best[2]


def grow(tracks: Sequence[Track], nominal: Model, progress: Callable[[str], None] | None = None) -> Growth:
    """Grow ``nominal`` until nothing is missing or nothing helps.

    What explains most of two effects alone may be neither of them, and what comes after it only mends it: where a grown model
    leaves something, it is grown again from each of the next best beginnings, and the one that leaves least counts.

    Args:
        tracks: the same recordings, followed at several bandwidths.
        nominal: with values that a fit can start from.
        progress: told what comes.
    """
    tell = progress or (lambda _: None)
    start = best_track(tracks, nominal)
    best = _grown(tracks, start, None, tell)
    if not best.steps or best.rest < _AGAIN:
        return best
    tried = {best.steps[0].term.split("#")[0]}
    for first in best.beginnings:
        if len(tried) > _BEGINNINGS:
            break
        if first.effect.id in tried:
            continue
        tried.add(first.effect.id)
        tell(f"once more, from {' and '.join(first.names)}")
        other = _grown(tracks, start, first, tell)
        if other.steps and other.price < best.price:
            best = other
        if best.rest < _AGAIN:
            break
    return best


def _grown(tracks: Sequence[Track], start: tuple[Track, State], first: Rival | None, tell: Callable[[str], None]) -> Growth:
    """The model grown from ``start``, with ``first`` as its first step where it is given."""
    track, begin = start
    scales = scales_of(track)
    state = begin
    steps: list[Step] = []
    last: tuple[Tried, ...] = ()
    beginnings: tuple[Rival, ...] = ()
    while True:
        if first is not None:
            rivals, last, first = [first], first.screened, None
        else:
            found = screen(track, state.fit, candidates(state.fit.model, scales), state.chance)
            last = found.tried
            if len(steps) >= _MOST_TERMS or (state.excess < _SAME * state.floor and not _worth(state, found.tried)):
                break
            rivals = rivals_of(track, state, found, scales)
            if not rivals or not _earns(state, rivals[0].left, rivals[0].offer):
                break
        best = rivals[0]
        beginnings = beginnings or tuple(rivals[1:])
        tell(
            f"{' and '.join(best.names)}: {100 * (state.left - best.left) / max(state.excess, 1e-300):.0f} % of what is missing"
        )
        before = state.left
        for k, name in enumerate(best.names):
            after = best.left if k == len(best.names) - 1 else best.halfway
            steps.append(Step(name, before, after, state.floor, state.excess, tuple(rivals[1:]), last))
            before = after
        # What is left may show best to another observer.
        track, state = best_track(tracks, best.fit.model, max_iterations=6)
        state, steps = _merged(track, begin, state, steps)
        scales = scales_of(track)
        begin_here = refit(track, begin.fit.model, max_iterations=4)
        if state.excess < _LITTLE * begin_here.excess:
            found = screen(track, state.fit, candidates(state.fit.model, scales), state.chance)
            last = found.tried
            break
    return _settled(track, begin, state, steps, last, beginnings)


def _settled(
    track: Track, begin: State, state: State, steps: list[Step], last: tuple[Tried, ...], beginnings: tuple[Rival, ...]
) -> Growth:
    """The grown model after each of its terms has earned its place again."""
    scales = scales_of(track)
    begin = refit(track, begin.fit.model, max_iterations=6)
    state, steps, gone = _pruned(track, begin, state, steps)
    rest = audit(track, begin.fit.model, state.fit.model) if steps else 1.0
    if len(steps) > 1 and rest < _HOPELESS:
        state, steps = _exchanged(track, begin, state, steps, scales)
        state, steps, more = _pruned(track, begin, state, steps)
        gone += more
        rest = audit(track, begin.fit.model, state.fit.model)
    if rest > 1.0:
        gone += [(step.term, "made what it was not fitted to worse") for step in steps]
        state, steps, rest = begin, [], 1.0
    return Growth(track, begin, state, tuple(steps), last, rest, tuple(gone), beginnings)


def _merged(track: Track, begin: State, state: State, steps: list[Step]) -> tuple[State, list[Step]]:
    """A play and a spring beside each other as the one effect that is both, where that explains as much."""
    transmission = [held for held in state.fit.model.terms if held.effect.play is not None or held.effect.link is not None]
    both = [each for each in worth_trying() if each.play is not None and each.link is not None]
    if len(transmission) != 2 or all(held.effect.play is None for held in transmission):
        return state, steps
    given: dict[str, float] = {}
    for held in transmission:
        for p, value in zip(held.effect.parameters, held.values, strict=True):
            given[p.name] = given.get(p.name, 0.0) + value  # two plays in a row are one
    effect = next((each for each in both if {p.name for p in each.parameters} == set(given)), None)
    if effect is None:
        return state, steps
    others = [held for held in state.fit.model.terms if held not in transmission]
    one = refit(track, state.fit.model.with_terms([*others, Term(effect, tuple(effect.values(given)))]))
    if one.left - state.left > max(_OF_FLOOR * state.floor, _TO_STAY * begin.excess):
        return state, steps
    gone = {held.effect.id for held in transmission}
    old = [step for step in steps if step.term.split("#")[0] in gone]
    if not old:
        return state, steps
    step = replace(old[0], term=_name_of(one.fit.model, effect), after=old[-1].after)
    return one, [*(each for each in steps if each not in old), step]


def audit(track: Track, begin: Model, end: Model) -> float:
    """Share of what ``begin`` lacks that ``end`` lacks too, both fitted to one half of the recordings and judged on the other.

    The halves interleave: first and third quarter against second and fourth. The models follow the recordings from begin to
    end both times: where a play or a contact stands at the start of a quarter, only what came before can tell. Above 1 the
    grown model is the worse one.
    """
    n = track.residual(begin).shape[0]
    first = (np.arange(n) * 4 // n) % 2 == 0
    lacking = {"begin": 0.0, "end": 0.0}
    for rows in (first, ~first):
        for name, model in (("begin", begin), ("end", end)):
            fitted = track.fit(model, free_names(model), 6, bounds_of(model, scales_of(track)), rows).model
            left = track.residual(fitted)[~rows]
            lacking[name] += float(left @ left)
    made = [track.residual(end, twin) for twin in twins(track, end, 2)]
    floor = float(np.mean([each @ each for each in made]))
    unpaid = track.unpaid(begin) if end.has_slip_dynamics else 1.0
    return unpaid * max(lacking["end"] - floor, 0.0) / max(lacking["begin"] - floor, 1e-300)


def _exchanged(track: Track, begin: State, state: State, steps: list[Step], scales: Scales) -> tuple[State, list[Step]]:
    """Each term against its rivals with all the others there: what came first was chosen while the others were missing."""
    for k, step in enumerate(list(steps)):
        effect_id = step.term.split("#")[0]
        terms = [held for held in state.fit.model.terms if held.effect.id != effect_id]
        if len(terms) != len(state.fit.model.terms) - 1:
            continue
        without = refit(track, state.fit.model.with_terms(terms), max_iterations=8)
        found = screen(track, without.fit, candidates(without.fit.model, scales), without.chance)
        rivals = [
            rival for rival in rivals_of(track, without, replace(found, pairs=()), scales) if rival.effect.id != effect_id
        ]
        own = state.left + _price(state.fit.model.terms[list(state.fit.model.prefixes).index(step.term)].effect, without.excess)
        if rivals and own - rivals[0].score > max(_OF_FLOOR * state.floor, _TO_STAY * begin.excess):
            state = refit(track, rivals[0].fit.model, max_iterations=6)
            term, rivals = rivals[0].names[0], rivals[1:]
        else:
            term = step.term
        price = _price(state.fit.model.terms[list(state.fit.model.prefixes).index(term)].effect, without.excess)
        beside = without.left, state.left, without.floor, without.excess
        steps[k] = Step(term, *beside, tuple(rivals), found.tried, price)
    return state, steps


def rivals_of(track: Track, state: State, found: Screening, scales: Scales) -> list[Rival]:
    """The most promising candidates, and pairs where these promise far more, fitted in full; the best first."""
    offers: list[tuple[Tried, ...]] = [(each,) for each in found.tried[:_FITTED] if each.gain > 0.0]
    # First order is no judge between the laws of one effect, whose differences are of the second.
    foremost = {each.column.term.effect.id for each in found.tried[:_OTHER_LAWS]}
    offers += [(each,) for each in found.laws if each.column.term.effect.id in foremost]
    if found.tried and found.pairs:
        single = max(found.tried[0].left - state.floor, 0.05 * state.excess)
        offers += [
            (one, other) for one, other, left in found.pairs[:_PAIRS_FITTED] if left - state.floor < _PAIR_BETTER * single
        ]
    fitted: list[Rival] = []
    along = Along(track)
    for offer in offers:
        try:
            fit = fitted_with(track, state.fit, offer, scales, 4, along)
        except ModelError:
            continue
        fitted.append(_rival(track, state, offer, fit, found))
    fitted.sort(key=lambda rival: rival.score)
    for k, rival in enumerate(fitted[:2]):
        fit = track.fit(rival.fit.model, rival.fit.names, 8, bounds_of(rival.fit.model, scales))
        fitted[k] = _rival(track, state, rival.offer, fit, found)
    return sorted(fitted, key=lambda rival: rival.score)


def _rival(track: Track, state: State, offer: tuple[Tried, ...], fit: Fit, found: Screening) -> Rival:
    effects = [each.column.term.effect for each in offer]
    slips = any(effect.slip is not None for effect in effects)
    left = unseen(track, fit, fit.residual) * (found.unpaid if slips else 1.0)
    dear = sum(_price(effect, state.excess) for effect in effects)
    names = [_name_of(fit.model, effect) for effect in effects]
    halfway = min((each.left for each in offer), default=left)
    return Rival(effects[0], left, fit, left + dear, offer, tuple(names), max(halfway, left), found.tried)


def _price(effect: Effect, excess: float) -> float:
    """What the parameters of ``effect`` cost [F^2]."""
    return _PER_PARAMETER * excess * sum(not p.shape for p in effect.parameters)


def _name_of(model: Model, effect: Effect) -> str:
    """The prefix of the newest term of ``effect``."""
    return [prefix for prefix, held in zip(model.prefixes, model.terms, strict=True) if held.effect is effect][-1]


def _worth(state: State, tried: Sequence[Tried]) -> bool:
    """True when a screened candidate promises a real gain although nothing much is left."""
    return bool(tried) and _earns(state, tried[0].left, tried[:1])


def _earns(state: State, left: float, tried: Sequence[Tried]) -> bool:
    """True when leaving ``left`` is more than what ``tried`` takes off by chance, and a real part of what is missing."""
    gain = state.left - left
    chance = max((each.by_chance for each in tried), default=0.0)
    return gain > max(_OF_FLOOR * state.floor, _OF_EXCESS * state.excess, _BY_CHANCE * chance)


def _pruned(track: Track, begin: State, state: State, steps: list[Step]) -> tuple[State, list[Step], list[tuple[str, str]]]:
    """Each term taken away again, everything else fitted anew; it goes when hardly anything is lost."""
    gone: list[tuple[str, str]] = []
    for step in list(steps):
        if len(steps) < 2:
            break
        effect_id = step.term.split("#")[0]
        terms = [held for held in state.fit.model.terms if held.effect.id != effect_id]
        if len(terms) != len(state.fit.model.terms) - 1:
            continue
        without = refit(track, state.fit.model.with_terms(terms), max_iterations=8)
        lost = without.left - state.left
        if lost < max(_OF_FLOOR * state.floor, _TO_STAY * begin.excess):
            state = without
            steps = [each for each in steps if each is not step]
            gone.append((effect_id, "not needed any more beside the terms that came after it"))
    return state, steps, gone
