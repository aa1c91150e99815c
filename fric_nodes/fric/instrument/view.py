"""A recording as the checks see it: on an even grid, filtered, differentiated, with its noise, its steps and its rests known.

The filter is a zero-phase Butterworth low-pass as wide as the position's noise allows: acceleration noise stays below a
twentieth of the acceleration, where that can be reached. White noise of s on the position gives s (2 pi)^2 B^2.5 sqrt(2 h /
5) on the acceleration after a filter to B [Hz].
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import signal

from ..record import Array, Index, Mask, Record
from ..signals.instrument_noise import level_of
from ..signals.resolution import step_of

__all__ = ["Balance", "View", "balance_on", "friction_along", "imbalance", "runs"]

_ORDER = 4
_WIDEST = 100.0  # [Hz]
_NARROWING = 1.5
_ACCELERATION_NOISE = 0.05
_RARER = 0.05  # share of the sliding samples, at least, in the rarer direction
_SLIDING = 0.05  # of the recording's high speed
_CLUSTERS = 20  # of a recording, for standard errors
_SURE = 4.0  # standard errors
_STANDS_OUT = 2.0  # times the residual
_WEIGHS = 0.5  # of the energy that the balance leaves without an arm's weight, the most that it may leave with one
_QUARTER_TURN = 0.5 * np.pi  # [rad]: over less a weight is hardly told from a spring
_FEWEST_OF_WEIGHT = 100  # samples
_AFTER_REVERSAL = 0.03  # of a typical stroke: pre-sliding, and what a play takes


class Balance(NamedTuple):
    """Force balance of the sliding samples, u = m a + F sgn v + c v + b + k (q - q_mean); NaN where it can't be made.

    Of a joint that carries an arm, the arm's weight is taken off u before.

    Attributes:
        names: ``mass``, ``coulomb``, ``viscous``, ``bias``, ``stiffness``.
        values: shape ``(5,)``.
        errors: standard errors, residual correlation counted, shape ``(5,)``.
        residual: rms [F].
        parts: rms of the force of each, shape ``(5,)`` [F].
        n_samples: that it was made from.
        covariance: of ``values``, shape ``(5, 5)``.
        own: rms of the force of each that the others don't make, shape ``(5,)`` [F].
    """

    names: tuple[str, ...]
    values: Array
    errors: Array
    residual: float
    parts: Array
    n_samples: int
    covariance: Array
    own: Array

    def shows(self, name: str) -> bool:
        """Whether ``name`` is positive beyond chance, and what only it explains stands out of what nothing explains.

        In a single tone inertia and a spring are one; then a misfit of the friction curve alone makes a mass.
        """
        k = self.names.index(name)
        return bool(self.values[k] > _SURE * self.errors[k] and self.own[k] > _STANDS_OUT * self.residual)

    def value(self, name: str) -> float:
        """The value of ``name``."""
        return float(self.values[self.names.index(name)])

    def error(self, name: str) -> float:
        """The standard error of ``name``."""
        return float(self.errors[self.names.index(name)])

    def part(self, name: str) -> float:
        """The rms force of ``name`` [F]."""
        return float(self.parts[self.names.index(name)])


_NAMES = ("mass", "coulomb", "viscous", "bias", "stiffness")


class View:
    """What the checks look at of one recording; everything is computed when it is first asked for.

    Args:
        record: as it was read.
    """

    def __init__(self, record: Record) -> None:
        self.record = record
        self.even = record.uniform()
        self.h = self.even.sample_time
        self.n = self.even.n_samples

    @cached_property
    def force(self) -> Array:
        """Force at the samples' own instants, as recorded [F], shape ``(n,)``."""
        effort = self.even.effort
        before, after = np.concatenate([effort[:1], effort[:-1]]), np.concatenate([effort[1:], effort[-1:]])
        other = {"following": before, "preceding": after, "linear": effort}[self.even.hold]
        return np.asarray(0.5 * (effort + other))

    @cached_property
    def travel(self) -> float:
        """From the lowest to the highest position [x]."""
        return float(np.ptp(self.even.position))

    @cached_property
    def resolution(self) -> float:
        """Step of the position sensor [x]; 0 when none shows."""
        return step_of(self.record.position)

    @cached_property
    def effort_resolution(self) -> float:
        """Step of the effort [F]; 0 when none shows."""
        return step_of(self.record.effort)

    @cached_property
    def noise(self) -> float:
        """Standard deviation of the errors of the position, steps included [x]."""
        return level_of(self.record.position, self.record.time)

    def low_pass(self, values: Array, cutoff: float | None = None) -> Array:
        """``values``, shape ``(n,)``, through the filter of the view, or to another ``cutoff`` [Hz]."""
        cutoff = self.cutoff if cutoff is None else cutoff
        sos = signal.butter(_ORDER, min(2.0 * cutoff * self.h, 0.99), output="sos")
        padding = min(values.shape[0] - 1, 3 * (2 * sos.shape[0] + 1))
        return np.asarray(signal.sosfiltfilt(sos, values, padlen=padding))

    @cached_property
    def cutoff(self) -> float:
        """Of the filter [Hz]."""
        cutoff = min(_WIDEST, 0.25 / self.h)
        lowest = min(max(10.0 / (self.n * self.h), 0.5), cutoff)
        while cutoff > lowest:
            smooth = self.low_pass(self.even.position, cutoff)
            acceleration = np.gradient(np.gradient(smooth, self.h), self.h)
            noise = self._acceleration_noise(cutoff)
            if noise <= _ACCELERATION_NOISE * float(np.sqrt(np.mean(acceleration**2))):
                break
            cutoff /= _NARROWING
        return max(cutoff, lowest)

    def _acceleration_noise(self, cutoff: float) -> float:
        """Standard deviation that the position's noise gives the acceleration behind a filter to ``cutoff`` [x/s^2]."""
        return float(self.noise * (2.0 * np.pi) ** 2 * cutoff**2.5 * np.sqrt(0.4 * self.h))

    @cached_property
    def acceleration_noise(self) -> float:
        """Of the filtered acceleration: what noise makes of it, over its rms [1]."""
        return self._acceleration_noise(self.cutoff) / max(float(np.sqrt(np.mean(self.acceleration**2))), 1e-300)

    @cached_property
    def position(self) -> Array:
        """Filtered [x], shape ``(n,)``."""
        return self.low_pass(self.even.position)

    @cached_property
    def velocity(self) -> Array:
        """Of the filtered position [x/s], shape ``(n,)``."""
        return np.asarray(np.gradient(self.position, self.h))

    @cached_property
    def acceleration(self) -> Array:
        """Of the filtered position [x/s^2], shape ``(n,)``."""
        return np.asarray(np.gradient(self.velocity, self.h))

    @cached_property
    def effort(self) -> Array:
        """Force at the samples' own instants, filtered as the position [F], shape ``(n,)``."""
        return self.low_pass(self.force)

    @cached_property
    def usable(self) -> Mask:
        """Valid samples away from the ends, which the filter spoils."""
        good = self.even.mask.copy()
        edge = min(int(np.ceil(1.0 / (self.cutoff * self.h))), self.n // 4)
        good[:edge] = False
        good[self.n - edge :] = False
        return good

    @cached_property
    def velocity_noise(self) -> float:
        """Standard deviation of the filtered velocity at rest [x/s]."""
        return float(self.noise * 2.0 * np.pi * self.cutoff**1.5 * np.sqrt(2.0 / 3.0 * self.h))

    @cached_property
    def speed(self) -> float:
        """High speed of the recording, the 98 % quantile [x/s]."""
        return float(np.quantile(np.abs(self.velocity), 0.98))

    @cached_property
    def moving(self) -> Mask:
        """Where it moves by more than noise would show, shape ``(n,)``."""
        return np.asarray(np.abs(self.velocity) > max(_SLIDING * self.speed, 5.0 * self.velocity_noise, 1e-300))

    @cached_property
    def moves(self) -> bool:
        """Whether it moves at all."""
        least = 4.0 * max(self.resolution, 3.0 * self.noise)
        return self.travel > least and float(np.mean(self.moving & self.usable)) > 0.01

    @cached_property
    def reversals(self) -> Index:
        """First samples of motion in another direction than the motion before."""
        at = np.flatnonzero(self.moving)
        sign = np.sign(self.velocity[at])
        return np.asarray(at[1:][sign[1:] != sign[:-1]], dtype=np.int64)

    @cached_property
    def strokes(self) -> Array:
        """Distances between reversals [x]."""
        ends = np.concatenate([[0], self.reversals, [self.n - 1]])
        return np.asarray(np.abs(np.diff(self.position[ends])))

    @cached_property
    def sliding(self) -> Mask:
        """Where it slides: moving, usable, and some way after the last reversal or rest."""
        way = np.zeros(self.n)
        distance = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.position)))])
        starts = np.flatnonzero(self.moving & ~np.concatenate([[False], self.moving[:-1]]))
        starts = np.union1d(starts, self.reversals)
        if starts.size:
            last = np.searchsorted(starts, np.arange(self.n), side="right") - 1
            way = np.where(last >= 0, distance - distance[starts[np.maximum(last, 0)]], 0.0)
        stroke = float(np.quantile(self.strokes, 0.75))
        return np.asarray(self.moving & self.usable & (way > _AFTER_REVERSAL * stroke))

    @cached_property
    def weight(self) -> Array:
        """Torque of an arm's weight, A sin q + B cos q [F], shape ``(n,)``; zero unless it explains far more than a spring."""
        at = np.flatnonzero(self.sliding)
        q = self.position
        if self.record.units.position != "rad" or at.size < _FEWEST_OF_WEIGHT or float(np.ptp(q[at])) < _QUARTER_TURN:
            return np.zeros(self.n)
        turning = np.column_stack([np.sin(q), np.cos(q)])
        columns = _columns(self, at)
        kept = np.column_stack([columns[:, :-1], turning[at]])
        found, left = (_least_squares(each, self.effort[at]) for each in (kept, columns))
        if found[1] > _WEIGHS * left[1]:
            return np.zeros(self.n)
        return np.asarray(turning @ found[0][-2:])

    @cached_property
    def free_effort(self) -> Array:
        """The filtered effort less the weight of an arm [F], shape ``(n,)``."""
        return self.effort - self.weight

    @cached_property
    def balance(self) -> Balance:
        """Force balance of the sliding samples."""
        return balance_on(self, np.flatnonzero(self.sliding))


