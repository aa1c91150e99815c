"""Growing a model: terms come and go by what they leave on unseen blocks, never by what they leave where they were fitted.

At each step every candidate is screened at first order (:mod:`fric.diagnosis.screen`), the most promising are fitted in
full, together with all that is there, and the best stays if what it takes off the missing force on unseen blocks is more than a
candidate takes off a twin by chance, and a real part of what is missing. Afterwards each term has to earn its place again:
without it, and with each rival in its place, everything is fitted anew. It ends when what is left is what a twin leaves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from ..model import Model
from .additive.together import grown_together, middle_of
from .candidates import candidates, scales_of
from .fitting import NOTHING, State, added, best_track, refit, without_place, without_term
from .laws import with_best_laws
from .moves import reconsidered
from .price import BY_CHANCE, OF_EXCESS, PER_PARAMETER, earns, implausible, worth
from .rival import Rival
from .rivals import rivals_of
from .screen import Screening, Tried, screen
from .settle import CLEARLY, FLOOR_KNOWN, NEARLY_ALL, Settled, Step, audit, exchanged, is_nothing, merged, settled
from .track import Track

__all__ = [
    "Growth",
    "by_parts",
    "first_terms",
    "grow",
    "helped",
    "leaves_much",
    "surpassing",
    "together",
    "with_moves",
    "without_nothings",
]

_TO_COMPARE = 2  # terms, after which another beginning is tried
_OTHER_BEGINNINGS = 2
_AGAIN = 0.05  # where nothing more helps and more is left of what is missing,
_AGAIN_FOR_MORE = 0.01  # or more than that, and more terms would come
_MOST_TERMS = 4
_LITTLE = 0.004  # of what is missing at the start: laws that differ in form only leave as much
_FAINTLY = 3.0  # floors: no more is missing where a faint term is looked for
_FAINT = 0.04  # of the floor, and
_DRAWS = 40.0  # times what one parameter takes off noise: so little may still be seen clearly
_ALIKE = 0.8  # of what the best takes off: another that does tells that the cause can't be told
_TIED = 0.05  # of the floor: no observer tells two that differ by less
_MUCH = 0.3  # of what is missing: with more left, another observer may see what it is
_HARDLY = 0.5  # of what is missing: with more left, it is hardly explained
_FASTER = 0.02  # of what is missing: with more left to a faster observer, it is looked at what that is
_TOGETHER = 3  # effects: of fewer the best is found one after the other
_TRIED = 0.15  # of the floor: with more left above it, something is fitted in full, whatever it promises at first order


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
        ended: False where more terms may help.
        beyond: share of what is missing to a faster observer that nothing explains; 0 where the fastest that sees it was kept.
        unhelped: the same before terms came that only help beside something unknown; None where none did.
    """

    track: Track
    begin: State
    end: State
    steps: tuple[Step, ...]
    last: tuple[Tried, ...]
    rest: float
    rejected: tuple[tuple[str, str], ...] = field(default=())
    beginnings: tuple[Rival, ...] = field(default=())
    ended: bool = False
    beyond: float = 0.0
    unhelped: Growth | None = None

    @property
    def price(self) -> float:
        """What is left, and a price for each parameter, by which grown models are compared."""
        return self.rest + self.dear

    @property
    def dear(self) -> float:
        """The price of its parameters, and of what is implausible about it."""
        n = sum(not p.shape for held in self.end.fit.model.terms for p in held.effect.parameters)
        return PER_PARAMETER * n + implausible(self.track.masses, self.end.fit.model)


def first_terms(tracks: Sequence[Track], nominal: Model, tell: Callable[[str], None]) -> tuple[Growth, Growth]:
    """``nominal`` fitted, and with the two terms that explain most one after the other; fewer where nothing is left."""
    track, state = best_track(tracks, nominal)
    start = Growth(track, state, state, (), (), 1.0)
    return start, _added(tracks, start, None, tell, most=_TO_COMPARE)


def leaves_much(first: Growth) -> bool:
    """True where the first terms of a model leave so much that there may be more effects, or others."""
    return first.end.excess > CLEARLY * first.end.floor and _lacks(first) > _AGAIN


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
    if best.rest > _MUCH and slower and (best.steps or best.end.excess > NOTHING * best.end.floor):
        tell(f"much of it stays unexplained to an observer of {best.track.bandwidth:.3g} rad/s; looking with a slower one")
        other = _best_growth(slower, nominal, tell)
        if other.steps and other.rest < min(best.rest, _HARDLY):
            return replace(other, beyond=best.rest)
    return _grown_faster(tracks, best, tell)


