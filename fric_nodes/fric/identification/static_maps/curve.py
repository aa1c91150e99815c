"""Which friction curve a set of mean forces shows, and how sure.

A point is a mean force F_k at a mean velocity v_k with standard error s_k. Its error against the curve is s_k and besides a
scatter tau from run to run (temperature, lubricant, position on the screw) that no single run shows: Var = s_k^2 + tau^2, with
tau^2 such that the weighted sum of squares of the richest curve equals its degrees of freedom (Paule and Mandel 1982). The
same weights then judge every candidate

    F = b + D_v |v| + sgn(v) (F_C + (F_S - F_C) g(|v|/v_S)) + F_v v + c v |v| ,
    g = exp(-(v/v_S)^2) or 1/(1 + (v/v_S)^2) or none, and with or without F_v, c and D_v,

by Akaike's criterion with its small-sample correction, n ln(S/n) + 2 k n/(n - k - 1). A candidate in which a coefficient that
can't be negative comes out negative is none.

The Stribeck velocity has no meaning where there is no surplus, so that neither that criterion nor tables of F hold for the step
from without to with it. What is compared is therefore the largest F over all Stribeck velocities and both forms, one-sided in
the surplus, and its distribution under the curve without it is drawn by simulation with the same velocities and errors. The
surplus stays when less than one in a hundred of these draws is as large.

Source: Armstrong-Helouvry, Dupont, Canudas de Wit 1994 (curve and its measurement); Szell, Eqs. 10 and 11; Paule and Mandel
1982; Hurvich and Tsai 1989 (criterion); Burnham and Anderson 2002 (errors after a choice); Davies 1987 and Hansen 1996
(parameter present under the alternative only).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy import stats

from ...record import Array

__all__ = ["STRIBECK_LAWS", "Candidate", "Choice", "Curve", "Points", "choose", "columns_of", "fitted"]

_SIGNIFICANT = 0.01
_DRAWS = 1999
_VELOCITIES = 40
STRIBECK_LAWS = ("exponential", "hess_soom")
"""Laws of a Stribeck effect that a curve can have."""


@dataclass(frozen=True, eq=False)
class Points:
    """Means: velocity [x/s], force [F] and standard error [F], each of shape ``(n,)``."""

    velocity: Array
    force: Array
    error: Array

    @property
    def n_speeds(self) -> int:
        """Number of speeds that differ by more than a tenth."""
        speeds = np.sort(np.abs(self.velocity))
        return 1 + int(np.sum(np.diff(np.log(speeds)) > 0.1))


@dataclass(frozen=True)
class Candidate:
    """Which terms a curve has besides bias and Coulomb friction; ``stribeck`` is a law or empty."""

    viscous: bool = False
    stribeck: str = ""
    quadratic: bool = False
    asymmetry: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters in the order of :func:`columns_of`; the Stribeck velocity last."""
        found = ["bias.force", "coulomb.force"]
        found += ["viscous.coefficient"] if self.viscous else []
        found += ["quadratic_drag.coefficient"] if self.quadratic else []
        found += ["asymmetry.coefficient"] if self.asymmetry else []
        found += ["stribeck.force", "stribeck.velocity"] if self.stribeck else []
        return tuple(found)

    def holds(self, other: Candidate) -> bool:
        """Whether it has every term of ``other``."""
        plain = all(getattr(self, name) or not getattr(other, name) for name in ("viscous", "quadratic", "asymmetry"))
        return plain and other.stribeck in ("", self.stribeck)

    @property
    def title(self) -> str:
        """For tables."""
        parts = ["Coulomb"]
        parts += ["viscous"] if self.viscous else []
        parts += ["quadratic"] if self.quadratic else []
        parts += [{"exponential": "Stribeck", "hess_soom": "Stribeck (Hess-Soom)"}[self.stribeck]] if self.stribeck else []
        parts += ["asymmetric viscous"] if self.asymmetry else []
        return " + ".join(parts)


