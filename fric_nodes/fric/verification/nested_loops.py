"""A displacement along an outer loop with inner loops on its last rising branch, to measure return-point memory by.

Up, down, up, down to the lower tip, then up again; on the way up it turns back for each inner loop. Once that has closed, a law
with a memory of its reversal points is back on the outer curve.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..record import Array

__all__ = ["NestedLoops"]


@dataclass(frozen=True)
class NestedLoops:
    """Where the displacement turns, in whole steps.

    Attributes:
        tip: amplitude of the outer loop.
        inner: where each inner loop begins on the last rising branch, and how far back it goes.
    """

    tip: int
    inner: tuple[tuple[int, int], ...]

    def path(self, inner: bool = True) -> Array:
        """Positions [steps], with or without the inner loops."""
        corners = [0, self.tip, -self.tip, self.tip, -self.tip]
        for begin, back in self.inner if inner else ():
            corners += [begin, back, begin]
        corners.append(self.tip)
        parts = [np.arange(a, b, 1 if b > a else -1) for a, b in pairwise(corners)]
        return np.concatenate([*parts, [self.tip]]).astype(np.float64)

    def deviations(self, plain: Array, looped: Array) -> list[float]:
        """Largest deviation from the outer curve after each inner loop [F].

        Args:
            plain: force over each step of the path without inner loops.
            looped: the same with them.
        """
        rising = plain[-2 * self.tip :]  # the last branch, one step after the other from the lower tip
        found = []
        n = looped.shape[0]
        for number, (begin, _) in enumerate(self.inner):
            end = self.inner[number + 1][0] if number + 1 < len(self.inner) else self.tip
            # From behind, the way from where the loop closes to where the next one begins.
            later = sum(2 * (first - back) for first, back in self.inner[number + 1 :])
            first = n - (self.tip - begin) - later
            part = looped[first : first + end - begin]
            found.append(float(np.max(np.abs(part - rising[begin + self.tip : end + self.tip]))))
        return found
