"""Growing by several terms at once: the laws that the components of the machine ask for, found together and then settled.

One term after the other fails where several effects are missing that only together explain the recording: what explains most
alone may be none of them. So the missing force is first taken apart by the components (:mod:`fric.diagnosis.additive`), whose
laws all come together. The model that comes of it is compared with the one that was grown one term after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..model import Model
from .adding import settled_again
from .additive.together import grown_together, middle_of
from .confidence import MANY
from .deadline import is_over
from .fitting import State, added, refit, without_place
from .grow import grown_faster
from .growth import AGAIN, LITTLE, Growth, fast_observer, left_to_a_fast_observer, screened
from .price import implausible
from .settle import CLEARLY, Step, audit
from .track import Track

__all__ = ["by_parts", "helped", "surpassing", "together"]


def together(tracks: Sequence[Track], nominal: Model, tell: Callable[[str], None]) -> Growth:
    """``nominal`` with all the laws at once that explain what is missing in its components, before it is settled.

    Where no law stays it is the refitted nominal model, without steps.

    Args:
        tracks: the same recordings, followed at several bandwidths.
        nominal: with values that a fit can start from.
        tell: told what comes.
    """
    tell("taking what is missing apart by the components of the machine")
    found = fast_observer(tracks, nominal)
    track, begin = found or (middle := middle_of(tracks), refit(middle, nominal))
    end = grown_together(track, begin, tell)
    steps = _steps_to(track, nominal, end)
    return Growth(track, begin, end, steps, (), end.excess / max(begin.excess, 1e-300), ended=True, together=end)


def _steps_to(track: Track, before: Model, end: State) -> tuple[Step, ...]:
    """A step for each term of ``end`` that ``before`` has not: what is left without it, and with it [F^2]."""
    model = end.fit.model
    steps = []
    for k in added(before, model):
        without = refit(track, without_place(model, k), max_iterations=8)
        steps.append(Step(model.prefixes[k], without.left, end.left, without.floor, without.excess, (), ()))
    return tuple(steps)


def by_parts(
    tracks: Sequence[Track], proposed: Growth, tell: Callable[[str], None], growth: Growth | None = None
) -> Growth | None:
    """The settled ``proposed``, where it leaves less than ``growth``; else ``growth``.

    Without a ``growth`` it is taken only where it is complete: it has several effects, and hardly anything is missing then, on
    blocks that were not fitted and to the faster observers. Otherwise the result is None.

    Args:
        tracks: the same recordings, followed at several bandwidths, that both were grown on.
        proposed: grown by several terms at once (:func:`together`).
        tell: told what comes.
        growth: grown by one term after the other; None where that wasn't done.
    """
    left = proposed.end.excess
    if not proposed.steps:
        return growth
    if growth is None and (
        len(proposed.steps) < MANY or left > max(LITTLE * proposed.begin.excess, CLEARLY * proposed.end.floor)
    ):
        return None
    # Of many laws that leave much, none is exchanged for its rivals: they were weighed beside each other when they came.
    settles = growth is None or left <= AGAIN * proposed.begin.excess
    rest = proposed.rest if settles else audit(proposed.track, proposed.begin.fit.model, proposed.end.fit.model)
    other = settled_again(proposed) if settles else replace(proposed, rest=rest)
    if growth is None:
        other = grown_faster(tracks, other, tell)
        complete = len(other.steps) >= MANY and other.rest < AGAIN and implausible(other.track, other.end.fit.model) == 0.0
        return replace(other, last=screened(other.track, other.end)) if complete else None
    left, least = (left_to_a_fast_observer(tracks, each) + each.dear for each in (other, growth))
    better = bool(other.steps) and left < least
    return replace(other, last=screened(other.track, other.end)) if better else growth


def surpassing(tracks: Sequence[Track], proposed: Growth, growth: Growth) -> Growth | None:
    """``proposed``, where it has several effects and leaves less than ``growth`` to a fast observer; else None.

    Its laws have been compared with others of their components already. Its parameters have no price here: it is fitted to each
    half of the recordings and judged on the other, where surplus parameters make it worse.

    Args:
        tracks: the same recordings, followed at several bandwidths, that both were grown on.
        proposed: grown by several terms at once (:func:`together`), not settled.
        growth: grown by one term after the other.
    """
    if len(proposed.steps) < MANY:
        return None
    rest = audit(proposed.track, proposed.begin.fit.model, proposed.end.fit.model)
    unlikely = max(rest, left_to_a_fast_observer(tracks, proposed)) + implausible(proposed.track, proposed.end.fit.model)
    if unlikely >= left_to_a_fast_observer(tracks, growth):
        return None
    return replace(proposed, rest=rest, last=screened(proposed.track, proposed.end))


def helped(tracks: Sequence[Track], growth: Growth, tell: Callable[[str], None]) -> Growth:
    """``growth`` with further terms that help beside something unknown; ``growth`` itself where none does.

    On a real machine many small effects may add up to what is left. None of them explains it, so that the verdict stays
    "unknown". Each has to help beside flexible functions of all other components. All together have to lower what is left on
    the half of the recordings that was not fitted, or on blocks left out in turn.

    Args:
        tracks: those that ``growth`` was grown on.
        growth: that leaves more than an explanation does.
        tell: told what comes.
    """
    track = growth.track
    found = fast_observer(tracks, growth.begin.fit.model)
    faster = found is not None and found[0].bandwidth > track.bandwidth
    if is_over() or (growth.together is growth.end and not faster):
        return growth  # it is what growing together came to: once more it would come to the same
    tell("looking for what helps beside it")
    start = replace(growth, slower=False, beyond=0.0)
    if found is not None and faster:
        track, begin = found
        end = refit(track, growth.end.fit.model)
        rest = audit(track, begin.fit.model, end.fit.model) if growth.steps else 1.0
        start = replace(start, track=track, begin=begin, end=end, rest=rest)
    end = grown_together(track, start.begin, tell, beside_unknown=True, state=start.end)
    more = _steps_to(track, start.end.fit.model, end)
    if not more:
        return growth
    rest = audit(track, start.begin.fit.model, end.fit.model)
    if rest >= start.rest and end.left >= start.end.left:
        return growth  # a half tells a run-in badly; blocks that are left out in turn tell it
    kept = {held.effect.key for held in end.fit.model.terms}
    steps = tuple(step for step in start.steps if step.term in end.fit.model.prefixes)
    gone = tuple(
        (held.effect.id, "not asked for beside the other terms")
        for held in start.end.fit.model.terms
        if held.effect.key not in kept
    )
    grown = replace(start, end=end, steps=(*steps, *more), rest=rest)
    return replace(grown, rejected=(*growth.rejected, *gone), last=screened(track, end), unhelped=growth, ended=True)