@dataclass(frozen=True, eq=False)
class Curve:
    """A fitted candidate.

    Attributes:
        candidate: its terms.
        values: of its parameters, shape ``(n_parameters,)``.
        covariance: shape ``(n_parameters, n_parameters)``.
        cost: weighted sum of squares.
        criterion: Akaike's, corrected.
        scatter: tau, from run to run [F].
        freedom: points less parameters.
    """

    candidate: Candidate
    values: Array
    covariance: Array
    cost: float
    criterion: float
    scatter: float
    freedom: int

    def force(self, velocity: Array) -> Array:
        """Mean force at ``velocity`` [F]."""
        v_s = float(self.values[-1]) if self.candidate.stribeck else 1.0
        linear = self.values[:-1] if self.candidate.stribeck else self.values
        return np.asarray(columns_of(self.candidate, velocity, v_s) @ linear, dtype=np.float64)

    def half_width(self, velocity: Array, level: float = 0.95) -> Array:
        """Half the confidence interval of :meth:`force` [F]."""
        slope = _jacobian(self.candidate, self.values, velocity)
        variance = np.einsum("ni,ij,nj->n", slope, self.covariance, slope)
        quantile = float(stats.t.ppf(0.5 + 0.5 * level, max(self.freedom, 1)))
        return np.asarray(quantile * np.sqrt(np.maximum(variance, 0.0)), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Choice:
    """What was chosen, and against what.

    Attributes:
        best: the curve chosen.
        rival: the best curve with a Stribeck effect where ``best`` has none, and without where it has one; None when there
            is none.
        all: every candidate that was possible, best first.
        p_value: probability of as much of a Stribeck effect by chance; NaN when it couldn't be tested, or every curve has one.
        f_value: the statistic behind it.
        widening: of the standard errors of the parameters of ``best``, for which candidate is chosen hangs on the noise too,
            shape ``(n_parameters,)``. The force itself, which all good candidates agree on, doesn't need it.
    """

    best: Curve
    rival: Curve | None
    all: tuple[Curve, ...]
    p_value: float
    f_value: float
    widening: Array


def _fall(law: str, ratio: Array) -> Array:
    return np.exp(-(ratio**2)) if law == "exponential" else 1.0 / (1.0 + ratio**2)


def columns_of(candidate: Candidate, velocity: Array, stribeck_velocity: float) -> Array:
    """One column per linear parameter, shape ``(n, n_linear)``."""
    one, sign = np.ones_like(velocity), np.sign(velocity)
    columns = [one, sign]
    columns += [velocity] if candidate.viscous else []
    columns += [velocity * np.abs(velocity)] if candidate.quadratic else []
    columns += [np.abs(velocity)] if candidate.asymmetry else []
    columns += [sign * _fall(candidate.stribeck, velocity / stribeck_velocity)] if candidate.stribeck else []
    return np.stack(columns, axis=1)


def _jacobian(candidate: Candidate, values: Array, velocity: Array) -> Array:
    if not candidate.stribeck:
        return columns_of(candidate, velocity, 1.0)
    v_s = float(values[-1])
    columns = columns_of(candidate, velocity, v_s)
    step = 1e-4 * v_s
    slope = (columns_of(candidate, velocity, v_s + step) - columns_of(candidate, velocity, v_s - step)) @ values[:-1]
    return np.concatenate([columns, (slope / (2.0 * step))[:, None]], axis=1)


def _velocities(points: Points) -> Array:
    """Stribeck velocities to try: below the slowest the surplus has no shape, above the fastest it is a constant."""
    speeds = np.abs(points.velocity)
    return np.geomspace(0.7 * float(np.min(speeds)), 0.7 * float(np.max(speeds)), _VELOCITIES)


def _solve(columns: Array, target: Array) -> tuple[Array, float]:
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    solution = np.linalg.lstsq(columns / scale, target, rcond=1e-10)[0] / scale
    left = target - columns @ solution
    return solution, float(left @ left)


def _costs(candidate: Candidate, points: Points, root: Array, grid: Array) -> Array:
    """Weighted sum of squares at each Stribeck velocity of ``grid``, shape ``(n_grid,)``."""
    known = np.linalg.qr(root[:, None] * columns_of(replace(candidate, stribeck=""), points.velocity, 1.0))[0]
    target = root * points.force
    left = target - known @ (known.T @ target)
    extra = (root * np.sign(points.velocity))[:, None] * _fall(candidate.stribeck, points.velocity[:, None] / grid)
    rest = extra - known @ (known.T @ extra)
    size = np.sum(rest**2, axis=0)
    gain = np.where(size > 1e-12 * np.sum(extra**2, axis=0), (left @ rest) ** 2 / np.maximum(size, 1e-300), 0.0)
    return np.asarray(float(left @ left) - gain, dtype=np.float64)


def _best_velocity(candidate: Candidate, points: Points, root: Array) -> float:
    """The Stribeck velocity of least cost: on a grid, and on finer ones around the best."""
    grid = _velocities(points)
    for _ in range(4):
        at = int(np.argmin(_costs(candidate, points, root, grid)))
        best = float(grid[at])
        grid = np.geomspace(grid[max(at - 1, 0)], grid[min(at + 1, grid.shape[0] - 1)], 21)
    return best


def fitted(candidate: Candidate, points: Points, scatter: float) -> Curve | None:
    """The curve of ``candidate``; None where a coefficient has a sign that it can't have, or there are too few points.

    Args:
        candidate: its terms.
        points: the means.
        scatter: tau, from run to run [F].
    """
    n = points.velocity.shape[0]
    count = len(candidate.names)
    if n - count - 1 <= 1:
        return None
    root = 1.0 / np.sqrt(points.error**2 + scatter**2)
    v_s = _best_velocity(candidate, points, root) if candidate.stribeck else 1.0
    values, cost = _solve(root[:, None] * columns_of(candidate, points.velocity, v_s), root * points.force)
    if candidate.stribeck:
        values = np.append(values, v_s)
    by_name = dict(zip(candidate.names, values.tolist(), strict=True))
    bounded = ("coulomb.force", "viscous.coefficient", "quadratic_drag.coefficient", "stribeck.force")
    if any(by_name.get(name, 0.0) < 0.0 for name in bounded):
        return None
    slope = root[:, None] * _jacobian(candidate, values, points.velocity)
    size = np.linalg.norm(slope, axis=0)
    size[size == 0.0] = 1.0
    spread = np.linalg.pinv((slope / size).T @ (slope / size), rcond=1e-12, hermitian=True) / np.outer(size, size)
    freedom = n - count
    k = count + 1
    criterion = n * np.log(max(cost, 1e-300) / n) + 2.0 * k * n / (n - k - 1)
    # Weights are right on average for the richest curve; a poorer one that is chosen pays for what it leaves.
    covariance = np.asarray(spread * max(cost / freedom, 1.0), dtype=np.float64)
    return Curve(candidate, values, covariance, cost, float(criterion), scatter, freedom)


def _scatter(candidate: Candidate, points: Points) -> float:
    """Scatter tau of Paule and Mandel under ``candidate``."""
    from scipy.optimize import brentq

    freedom = points.velocity.shape[0] - len(candidate.names)

    def excess(tau: float) -> float:
        root = 1.0 / np.sqrt(points.error**2 + tau**2)
        if candidate.stribeck:
            return float(np.min(_costs(candidate, points, root, _velocities(points))) - freedom)
        cost = _solve(root[:, None] * columns_of(candidate, points.velocity, 1.0), root * points.force)[1]
        return float(cost - freedom)

    if freedom < 2 or excess(0.0) <= 0.0:
        return 0.0
    high = float(np.ptp(points.force)) + float(np.max(points.error))
    return float(brentq(excess, 0.0, high, xtol=1e-4 * high)) if excess(high) < 0.0 else high


def _test_stribeck(base: Candidate, points: Points, scatter: float, rng: np.random.Generator) -> tuple[float, float]:
    """Largest one-sided F of a surplus on top of ``base``, and the probability of one as large by chance."""
    n = points.velocity.shape[0]
    freedom = n - len(base.names) - 2
    if freedom < 2:
        return float("nan"), float("nan")
    root = 1.0 / np.sqrt(points.error**2 + scatter**2)
    known = np.linalg.qr(root[:, None] * columns_of(base, points.velocity, 1.0))[0]
    directions = []
    for law, v_s in product(STRIBECK_LAWS, _velocities(points)):
        column = root * np.sign(points.velocity) * _fall(law, points.velocity / float(v_s))
        rest = column - known @ (known.T @ column)
        size = float(np.linalg.norm(rest))
        if size > 1e-3 * float(np.linalg.norm(column)):
            directions.append(rest / size)
    if not directions:
        return float("nan"), float("nan")
    new = np.stack(directions)

    def largest(white: Array) -> Array:
        left = white - (white @ known) @ known.T
        gain = np.max(np.maximum(left @ new.T, 0.0), axis=1) ** 2
        whole = np.sum(left**2, axis=1)
        return np.asarray(0.5 * gain / np.maximum((whole - gain) / freedom, 1e-300), dtype=np.float64)

    found = float(largest((root * points.force)[None, :])[0])
    by_chance = largest(rng.standard_normal((_DRAWS, n)))
    return found, float((1 + np.sum(by_chance >= found)) / (1 + _DRAWS))


def choose(points: Points, seed: int = 1, at_least: Candidate | None = None) -> Choice:
    """The curve that ``points`` show.

    Args:
        points: at least three, of both directions.
        seed: of the draws behind the test for a Stribeck effect.
        at_least: terms that every curve has, however small they come out. Where no curve without a Stribeck effect is possible
            with them, those of them that would be negative are left out of it.
    """
    several = points.n_speeds
    viscous = (False, True) if several >= 2 else (False,)
    more = (False, True) if several >= 3 else (False,)
    laws = ("", *STRIBECK_LAWS) if several >= 4 else ("",)
    possible = [Candidate(v, s, q, a) for v, s, q, a in product(viscous, laws, more, viscous)]
    every = [c for c in possible if at_least is None or c.holds(at_least)]
    n = points.velocity.shape[0]
    rich = [c for c in every if n - len(c.names) >= 3]
    scatter = min((_scatter(c, points) for c in rich[-1:]), default=0.0)
    found = [curve for c in every if (curve := fitted(c, points, scatter)) is not None]
    given = at_least is not None and bool(at_least.stribeck)
    if not found or (not given and all(curve.candidate.stribeck for curve in found)):
        found += _plain(possible, points, scatter, at_least or Candidate())
    found.sort(key=lambda curve: curve.criterion)
    without = [curve for curve in found if not curve.candidate.stribeck]
    with_it = [curve for curve in found if curve.candidate.stribeck]
    f_value = p_value = float("nan")
    # The plain curve that the surplus must beat is the richest possible one, so that it isn't mistaken for another term.
    if len(laws) > 1 and without:
        base = max(without, key=lambda curve: (len(curve.candidate.names), -curve.criterion)).candidate
        f_value, p_value = _test_stribeck(base, points, scatter, np.random.default_rng(seed))
    there = bool(with_it) and (not without or (p_value < _SIGNIFICANT and with_it[0].criterion < without[0].criterion))
    rivals = without if there else with_it
    best, rival = (with_it if there else without)[0], rivals[0] if rivals else None
    ordered = (best, *[curve for curve in found if curve is not best])
    return Choice(best, rival, ordered, p_value, f_value, _widening(best, with_it if there else without))


def _plain(possible: Sequence[Candidate], points: Points, scatter: float, at_least: Candidate) -> list[Curve]:
    """Curves without a Stribeck effect where none has all terms of ``at_least``: what can't be negative is zero instead.

    Where a strong surplus falls over all speeds, viscous friction without it would come out negative.
    """
    plain = [curve for c in possible if not c.stribeck and (curve := fitted(c, points, scatter)) is not None]
    whole = [curve for curve in plain if curve.candidate.holds(replace(at_least, stribeck=""))]
    return whole or plain or [_mean_only(points)]


def _widening(best: Curve, others: Sequence[Curve]) -> Array:
    """Factors on the standard errors of the parameters of ``best`` for the choice among ``others``, shape ``(n_parameters,)``.

    Each standard error becomes the mean over all candidates that have the parameter, weighted by exp(-criterion/2), of
    sqrt(variance + (value - chosen value)^2) (Burnham and Anderson 2002, Eq. 4.9).
    """
    factor = np.ones(best.values.shape[0])
    if not np.isfinite(best.criterion):
        return factor
    least = min(curve.criterion for curve in others)
    for k, name in enumerate(best.candidate.names):
        own = float(np.sqrt(best.covariance[k, k]))
        total = spread = 0.0
        for curve in (each for each in others if name in each.candidate.names):
            j = curve.candidate.names.index(name)
            weight = float(np.exp(-0.5 * (curve.criterion - least)))
            total += weight
            spread += weight * float(np.hypot(np.sqrt(curve.covariance[j, j]), curve.values[j] - best.values[k]))
        if own > 0.0 and total > 0.0:
            factor[k] = max(spread / total / own, 1.0)
    return factor


def _mean_only(points: Points) -> Curve:
    """Coulomb friction and bias from two or three points, the errors those of the points."""
    candidate = Candidate()
    root = 1.0 / np.maximum(points.error, 1e-12 * float(np.max(np.abs(points.force))) + 1e-300)
    columns = root[:, None] * columns_of(candidate, points.velocity, 1.0)
    values, cost = _solve(columns, root * points.force)
    covariance: Array = np.asarray(np.linalg.pinv(columns.T @ columns, hermitian=True), dtype=np.float64)
    return Curve(candidate, values, covariance, cost, float("nan"), 0.0, max(points.velocity.shape[0] - 2, 0))
