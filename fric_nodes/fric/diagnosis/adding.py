"""Adding terms one after the other: each time the candidate that explains most, while that is a real part of what is missing.

At each step all candidates are screened at first order, the most promising are fitted in full together with all terms, and the
best one comes. Afterwards each term has to earn its place again (:mod:`fric.diagnosis.settle`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from .candidates import candidates, scales_of
from .deadline import is_over
from .fitting import NOTHING, State, best_track, refit
from .growth import LITTLE, Growth, screened
from .laws import with_best_laws
from .price import OF_EXCESS, earns, worth
from .reproduced import reproduced
from .rival import Rival
from .rivals import rivals_of
from .screen import Tried, screen
from .settle import CLEARLY, FLOOR_KNOWN, NEARLY_ALL, Settled, Step, by_simpler_laws, exchanged, merged, settled
from .track import Track

__all__ = ["extended_by_terms", "grown_on", "settled_again"]

_MOST_TERMS = 4
_TIED = 0.05  # of the floor: no observer tells two that differ by less
_TRIED = 0.15  # of the floor: with more left above it, something is fitted in full, whatever it promises at first order


def extended_by_terms(
    tracks: Sequence[Track],
    growth: Growth,
    first: Rival | None,
    tell: Callable[[str], None],
    most: int = _MOST_TERMS,
    least: float = OF_EXCESS,
) -> Growth:
    """``growth`` and the terms that come to it while they help, not settled: its ``rest`` is that of ``growth``.

    Args:
        tracks: the same recordings, followed at several bandwidths.
        growth: to begin with.
        first: comes before all others, without a screening; None to begin with a screening.
        tell: told what comes.
        most: terms that it has in the end.
        least: share of what is missing that a term has to take off. Where little is missing beside what was missing at the
            start, a term has to take off nearly all of it.
    """
    track, begin, state = growth.track, growth.begin, growth.end
    scales = scales_of(track)
    steps, last, beginnings = list(growth.steps), growth.last, growth.beginnings
    floors = {each.bandwidth: refit(each, begin.fit.model, max_iterations=4).floor for each in tracks}
    ended = True
    while first is not None or (len(steps) < most and not is_over()):
        if first is not None:
            rivals, last, first = [first], first.screened, None
        else:
            found = screen(track, state.fit, candidates(state.fit.model, scales), state.chance)
            last = found.tried
            least_worth = NOTHING if track.unsure else _TRIED
            if state.excess < least_worth * state.floor and (track.unsure or not worth(state, found.tried, least)):
                break
            rivals = [rival for rival in rivals_of(track, state, found, scales) if earns(state, rival.left, rival.offer, least)]
            if not rivals:
                break
            rivals = _told_apart(tracks, track, state, rivals)
        best = rivals[0]
        beginnings = beginnings if steps else tuple(rivals[1:])
        tell(f"{' and '.join(best.names)}: {_taken(state, best)}")
        steps += _steps_by(best, state, tuple(rivals[1:]), last)
        # What is left may show best to another observer.
        track, state = best_track(tracks, best.fit.model, 6, floors, track)
        state, steps = by_simpler_laws(track, begin, *merged(track, begin, state, steps))
        missing = refit(track, begin.fit.model, max_iterations=4).excess  # to the observer that is asked now
        if state.excess > NOTHING * state.floor and state.excess > min(LITTLE * missing, CLEARLY * state.floor):
            state, steps = with_best_laws(track, state, steps, tell)
        scales = scales_of(track)
        little = max(LITTLE * missing, FLOOR_KNOWN * state.floor)
        if state.excess < little and state.excess > CLEARLY * state.floor:
            least = max(least, NEARLY_ALL)  # beside an actuator at its limit all else is little
        elif state.excess < little:
            last = screened(track, state)
            break
    else:
        ended = most == _MOST_TERMS and len(steps) >= most  # and not because the time is over
        last = screened(track, state) if most == _MOST_TERMS else last
    return replace(growth, track=track, end=state, steps=tuple(steps), last=last, beginnings=beginnings, ended=ended)


def _taken(state: State, best: Rival) -> str:
    """What ``best`` takes of what ``state`` lacks, in words: of what noise may be as well no share tells anything."""
    if state.excess < NOTHING * state.floor:
        return "faint"
    return f"{100 * (state.left - best.left) / state.excess:.0f} % of what is missing"


def _steps_by(best: Rival, state: State, others: tuple[Rival, ...], last: tuple[Tried, ...]) -> list[Step]:
    """The step by which ``best`` comes to ``state``, or the two of a pair.

    Args:
        best: the rival that comes.
        state: what the recordings come to before it.
        others: the rivals that it was preferred to.
        last: the screening that they come from.
    """
    steps, before = [], state.left
    for k, name in enumerate(best.names):
        after = best.left if k == len(best.names) - 1 else best.halfway
        steps.append(Step(name, before, after, state.floor, state.excess, others, last))
        before = after
    return steps


def _told_apart(tracks: Sequence[Track], track: Track, state: State, rivals: Sequence[Rival]) -> list[Rival]:
    """``rivals``, where of those that leave as much as the best that one comes first that leaves least to faster observers.

    What is missing may stand out most to a slow observer, to which a delay and a lag look the same.
    """
    tied = [
        each
        for each in rivals
        if each.score - rivals[0].score < _TIED * state.floor and len(each.names) == len(rivals[0].names)
    ]
    faster = [each for each in tracks if each.bandwidth > track.bandwidth]
    if not faster or len({each.effect.id for each in tied}) < 2:
        return list(rivals)
    left = [sum(math.log(refit(each, one.fit.model, max_iterations=4).left) for each in faster) for one in tied]
    first = tied[left.index(min(left))]
    return [first, *(each for each in rivals if each is not first)]


def grown_on(tracks: Sequence[Track], start: Growth, tell: Callable[[str], None]) -> Growth:
    """``start`` with further terms, settled.

    Settling may take terms away that only made up for a wrong form of others. If much is missing then, terms are added once
    more. The result of that stays only if it is better.
    """
    raw = start if start.ended else extended_by_terms(tracks, start, None, tell)
    growth = settled_again(raw)
    if 0 < len(growth.steps) < len(raw.steps) and growth.end.excess > LITTLE * growth.begin.excess:
        raw = extended_by_terms(tracks, growth, None, tell)
        if len(raw.steps) > len(growth.steps):
            more = settled_again(raw)
            # What comes to the same terms has earned its place among them; other terms have to be better altogether.
            if {step.term for step in growth.steps} <= {step.term for step in more.steps}:
                better = more.rest < growth.rest
            else:
                better = bool(more.steps) and more.price < growth.price
            growth = more if better else growth
    return growth


def settled_again(growth: Growth, exchange: bool = True) -> Growth:
    """``growth`` without the terms that do not earn their place.

    Those that stay are held against their rivals if they may be ``exchange``d, else the caller does that.
    """
    done = settled(growth.track, growth.begin, growth.end, list(growth.steps))
    gone = (*growth.rejected, *done.gone)
    held = replace(growth, begin=done.begin, end=done.state, steps=done.steps, rest=done.rest, rejected=gone)
    # What halves contradict each other about goes first: none of its rivals has to be fitted then.
    return _exchanged(reproduced(held)) if exchange else reproduced(held)


def _exchanged(growth: Growth) -> Growth:
    """``growth`` with each of its terms compared with its rivals while all other terms are there."""
    done = exchanged(growth.track, Settled(growth.begin, growth.end, growth.steps, growth.rest, growth.rejected))
    return replace(growth, begin=done.begin, end=done.state, steps=done.steps, rest=done.rest, rejected=done.gone)
