"""Steady sliding of the asperity model by quadrature: what the simulated population is held against.

A second way to the same numbers: nothing random and no steps. At the speed v an asperity of height y sticks until t_1, where v
t_1 = l(t_1), l its extension at the limit; it slips over its wave w until t_2, where v t_2 = l(t_2) + w. The work of one
contact over the mean way from one contact to the next, averaged over waves and heights, is the mean force. Normalised as in
Sec. 7 of Al-Bender et al. 2004, with mu* = 1 + (M - 1)(1 - exp(-t)), waves uniform in [0, 2] and heights uniform in [0, 2].
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..record import Array

__all__ = ["Steady", "plateau", "steady"]


class Steady(NamedTuple):
    """Means while sliding steadily.

    Attributes:
        force: F_t*.
        load: F_n*.
        touching: share of the asperities in contact.
    """

    force: float
    load: float
    touching: float


def _root(lead: Callable[[Array], Array], like: Array) -> Array:
    """Where the rising function ``lead`` of time is zero, element by element, by bisection."""
    low, high = np.zeros_like(like), np.ones_like(like)
    while np.any(lead(high) < 0.0):
        high *= 2.0
    for _ in range(70):
        middle = 0.5 * (low + high)
        below = lead(middle) < 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


def steady(
    speed: float,
    stiffness: float,
    growth: float = 5.0,
    gap: float = 1.0,
    reach: float = 0.0,
    mass: float = 0.0,
    points: int = 240,
) -> Steady:
    """Steady sliding at the normalised ``speed`` v*, with k_t* = ``stiffness``."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    heights, share = 1.0 + nodes[:, None], 0.5 * weights
    # A kink where the gap just takes up what the spring is stretched by: many points, the most where waves are short.
    s = (np.arange(points) + 0.5) / points
    waves, density = 2.0 * s[None, :] ** 2, 2.0 * s / points
    rise = growth - 1.0

    def limit(t: Array) -> Array:
        return np.asarray(heights / stiffness * (1.0 + rise * (1.0 - np.exp(-t))))

    slips = _root(lambda t: speed * t - limit(t), heights)
    loses = _root(lambda t: speed * t - limit(t) - waves, heights + waves)
    sliding = growth * (loses - slips) - rise * (np.exp(-slips) - np.exp(-loses))
    work = 0.5 * stiffness * (speed * slips) ** 2 + heights * speed * sliding + 0.5 * mass * speed**2
    contact = speed * loses
    carried = heights * (np.minimum(contact, (1.0 + reach) * waves) if reach else waves)
    period = np.maximum((1.0 + gap) * waves, contact) @ density

    def mean(amount: Array) -> float:
        return float(share @ ((amount @ density) / period))

    return Steady((1.0 + gap) * mean(work), (1.0 + gap) * mean(carried), mean(contact))


def plateau(stiffness: float, growth: float = 5.0, gap: float = 1.0) -> float:
    """F_t* while every contact is old before it slips, k_t* = ``stiffness``: closed, for stiffness above growth/gap."""
    s = growth / stiffness
    # Mean over y in [0, 2] of y (1 + s y/2) / (1 + (s y)^2/(4 alpha (1 + alpha))), <y^2> = 4/3, <y^3> = 2, <y^4> = 16/5.
    short = s * s / (4.0 * gap * (1.0 + gap))
    return growth * (1.0 + 2.0 / 3.0 * s - 2.0 * short - 1.6 * s * short)
