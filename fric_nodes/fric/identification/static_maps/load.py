"""Friction against load from settled parts of both directions at several loads.

At each load the friction is half the difference of the mean forces forward and backward, F = (F_+ - F_-)/2, its bias half their
sum. Where the load is a pressure that pushes the joint too, through an area A that need not be known, the forces are
F_k = A p_k + b + s_k F(p): the half sums over several pressures give A and b, and A the part of the half difference that is due
to pressures that aren't the same in both directions (a regulator that lags behind a moving piston).
The law over the loads is a straight line F = F_0 + mu N through the points, with a scatter from recording to recording
(:mod:`.weighted`).

Source: Amontons and Coulomb; force balance of a piston, as Szell, Eq. 12.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from ...record import Array
from .weighted import Weighted, weighted

__all__ = ["Line", "LoadLaw", "LoadPoint", "MeanForce", "area_of", "load_law"]


@dataclass(frozen=True)
class MeanForce:
    """Mean over the settled parts of one recording at one speed and direction.

    Attributes:
        source: the recording.
        velocity: [x/s].
        force: as measured, and its standard error [F].
        load: mean, NaN where not recorded.
        n: number of settled parts.
        drift: change of the force from the first part to the last [F]; 0 with fewer than four.
        thrust: of the load, taken off the force [F].
    """

    source: str
    velocity: float
    force: tuple[float, float]
    load: float
    n: int
    drift: float = 0.0
    thrust: float = 0.0

    @property
    def direction(self) -> float:
        """1 forward, -1 backward."""
        return float(np.sign(self.velocity))

    @property
    def friction(self) -> float:
        """Force less the load's thrust [F]."""
        return self.force[0] - self.thrust


@dataclass(frozen=True)
class Line:
    """A straight line: intercept, slope, their standard errors, degrees of freedom of their quantile, scatter about it."""

    intercept: tuple[float, float]
    slope: tuple[float, float]
    covariance: float
    freedom: int
    scatter: float

    def interval(self, of: tuple[float, float], level: float = 0.95) -> tuple[float, float]:
        """Confidence interval of intercept or slope."""
        half = float(stats.t.ppf(0.5 + 0.5 * level, max(self.freedom, 1))) * of[1]
        return of[0] - half, of[0] + half

    def at(self, x: Array) -> tuple[Array, Array]:
        """Value and half 95 % interval at ``x``."""
        variance = self.intercept[1] ** 2 + 2.0 * x * self.covariance + (x * self.slope[1]) ** 2
        quantile = float(stats.t.ppf(0.975, max(self.freedom, 1)))
        return self.intercept[0] + self.slope[0] * x, quantile * np.sqrt(np.maximum(variance, 0.0))


@dataclass(frozen=True)
class LoadPoint:
    """Friction at one load: half the difference of the directions, and bias, each with its standard error [F]."""

    load: float
    friction: tuple[float, float]
    bias: tuple[float, float]
    speeds: tuple[float, float]
    freedom: int

    def interval(self, level: float = 0.95) -> tuple[float, float]:
        """Confidence interval of the friction [F]."""
        half = float(stats.t.ppf(0.5 + 0.5 * level, max(self.freedom, 1))) * self.friction[1]
        return self.friction[0] - half, self.friction[0] + half


@dataclass(frozen=True)
class LoadLaw:
    """Friction over load.

    Attributes:
        points: one per recording that has both directions, by load.
        line: through them; None with fewer than three loads.
        bias: their common bias force [F]; None with the line.
        area: through which the load pushes, and its standard error [F per load]; zero where it doesn't.
        area_freedom: degrees of freedom of its quantile.
    """

    points: tuple[LoadPoint, ...]
    line: Line | None
    bias: Weighted | None = None
    area: tuple[float, float] = (0.0, 0.0)
    area_freedom: int = 1


def _pairs(means: Sequence[MeanForce]) -> list[tuple[MeanForce, MeanForce]]:
    """Forward and backward of one recording at the speeds that are nearest to each other."""
    pairs = []
    for source in dict.fromkeys(mean.source for mean in means):
        forward = [m for m in means if m.source == source and m.direction > 0]
        backward = [m for m in means if m.source == source and m.direction < 0]
        if forward and backward:
            pairs.append(
                min(
                    ((f, b) for f in forward for b in backward),
                    key=lambda p: abs(abs(p[0].velocity) / abs(p[1].velocity) - 1.0),
                )
            )
    return pairs


def _line(x: Array, y: Array, error: Array, known: int) -> Line:
    """Weighted straight line, with a scatter beside the errors; ``known`` as in :func:`.weighted.weighted`."""
    found = weighted(np.stack([np.ones_like(x), x], axis=1), y, error, known)
    spread = np.sqrt(np.diag(found.covariance))
    return Line(
        (float(found.values[0]), float(spread[0])),
        (float(found.values[1]), float(spread[1])),
        float(found.covariance[0, 1]),
        found.freedom,
        found.scatter,
    )


def area_of(means: Sequence[MeanForce]) -> Line | None:
    """Mean of both directions over the pressure, whose slope is the area that it pushes on; None with fewer than three."""
    pairs = _pairs(means)
    load = np.array([0.5 * (f.load + b.load) for f, b in pairs])
    if load.shape[0] < 3 or np.ptp(load) < 0.2 * np.max(np.abs(load)):
        return None
    middle = np.array([0.5 * (f.force[0] + b.force[0]) for f, b in pairs])
    error = np.array([0.5 * np.hypot(f.force[1], b.force[1]) for f, b in pairs])
    return _line(load, middle, error, sum(max(f.n + b.n - 2, 1) for f, b in pairs))


def load_law(means: Sequence[MeanForce], area: Line | None) -> LoadLaw:
    """Friction over load from means of both directions, whose thrust through ``area`` is taken off already."""
    points = []
    for forward, backward in _pairs(means):
        by_area = 0.5 * (forward.load - backward.load) * area.slope[1] if area is not None else 0.0
        error = float(np.sqrt(0.25 * (forward.force[1] ** 2 + backward.force[1] ** 2) + by_area**2))
        points.append(
            LoadPoint(
                0.5 * (forward.load + backward.load),
                (0.5 * (forward.friction - backward.friction), error),
                (0.5 * (forward.friction + backward.friction), error),
                (abs(forward.velocity), abs(backward.velocity)),
                max(forward.n + backward.n - 2, 1),
            )
        )
    points.sort(key=lambda point: point.load)
    load = np.array([point.load for point in points])
    line = bias = None
    if load.shape[0] >= 3 and np.ptp(load) > 0.2 * np.max(np.abs(load)):
        friction, middle = (np.array([getattr(p, name) for p in points]) for name in ("friction", "bias"))
        known = sum(point.freedom for point in points)
        line = _line(load, friction[:, 0], friction[:, 1], known)
        bias = weighted(np.ones((load.shape[0], 1)), middle[:, 0], middle[:, 1], known)
    return LoadLaw(tuple(points), line, bias, *((area.slope, area.freedom) if area is not None else ()))
