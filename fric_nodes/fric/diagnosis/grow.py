"""Growing a model: terms come and go by what they leave on unseen blocks, never by what they leave where they were fitted.

At each step every candidate is screened at first order (:mod:`fric.diagnosis.screen`), the most promising are fitted in
full, together with all that is there, and the best stays if what it takes off the missing force on unseen blocks is more than a
candidate takes off a twin by chance, and a real part of what is missing. Afterwards each term has to earn its place again:
without it, and with each rival in its place, everything is fitted anew. It ends when what is left is what a twin leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..model import Model
from .adding import extended_by_terms, grown_on, settled_again
from .deadline import is_over
from .faint import faint_term
from .fitting import NOTHING, State, added, best_track, refit, without_place
from .growth import AGAIN, FAINTLY, LITTLE, Growth, share_left
from .moves import reconsidered
from .price import implausible
from .reproduced import reproduced
from .rival import Rival
from .settle import CLEARLY, HOPELESS, Step, audit, compared
from .track import Track

__all__ = ["first_terms", "grow", "grown_faster", "leaves_much", "left_beyond", "with_moves"]

_TO_COMPARE = 2  # terms, after which another beginning is tried
_OTHER_BEGINNINGS = 2
_AGAIN_FOR_MORE = 0.01  # as AGAIN, where more terms would come
_MUCH = 0.3  # of what is missing: with more left, another observer may see what it is
_FASTER = 0.02  # of what is missing: with more left to a faster observer, it is looked at what that is


def first_terms(tracks: Sequence[Track], nominal: Model, tell: Callable[[str], None]) -> tuple[Growth, Growth]:
    """``nominal`` refitted, and the same with the two terms that explain most in turn; fewer if nothing is left."""
    track, state = best_track(tracks, nominal)
    start = Growth(track, state, state, (), (), 1.0)
    return start, extended_by_terms(tracks, start, None, tell, most=_TO_COMPARE)


def leaves_much(first: Growth) -> bool:
    """True where the first terms of a model leave so much that there may be more effects, or others."""
    return first.end.excess > CLEARLY * first.end.floor and share_left(first) > AGAIN


def grow(
    tracks: Sequence[Track],
    nominal: Model,
    progress: Callable[[str], None] | None = None,
    begun: tuple[Growth, Growth] | None = None,
) -> Growth:
    """Grow ``nominal`` until nothing is missing or nothing helps.

    What explains most of two effects alone may be neither of them, and what comes after it only mends it: where the first terms
    leave something, others are tried from the next best beginning, and those that come further are grown on. Where a fast
    observer sees much that nothing explains, a slower one may still see what can be explained.

    Args:
        tracks: the same recordings, followed at several bandwidths.
        nominal: with values that a fit can start from.
        progress: told what comes.
        begun: what :func:`first_terms` has given, if that is known.
    """
    tell = progress or (lambda _: None)
    best = _best_growth(tracks, nominal, tell, begun)
    slower = [track for track in tracks if track.bandwidth < best.track.bandwidth]
    if not is_over() and best.rest > _MUCH and slower and (best.steps or best.end.excess > NOTHING * best.end.floor):
        tell(f"much of it stays unexplained to an observer of {best.track.bandwidth:.3g} rad/s; looking with a slower one")
        other = _best_growth(slower, nominal, tell)
        if other.steps and other.rest < min(best.rest, HOPELESS):
            return replace(other, slower=True, beyond=left_beyond(best, other))
    return grown_faster(tracks, best, tell)


def left_beyond(fast: Growth, slow: Growth) -> float:
    """Share that neither growth explains to the faster observer of ``fast``; 0 where ``slow`` explains it to that one, too."""
    begin, end = (refit(fast.track, state.fit.model) for state in (fast.begin, slow.end))
    left = audit(fast.track, begin.fit.model, end.fit.model)
    return min(left, fast.rest) if left > AGAIN else 0.0


def grown_faster(tracks: Sequence[Track], growth: Growth, tell: Callable[[str], None]) -> Growth:
    """``growth`` with further terms found by a faster observer, where they explain what it leaves to that one; else ``growth``.

    A slow observer attenuates a force that lasts only briefly far more than one that oscillates, such as that of a ripple.
    """
    for track in sorted(tracks, key=lambda each: -each.bandwidth):
        if is_over() or track.bandwidth <= growth.track.bandwidth or not growth.steps:
            break
        begin, end = (refit(track, state.fit.model) for state in (growth.begin, growth.end))
        if begin.excess < CLEARLY * begin.floor:
            continue
        if end.excess < max(_FASTER * begin.excess, CLEARLY * end.floor):
            break
        tell(f"an observer of {track.bandwidth:.3g} rad/s sees {100 * end.excess / begin.excess:.2g} % of it unexplained")
        seen = replace(growth, track=track, begin=begin, end=end, rest=audit(track, begin.fit.model, end.fit.model))
        more = settled_again(extended_by_terms([track], seen, None, tell))
        return more if more.steps and more.rest < AGAIN and more.price < seen.price else growth
    return growth


def with_moves(growth: Growth, tell: Callable[[str], None]) -> Growth:
    """``growth``, or what moves on one score make of it (:mod:`.moves`), in turn with further terms, as long as either helps.

    Args:
        growth: settled.
        tell: told what is done.
    """
    while True:
        moved = _moved(growth, tell)
        left = moved.end.excess
        if is_over() or not moved.steps or left < max(NOTHING * moved.end.floor, LITTLE * moved.begin.excess):
            break
        more = extended_by_terms([moved.track], moved, None, tell, most=len(moved.steps) + _TO_COMPARE)
        if len(more.steps) == len(moved.steps):
            break
        # The term that has come was the best of its rivals, and the moves exchange what looks alike.
        growth = settled_again(more, exchange=False)
        if not growth.steps or growth.rest >= moved.rest:
            break
    # Of terms that have come together, or in the place of others, none has been compared.
    return replace(moved, steps=compared(moved.track, moved.begin, moved.end, moved.steps))


def _moved(growth: Growth, tell: Callable[[str], None]) -> Growth:
    """``growth``, or what moves on one score make of it; after the time for the search terms may still go, but none comes."""
    left = growth.end.excess
    nothing = left < NOTHING * growth.end.floor
    if not growth.steps or (nothing and len(growth.steps) == 1) or growth.rest > HOPELESS:
        return growth  # one term alone has been compared with all of its rivals
    little = nothing or left < LITTLE * growth.begin.excess
    if not is_over():
        tell("comparing its effects with those that look like them" if little else "reconsidering its laws and values")
    state = reconsidered(growth.track, growth.begin, growth.end, tell, names_only=little)
    if state is growth.end:
        return growth
    more = reproduced(replace(growth, end=state, steps=_steps_of(growth, state), rest=_rest_of(growth, state)))
    # The moves have paid for their parameters in nats; halves of the recordings must not speak against what came of them.
    if not more.steps or more.rest > growth.rest + max(growth.dear - more.dear, 0.0):
        return growth
    return more


def _rest_of(growth: Growth, state: State) -> float:
    """Share of what is missing that ``state`` lacks too, where it was not fitted."""
    return audit(growth.track, growth.begin.fit.model, state.fit.model)


def _steps_of(growth: Growth, state: State) -> tuple[Step, ...]:
    """The steps of ``growth`` as steps to ``state``, whose terms are among those or have come in the place of one.

    The rivals of a term that has stayed are taken to leave less by as much as the whole does; others are to be compared anew.
    """
    model = state.fit.model
    brought = added(growth.begin.fit.model, model)
    places: dict[int, int] = {}
    for number, step in enumerate(growth.steps):
        place = next((k for k in brought if model.terms[k].effect.id == step.term.split("#")[0]), None)
        if place is not None:
            brought.remove(place)
            places[number] = place
    gone = [number for number in range(len(growth.steps)) if number not in places]
    places |= dict(zip(gone, brought, strict=False))
    steps = []
    less = growth.end.left - state.left
    for number, place in sorted(places.items()):
        step = growth.steps[number]
        without = refit(growth.track, without_place(model, place), max_iterations=8)
        beside = without.left, state.left, without.floor, without.excess
        rivals = tuple(_left_by(each, less, without.floor) for each in step.rivals) if number not in gone else ()
        steps.append(Step(model.prefixes[place], *beside, rivals, step.screened, step.price))
    return tuple(steps)


def _left_by(rival: Rival, less: float, floor: float) -> Rival:
    """``rival`` beside terms with which all leave ``less``, but no less than ``floor``."""
    return replace(rival, left=max(rival.left - less, floor), fair=max(rival.fair - less, floor))


def _best_growth(
    tracks: Sequence[Track], nominal: Model, tell: Callable[[str], None], begun: tuple[Growth, Growth] | None = None
) -> Growth:
    """The best of the models grown from several first terms, or from a faint one where these explain hardly anything."""
    start, first = begun or first_terms(tracks, nominal, tell)
    best = grown_on(tracks, _compared(tracks, start, first, tell), tell)
    faintly = best.rest > HOPELESS and best.begin.excess < FAINTLY * best.begin.floor
    if not is_over() and (not best.steps or faintly):
        faint = faint_term(tracks, nominal, tell)
        if faint is not None and faint.steps and (not best.steps or faint.rest < best.rest):
            best = faint
    return best


def _compared(tracks: Sequence[Track], start: Growth, first: Growth, tell: Callable[[str], None]) -> Growth:
    """The better of ``first`` and of the growths of ``start`` that begin with the next best terms.

    ``first`` begins with the term that explains most alone. A term that stands in for two effects at once explains more than
    either of them, and would keep both away. A term that needs another mass of the axis than the given one explains nothing.
    """
    tried, begun = [(first, _surely_lacks(first))], {step.term.split("#")[0] for step in first.steps[:1]}

    def best_of_all() -> tuple[Growth, float]:
        return min(tried, key=lambda each: each[1] + each[0].dear)

    for other in first.beginnings:
        best, lacks = best_of_all()
        lacks += implausible(best.track, best.end.fit.model)
        if is_over() or len(tried) > _OTHER_BEGINNINGS or lacks < (AGAIN if best.ended else _AGAIN_FOR_MORE):
            break
        if begun & {name.split("#")[0] for name in other.names}:
            continue  # with what it has besides it would come no further than that alone
        begun.add(other.effect.id)
        tell(f"once more, from {' and '.join(other.names)}")
        grown = extended_by_terms(tracks, start, other, tell, most=_TO_COMPARE)
        tried.append((grown, _surely_lacks(grown)))
    best, lacks = best_of_all()
    # What mends the last of it may cost a beginning more than it gains.
    plain = [_first_alone(each) for each, _ in tried if each is not best and len(each.steps) > 1]
    judged = [(best, lacks), *((each, _surely_lacks(each)) for each in plain)]
    return min(judged, key=lambda each: each[1] + each[0].dear)[0]


def _first_alone(growth: Growth) -> Growth:
    """``growth`` with its first term only."""
    gone = {step.term for step in growth.steps[1:]}
    model = growth.end.fit.model
    first = model.with_terms(held for name, held in zip(model.prefixes, model.terms, strict=True) if name not in gone)
    return replace(growth, end=refit(growth.track, first), steps=growth.steps[:1], ended=False)


def _surely_lacks(growth: Growth) -> float:
    """The share that ``growth`` leaves [1], from fits to one half judged on the other where that is larger and it matters."""
    lacks, end = share_left(growth), growth.end
    if not growth.steps or not growth.ended or lacks > AGAIN or end.excess < CLEARLY * end.floor:
        return lacks
    return max(lacks, audit(growth.track, growth.begin.fit.model, end.fit.model))
