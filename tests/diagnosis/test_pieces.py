"""Pieces of time, against all partitions that there are and against steps at places that no grid has."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from fric.diagnosis.pieces import amplitudes_of, in_pieces, partition


def _cost(signal: np.ndarray, target: np.ndarray, edges: tuple[int, ...], price: float) -> float:
    """What the pieces leave of the target, each with an amplitude of its own, and what they cost."""
    total = 0.0
    for first, last in itertools.pairwise((*edges, signal.shape[0])):
        own, wanted = signal[first:last, None], target[first:last]
        amplitude = np.linalg.lstsq(own, wanted, rcond=None)[0]
        total += float(np.sum((wanted - own @ amplitude) ** 2)) + price
    return total


@pytest.mark.parametrize("shortest", [1, 2, 3])
@pytest.mark.parametrize("seed", range(8))
def test_no_other_partition_is_cheaper(seed: int, shortest: int) -> None:
    random = np.random.default_rng(seed)
    n, price = 10, 0.7
    signal = random.standard_normal(n) * (random.random(n) > 0.2)
    target = signal * np.where(np.arange(n) < random.integers(2, 8), 1.0, -0.5) + 0.5 * random.standard_normal(n)
    least, best = np.inf, (0,)
    for k in range(n):
        for inner in itertools.combinations(range(1, n), k):
            edges = (0, *inner)
            if min(np.diff([*edges, n])) >= shortest and _cost(signal, target, edges, price) < least - 1e-6:
                least, best = _cost(signal, target, edges, price), edges
    found = tuple(partition(signal**2, signal * target, price, shortest).tolist())
    assert found[0] == 0
    assert min(np.diff([*found, n])) >= shortest
    assert _cost(signal, target, found, price) == pytest.approx(_cost(signal, target, best, price), abs=1e-6)


def test_a_piece_shorter_than_the_shortest_is_the_whole() -> None:
    assert partition(np.ones(3), np.ones(3), 0.1, 5).tolist() == [0]


def test_edges_are_found_where_they_are_beside_what_always_acts() -> None:
    random = np.random.default_rng(3)
    time = [0.004 * np.arange(2500), 100.0 + 0.004 * np.arange(1500)]
    t = np.concatenate(time)
    column, always = np.sin(7.0 * t) + 0.3 * np.sin(31.0 * t), np.cos(3.0 * t)[:, None]
    steps = ((t > 2.37) & (t < 3.11)) | ((t > 6.83) & (t < 9.49)) | ((t > 101.27) & (t < 103.61))
    target = column * (1.0 + 0.8 * steps) + 2.0 * always[:, 0] + 0.2 * random.standard_normal(t.shape)
    columns, n = in_pieces(column, time, always, target, 0.25 * float(np.sum(target**2)), 400.0, 0.25)
    # Five pieces in the first recording and three in the second, and the edges between them.
    assert columns.shape == (4000, 8)
    assert n == 8 + 4 + 2
    amplitude = amplitudes_of(np.concatenate([always, columns], axis=1), target)
    assert amplitude[0] == pytest.approx(2.0, abs=0.02)
    assert amplitude[1:] == pytest.approx([1.0, 1.8, 1.0, 1.8, 1.0, 1.0, 1.8, 1.0], abs=0.1)
    began = [t[np.flatnonzero(each)[0]] for each in columns.T]
    assert [began[k] for k in (1, 2, 3, 4, 6, 7)] == pytest.approx([2.37, 3.11, 6.83, 9.49, 101.27, 103.61], abs=0.1)


def test_nothing_that_changes_is_one_piece() -> None:
    random = np.random.default_rng(4)
    time = [0.004 * np.arange(3000)]
    column = np.sin(7.0 * time[0])
    target = 1.5 * column + 0.5 * random.standard_normal(3000)
    columns, n = in_pieces(column, time, np.zeros((3000, 0)), target, 0.3 * float(np.sum(target**2)), 1500.0, 0.25)
    assert columns.shape[1] == n == 1
    assert columns[:, 0] == pytest.approx(column)
