"""Growing a model: terms come and go by what they leave on unseen blocks, never by what they leave where they were fitted.

At each step every candidate is screened at first order (:mod:`fric_nodes.diagnosis.screen`), the most promising are fitted in
full, together with all that is there, and the best stays if what it takes off the missing force on unseen blocks is more than a
candidate takes off a twin by chance, and a real part of what is missing. Afterwards each term has to earn its place again:
without it, and with each rival in its place, everything is fitted anew. It ends when what is left is what a twin leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..effect import Effect
from ..model import Model, ModelError, Term
from ..plants import PLANTS
from ..record import Array
from .candidates import Scales, candidates, scales_of
from .screen import Gram, Screening, Tried, blocks_of, screen
from .track import Bounds, Fit, Track
from .twin import twins

__all__ = ["Growth", "Rival", "State", "Step", "audit", "best_track", "grow", "refit"]

_TWINS = 3
_PAIRS_FITTED = 2
_PAIR_BETTER = 0.5  # of what the best single effect leaves, for a pair to be tried
_PER_PARAMETER = 0.012  # of what is missing
_FITTED = 4  # candidates that are fitted in full at each step
_MOST_TERMS = 5
_OF_FLOOR = 0.15  # what a term has to take off, as a share of the floor
_OF_EXCESS = 0.12  # and of what is missing: less is no explanation
_TO_STAY = 0.004  # of what is missing at the start, beside all other terms
_LITTLE = 0.004  # of what is missing at the start: laws that differ in form only leave as much
_CLEAR = 25.0  # times the floor
_BY_CHANCE = 6.0  # and times what candidates take off twins
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
    """

    effect: Effect
    left: float
    fit: Fit
    score: float
    offer: tuple[Tried, ...]
    names: tuple[str, ...]
    halfway: float


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
    """

    term: str
    before: float
    after: float
    floor: float
    missing: float
    rivals: tuple[Rival, ...]
    screened: tuple[Tried, ...]


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
    """

    track: Track
    begin: State
    end: State
    steps: tuple[Step, ...]
    last: tuple[Tried, ...]
    rest: float
    rejected: tuple[tuple[str, str], ...] = field(default=())


def is_driven(model: Model) -> bool:
    """True when the model has two bodies because it has a transmission."""
    return model.plant is PLANTS[model.plant.id].driven


def free_names(model: Model) -> tuple[str, ...]:
    """The parameters that a fit moves: all but shapes, and the share of the mass behind a transmission."""
    return tuple(p.name for p in model.parameters() if not p.declaration.shape or (p.name == "load_share" and is_driven(model)))


def refit(track: Track, model: Model, bounds: Bounds | None = None, max_iterations: int = 12) -> State:
    """``model`` fitted to the track, and what it leaves."""
    fit = track.fit(model, free_names(model), max_iterations, bounds)
    made = twins(track, fit.model, _TWINS)
    chance = tuple(track.residual(fit.model, twin.efforts, twin.positions) for twin in made)
    return State(fit, unseen(track, fit, fit.residual), float(np.mean([unseen(track, fit, each) for each in chance])), chance)


def unseen(track: Track, fit: Fit, residual: Array) -> float:
    """Sum of squares of ``residual`` on blocks left out of the fit in turn [F^2]."""
    columns = np.concatenate([residual[:, None], fit.jacobian], axis=1)
    gram = Gram(columns, blocks_of(track, columns.shape[0]))
    return gram.left(0, range(1, columns.shape[1]))


def fitted_with(track: Track, fit: Fit, tried: Sequence[Tried], scales: Scales, max_iterations: int = 12) -> Fit:
    """The fitted model with the candidates, everything fitted together from the screening's values."""
    added = [_start(each) for each in tried]
    grown = fit.model.with_terms((*fit.model.terms, *added))
    moved = _moved(grown, fit, tried[0])
    if float(np.sum(track.residual(moved) ** 2)) < float(np.sum(track.residual(grown) ** 2)):
        grown = moved
    return track.fit(grown, free_names(grown), max_iterations, _bounds(grown, scales))


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


