"""Evidence for each term of a fitted model where flexible functions of all components but its own are there.

The missing force without the term, everything else fitted anew, is explained by these functions alone, or by them and the
term. What they explain as well is no evidence for it, and what they explain of the rest is no noise that it has to stand out
from. Everything else is fitted in full: of a term that other terms nearly do as well, little is its own, and less than what a
first-order change of the others is wrong by.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ...record import Array
from ..candidates import scales_of
from ..fitting import State, bounds_of, free_names, without_place
from ..indifference import indifference
from ..least_squares import FROM_NEAR, Fit
from ..track import Track
from .components import COMPONENTS
from .evidence import Grouped
from .residual import ALIKE, functions_of, independent_share

__all__ = ["Asked"]

_TERM = "term"  # name of a group


class Asked:
    """What asks for the terms of a fitted model.

    Args:
        track: the recordings.
        state: the fitted model.
    """

    def __init__(self, track: Track, state: State) -> None:
        self._track, self._state = track, state
        self._withouts: dict[int, Fit] = {}
        self._indifferent: dict[int, float] = {}

    @cached_property
    def _functions(self) -> tuple[dict[str, Array], slice]:
        groups, rows, _ = functions_of(self._track, self._state.fit.model)
        return groups, rows

    def _functions_without(self, place: int) -> tuple[dict[str, Array], slice]:
        """The functions, those of the force along the motion without the term number ``place``, and their rows."""
        groups, rows = self._functions
        of_force = [each for each in COMPONENTS if each.of_force]
        return {**groups, **functions_of(self._track, self.without(place).model, of_force)[0]}, rows

    def without(self, place: int) -> Fit:
        """The model without its term number ``place``, everything else fitted anew."""
        if place not in self._withouts:
            model = without_place(self._state.fit.model, place)
            bounds = bounds_of(model, scales_of(self._track))
            self._withouts[place] = self._track.fit(model, free_names(model), FROM_NEAR, bounds)
        return self._withouts[place]

    def nats(self, place: int) -> float:
        """Evidence for the term number ``place`` of the model, the dependence of the rows counted [nats]."""
        fit = self._state.fit
        without, (groups, rows) = self.without(place), self._functions_without(place)
        change = (without.residual - fit.residual)[rows, None]
        size = float(np.sqrt(np.mean(change**2)))
        if size == 0.0:
            return 0.0
        grouped = Grouped(without.residual[rows], without.jacobian[rows], {**groups, _TERM: change / size})
        likeness = {name: grouped.likeness(_TERM, name) for name in groups}
        own = max(likeness, key=lambda name: likeness[name])
        beside = [name for name in groups if name != own or likeness[name] < ALIKE]
        before = grouped.weighed(beside)
        start = dict(zip(before.groups, before.sizes, strict=True))
        after = grouped.weighed([*beside, _TERM], start, float(np.log(before.noise / grouped.size)))
        share = independent_share(grouped.residual(after))
        return float(share * (after.log_evidence - before.log_evidence - grouped.n * self.indifferent(place)))

    def indifferent(self, place: int) -> float:
        """By how much less the model minds the effort for its term number ``place`` [nats per value], below 0 for more."""
        if place not in self._indifferent:
            self._indifferent[place] = self._own - indifference(self._track, self.without(place).model)
        return self._indifferent[place]

    @cached_property
    def _own(self) -> float:
        return indifference(self._track, self._state.fit.model)
