"""A model grown from what its components lack: laws are proposed with the functions of all other components there.

When several effects are missing at once, the one that explains most alone is often none of them. Here each law is weighed
beside flexible functions of all other components (:mod:`.forms`), so that it has only its own part to explain. The law
with the most evidence is then fitted in full, together with all that is there. It stays if what it takes off the missing force
on unseen blocks is more than its parameters would take by chance. What it leaves is taken apart anew.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...model import Term
from ..fitting import NOTHING, State, refit
from ..track import Track
from .forms import forms_of
from .residual import additive

__all__ = ["BANDWIDTH", "Arrival", "grown_by_parts", "middle_of"]

BANDWIDTH = 140.0
"""Of the observer [rad/s]: about 22 Hz, where most axes' friction shows and their structures don't yet ring."""

_WORTH = 5.0  # nats: odds of about 150 to one, for a law to be fitted in full
_GAIN = 10.0  # nats on unseen blocks, for it to stay: beyond what four parameters take off by chance
_PLAUSIBLE = 0.3  # probability among the laws of its component
_TRIED = 3  # laws that are fitted in full at each step
_MOST = 7  # terms: more than any axis here has had missing


@dataclass(frozen=True, eq=False)
class Arrival:
    """A term that came.

    Attributes:
        term: with the values at which it was proposed.
        before: the model without it, fitted.
        after: the model with it, fitted.
    """

    term: Term
    before: State
    after: State


def middle_of(tracks: Sequence[Track]) -> Track:
    """The one of ``tracks`` whose bandwidth is nearest to :data:`BANDWIDTH`."""
    return min(tracks, key=lambda each: abs(math.log(each.bandwidth / BANDWIDTH)))


def grown_by_parts(track: Track, begin: State, tell: Callable[[str], None]) -> list[Arrival]:
    """The terms that come to the model of ``begin``, in their order.

    Args:
        track: the recordings.
        begin: the fitted model that lacks something.
        tell: told what comes.
    """
    state = begin
    arrivals: list[Arrival] = []
    refused: set[str] = set()
    while len(arrivals) < _MOST and state.excess > NOTHING * state.floor:
        taken = additive(track, state)
        independent = taken.dependence * taken.n_rows
        offered = [
            form
            for form in forms_of(state, taken)
            if form.nats > _WORTH and form.probability >= _PLAUSIBLE and form.term.effect.key not in refused
        ]
        for form in offered[:_TRIED]:
            new = refit(track, state.fit.model.with_terms((*state.fit.model.terms, form.term)))
            if _gain(state, new, independent) > _GAIN:
                tell(f"{form.term.effect.title}: {100 * (1.0 - new.left / state.left):.0f} % of what was left")
                arrivals.append(Arrival(form.term, state, new))
                state = new
                break
            refused.add(form.term.effect.key)
        else:
            break
    return arrivals


def _gain(before: State, after: State, independent: float) -> float:
    """Logarithm of the likelihood ratio on unseen blocks [nats], of residuals whose variance each model has of its own."""
    if not np.isfinite(after.left) or after.left <= 0.0:
        return -math.inf
    return 0.5 * independent * math.log(before.left / after.left)
