"""A law of effects through the grid points, so that what was found runs as a model in plant and compensator.

Tensor-product friction is a table. Coulomb friction, viscous friction and the surplus of Hess and Soom, which acts while
speeding up only where both branches differ (``accel_hysteresis``, Szell's Model B) and always where they are one
(``stribeck/hess_soom``), are fitted to it by least squares, each point weighted by its standard error. A surplus has to lower
the weighted sum of squares by more than the 99 % quantile of chance, scaled by what is left, to be there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.optimize import nnls

from ...model import Term, term
from ...record import Array
from .choice import Branch

__all__ = ["Law", "law_through"]

_VELOCITIES = 60


@dataclass(frozen=True, eq=False)
class Law:
    """Terms, their parameters in the order of the covariance, and the root of the reduced weighted sum of squares."""

    terms: tuple[Term, ...]
    names: tuple[str, ...]
    values: Array
    covariance: Array
    misfit: float


def _columns(branches: Sequence[Branch], velocity: float | None, directions: bool) -> Array:
    """Columns of Coulomb level, viscous coefficient, surplus and, with directions of their own, bias, ``(n_points, n)``."""
    rows = []
    for branch in branches:
        v = branch.speed
        own = [np.ones_like(v), v]
        if velocity is not None:
            own.append(np.zeros_like(v) if branch.speeding_up is False else 1.0 / (1.0 + (v / velocity) ** 2))
        if directions:
            own.append(np.full_like(v, branch.side))
        rows.append(np.stack(own, axis=1))
    return np.concatenate(rows)


def _solved(columns: Array, force: Array, root: Array, free_last: bool) -> tuple[Array, float]:
    """Least squares with all values at least 0, the last one excepted where it is a bias."""
    rows = columns * root[:, None]
    if free_last:
        rows = np.concatenate([rows, -rows[:, -1:]], axis=1)
    values, left = nnls(rows, force * root)
    if free_last:
        values = np.append(values[:-2], values[-2] - values[-1])
    return values, float(left) ** 2


def law_through(branches: Sequence[Branch]) -> Law:
    """The law through the points of ``branches``."""
    force = np.concatenate([branch.force for branch in branches])
    error = np.concatenate([branch.error for branch in branches])
    known = np.isfinite(error) & (error > 0.0)
    usual = float(np.median(error[known])) if np.any(known) else 1.0
    # A few blocks may agree by chance: no point weighs more than four usual ones.
    root = 1.0 / np.maximum(np.where(known, error, usual), 0.5 * usual)
    directions = any(branch.side != 0.0 for branch in branches)
    speeds = np.concatenate([branch.speed for branch in branches])
    plain, plain_cost = _solved(_columns(branches, None, directions), force, root, directions)
    grid = np.geomspace(0.5 * float(np.min(speeds)), float(np.max(speeds)), _VELOCITIES)
    found = [(_solved(_columns(branches, float(v), directions), force, root, directions), float(v)) for v in grid]
    (values, cost), velocity = min(found, key=lambda each: each[0][1])
    freedom = force.shape[0] - values.shape[0] - 1
    scale = max(cost / freedom, 1.0) if freedom > 0 else np.inf
    names = ["coulomb.force", "viscous.coefficient"]
    effect = "accel_hysteresis" if any(branch.speeding_up is not None for branch in branches) else "stribeck"
    slope: Array
    if plain_cost - cost > float(stats.chi2.ppf(0.99, 2)) * scale:
        names += [f"{effect}.force", f"{effect}.velocity"]
        step = 1e-4 * velocity
        near = [_columns(branches, velocity + side * step, directions) for side in (1.0, -1.0)]
        bend = (near[0] - near[1]) @ values / (2.0 * step)
        columns = _columns(branches, velocity, directions)
        slope = np.insert(columns, 3, bend, axis=1)
        values = np.insert(values, 3, velocity)
    else:
        values, cost, slope = plain, plain_cost, _columns(branches, None, directions)
    if directions:
        names.append("bias.force")
    weighted = slope * root[:, None]
    size = np.linalg.norm(weighted, axis=0)
    size[size == 0.0] = 1.0
    misfit = float(np.sqrt(cost / max(force.shape[0] - values.shape[0], 1)))
    covariance = np.linalg.pinv((weighted / size).T @ (weighted / size), hermitian=True) / np.outer(size, size)
    return Law(_terms(names, values), tuple(names), values, np.asarray(covariance * max(misfit, 1.0) ** 2), misfit)


def _terms(names: Sequence[str], values: Array) -> tuple[Term, ...]:
    grouped: dict[str, dict[str, float]] = {}
    for name, value in zip(names, values.tolist(), strict=True):
        effect, parameter = name.split(".")
        grouped.setdefault(effect, {})[parameter] = value
    laws = {"stribeck": "hess_soom"}
    return tuple(term(effect, laws.get(effect, ""), **given) for effect, given in grouped.items())
