"""How many cells, whether both branches and both directions differ: by what is predicted of blocks that were not used.

Samples are sorted into cells of equal width in speed, and mean speed and mean friction of each make a grid point (Model D). Few
wide cells smooth the curve, many narrow ones follow the noise. Every fourth block is held out in turn; each candidate is filled
from the others and judged by its squared error on these. Of all candidates that aren't worse than the best by more than a
standard error (of the difference, over the blocks) the one with the fewest grid points is taken, first among those that make
branches and directions one.

A grid point's standard error is that of a mean over blocks: within a slip or stroke errors go together, so it is the sums over
whole blocks that are independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy import stats

from ...record import Array, Mask
from .samples import Samples

__all__ = ["Branch", "Candidate", "Trial", "branches_of", "choose", "edges_of"]

_CELLS = (3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
_FOLDS = 4
_LEAST_COUNT = 3
_LEAST_POINTS = 2


@dataclass(frozen=True)
class Candidate:
    """One way to make the grid.

    Attributes:
        cells: in speed, from 0 to the largest.
        hysteresis: speeding up and slowing down have a branch each.
        directions: forward and backward have branches of their own.
    """

    cells: int
    hysteresis: bool
    directions: bool

    @property
    def text(self) -> str:
        """For tables."""
        parts = ["a branch each for speeding up and slowing down" if self.hysteresis else "one branch"]
        parts += ["each direction by itself"] if self.directions else []
        return f"{self.cells} cells, {', '.join(parts)}"


@dataclass(frozen=True, eq=False)
class Branch:
    """The grid points of one branch in one direction; arrays of shape ``(n,)``.

    Attributes:
        speeding_up: None where both branches are one.
        side: 1 or -1; 0 where both directions are one.
        speed: mean [x/s].
        force: mean, against the motion [F].
        error: its standard error [F]; NaN where a single block has samples.
        blocks: how many blocks have samples.
    """

    speeding_up: bool | None
    side: float
    speed: Array
    force: Array
    error: Array
    blocks: Array

    def half_width(self, level: float = 0.95) -> Array:
        """Half the confidence interval of each force [F], shape ``(n,)``."""
        quantile = stats.t.ppf(0.5 + 0.5 * level, np.maximum(self.blocks - 1, 1))
        return np.asarray(quantile * self.error, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Trial:
    """One candidate: mean squared error on blocks held out [F^2], shape ``(n_blocks,)``, and its number of grid points."""

    candidate: Candidate
    block_errors: Array
    n_points: int

    @property
    def error(self) -> float:
        """Root mean square over the blocks [F]."""
        return float(np.sqrt(np.mean(self.block_errors)))


def edges_of(largest: float, cells: int) -> Array:
    """Edges of the cells [x/s], shape ``(cells + 1,)``."""
    return np.linspace(0.0, largest, cells + 1)


def _masks(samples: Samples, candidate: Candidate) -> list[tuple[bool | None, float, Mask]]:
    """Branch, direction and samples of each curve of ``candidate``."""
    everything = np.ones(samples.velocity.shape[0], dtype=np.bool_)
    up = samples.speeding_up
    branches = ((True, up), (False, ~up)) if candidate.hysteresis else ((None, everything),)
    sides = ((1.0, samples.velocity > 0), (-1.0, samples.velocity < 0)) if candidate.directions else ((0.0, everything),)
    return [(name, side, own & there) for (name, own), (side, there) in product(branches, sides)]


def branches_of(samples: Samples, candidate: Candidate, largest: float) -> list[Branch] | None:
    """The grid points of ``candidate`` from ``samples``; None where a branch has too few."""
    edges = edges_of(largest, candidate.cells)
    found = []
    for name, side, own in _masks(samples, candidate):
        speed = np.abs(samples.velocity[own])
        force = np.sign(samples.velocity[own]) * samples.friction[own]
        cell = np.clip(np.searchsorted(edges, speed, side="right") - 1, 0, candidate.cells - 1)
        count = np.bincount(cell, minlength=candidate.cells)
        held = np.flatnonzero(count >= _LEAST_COUNT)
        if held.shape[0] < _LEAST_POINTS:
            return None
        means = [np.bincount(cell, weights=x, minlength=candidate.cells) / np.maximum(count, 1) for x in (speed, force)]
        n_blocks = int(samples.block.max()) + 1
        key = cell * n_blocks + samples.block[own]
        # Along the cell friction changes with speed: that isn't an error of its mean.
        left = force - np.interp(speed, means[0][held], means[1][held])
        sums = np.bincount(key, weights=left, minlength=candidate.cells * n_blocks).reshape(candidate.cells, n_blocks)
        there = np.bincount(key, minlength=candidate.cells * n_blocks).reshape(candidate.cells, n_blocks) > 0
        blocks = there.sum(axis=1)
        sums = sums - there * (sums.sum(axis=1) / np.maximum(blocks, 1))[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            variance = np.sum(sums**2, axis=1) * blocks / (blocks - 1.0) / count**2
        error = np.sqrt(np.where(blocks > 1, variance, np.nan))
        found.append(Branch(name, side, means[0][held], means[1][held], error[held], blocks[held].astype(np.float64)))
    return found


def _predicted(samples: Samples, candidate: Candidate, branches: Sequence[Branch]) -> Array:
    """Friction of every sample [F], shape ``(n,)``."""
    force = np.empty(samples.velocity.shape[0])
    for branch, (_, _, own) in zip(branches, _masks(samples, candidate), strict=True):
        v = samples.velocity[own]
        force[own] = np.sign(v) * np.interp(np.abs(v), branch.speed, branch.force)
    return force


def _tried(samples: Samples, candidate: Candidate, largest: float) -> Trial | None:
    whole = branches_of(samples, candidate, largest)
    if whole is None:
        return None
    names = np.unique(samples.block)
    folds = min(_FOLDS, names.shape[0])
    fold_of = np.zeros(int(names.max()) + 1, dtype=np.int64)
    fold_of[names] = np.arange(names.shape[0]) % folds
    fold = fold_of[samples.block]
    error = np.empty(samples.velocity.shape[0])
    for number in range(folds):
        held = fold == number
        branches = branches_of(samples.only(~held), candidate, largest)
        if branches is None:
            return None
        judged = samples.only(held)
        error[held] = (judged.friction - _predicted(judged, candidate, branches)) ** 2
    count = np.bincount(samples.block)[names]
    errors = np.bincount(samples.block, weights=error)[names] / count
    return Trial(candidate, errors, sum(branch.speed.shape[0] for branch in whole))


def _as_good(trial: Trial, best: Trial) -> bool:
    more = trial.block_errors - best.block_errors
    return float(np.mean(more)) <= float(np.std(more, ddof=1) / np.sqrt(more.shape[0]))


def choose(samples: Samples, largest: float) -> tuple[Trial, tuple[Trial, ...]]:
    """The trial to take, and all that were possible, best first; empty when none was."""
    both = bool(np.any(samples.velocity > 0) and np.any(samples.velocity < 0))
    tried = (
        _tried(samples, Candidate(cells, hysteresis, directions), largest)
        for cells, hysteresis, directions in product(_CELLS, (False, True), (False, True) if both else (False,))
    )
    trials = sorted((trial for trial in tried if trial is not None), key=lambda trial: trial.error)
    if not trials:
        raise ValueError("no candidate has two grid points in each of its branches")
    good = [trial for trial in trials if trial is trials[0] or _as_good(trial, trials[0])]
    chosen = min(good, key=lambda t: (t.candidate.hysteresis + t.candidate.directions, t.n_points))
    return chosen, tuple(trials)
