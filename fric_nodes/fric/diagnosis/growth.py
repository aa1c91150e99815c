"""A model that grew: its terms in the order in which they came, what it leaves, and how that compares with others.

A share is one of what the refitted nominal model leaves: the sum of squares of the missing force above the floor [F^2].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from ..model import Model
from .candidates import candidates, scales_of
from .confidence import FAINT, LITTLE_LEFT
from .fitting import State, refit
from .price import PER_PARAMETER, implausible
from .rival import Rival
from .screen import Tried, screen
from .settle import CLEARLY, TO_STAY, Step, is_nothing
from .track import Track

__all__ = [
    "AGAIN",
    "FAINTLY",
    "LITTLE",
    "NAMELESS",
    "Growth",
    "fast_observer",
    "left_to_a_fast_observer",
    "screened",
    "share_left",
    "without_nothings",
]

AGAIN = LITTLE_LEFT
"""Statistical, of what is missing: where nothing more helps and more is left, another beginning is tried."""
LITTLE = TO_STAY
"""Statistical, of what is missing at the start: laws that differ in form only leave as much."""
FAINTLY = CLEARLY
"""Statistical, times the floor: with less missing, the share that is left says nothing, and a faint term is looked for."""
NAMELESS = FAINT
"""Statistical, times the floor: less than that above it, what no effect explains could be the measuring chain's."""


@dataclass(frozen=True, eq=False)
class Growth:
    """How a model grew.

    Attributes:
        track: the observer that it ended with; ``begin`` and ``end`` are what it finds.
        begin: the refitted nominal model.
        end: the grown model.
        steps: the terms that stayed, in the order in which they came.
        last: the last screening, of what did not come.
        rest: share of what is missing that the grown model lacks too, where it was not fitted.
        rejected: terms that came and went, with the reason.
        beginnings: what the first term was chosen from, the best first.
        ended: False where more terms may help.
        slower: True where what is missing is told by a slower observer than the fastest to which it stands out.
        beyond: share that nothing explains to that one then; else 0.
        unhelped: the same before terms came that only help beside something unknown; None where none did.
        together: what growing by several terms at once ended with; None where that wasn't done.
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
    slower: bool = False
    beyond: float = 0.0
    unhelped: Growth | None = None
    together: State | None = None

    @property
    def price(self) -> float:
        """What is left, and a price for each parameter, by which grown models are compared."""
        return self.rest + self.dear

    @property
    def stands_out(self) -> bool:
        """Whether so much is missing that it is physics even where no effect explains it."""
        return self.begin.excess > NAMELESS * self.begin.floor

    @property
    def dear(self) -> float:
        """The price of its parameters, and of what is implausible about it."""
        n = sum(not p.shape for held in self.end.fit.model.terms for p in held.effect.parameters)
        return PER_PARAMETER * n + implausible(self.track, self.end.fit.model)


def share_left(growth: Growth) -> float:
    """Share of what is missing that the grown model leaves [1], at first order on blocks that were left out of the fit."""
    begin = refit(growth.track, growth.begin.fit.model, max_iterations=4)
    return growth.end.excess / max(begin.excess, 1e-300)


def left_to_a_fast_observer(tracks: Sequence[Track], growth: Growth) -> float:
    """Share of what is missing that stays [1], to the fastest observer to which what is missing stands out from the floor.

    A slow observer hardly hinders a model to stick and slip at other times than the axis. There a wrong structure may leave
    less than the true one.
    """
    found = fast_observer(tracks, growth.begin.fit.model)
    return growth.rest if found is None else refit(found[0], growth.end.fit.model).excess / found[1].excess


def fast_observer(tracks: Sequence[Track], model: Model) -> tuple[Track, State] | None:
    """The fastest observer to which what ``model`` lacks stands out from the floor, and the model fitted there, if any."""
    for track in sorted(tracks, key=lambda each: -each.bandwidth):
        state = refit(track, model)
        if state.excess > FAINTLY * state.floor:
            return track, state
    return None


def without_nothings(growth: Growth, end: Model) -> tuple[Growth, Model]:
    """``growth`` and ``end`` without the terms that came and whose size is nothing in ``end``.

    Args:
        growth: whose terms they are.
        end: its model, fitted with a faster observer.
    """
    gone = {held.effect.id for held in end.terms if is_nothing(held)} & {step.term for step in growth.steps}
    if not gone:
        return growth, end
    why = tuple((name, "comes out at nothing when it is fitted to all that a fast observer sees") for name in sorted(gone))
    left = end.with_terms(held for held in end.terms if held.effect.id not in gone)
    kept = tuple(step for step in growth.steps if step.term not in gone)
    return replace(growth, steps=kept, rejected=(*growth.rejected, *why)), left


def screened(track: Track, state: State) -> tuple[Tried, ...]:
    """All candidates at first order beside the fitted model of ``state``, the best first."""
    return screen(track, state.fit, candidates(state.fit.model, scales_of(track)), state.chance, in_pairs=False).tried