def _grown_faster(tracks: Sequence[Track], growth: Growth, tell: Callable[[str], None]) -> Growth:
    """``growth`` and what a faster observer sees beside it, where that explains what it leaves to such a one.

    A slow observer sees a force that swings fast, such as that of a ripple, many times as strong as one that comes and goes.
    """
    for track in sorted(tracks, key=lambda each: -each.bandwidth):
        if track.bandwidth <= growth.track.bandwidth or not growth.steps:
            break
        begin, end = (refit(track, state.fit.model) for state in (growth.begin, growth.end))
        if begin.excess < CLEARLY * begin.floor:
            continue
        if end.excess < max(_FASTER * begin.excess, CLEARLY * end.floor):
            break
        tell(f"an observer of {track.bandwidth:.3g} rad/s sees {100 * end.excess / begin.excess:.2g} % of it unexplained")
        seen = replace(growth, track=track, begin=begin, end=end, rest=audit(track, begin.fit.model, end.fit.model))
        more = _settled(_added([track], seen, None, tell))
        return more if more.steps and more.rest < _AGAIN and more.price < seen.price else growth
    return growth


def with_moves(growth: Growth, tell: Callable[[str], None]) -> Growth:
    """``growth``, or what moves on one score make of it (:mod:`.moves`), where it leaves more than laws of another form would.

    Args:
        growth: settled.
        tell: told what is done.
    """
    left = growth.end.excess
    if not growth.steps or left < max(NOTHING * growth.end.floor, _LITTLE * growth.begin.excess):
        return growth
    tell("reconsidering its laws and values")
    state = reconsidered(growth.track, growth.begin, growth.end, tell)
    if state is growth.end:
        return growth
    model = state.fit.model
    there = {held.effect.id: prefix for prefix, held in zip(model.prefixes, model.terms, strict=True)}
    steps = []
    for step in growth.steps:
        name = there.get(step.term.split("#")[0])
        if name is not None:
            without = refit(growth.track, without_term(model, name.split("#")[0]), max_iterations=8)
            beside = without.left, state.left, without.floor, without.excess
            steps.append(Step(name, *beside, step.rivals, step.screened, step.price))
    more = _settled(replace(growth, end=state, steps=tuple(steps)))
    return more if more.steps and more.price < growth.price else growth


def together(tracks: Sequence[Track], nominal: Model, tell: Callable[[str], None]) -> Growth:
    """``nominal`` grown by all laws at once that its components ask for, not yet settled; without steps where none stays.

    Args:
        tracks: the same recordings, followed at several bandwidths.
        nominal: with values that a fit can start from.
        tell: told what comes.
    """
    tell("taking what is missing apart by the components of the machine")
    track = middle_of(tracks)
    begin = refit(track, nominal)
    end = grown_together(track, begin, tell)
    steps = _steps_to(track, nominal, end)
    return Growth(track, begin, end, steps, (), end.excess / max(begin.excess, 1e-300), ended=True)


def _steps_to(track: Track, before: Model, end: State) -> tuple[Step, ...]:
    """What each term of ``end`` brings that ``before`` has not."""
    model = end.fit.model
    steps = []
    for k in added(before, model):
        without = refit(track, without_place(model, k), max_iterations=8)
        steps.append(Step(model.prefixes[k], without.left, end.left, without.floor, without.excess, (), ()))
    return tuple(steps)


def by_parts(
    tracks: Sequence[Track], proposed: Growth, tell: Callable[[str], None], growth: Growth | None = None
) -> Growth | None:
    """The model that was grown together, settled, where it leaves less than ``growth``; else that.

    Without a ``growth`` to hold it against it is taken only where it is complete: several effects that leave hardly anything
    on blocks that they have not seen, and to no observer.

    Args:
        tracks: those that both were grown on.
        proposed: grown together.
        tell: told what comes.
        growth: grown otherwise.
    """
    left = proposed.end.excess
    if not proposed.steps:
        return growth
    if growth is None and (
        len(proposed.steps) < _TOGETHER or left > max(_LITTLE * proposed.begin.excess, CLEARLY * proposed.end.floor)
    ):
        return None
    other = _settled(proposed)
    if growth is None:
        other = _grown_faster(tracks, other, tell)
        complete = (
            len(other.steps) >= _TOGETHER
            and other.rest < _AGAIN
            and implausible(other.track.masses, other.end.fit.model) == 0.0
        )
        return replace(other, last=_screened(other.track, other.end)) if complete else None
    left, least = (_to_a_fast_observer(tracks, each) + each.dear for each in (other, growth))
    better = bool(other.steps) and left < least
    return replace(other, last=_screened(other.track, other.end)) if better else growth


