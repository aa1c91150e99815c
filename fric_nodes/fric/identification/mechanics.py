"""Mass, damping and stiffness with their covariance: what parametric and forced oscillations both give."""

from __future__ import annotations

from dataclasses import dataclass

from ..record import Array

__all__ = ["Mechanics"]


@dataclass(frozen=True)
class Mechanics:
    """Mass, viscous coefficient, stiffness and Coulomb force with their covariance, in this order.

    Attributes:
        mass: [F s^2/x].
        viscous: c [F s/x].
        stiffness: k [F/x].
        coulomb: F_C [F]; NaN where it isn't asked for.
        covariance: shape ``(4, 4)``; zero for what was held.
        misfit: by how many standard errors the runs differ: their frequencies and dampings, or both parts of their dynamic
            stiffness; taken into account in the covariance where above 1.
    """

    mass: float
    viscous: float
    stiffness: float
    coulomb: float
    covariance: Array
    misfit: tuple[float, float]
