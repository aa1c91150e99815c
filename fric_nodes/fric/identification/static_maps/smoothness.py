"""Whether what a friction curve leaves is scatter from run to run, or depends on the speed.

Scatter is independent of the speed and of its neighbours. Two statistics of the weighted residuals r, per direction in order
of speed:

    R = sum (r_{k+1} - r_k)^2      (von Neumann's ratio, but for the variance): small where neighbours are alike;
    P = |sum r_k(+v) r_k(-v)|       large where both directions are alike, or opposite, at one speed.

Their distribution without structure is drawn by exchanging the runs of each direction, so that nothing is assumed of that of
the scatter. A curve that leaves such a residual has another shape than the law, in the range of speeds where it sits: what a
larger tau beside the errors would hide.

Source: von Neumann 1941; permutation null as in Good, Permutation, Parametric and Bootstrap Tests of Hypotheses, 2005.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...record import Array

__all__ = ["Structure", "structure_of"]

_DRAWS = 1999
_SIGNIFICANT = 0.005  # for each of the two: a hundredth for both
_SAME_SPEED = 0.1
_FEWEST = 4
_ENERGY = 0.8  # of what is left, by the range of speeds named


class Structure(NamedTuple):
    """What is left of a curve's points.

    Attributes:
        why: in what way it hangs on the speed; empty where it may be scatter.
        low: slowest speed of the range that holds most of it [x/s].
        high: fastest [x/s].
    """

    why: str
    low: float
    high: float


def structure_of(velocity: Array, left: Array, error: Array) -> Structure:
    """How residuals hang on the speed.

    Args:
        velocity: of the points [x/s], shape ``(n,)``.
        left: what a curve leaves of their forces [F], shape ``(n,)``.
        error: standard errors of the forces [F], shape ``(n,)``.
    """
    rng = np.random.default_rng(1)
    white = left / np.sqrt(error**2 + float(np.var(left)))
    speed = np.abs(velocity)
    ways = [np.flatnonzero(way)[np.argsort(speed[way])] for way in (velocity > 0.0, velocity < 0.0)]
    pairs = [(k, j) for k in ways[0] for j in ways[1] if abs(speed[j] - speed[k]) < _SAME_SPEED * speed[k]]
    ahead, back = (np.array([pair[side] for pair in pairs], dtype=np.int64) for side in (0, 1))

    # The points as they are, and then every draw, one a row.
    values = np.tile(white, (1 + _DRAWS, 1))
    for way in ways:
        values[1:, way] = rng.permuted(np.tile(white[way], (_DRAWS, 1)), axis=1)
    rough = np.sum([np.sum(np.diff(values[:, way], axis=1) ** 2, axis=1) for way in ways], axis=0)
    mirrored = -np.abs(np.sum(values[:, ahead] * values[:, back], axis=1))
    # The points count among their own draws.
    by_chance = [float(np.mean(each <= each[0])) for each in (rough, mirrored)]
    low, high = _range(speed, left**2)
    if by_chance[0] < _SIGNIFICANT:
        return Structure("residuals at neighbouring speeds are alike", low, high)
    if len(pairs) >= _FEWEST and by_chance[1] < _SIGNIFICANT:
        return Structure("residuals at one speed are correlated between both directions", low, high)
    return Structure("", low, high)


def _range(speed: Array, energy: Array) -> tuple[float, float]:
    """The range of speeds, shortest by ratio, that holds most of ``energy``."""
    levels, total = np.sort(speed).tolist(), float(np.sum(energy))
    ranges = [
        (high / low, low, high)
        for k, low in enumerate(levels)
        for high in levels[k:]
        if float(np.sum(energy[(speed >= low) & (speed <= high)])) >= _ENERGY * total
    ]
    _, low, high = min(ranges, default=(1.0, levels[0], levels[-1]))
    return low, high
