"""Counting how often intervals hold the truth, over simulated experiments that have one seed each.

A trial simulates one experiment from its seed, identifies it and hands back what it found less the truth. An interval of 90 %
that is what it says holds the truth in nine of ten trials; over n trials that share scatters by sqrt(0.09/n), 0.02 with 200.
Bias and spread over the standard error say which of the two is at fault where it doesn't: 0 and 1 are right.
"""

from __future__ import annotations

import math
import multiprocessing
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from scipy.special import ndtri

from ..figure import Figure
from ..identification.calibration import Calibration
from ..identification.result import Identification, IdentificationError
from ..record import Array, Record
from ..threads import alone

__all__ = ["SEEDS", "Change", "Finding", "Listener", "as_it_is", "count", "figures_of", "of_model", "over_interval", "unheard"]

SEEDS = range(20_000, 20_200)
"""Of the full counts; none of these experiments was looked at while the methods were made."""

_PROCESSES = 2
_NINETY = float(ndtri(0.95))
_LOW, _HIGH = 0.85, 0.95  # share of the intervals of 90 % that should hold the truth

Finding = Mapping[str, tuple[float, float]]
"""By name, the estimate less the truth, and the standard error."""

Change = Callable[[Record], Record]
"""Made to a recording before it is fitted."""

Listener = Callable[[Identification], None]
"""Is given what a trial identified."""


def as_it_is(record: Record) -> Record:
    """``record``."""
    return record


def unheard(_: Identification) -> None:
    """Nothing is done with what was identified."""


def over_interval(estimate: float, truth: float, half_width: float) -> tuple[float, float]:
    """A finding from an interval of 90 % of this half width, which may be another than a normal distribution's."""
    return estimate - truth, half_width / _NINETY


def of_model(found: Identification, truth: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Parameters of the model in ``found`` with their standard errors; NaN where there is none."""
    errors = found.model.standard_errors
    return {name: (found.model.value(name) - value, errors.get(name, math.nan)) for name, value in truth.items()}


class _Guarded:
    """A trial that gives None where the recording is refused; a class, so that other processes can have it."""

    def __init__(self, trial: Callable[[int], Finding]) -> None:
        self.trial = trial

    def __call__(self, seed: int) -> Finding | None:
        try:
            return self.trial(seed)
        except IdentificationError:
            return None


def count(trial: Callable[[int], Finding], seeds: Sequence[int], n_processes: int = _PROCESSES) -> tuple[Calibration, int]:
    """Run ``trial`` for each seed.

    Args:
        trial: from a seed to what was found; all give the same names.
        seeds: one experiment each.
        n_processes: that share the work; 1: this one.

    Returns:
        Errors (the truth is 0), and how many recordings were refused, which count neither way.
    """
    guarded = _Guarded(trial)
    if n_processes == 1:
        rows = [guarded(seed) for seed in seeds]
    else:
        with ProcessPoolExecutor(n_processes, multiprocessing.get_context("spawn"), initializer=alone) as pool:
            rows = list(pool.map(guarded, seeds, chunksize=4))
    kept = [row for row in rows if row is not None]
    if not kept:
        raise IdentificationError("calibration", f"all {len(rows)} recordings were refused", "look at one of them")
    names = tuple(kept[0])

    def column(k: int) -> Array:
        return np.array([[row[name][k] for name in names] for row in kept])

    return Calibration(names, np.zeros(len(names)), column(0), column(1)), len(rows) - len(kept)


def figures_of(title: str, found: Calibration, refused: int = 0) -> list[Figure]:
    """Coverage of all intervals together, and coverage, bias and spread of each quantity.

    The goals are those of all together. The share of a single quantity is known to two standard deviations of that count:
    it misses them where it lies farther out.
    """
    n = found.estimates.shape[0]
    chance = 2.0 * math.sqrt(0.9 * 0.1 / n)
    covered = found.coverage(0.9)
    figures = [
        Figure(f"{title}: all together, 90 % intervals that hold the truth", float(np.mean(covered)), "1", f">= {_LOW}"),
        Figure(f"{title}: all together, the same", float(np.mean(covered)), "1", f"<= {_HIGH}"),
    ]
    # Each error over its own standard error: the experiments aren't equally long.
    score = (found.estimates - found.truth) / found.errors
    bias, spread = np.nanmean(score, axis=0), np.nanstd(score, axis=0, ddof=1)
    for name, share, off, wide in zip(found.names, covered.tolist(), bias.tolist(), spread.tolist(), strict=True):
        figures += [
            Figure(f"{title}: {name}, 90 % intervals that hold the truth", share, "1", f">= {_LOW - chance:.3g}"),
            Figure(f"{title}: {name}, the same", share, "1", f"<= {min(_HIGH + chance, 1.0):.3g}"),
            Figure(f"{title}: {name}, mean error over standard error", off, "1"),
            Figure(f"{title}: {name}, spread over standard error", wide, "1"),
        ]
    return [*figures, Figure(f"{title}: recordings refused", float(refused), "")]
