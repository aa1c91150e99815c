"""The law of an effect that has been found: the usual one, or another that explains much more.

An effect is found by the one of its laws that comes nearest to all others (:func:`fric.diagnosis.worth_trying.worth_trying`).
The machine may follow another: bristles that bend elastically up to a sharp corner instead of an exponential, say. What that
leaves would bring further effects in that only mend the form of the first. So each other law is fitted in the place of the
usual one, everything else anew, and takes it if it leaves much less on unseen blocks. The effect, its rivals and its place stay
what they were.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from .candidates import scales_of
from .exchange import exchanged_at
from .fitting import State, refit
from .other_laws import laws_in_place, told
from .settle import Step
from .track import Track

__all__ = ["with_best_laws"]

_BETTER = 0.3  # of what is left, that another law has to take off: what another effect explains, it explains better


def with_best_laws(track: Track, state: State, steps: Sequence[Step], tell: Callable[[str], None]) -> tuple[State, list[Step]]:
    """The fitted model and its steps, with other laws of the effects that came, where these leave much less."""
    found = list(steps)
    for number, step in enumerate(steps):
        model = state.fit.model
        place = list(model.prefixes).index(step.term)
        best, at = state, place
        for term in laws_in_place(track, state.fit, place):
            other, its = exchanged_at(model, place, term)
            tried = refit(track, other)
            if tried.left < best.left and told(tried.fit.model.terms[its], scales_of(track)):
                best, at = tried, its
        if state.left - best.left <= _BETTER * state.excess or state.excess == 0.0:
            continue
        law = best.fit.model.terms[at].effect.law
        tell(f"{step.term} by the law {law}: leaves {100.0 * best.excess / state.excess:.0f} % of what was left")
        found[number] = replace(step, term=best.fit.model.prefixes[at], after=max(step.after - state.left + best.left, 0.0))
        state = best
    return state, found
