"""The outer half of Eq. 18: thresholds by an evolutionary search, then by Nelder-Mead from its best regions.

The cost has many minima (thresholds may swap, coincide, or lie where no swing of the recording ends), so that the first stage
looks for regions and the second goes down into them. The paper's genetic algorithm is a differential evolution here (Storn and
Price 1997, scipy): it needs no coding of numbers into genes. Thresholds range over decades, so the search runs in their
logarithm; and since their order means nothing, the population starts sorted and every trial is sorted before it is evaluated.

Source: Amthor et al. 2008, section 3.1; Rizos and Fassois 2005.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import optimize

from ...record import Array
from .cost import Cost

__all__ = ["Found", "search"]

_POPULATION = 8  # per threshold
_LEAST_POPULATION = 24
_GENERATIONS = 120
_REGIONS = 2  # that the second stage goes down into
_APART = 0.1  # of a natural logarithm: members that are closer share a region
_PER_THRESHOLD = 150  # evaluations of the second stage, per threshold and region


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found.

    Attributes:
        thresholds: ascending [x], shape ``(M,)``.
        noe: there, over the rows of the cost [%].
        first_stage: NOE after the evolutionary stage [%].
        evaluations: of the cost, both stages together.
        spread: NOE of each region's minimum [%], best first.
    """

    thresholds: Array
    noe: float
    first_stage: float
    evaluations: int
    spread: tuple[float, ...]


def search(cost: Cost, lowest: float, highest: float, seed: int = 0, known: Array | None = None) -> Found:
    """Thresholds between ``lowest`` and ``highest`` [x] with the least ``cost``.

    Args:
        cost: what to minimise.
        lowest: smallest threshold.
        highest: largest threshold.
        seed: of the first stage.
        known: thresholds that are good for a similar cost, shape ``(M,)``; None: none are known.
    """
    n_springs = cost.order[0]
    before = cost.evaluations
    if n_springs == 0:
        return Found(np.zeros(0), cost(np.zeros(0)), cost(np.zeros(0)), 2, ())
    low, high = np.log(lowest), np.log(highest)
    rng = np.random.default_rng(seed)

    def thresholds(points: Array) -> Array:
        return np.sort(np.exp(np.clip(points, low, high)), axis=-1)

    # One evenly spread, the rest at random, all sorted.
    n_population = max(_POPULATION * n_springs, _LEAST_POPULATION)
    population = np.sort(rng.uniform(low, high, (n_population, n_springs)), axis=1)
    population[0] = low + (high - low) * (np.arange(n_springs) + 0.5) / n_springs
    if known is not None:
        population[1] = np.clip(np.sort(np.log(known)), low, high)
    first = optimize.differential_evolution(
        lambda points: cost.many(thresholds(points.T)),
        [(low, high)] * n_springs,
        init=population,
        maxiter=_GENERATIONS,
        tol=1e-3,
        mutation=(0.4, 0.9),
        recombination=0.8,
        polish=False,
        updating="deferred",
        vectorized=True,
        seed=rng,
    )
    minima = []
    for start in _regions(np.asarray(first.population), np.asarray(first.population_energies)):
        simplex = np.vstack([start, start + 0.05 * np.eye(n_springs)])
        second = optimize.minimize(
            lambda point: cost(thresholds(point)),
            start,
            method="Nelder-Mead",
            options={
                "initial_simplex": simplex,
                "maxfev": _PER_THRESHOLD * n_springs,
                "xatol": 1e-4,
                "fatol": 1e-6 * float(first.fun),
                "adaptive": n_springs > 2,
            },
        )
        minima.append((float(second.fun), thresholds(np.asarray(second.x))))
    minima.sort(key=lambda each: each[0])
    values = tuple(value for value, _ in minima)
    return Found(minima[0][1], minima[0][0], float(first.fun), cost.evaluations - before, values)


def _regions(population: Array, energies: Array) -> list[Array]:
    """The best members of ``population`` ``(n, M)`` that aren't near a better one, sorted thresholds as logarithms."""
    chosen: list[Array] = []
    for k in np.argsort(energies):
        member = np.sort(population[k])
        if all(float(np.max(np.abs(member - other))) > _APART for other in chosen):
            chosen.append(member)
        if len(chosen) == _REGIONS:
            break
    return chosen