def surpassing(tracks: Sequence[Track], proposed: Growth, growth: Growth) -> Growth | None:
    """The model that was grown together, where it has several effects and leaves less than ``growth`` to a fast observer.

    Its laws have been held against others of their components already. Its parameters have no price: halves of the recordings
    are asked here, which don't agree about surplus ones.

    Args:
        tracks: those that both were grown on.
        proposed: grown together.
        growth: grown otherwise.
    """
    if len(proposed.steps) < _TOGETHER:
        return None
    rest = audit(proposed.track, proposed.begin.fit.model, proposed.end.fit.model)
    unlikely = max(rest, _to_a_fast_observer(tracks, proposed)) + implausible(proposed.track.masses, proposed.end.fit.model)
    if unlikely >= _to_a_fast_observer(tracks, growth):
        return None
    return replace(proposed, rest=rest, last=_screened(proposed.track, proposed.end))


def _to_a_fast_observer(tracks: Sequence[Track], growth: Growth) -> float:
    """Share of what is missing that the fastest observer to which it stands out sees unexplained.

    A slow one lets a model stick and slip in its own way: there a wrong structure may leave less than the true one.
    """
    for track in sorted(tracks, key=lambda each: -each.bandwidth):
        begin, end = (refit(track, state.fit.model) for state in (growth.begin, growth.end))
        if begin.excess > _FAINTLY * begin.floor:
            return end.excess / begin.excess
    return growth.rest


def helped(tracks: Sequence[Track], growth: Growth, tell: Callable[[str], None]) -> Growth:
    """``growth`` and the terms that help beside something unknown; ``growth`` itself where none does.

    On a real machine many small effects may add up to what stays. None of them is an explanation, so that the verdict is not
    theirs; but each has to be asked for where flexible functions of all other components are there, and all of them together
    have to take their part off the other half.

    Args:
        tracks: those that ``growth`` was grown on.
        growth: that leaves more than an explanation does.
        tell: told what comes.
    """
    tell("looking for what helps beside it")
    track = growth.track
    for each in sorted(tracks, key=lambda one: -one.bandwidth):
        begin = refit(each, growth.begin.fit.model)
        if each.bandwidth <= track.bandwidth or begin.excess > _FAINTLY * begin.floor:
            track = each
            break
    start = replace(growth, beyond=0.0)
    if track is not growth.track:
        begin, end = (refit(track, state.fit.model) for state in (growth.begin, growth.end))
        rest = audit(track, begin.fit.model, end.fit.model) if growth.steps else 1.0
        start = replace(start, track=track, begin=begin, end=end, rest=rest)
    end = grown_together(track, start.end, tell, beside_unknown=True)
    more = _steps_to(track, start.end.fit.model, end)
    if not more:
        return growth
    done = settled(track, start.begin, end, [*start.steps, *more])
    if len(done.steps) <= len(growth.steps) or done.rest >= start.rest:
        return growth
    gone = (*growth.rejected, *done.gone)
    last = _screened(track, done.state)
    grown = replace(start, end=done.state, begin=done.begin, steps=done.steps, rest=done.rest)
    return replace(grown, rejected=gone, last=last, unhelped=growth, ended=True)


def without_nothings(growth: Growth, end: Model) -> tuple[Growth, Model]:
    """Both without the terms that come out at nothing when they are fitted to what the faster observer sees."""
    gone = {held.effect.id for held in end.terms if is_nothing(held)} & {step.term for step in growth.steps}
    if not gone:
        return growth, end
    why = tuple((name, "comes out at nothing when it is fitted to all that a fast observer sees") for name in sorted(gone))
    left = end.with_terms(held for held in end.terms if held.effect.id not in gone)
    kept = tuple(step for step in growth.steps if step.term not in gone)
    return replace(growth, steps=kept, rejected=(*growth.rejected, *why)), left