def balance_on(view: View, at: Index) -> Balance:
    """Force balance of the samples ``at``."""
    if at.size < 40:
        nothing = np.full(5, np.nan)
        return Balance(_NAMES, nothing, nothing, float("nan"), nothing, int(at.size), np.full((5, 5), np.nan), nothing)
    columns = _columns(view, at)
    size = np.sqrt(np.mean(columns**2, axis=0))
    size[size == 0.0] = 1.0
    scaled = columns / size
    inverse = np.linalg.pinv(scaled.T @ scaled, rcond=1e-10, hermitian=True)
    effort = view.free_effort[at]
    values = inverse @ (scaled.T @ effort)
    residual = effort - scaled @ values
    # Clusters as long as the slowest thing in the residual can be: a twentieth of the recording.
    cluster = at * _CLUSTERS // view.n
    score = np.zeros((_CLUSTERS, 5))
    np.add.at(score, cluster, scaled * residual[:, None])
    n_clusters = np.unique(cluster).size
    # With fewer clusters than parameters every score can be zero by the fit itself: then no error is known.
    covariance = np.full((5, 5), np.inf)
    if n_clusters > 5:
        covariance = n_clusters / (n_clusters - 5) * (inverse @ (score.T @ score) @ inverse)
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    rms = float(np.sqrt(np.mean(residual**2)))
    own = np.abs(values) / np.sqrt(np.maximum(np.diag(inverse), 1e-300) * at.size)
    spread = covariance / np.outer(size, size)
    return Balance(_NAMES, values / size, errors / size, rms, np.abs(values), int(at.size), spread, own)


