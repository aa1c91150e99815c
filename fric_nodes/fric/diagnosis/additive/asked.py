"""Evidence for each term of a fitted model where flexible functions of all components but its own are there.

The missing force without the term, everything else fitted anew, is explained by these functions alone, or by them and the
term. What they explain as well is no evidence for it, and what they explain of the rest is no noise that it has to stand out
from. Everything else is fitted in full: of a term that other terms nearly do as well, little is its own, and less than what a
first-order change of the others is wrong by.
"""

from __future__ import annotations

import numpy as np

from ..fitting import State, refit, without_place
from ..track import Track
from .evidence import Grouped
from .residual import ALIKE, functions_of, independent_share

__all__ = ["Asked"]

_TERM = "term"  # name of a group
_ITERATIONS = 8  # numerical: from where everything fits


class Asked:
    """What asks for the terms of a fitted model.

    Args:
        track: the recordings.
        state: the fitted model.
    """

    def __init__(self, track: Track, state: State) -> None:
        self._track, self._state = track, state
        self._groups, self._rows, _ = functions_of(track, state)

    def nats(self, place: int) -> float:
        """Evidence for the term number ``place`` of the model, the dependence of the rows counted [nats]."""
        fit = self._state.fit
        without = refit(self._track, without_place(fit.model, place), _ITERATIONS).fit
        change = (without.residual - fit.residual)[self._rows, None]
        size = float(np.sqrt(np.mean(change**2)))
        if size == 0.0:
            return 0.0
        grouped = Grouped(without.residual[self._rows], without.jacobian[self._rows], {**self._groups, _TERM: change / size})
        likeness = {name: grouped.likeness(_TERM, name) for name in self._groups}
        own = max(likeness, key=lambda name: likeness[name])
        beside = [name for name in self._groups if name != own or likeness[name] < ALIKE]
        before = grouped.weighed(beside)
        start = dict(zip(before.groups, before.sizes, strict=True))
        after = grouped.weighed([*beside, _TERM], start, float(np.log(before.noise / grouped.size)))
        return independent_share(grouped.residual(after)) * (after.log_evidence - before.log_evidence)