def _bounds(model: Model, scales: Scales) -> Bounds:
    """Where nonlinear parameters make sense on this recording."""
    ranges = {
        "x/s": (0.3 * scales.slow, 2.0 * scales.speed),
        "s": (0.02 * scales.step, 2.0 * scales.duration),
        "1/s": (0.5, 0.5 / scales.step),
    }
    found: Bounds = {}
    for p in model.parameters():
        if "." in p.name and not p.declaration.linear and p.declaration.dimension in ranges:
            low, high = ranges[p.declaration.dimension]
            found[p.name] = (min(low, p.value), max(high, p.value))
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

    Args:
        tracks: the same recordings, followed at several bandwidths.
        nominal: with values that a fit can start from.
        progress: told what comes.
    """
    tell = progress or (lambda _: None)
    track, begin = best_track(tracks, nominal)
    scales = scales_of(track)
    state = begin
    steps: list[Step] = []
    last: tuple[Tried, ...] = ()
    while True:
        found = screen(track, state.fit, candidates(state.fit.model, scales), state.chance)
        last = found.tried
        if len(steps) >= _MOST_TERMS or (state.excess < _SAME * state.floor and not _worth(state, found.tried)):
            break
        rivals = rivals_of(track, state, found, scales)
        if not rivals or not _earns(state, rivals[0].left, rivals[0].offer):
            break
        best = rivals[0]
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
        scales = scales_of(track)
        begin_here = refit(track, begin.fit.model, max_iterations=4)
        if state.excess < _LITTLE * begin_here.excess:
            found = screen(track, state.fit, candidates(state.fit.model, scales), state.chance)
            last = found.tried
            break
    begin = refit(track, begin.fit.model, max_iterations=6)
    state, steps, gone = _pruned(track, begin, state, steps)
    if len(steps) > 1:
        state, steps = _exchanged(track, begin, state, steps, scales)
        state, steps, more = _pruned(track, begin, state, steps)
        gone += more
    rest = audit(track, begin.fit.model, state.fit.model) if steps else 1.0
    if rest > 1.0:
        gone += [(step.term, "made what it was not fitted to worse") for step in steps]
        state, steps, rest = begin, [], 1.0
    return Growth(track, begin, state, tuple(steps), last, rest, tuple(gone))


def audit(track: Track, begin: Model, end: Model) -> float:
    """Share of what ``begin`` lacks that ``end`` lacks too, both fitted to one half of the recordings and judged on the other.

    The halves interleave: first and third quarter against second and fourth. Above 1 the grown model is the worse one.
    """
    quarters = track.parts(4)
    halves = [quarters[0].with_runs_of(quarters[2]), quarters[1].with_runs_of(quarters[3])]
    if any(not half.runs for half in halves):
        return 0.0
    lacking = {"begin": 0.0, "end": 0.0}
    floor = 0.0
    for one, other in (halves, halves[::-1]):
        for name, model in (("begin", begin), ("end", end)):
            fitted = one.fit(model, free_names(model), 6).model
            left = other.residual(fitted)
            lacking[name] += float(left @ left)
        made = [other.residual(end, twin.efforts, twin.positions) for twin in twins(other, end, 2)]
        floor += float(np.mean([each @ each for each in made]))
    return max(lacking["end"] - floor, 0.0) / max(lacking["begin"] - floor, 1e-300)


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
        if rivals and state.left - rivals[0].left > max(_OF_FLOOR * state.floor, _TO_STAY * begin.excess):
            state = refit(track, rivals[0].fit.model, max_iterations=6)
            steps[k] = Step(
                rivals[0].names[0], without.left, state.left, without.floor, without.excess, tuple(rivals[1:]), found.tried
            )
        else:
            steps[k] = Step(step.term, without.left, state.left, without.floor, without.excess, tuple(rivals), found.tried)
    return state, steps


def rivals_of(track: Track, state: State, found: Screening, scales: Scales) -> list[Rival]:
    """The most promising candidates, and pairs where these promise far more, fitted in full; the best first."""
    offers: list[tuple[Tried, ...]] = [(each,) for each in found.tried[:_FITTED] if each.gain > 0.0]
    if found.tried and found.pairs:
        single = max(found.tried[0].left - state.floor, 0.05 * state.excess)
        offers += [
            (one, other) for one, other, left in found.pairs[:_PAIRS_FITTED] if left - state.floor < _PAIR_BETTER * single
        ]
    fitted: list[Rival] = []
    for offer in offers:
        try:
            fit = fitted_with(track, state.fit, offer, scales, max_iterations=4)
        except ModelError:
            continue
        fitted.append(_rival(track, state, offer, fit))
    fitted.sort(key=lambda rival: rival.score)
    for k, rival in enumerate(fitted[:2]):
        fit = track.fit(rival.fit.model, rival.fit.names, 8, _bounds(rival.fit.model, scales))
        fitted[k] = _rival(track, state, rival.offer, fit)
    return sorted(fitted, key=lambda rival: rival.score)


def _rival(track: Track, state: State, offer: tuple[Tried, ...], fit: Fit) -> Rival:
    left = unseen(track, fit, fit.residual)
    effects = [each.column.term.effect for each in offer]
    n = sum(not p.shape for effect in effects for p in effect.parameters)
    dear = _PER_PARAMETER * state.excess * n
    names = [_name_of(fit.model, effect) for effect in effects]
    halfway = min((each.left for each in offer), default=left)
    return Rival(effects[0], left, fit, left + dear, offer, tuple(names), max(halfway, left))


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
