"""Several starts for one search: the best minimum, and how the others compare with it.

A sum of squares over a free run has wrong valleys (a Stribeck velocity, a stiffness, a play), and a search ends in the nearest.
Starts are spread over the logarithms of the parameters by Latin hypercube sampling (McKay, Beckman, Conover 1979): within what
the recording can tell apart (:meth:`fric.identification.free_parameters.FreeParameters.within_reach`) where that has
two ends, else within a factor e of the first start. The searches share no data but what they read; their loops run without
Python's lock, one thread for each processor.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from scipy.stats import qmc

from ..model import Model
from ..record import Array
from ..threads import mapped
from .equations import Equations
from .free_parameters import FreeParameters

__all__ = ["End", "Ends", "best_of", "spread_starts"]

_SAME = 1.0  # standard errors: ends that are nearer to each other are one minimum
_LIKE = 0.05  # of the least cost: a minimum that is worse by less is as good
_BEHIND = 16.0  # times the least cost after a few steps: such a start is given up
_MOST = 8  # starts that are led to their end
_APART = 2.0  # standard errors between minima that contradict each other


class End(Protocol):
    """Where a search ended."""

    @property
    def model(self) -> Model:
        """With the values found."""

    @property
    def cost(self) -> float:
        """Sum of squares."""


Found = TypeVar("Found", bound=End)


@dataclass(frozen=True, eq=False)
class Ends:
    """All ends, the best one first.

    Attributes:
        names: of the free parameters.
        points: their values, shape ``(n_starts, n_free)``.
        costs: shape ``(n_starts,)``.
    """

    names: tuple[str, ...]
    points: Array
    costs: Array

    def _away(self, errors: Array) -> Array:
        """Largest distance from the best end in standard errors, ``(n_starts,)``; one without an error doesn't count."""
        known = np.isfinite(errors) & (errors > 0.0)
        distance = np.abs(self.points - self.points[0])[:, known] / errors[known]
        return np.asarray(np.max(distance, axis=1, initial=0.0), dtype=np.float64)

    def note(self, errors: Array) -> str:
        """How many starts agree, and how much worse the others are; ``errors``: standard errors, shape ``(n_free,)``."""
        together = self._away(errors) <= _SAME
        n = self.costs.shape[0]
        head = f"{int(np.sum(together))} of {n} starts ended in the same minimum"
        if np.all(together):
            return head
        worse = 100.0 * (np.sqrt(self.costs[~together] / self.costs[0]) - 1.0)
        low, high = float(np.min(worse)), float(np.max(worse))
        by = f"{low:.3g} %" if high - low < 0.01 * high else f"{low:.3g} to {high:.3g} %"
        return f"{head}; the position error of the others is larger by {by}"

    def warning(self, errors: Array) -> str | None:
        """What to say when a minimum that is as good has other values; None when there is none."""
        rival = np.flatnonzero((self._away(errors) > _APART) & (self.costs <= (1.0 + _LIKE) * self.costs[0]))
        if not rival.size:
            return None
        other = self.points[rival[0]]
        distance = np.where(errors > 0.0, np.abs(other - self.points[0]) / errors, 0.0)
        k = int(np.nanargmax(distance))
        return (
            f"another minimum explains the recording as well with {self.names[k]} {other[k]:.4g} instead of "
            f"{self.points[0, k]:.4g}: the recording does not decide between them; record motion for which they differ"
        )


def spread_starts(model: Model, free: FreeParameters, found: Equations, n: int, seed: int = 1) -> list[Model]:
    """``n`` models around ``model``, or over the reach of its free parameters."""
    if n <= 0 or not free.names:
        return []
    reach = free.within_reach(model, found)
    value = model.values[free.index]
    wide = ~free.linear & (reach.lower > np.finfo(np.float64).tiny) & np.isfinite(reach.upper)
    near = math.e * np.ones_like(value)
    low = np.where(wide, np.log(np.where(wide, reach.lower, 1.0)), -np.log(near))
    high = np.where(wide, np.log(np.where(wide, reach.upper, 1.0)), np.log(near))
    starts = []
    for share in qmc.LatinHypercube(len(free.names), seed=seed).random(n):
        drawn = np.exp(low + share * (high - low))
        values = model.values
        values[free.index] = np.clip(np.where(wide, drawn, value * drawn), reach.lower, reach.upper)
        starts.append(model.with_values(values))
    return starts


def best_of(
    briefly: Callable[[Model], Found], to_the_end: Callable[[Model], Found], starts: Sequence[Model], free: FreeParameters
) -> tuple[Found, Ends]:
    """The best end of the searches from ``starts``, and where all of them ended.

    Args:
        briefly: a search of a few steps.
        to_the_end: a search until it converges, where it isn't given up after those for being far behind.
        starts: where to begin.
        free: the parameters that are searched.
    """
    if len(starts) == 1:
        ends = [to_the_end(starts[0])]
    else:
        ends = sorted(mapped(briefly, starts), key=lambda end: end.cost)
        promising = [end for end in ends[:_MOST] if end.cost <= _BEHIND * ends[0].cost]
        ends[: len(promising)] = mapped(to_the_end, [end.model for end in promising])
        ends.sort(key=lambda end: end.cost)
    points = np.array([end.model.values[free.index] for end in ends])
    return ends[0], Ends(free.names, points, np.array([end.cost for end in ends]))
