"""One point of a reference motion, and where it leads to until the next one comes."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["ReferencePoint"]


class ReferencePoint(NamedTuple):
    """A reference: stamp [ns], position [x], velocity [x/s], acceleration [x/s^2]."""

    stamp: int
    position: float
    velocity: float
    acceleration: float

    def at(self, stamp: int, timeout: float) -> float:
        """Position wanted at ``stamp`` [ns], by constant acceleration; the last one [x] when that is ``timeout`` [s] away."""
        ahead = (stamp - self.stamp) * 1e-9
        if abs(ahead) > timeout:
            return self.position
        return self.position + ahead * (self.velocity + 0.5 * ahead * self.acceleration)
