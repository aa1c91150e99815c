"""A grown model reconsidered by moves on one score: a term less, another law, other values to begin with.

What explained most when it came may only have mended what was not there yet, and the law by which it came may keep terms alive
that mend its form. So a structure is not final because its terms came in a good order: each may go or give way to another
law of its effect, or to an effect with a similar trace, with everything fitted anew each time. All structures are judged by one
number on one observer: the logarithm of the likelihood of blocks that the fit has not seen, less a price for each parameter and
for a mass far from the one given. The observer has to be fast: a slow one lets a model stick and slip in its own way, and a
wrong one may then leave less.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from ..effect import Effect
from ..model import Model, Term
from ..threads import mapped
from .along import Along
from .candidates import Candidate, candidates, scales_of
from .costs import NATS_PER_PARAMETER, law_of_form
from .deadline import is_over
from .exchange import exchanged_at
from .fitting import NOTHING, State, begun, bounds_of, free_names, left_beside, refit, without_place
from .motor_side import all_on_load, half_on_motor
from .other_laws import laws_in_place, told
from .price import implausible
from .screen import screen
from .settle import TO_STAY
from .track import Track

__all__ = ["TWENTY_TO_ONE", "Search", "alike", "reconsidered"]

TWENTY_TO_ONE = 3.0
"""Statistical [nats]: a move that gains less isn't made."""

_LAWS = 2  # of the best by themselves, that are also tried with each other term taken away
_MOVES = 20  # at most: each one gains, so that the search ends anyway
_FACTORS = (0.25, 4.0)  # by which values that are not linear are moved, from which everything is fitted again
_ROUGHLY = 5  # iterations of such a fit before it is worth more