def _least_squares(columns: Array, target: Array) -> tuple[Array, float]:
    """Coefficients of ``columns``, and the sum of squares that they leave of ``target``."""
    size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300)
    found = np.linalg.lstsq(columns / size, target, rcond=1e-10)[0]
    return found / size, float(np.sum((target - (columns / size) @ found) ** 2))


def _columns(view: View, at: Index) -> Array:
    """Acceleration, direction, velocity, one, and position from the middle of the sliding, shape ``(n, 5)``."""
    q = view.position[at] - float(np.mean(view.position[view.sliding]))
    v = view.velocity[at]
    return np.column_stack([view.acceleration[at], np.sign(v), v, np.ones(at.size), q])


def imbalance(view: View, without: Mask) -> tuple[Array, Array]:
    """Effort that the balance made without some samples leaves unexplained, where it slides; NaN elsewhere, ``(n,)`` [F].

    And the standard error of what it explains there, ``(n,)`` [F].
    """
    found = balance_on(view, np.flatnonzero(view.sliding & ~without))
    left, error = np.full((2, view.n), np.nan)
    at = np.flatnonzero(view.sliding)
    if np.all(np.isfinite(found.values)):
        columns = _columns(view, at)
        left[at] = view.free_effort[at] - columns @ found.values
        if np.all(np.isfinite(found.covariance)):
            error[at] = np.sqrt(np.maximum(np.sum((columns @ found.covariance) * columns, axis=1), 0.0))
    return left, error


def friction_along(view: View) -> tuple[float, float, float]:
    """Friction of the sliding axis along its motion [F], its standard error, and the median sliding speed [x/s].

    What the effort does along the motion, without what inertia, a spring and a constant force take: positive when energy is
    lost. Its error holds that of the parts taken off. NaN where it isn't known: in one direction alone friction is no different
    from gravity.
    """
    found = view.balance
    if not np.all(np.isfinite(found.values)):
        return float("nan"), float("nan"), float("nan")
    at = np.flatnonzero(view.sliding)
    q, v = view.position[at] - float(np.mean(view.position[at])), view.velocity[at]
    if not _RARER < float(np.mean(v > 0.0)) < 1.0 - _RARER:
        return float("nan"), float("nan"), float("nan")
    other = found.value("mass") * view.acceleration[at] + found.value("bias") + found.value("stiffness") * q
    mean = float(np.mean(np.sign(v) * (view.free_effort[at] - other)))
    # The same mean by the balance's own terms: its residual is orthogonal to sgn v.
    slope = np.array([0.0, 1.0, float(np.mean(np.abs(v))), 0.0, 0.0])
    known = bool(np.all(np.isfinite(found.covariance)))
    error = float(np.sqrt(max(float(slope @ found.covariance @ slope), 0.0))) if known else float("inf")
    return mean, error, float(np.median(np.abs(v)))


def runs(mask: Mask) -> list[tuple[int, int]]:
    """First sample, and sample after the last, of every run of True."""
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return list(zip(bounds[::2].tolist(), bounds[1::2].tolist(), strict=True))
