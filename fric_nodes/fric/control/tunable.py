"""What a controller declares so that it can be tuned from an identified model: gains from a basis, and its linear forms.

:mod:`fric.control.autotune` makes the basis, asks the controller for gains, and tests its linear forms in
:mod:`fric.control.loop` and its nonlinear self in simulation. A controller's file holds all that is particular to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from ..model import Model
from .loop import LinearPlant, Polynomials

__all__ = ["Basis", "Tunable"]


@dataclass(frozen=True)
class Basis:
    """What gains are made from.

    Attributes:
        model: identified. plant: its mass and damping with the timing of the loop. pid: ``proportional``, ``integral``,
        ``derivative`` and ``filter_time`` with the most integral action within the limits of
            sensitivity.
        crossover: of that loop [rad/s].
        resolution: step of the encoder [x].
        stuck: stiffness of pre-sliding [F/x]; 0: rigid friction.
        calm: how often hunting was found with less of it; 0 at first.
        accepted: whether a set of gains keeps the margins at all linear forms.
    """

    model: Model
    plant: LinearPlant
    pid: Mapping[str, float]
    crossover: float
    resolution: float
    stuck: float
    calm: int
    accepted: Callable[[Mapping[str, float]], bool] = field(repr=False)

    @property
    def dead_zone(self) -> float:
        """An error that the loop need not bring down: two steps of the encoder, four times as many after each hunting [x]."""
        return 2.0 * self.resolution * 4.0**self.calm

    @property
    def coulomb(self) -> float:
        """Friction level [F]."""
        return next((p.value for p in self.model.parameters() if p.name == "coulomb.force"), 0.0)

    def largest(self, of: Callable[[float], Mapping[str, float]], low: float, high: float, steps: int = 12) -> float:
        """Largest value (on a logarithmic scale) between ``low`` and ``high`` whose gains are accepted; ``low`` if none is."""
        if self.accepted(of(high)):
            return high
        for _ in range(steps):
            middle = math.sqrt(low * high)
            low, high = (middle, high) if self.accepted(of(middle)) else (low, middle)
        return low


@dataclass(frozen=True)
class Tunable:
    """How a controller is tuned.

    Attributes:
        gains: all parameters from a basis.
        linear: its linear forms for a period [s], the ends between which its gains move.
    """

    gains: Callable[[Basis], dict[str, float]] = field(repr=False)
    linear: Callable[[Mapping[str, float], float], Sequence[Polynomials]] = field(repr=False)