@dataclass(eq=False)
class Search:
    """A search by moves: where it is, and what moves have come to."""

    track: Track
    begin: State
    state: State
    own: frozenset[str]
    tell: Callable[[str], None]
    scores: dict[tuple[State, bool], float] = field(default_factory=dict)
    won: float = 0.0  # by all moves [nats]
    lost: dict[tuple[str, ...], tuple[float, float]] = field(default_factory=dict)

    def is_worth(self, move: tuple[str, ...]) -> bool:
        """Whether a move may be better by now: one that has lost by more than others have won since isn't tried again."""
        by, then = self.lost.get(move, (-math.inf, 0.0))
        return by < self.won - then

    def judged(self, move: tuple[str, ...], state: State) -> State:
        """``state``, remembered as what ``move`` came to."""
        slips = self.state.fit.model.has_slip_dynamics or state.fit.model.has_slip_dynamics
        self.lost[move] = (self.score(self.state, slips) - self.score(state, slips), self.won)
        return state

    def score(self, state: State, with_slip: bool) -> float:
        """Log likelihood of unseen blocks, less the price of the structure [nats], as it counts beside slip dynamics or not."""
        if (state, with_slip) not in self.scores:
            self.scores[state, with_slip] = self._score(state, with_slip)
        return self.scores[state, with_slip]

    def _score(self, state: State, with_slip: bool) -> float:
        left, model = left_beside(self.track, state, with_slip), state.fit.model
        if not math.isfinite(left) or left <= 0.0:
            return -math.inf
        price = NATS_PER_PARAMETER * sum(name != "load_share" for name in free_names(model))
        off = max(implausible(self.track, model) - implausible(self.track, self.begin.fit.model), 0.0)
        return -0.5 * self.track.independent * (math.log(left / self.begin.left) + off) - price

    @property
    def brought(self) -> list[int]:
        """Places of the terms that may go again."""
        return self._brought_to(self.state.fit.model)

    def _brought_to(self, model: Model) -> list[int]:
        """Places of the terms that came to ``model``."""
        return [k for k, held in enumerate(model.terms) if held.effect.key not in self.own]

    def taken(self, made: Iterable[tuple[str, State]], same: bool = False) -> bool:
        """Whether the best of the moves is clearly better, and then is where the search goes on.

        What doesn't make the structure smaller must take off a real part of what was missing, too, unless it is to explain the
        ``same``.
        """
        moves = list(made)
        slips = any(each.fit.model.has_slip_dynamics for each in (self.state, *(state for _, state in moves)))
        best = max(moves, key=lambda each: self.score(each[1], slips), default=None)
        if best is None:
            return False
        better = self.score(best[1], slips) - self.score(self.state, slips)
        if not better > TWENTY_TO_ONE:
            return False
        smaller = len(best[1].fit.model.terms) < len(self.state.fit.model.terms)
        if not (smaller or same) and self.state.left - best[1].left < TO_STAY * self.begin.excess:
            return False
        self.tell(f"{best[0]}: better by {better:.0f} nats")
        self.won += better
        self.state = best[1]
        return True

    def without_each(self, state: State, but: int | None = None) -> list[tuple[str, State]]:
        """``state`` with each brought term taken away but that at the place ``but``, everything else fitted anew."""
        model = state.fit.model
        moves = []
        for k in self._brought_to(model):
            move = ("without", model.prefixes[k], "" if but is None else model.terms[but].effect.key)
            if k != but and self.is_worth(move):
                moves.append((move, f"without {model.terms[k].effect.title}", without_place(model, k)))
        return self._made(moves)

    def _made(self, moves: Sequence[tuple[tuple[str, ...], str, Model]]) -> list[tuple[str, State]]:
        """What ``moves`` come to, each given with what it is called and the model that its fit begins with; on all cores."""
        states = mapped(lambda move: refit(self.track, move[2]), moves)
        return [(what, self.judged(move, state)) for (move, what, _), state in zip(moves, states, strict=True)]

    def elsewhere(self) -> list[tuple[str, State]]:
        """The same structure from other values of what isn't linear: what sticks or gives way makes one valley for each."""
        state = self.state
        bounds = bounds_of(state.fit.model, scales_of(self.track))
        now = float(state.fit.residual @ state.fit.residual)
        best = now, state.fit.model
        moves = []
        for name, value, factor in self._moved(state.fit.model):
            low, high = bounds.get(name, (-math.inf, math.inf))
            move = ("from", name, str(factor))
            if low < value < high and self.is_worth(move):
                moves.append((move, state.fit.model.with_value(name, value)))
        fits = mapped(lambda move: self.track.fit(move[1], state.fit.names, _ROUGHLY, bounds), moves)
        for (move, _), fit in zip(moves, fits, strict=True):
            left = float(fit.residual @ fit.residual)
            self.lost[move] = (0.5 * self.track.independent * math.log(max(left, 1e-300) / max(now, 1e-300)), self.won)
            best = min(best, (left, fit.model), key=lambda each: each[0])
        return [] if best[1] is state.fit.model else [("from other values", refit(self.track, best[1]))]

    def _moved(self, model: Model) -> list[tuple[str, float, float]]:
        """Names of values that are not linear, each with another value and by what factor it is another."""
        return [
            (f"{model.prefixes[k]}.{p.name}", value * factor, factor)
            for k in self.brought
            for p, value in zip(model.terms[k].effect.parameters, model.terms[k].values, strict=True)
            if not p.linear and not p.shape and p.name != "period" and value != 0.0
            for factor in _FACTORS
        ]

    def other_side(self) -> list[tuple[str, State]]:
        """With half of the friction on the motor's side of a transmission, or with none there."""
        model = self.state.fit.model
        tried = {"friction of the motor": half_on_motor(model), "no friction of the motor": all_on_load(model)}
        return self._made(
            [((what,), what, start) for what, start in tried.items() if start is not None and self.is_worth((what,))]
        )

    def other_laws(self) -> list[tuple[str, State]]:
        """Each term by each other law of its effect; the best of these also with each other term taken away.

        A law that is the wrong one may need a further term that mends it: neither move gains without the other.
        """
        model, scales = self.state.fit.model, scales_of(self.track)
        moves, places = [], []
        for k in self.brought:
            for law in laws_in_place(self.track, self.state.fit, k):
                move = ("by another law", model.prefixes[k], law.effect.key, *map(str, _shape_of(law)))
                if self.is_worth(move):
                    other, place = exchanged_at(model, k, law)
                    moves.append((move, f"{law.effect.title} by another law ({law.effect.law})", other))
                    places.append(place)
        made = [
            (what, place, state)
            for (what, state), place in zip(self._made(moves), places, strict=True)
            if told(state.fit.model.terms[place], scales)
        ]
        slips = any(state.fit.model.has_slip_dynamics for *_, state in made)
        made.sort(key=lambda each: -self.score(each[2], slips))
        fewer = [(f"{what}, {which}", state) for what, k, whole in made[:_LAWS] for which, state in self.without_each(whole, k)]
        return [*((what, state) for what, _, state in made), *fewer]

    def simpler_laws(self) -> list[tuple[str, State]]:
        """Each term by the law that its own is a form of: beside the others, what the form has more may be nothing."""
        model = self.state.fit.model
        moves = []
        for k in self.brought:
            held, law = model.terms[k], law_of_form(model.terms[k].effect)
            move = ("by the simpler law", model.prefixes[k])
            if law is not None and self.is_worth(move):
                other, _ = exchanged_at(model, k, Term(law, tuple(law.values(held.by_name))))
                moves.append((move, f"{held.effect.title} by a simpler law", other))
        return self._made(moves)

    def mended(self) -> bool:
        """Whether other values or laws of the same effects have become the better ones."""
        return self.taken(self.other_side()) or self.taken(self.elsewhere()) or self.taken(self.other_laws())

    def renamed(self) -> bool:
        """Whether an effect has taken the place of one that it looks like.

        It explains the same, so that it needn't take off any of what was missing: what tells them apart may be a few turns, or
        that it needs fewer parameters.
        """
        return self.taken(self.look_alikes(), same=True)

    def look_alikes(self) -> list[tuple[str, State]]:
        """Each term with the effects that have a similar trace in its place, from all values that the recordings suggest.

        While another term was missing, or at first order, the wrong one may have promised more.
        """
        model, scales, along = self.state.fit.model, scales_of(self.track), Along(self.track)
        made = []
        for k in self.brought:
            if is_over():
                break
            held = model.terms[k].effect
            begun_without = without_place(model, k)
            like = [each for each in candidates(begun_without, scales) if alike(each.effect, held)]
            like = [each for each in like if self.is_worth(("exchanged", model.prefixes[k], each.effect.id))]
            if not like:
                continue
            without = refit(self.track, begun_without)
            alone = [Candidate(each.effect, (trial,)) for each in like for trial in each.trials]
            starts = []
            for effect_id in dict.fromkeys(each.effect.id for each in like):
                of_it = [each for each in alone if each.effect.id == effect_id]
                tried = screen(self.track, without.fit, of_it, without.chance, in_pairs=False).tried
                starts += [(effect_id, begun(self.track, without.fit, [each], scales, along).model) for each in tried[:_LAWS]]
            states = mapped(lambda start: (start[0], refit(self.track, start[1])), starts)
            for effect_id, state in sorted(states, key=lambda each: each[1].left, reverse=True):
                self.judged(("exchanged", model.prefixes[k], effect_id), state)  # the best of an effect comes last
            made += [(f"{effect_id} in the place of {held.id}", state) for effect_id, state in states]
        return made


def _shape_of(held: Term) -> list[float]:
    """The values of ``held`` that are shapes, which no fit moves."""
    return [value for p, value in zip(held.effect.parameters, held.values, strict=True) if p.shape]


def alike(one: Effect, other: Effect) -> bool:
    """Whether either effect is named among those that look like the other: that holds both ways."""
    return one.id in other.looks_like or other.id in one.looks_like


def reconsidered(track: Track, begin: State, state: State, tell: Callable[[str], None], names_only: bool = False) -> State:
    """The best structure that moves from ``state`` come to.

    Args:
        track: the recordings, as one observer follows them.
        begin: the fitted nominal model, whose terms stay.
        state: a fitted model with all of its terms and more.
        tell: told what is done.
        names_only: only drop terms, or exchange them for effects that look like them.
    """
    own = frozenset(held.effect.key for held in begin.fit.model.terms)
    search = Search(track, begin, state, own, tell)
    for _ in range(_MOVES):
        if search.taken(search.without_each(search.state)) or search.taken(search.simpler_laws(), same=True):
            continue
        if is_over():
            break
        if not names_only and search.state.excess >= NOTHING * search.state.floor and search.mended():
            continue
        if not search.renamed():
            break
    return search.state
