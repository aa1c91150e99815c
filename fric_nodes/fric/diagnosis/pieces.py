"""What changes with time in steps: from when to when it is how large, with the edges where the data put them.

A grid of spans cuts where it happens to cut: a drop that begins within a span is smeared over it, and friction and an actuator,
which differ by what they do to the force within milliseconds of the edge, look alike.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from ..record import Array

__all__ = ["amplitudes_of", "in_pieces", "partition"]

_FINE = 0.02  # [s], from one place at which an edge may be to the next,
_MOST = 3000  # of which a recording has no more
_ROUNDS = 3  # in which the pieces and the amplitudes of all else are found in turn


def amplitudes_of(columns: Array, target: Array) -> Array:
    """Amplitudes of the ``columns``, shape ``(n, m)``, that leave least of ``target``; zero for a column of nothing."""
    size = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(size > 0.0, size, 1.0)
    normal = scaled.T @ scaled + 1e-9 * np.eye(columns.shape[1])
    return np.asarray(np.linalg.solve(normal, scaled.T @ target) / np.where(size > 0.0, size, np.inf))


def partition(square: Array, product: Array, price: float, shortest: int) -> Array:
    """Where the pieces begin within which one amplitude each leaves least, shape ``(n_pieces,)``.

    The amplitude times a signal is to be a target; each piece costs a price. All partitions are compared, by dynamic
    programming over the last edge (Jackson et al., An algorithm for optimal partitioning of data on an interval, 2005).

    The package ruptures (``Pelt`` with its linear cost) has the same criterion and found the same edges where both were tried.
    But it takes rows in place of sums and solves a least-squares problem for each segment that it tries: 59 s for 3000 places
    with two edges, for which this takes 0.03 s.

    Args:
        square: the signal's own energy in each place, shape ``(n,)``.
        product: sum of signal times target there.
        price: of a piece, in units of the target's energy.
        shortest: places that a piece has at least; fewer are one piece.
    """
    n = square.shape[0]
    energy, common = (np.concatenate([[0.0], np.cumsum(each)]) for each in (square, product))
    least = 1e-9 * max(float(energy[-1]), 1e-300) / n  # where the signal rests any amplitude will do
    best, before = np.full(n + 1, np.inf), np.zeros(n + 1, dtype=np.int64)
    best[0] = 0.0
    for end in range(min(shortest, n), n + 1):
        begins = max(end - shortest, 0) + 1
        told = (common[end] - common[:begins]) ** 2 / (energy[end] - energy[:begins] + least)
        cost = best[:begins] - told + price
        before[end] = np.argmin(cost)
        best[end] = cost[before[end]]
    edges, at = [], n
    while at > 0:
        at = int(before[at])
        edges.append(at)
    return np.array(edges[::-1], dtype=np.int64)


def in_pieces(
    column: Array, time: Sequence[Array], beside: Array, target: Array, left: float, independent: float, shortest: float
) -> tuple[Array, int]:
    """Columns that are ``column`` within a piece of time and zero outside, and how many numbers they have to choose.

    A piece costs its amplitude and its edge, by Schwarz's criterion.

    Args:
        column: what acts, were it always as large, shape ``(n,)``.
        time: of each row [s], an array per run; a piece doesn't go on from one to the next.
        beside: columns that always are as large, shape ``(n, m)``.
        target: what all together are to explain, shape ``(n,)``.
        left: sum of squares that is thought to be left of it in the end.
        independent: numbers that the target holds.
        shortest: length of a piece [s].
    """
    time = [each for each in time if each.shape[0]]
    starts = np.cumsum([0, *(each.shape[0] for each in time)])
    runs = [slice(int(first), int(last)) for first, last in itertools.pairwise(starts)]
    fine = [max(_FINE, float(np.ptp(each)) / _MOST) for each in time]
    places = [((each - each[0]) / step).astype(np.int64) for each, step in zip(time, fine, strict=True)]
    wanted, columns = target, np.zeros((target.shape[0], 0))
    for _ in range(_ROUNDS):
        price = 2.0 * math.log(independent) * left / independent
        within: list[Array] = []
        for run, place, step in zip(runs, places, fine, strict=True):
            own = column[run]
            square, product = (np.bincount(place, each).astype(np.float64) for each in (own * own, own * wanted[run]))
            edges = partition(square, product, price, max(int(shortest / step), 1))
            piece = np.searchsorted(edges, place, side="right") - 1
            for k in range(edges.shape[0]):
                within.append(np.zeros_like(column))
                within[-1][run] = np.where(piece == k, own, 0.0)
        columns = np.stack(within, axis=1)
        together = np.concatenate([beside, columns], axis=1)
        amplitudes = amplitudes_of(together, target)
        wanted = target - beside @ amplitudes[: beside.shape[1]]
        left = float(np.sum((target - together @ amplitudes) ** 2))
    return columns, 2 * columns.shape[1] - len(runs)