def _best_growth(
    tracks: Sequence[Track], nominal: Model, tell: Callable[[str], None], begun: tuple[Growth, Growth] | None = None
) -> Growth:
    """The best of the models grown from two beginnings."""
    start, first = begun or first_terms(tracks, nominal, tell)
    best = _grown(tracks, _compared(tracks, start, first, tell), tell)
    if not best.steps or (best.rest > _HARDLY and best.begin.excess < _FAINTLY * best.begin.floor):
        faint = _faint(tracks, nominal, tell)
        if faint is not None and faint.steps and (not best.steps or faint.rest < best.rest):
            best = faint
    return best


def _compared(tracks: Sequence[Track], start: Growth, first: Growth, tell: Callable[[str], None]) -> Growth:
    """``start`` with the ``first`` terms, which begin with what explains most alone, or from the next best, if that is better.

    What does the work of two effects at once explains more than either, and stays in the way of both; and what explains it on
    an axis of another mass hasn't explained it.
    """
    tried, begun = [(first, _surely_lacks(first))], {step.term.split("#")[0] for step in first.steps[:1]}

    def best_of_all() -> tuple[Growth, float]:
        return min(tried, key=lambda each: each[1] + each[0].dear)

    for other in first.beginnings:
        best, lacks = best_of_all()
        lacks += implausible(best.track.masses, best.end.fit.model)
        if len(tried) > _OTHER_BEGINNINGS or lacks < (_AGAIN if best.ended else _AGAIN_FOR_MORE):
            break
        if begun & {name.split("#")[0] for name in other.names}:
            continue  # with what it has besides it would come no further than that alone
        begun.add(other.effect.id)
        tell(f"once more, from {' and '.join(other.names)}")
        grown = _added(tracks, start, other, tell, most=_TO_COMPARE)
        tried.append((grown, _surely_lacks(grown)))
    return best_of_all()[0]


def _lacks(growth: Growth) -> float:
    """Share of what is missing, on unseen blocks at first order, that the grown model lacks too."""
    begin = refit(growth.track, growth.begin.fit.model, max_iterations=4)
    return growth.end.excess / max(begin.excess, 1e-300)


def _surely_lacks(growth: Growth) -> float:
    """The same, or more where halves of the recordings disagree about what was grown, and it clearly leaves something."""
    lacks, end = _lacks(growth), growth.end
    if not growth.steps or not growth.ended or lacks > _AGAIN or end.excess < CLEARLY * end.floor:
        return lacks
    return max(lacks, audit(growth.track, growth.begin.fit.model, end.fit.model))


def _faint(tracks: Sequence[Track], nominal: Model, tell: Callable[[str], None]) -> Growth | None:
    """The model grown by a term that an observer sees clearly although hardly anything is missing beside the noise.

    A ripple or a resonance has a form of its own, which stands out from noise that holds many times its energy. None, where
    no term does, or where several do alike.
    """
    best: tuple[float, Track, State, Screening] | None = None
    for track in tracks:
        if track.unsure:
            return None
        state = refit(track, nominal)
        found = screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False)
        clear = tuple(each for each in found.tried if each.gain > _chance_of(track, state, (each,)))
        if not clear:
            continue
        surprise = clear[0].gain / state.floor * track.independent
        if best is None or surprise > best[0]:
            best = surprise, track, state, replace(found, tried=clear, laws=())
    if best is None:
        return None
    _, track, state, found = best
    rivals = rivals_of(track, state, found, scales_of(track))
    rivals = [rival for rival in rivals if state.left - rival.left > _chance_of(track, state, rival.offer)]
    if not rivals:
        return None
    others = [state.left - rival.left for rival in rivals if rival.effect.id != rivals[0].effect.id]
    if max(others, default=0.0) > _ALIKE * (state.left - rivals[0].left):
        return None
    return _grown([track], _added([track], Growth(track, state, state, (), (), 1.0), rivals[0], tell, most=1), tell)


def _chance_of(track: Track, state: State, tried: Sequence[Tried]) -> float:
    """More than any candidate takes off by chance [F^2]."""
    by_chance = max(each.by_chance for each in tried)
    return max(state.floor * max(_FAINT, _DRAWS / track.independent), BY_CHANCE * by_chance)


def _exchanged(growth: Growth) -> Growth:
    """The same with each term held against its rivals beside all the others."""
    done = exchanged(growth.track, Settled(growth.begin, growth.end, growth.steps, growth.rest, growth.rejected))
    return replace(growth, begin=done.begin, end=done.state, steps=done.steps, rest=done.rest, rejected=done.gone)


def _grown(tracks: Sequence[Track], start: Growth, tell: Callable[[str], None]) -> Growth:
    """``start``, grown on and settled.

    Where terms have gone that only mended what others lacked, there is room again for what is still missing, if it is much.
    """
    raw = start if start.ended else _added(tracks, start, None, tell)
    growth = _settled(raw)
    if 0 < len(growth.steps) < len(raw.steps) and growth.end.excess > _LITTLE * growth.begin.excess:
        raw = _added(tracks, growth, None, tell)
        if len(raw.steps) > len(growth.steps):
            more = _settled(raw)
            # What comes to the same terms has earned its place among them; other terms have to be better altogether.
            if {step.term for step in growth.steps} <= {step.term for step in more.steps}:
                better = more.rest < growth.rest
            else:
                better = bool(more.steps) and more.price < growth.price
            growth = more if better else growth
    return growth


def _settled(growth: Growth) -> Growth:
    """``growth`` after each of its terms had to earn its place again."""
    done = settled(growth.track, growth.begin, growth.end, list(growth.steps))
    gone = (*growth.rejected, *done.gone)
    held = replace(growth, begin=done.begin, end=done.state, steps=done.steps, rest=done.rest, rejected=gone)
    return _exchanged(held)


def _added(
    tracks: Sequence[Track],
    growth: Growth,
    first: Rival | None,
    tell: Callable[[str], None],
    most: int = _MOST_TERMS,
    least: float = OF_EXCESS,
) -> Growth:
    """``growth`` and the terms that come to it while they help, ``first`` before others, or until they are ``most``.

    Each takes off ``least`` of what is missing; where that is little beside what was missing at the start, nearly all of it.
    What it leaves on unseen halves is not known yet.
    """
    track, begin, state = growth.track, growth.begin, growth.end
    scales = scales_of(track)
    steps, last, beginnings = list(growth.steps), growth.last, growth.beginnings
    floors = {each.bandwidth: refit(each, begin.fit.model, max_iterations=4).floor for each in tracks}
    ended = True
    while first is not None or len(steps) < most:
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
        tell(
            f"{' and '.join(best.names)}: {100 * (state.left - best.left) / max(state.excess, 1e-300):.0f} % of what is missing"
        )
        before = state.left
        for k, name in enumerate(best.names):
            after = best.left if k == len(best.names) - 1 else best.halfway
            steps.append(Step(name, before, after, state.floor, state.excess, tuple(rivals[1:]), last))
            before = after
        # What is left may show best to another observer.
        track, state = best_track(tracks, best.fit.model, 6, floors, track)
        state, steps = merged(track, begin, state, steps)
        missing = refit(track, begin.fit.model, max_iterations=4).excess  # to the observer that is asked now
        if state.excess > NOTHING * state.floor and state.excess > min(_LITTLE * missing, CLEARLY * state.floor):
            state, steps = with_best_laws(track, state, steps, tell)
        scales = scales_of(track)
        little = max(_LITTLE * missing, FLOOR_KNOWN * state.floor)
        if state.excess < little and state.excess > CLEARLY * state.floor:
            least = max(least, NEARLY_ALL)  # beside an actuator at its limit all else is little
        elif state.excess < little:
            last = _screened(track, state)
            break
    else:
        ended = most == _MOST_TERMS
        last = _screened(track, state) if ended else last
    return replace(growth, track=track, end=state, steps=tuple(steps), last=last, beginnings=beginnings, ended=ended)


def _told_apart(tracks: Sequence[Track], track: Track, state: State, rivals: Sequence[Rival]) -> list[Rival]:
    """``rivals``, of those that leave as much as the best the one first that leaves least to faster observers.

    A delay and a lag are one to a slow observer, to which what is missing may stand out most all the same.
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


def _screened(track: Track, state: State) -> tuple[Tried, ...]:
    """All candidates beside the fitted model, the best first."""
    return screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False).tried
