"""Lag of the effort against the motion, constant and growing, from the force balance alone.

The effort, shifted by tau, is fitted by what a motion needs: m a, a cubic of the position (springs), the weight of an arm where
one shows and, for each direction, a constant, a viscous and a quadratic part and two that fade with speed. The tau that leaves
least is the lag.
Only sliding samples count, so that pre-sliding and play after a reversal, which lag behind by themselves, stay out. The sums
are kept per window, so that a lag that grows, and intervals by the jackknife over windows, need no second pass.

What can shift is the inertial force alone: any force of position and speed may have another shape than was thought. So the part
of the acceleration that no function of position and speed makes has to stand out of the residual. In a single tone, a ramp, or
moves at one speed there is none, and no lag can be told. A controller also reacts to the noise of the position, which the
acceleration has too: the two seem shifted. What that can make is the noise's share of the acceleration, times the inertial
force. An effect below that, at 95 %, or below what matters, can't be told either.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from ..record import Array, Index
from .view import View

__all__ = ["MATTERS", "Growth", "Lag", "LagCurves", "judged"]

MATTERS = 0.01
"""Of the effort's standard deviation: a third of what friction models leave of a real axis at best. Less can't be told."""

_SURE = 1.645  # quantile of 95 %, one-sided
_WINDOWS = 16
_RANGE = 0.1  # [s]
_LEAST_RANGE = 6  # steps of the grid
_MOST_RANGE = 80
_SPAN = 0.1  # [s] longest growth over a recording that is looked for
_CONTRAST = 6.0  # energy at a typical shift over the least
_INERTIA = 3.0  # rms of the inertial force over the residual's, at least
_STANDS_OUT = 4.0  # standard errors, beyond which a lag that can't be told is still named as a suspicion
_TAKES = 0.8  # of the energy that the force balance leaves, the most that such a lag may leave
_FADING = (0.03, 0.2)  # of the high speed, at which parts of friction have fallen to half
_PER_BAND = 10.0  # steps of the grid per period of the cutoff


@dataclass(frozen=True)
class Lag:
    """A constant lag.

    Attributes:
        value: [s].
        error: standard error [s].
        left: share of the residual's energy that it leaves.
        at_edge: whether it lies at the edge of what was looked for.
        residual: rms [F].
        contrast: energy at a typical shift over the least.
        inertia: rms of the inertial force that only the acceleration explains, at this lag, over the residual's.
        effect: rms of what is explained better than without it, over the effort's standard deviation.
        least: effect that it takes to be told.
    """

    value: float
    error: float
    left: float
    at_edge: bool
    residual: float
    contrast: float
    inertia: float
    effect: float
    least: float


@dataclass(frozen=True)
class Growth:
    """A lag that grows.

    Attributes:
        value: growth [s/s].
        error: its standard error [s/s].
        start: lag at the start of the recording [s].
        left: share of the energy after a constant lag that it leaves.
        inertia: as in :class:`Lag`.
        effect: as there, beside a constant lag.
        least: as there.
    """

    value: float
    error: float
    start: float
    left: float
    inertia: float
    effect: float
    least: float


class LagCurves:
    """Sums for every window and every shift.

    Args:
        view: the recording.
    """

    def __init__(self, view: View) -> None:
        thin = max(int(1.0 / (view.h * _PER_BAND * view.cutoff)), 1)
        self.step = thin * view.h
        reach = int(np.clip(np.ceil(_RANGE / self.step), _LEAST_RANGE, _MOST_RANGE))
        shifts = np.arange(-reach, reach + 1)
        self.tau: Array = np.asarray(shifts * self.step, dtype=np.float64)
        at = np.arange(0, view.n, thin, dtype=np.int64)
        effort = view.effort[at]
        usable = view.usable[at]
        keep = np.flatnonzero(view.sliding[at])
        keep = keep[(keep >= reach) & (keep < at.size - reach)]
        keep = keep[np.all(usable[np.clip(keep[:, None] + np.array([-reach, reach]), 0, at.size - 1)], axis=1)]
        columns = _columns(view, at[keep])
        self.columns = columns
        bounds = np.linspace(0, keep.size, _WINDOWS + 1).astype(np.int64)
        self.enough = keep.size > 8 * columns.shape[1] + 10 * _WINDOWS
        self.n_samples = int(keep.size)
        self.noise = view.acceleration_noise
        self.spread = float(np.std(effort[keep])) if keep.size else 0.0
        if not self.enough:
            return
        self.time = np.array([float(np.mean(at[keep[a:b]])) * view.h for a, b in pairwise(bounds.tolist())])
        xx, xu, uu = [], [], []
        for first, last in pairwise(bounds.tolist()):
            x = columns[first:last]
            u = effort[keep[first:last, None] + shifts]
            xx.append(x.T @ x)
            xu.append(x.T @ u)
            uu.append(np.sum(u**2, axis=0))
        self.xx, self.xu, self.uu = np.array(xx), np.array(xu), np.array(uu)

    def _least(self, keep: Array) -> tuple[float, Array]:
        """Best constant shift with the windows weighted by ``keep``, and the curve of the residual's energy."""
        xx, xu, uu = (np.tensordot(keep, each, axes=1) for each in (self.xx, self.xu, self.uu))
        curve = uu - np.sum(xu * (np.linalg.pinv(xx, rcond=1e-9, hermitian=True) @ xu), axis=0)
        return _minimum(self.tau, curve), curve

    @lru_cache(maxsize=1)  # noqa: B019 - the curves live as long as their view, and so may what follows from them
    def constant(self) -> Lag:
        """The lag of the whole recording."""
        ones = np.ones(_WINDOWS)
        best, curve = self._least(ones)
        others = np.array([self._least(ones - np.eye(_WINDOWS)[w])[0] for w in range(_WINDOWS)])
        error = float(np.sqrt((_WINDOWS - 1) / _WINDOWS * np.sum((others - np.mean(others)) ** 2)))
        zero = float(np.interp(0.0, self.tau, curve))
        lowest = float(np.min(curve))
        at_edge = abs(best) > self.tau[-1] - 1.5 * self.step
        residual = float(np.sqrt(max(lowest, 0.0) / self.n_samples))
        k = int(np.argmin(curve))
        inertia = self._own_inertia(self.xx.sum(axis=0), self.xu.sum(axis=0)[:, k])
        contrast = float(np.median(curve)) / max(lowest, 1e-300)
        effect, least = self._effect(zero, lowest), self._least_effect(inertia)
        left, inertia = lowest / max(zero, 1e-300), inertia / max(residual, 1e-300)
        return Lag(best, error, left, at_edge, residual, contrast, inertia, effect, least)

    def _effect(self, before: float, after: float) -> float:
        """Rms by which the residual's energy falls, over the effort's standard deviation."""
        return float(np.sqrt(max(before - after, 0.0) / self.n_samples)) / max(self.spread, 1e-300)

    def _least_effect(self, inertia: float) -> float:
        """What has to be exceeded, with an inertial force of its own of ``inertia`` [F]."""
        return max(MATTERS, _SURE * self.noise * abs(inertia) / max(self.spread, 1e-300))

    def _own_inertia(self, xx: Array, xu: Array) -> float:
        """Rms of the force of the acceleration's part that the other columns don't make [F], with the sign of the mass."""
        inverse = np.linalg.pinv(xx, rcond=1e-9, hermitian=True)
        return float((inverse @ xu)[0]) / float(np.sqrt(max(float(inverse[0, 0]), 1e-300) * self.n_samples))

    @lru_cache(maxsize=1)  # noqa: B019 - as above
    def growing(self) -> Growth:
        """A lag tau + s t."""
        best, curve = self._least(np.ones(_WINDOWS))
        middle = self.time - float(np.mean(self.time))
        slopes = np.linspace(-1.0, 1.0, 97) * _SPAN / float(np.ptp(self.time))
        # A lag that grows much can throw the best constant one far off; then it is near zero that there is a better start.
        near = np.linspace(-8.0, 8.0, 33) * self.step
        offsets = np.concatenate([best + near, near])
        n = slopes.shape[0] * offsets.shape[0]
        xu, uu = np.empty((_WINDOWS, self.xx.shape[1], n)), np.empty((_WINDOWS, n))
        for w, t in enumerate(middle):
            at = np.clip((offsets[None, :] + slopes[:, None] * t).ravel(), self.tau[0], self.tau[-1])
            left = np.minimum(((at - self.tau[0]) / self.step).astype(np.int64), self.tau.shape[0] - 2)
            share = (at - self.tau[left]) / self.step
            xu[w] = self.xu[w][:, left] * (1.0 - share) + self.xu[w][:, left + 1] * share
            uu[w] = self.uu[w][left] * (1.0 - share) + self.uu[w][left + 1] * share
        all_xx, all_xu, all_uu = self.xx.sum(axis=0), xu.sum(axis=0), uu.sum(axis=0)

        def fit(without: int | None) -> tuple[float, float, float, float]:
            xx = all_xx if without is None else all_xx - self.xx[without]
            x = all_xu if without is None else all_xu - xu[without]
            u = all_uu if without is None else all_uu - uu[without]
            energy = u - np.sum(x * (np.linalg.pinv(xx, rcond=1e-9, hermitian=True) @ x), axis=0)
            table = energy.reshape(slopes.shape[0], offsets.shape[0])
            row, column = np.unravel_index(int(np.argmin(table)), table.shape)
            k = int(row) * offsets.shape[0] + int(column)
            inertia = self._own_inertia(xx, x[:, k])
            return float(offsets[column]), _minimum(slopes, table[:, column]), float(table[row, column]), inertia

        offset, slope, energy, inertia = fit(None)
        others = np.array([fit(w)[1] for w in range(_WINDOWS)])
        error = float(np.sqrt((_WINDOWS - 1) / _WINDOWS * np.sum((others - np.mean(others)) ** 2)))
        # A tenth of the grid's own step can't be told from none.
        error = max(error, 0.1 * float(slopes[1] - slopes[0]))
        start = offset - slope * float(np.mean(self.time))
        left = energy / max(float(np.min(curve)), 1e-300)
        effect, least = self._effect(float(np.min(curve)), energy), self._least_effect(inertia)
        inertia /= max(float(np.sqrt(max(energy, 0.0) / self.n_samples)), 1e-300)
        return Growth(slope, error, start, left, inertia, effect, least)


_CURVES: WeakKeyDictionary[View, LagCurves] = WeakKeyDictionary()


def _curves(view: View) -> LagCurves:
    """The curves of ``view``, which two checks ask for, made once and kept as long as the view."""
    if view not in _CURVES:
        _CURVES[view] = LagCurves(view)
    return _CURVES[view]


def judged(view: View, growing: bool = False) -> tuple[LagCurves | None, str]:
    """The curves of ``view``, or None and why a lag, constant or growing, can't be seen in it."""
    if not view.moves:
        return None, "it does not move"
    curves = _curves(view)
    if not curves.enough:
        return None, "too few sliding samples"
    if growing:
        inertia = curves.growing().inertia
        return (curves, "") if inertia > _INERTIA else (None, _too_little(inertia))
    found = curves.constant()
    if found.inertia > _INERTIA and found.contrast > _CONTRAST:
        return curves, ""
    why = _too_little(found.inertia)
    if found.inertia > _INERTIA:
        why = "the force balance closes nearly as well at any lag"
    if not found.at_edge and abs(found.value) > _STANDS_OUT * found.error and found.left < _TAKES:
        side = "effort" if found.value > 0.0 else "motion"
        why += f"; it would leave {100.0 * (1.0 - found.left):.2g} % less energy if the {side} came late, by "
        why += f"{1e3 * abs(found.value):.3g} ms: compare the clocks"
    return None, why


def _too_little(inertia: float) -> str:
    """Why a lag can't be seen, with an inertial force of its own of ``inertia`` times what the force balance leaves."""
    return (
        f"the force that only the acceleration explains is {max(inertia, 0.0):.2g} times what the force balance leaves; "
        f"to tell a lag takes {_INERTIA:.2g} times"
    )


def _columns(view: View, at: Index) -> Array:
    """What a motion needs, one column each, scaled to rms 1.

    Friction jumps at a reversal and the effort went through the view's filter: so do the columns of friction.
    """
    q = view.position[at]
    middle, half = (float(np.mean(q)), 0.5 * float(np.ptp(q)) or 1.0) if q.size else (0.0, 1.0)
    q = (q - middle) / half
    speed = np.abs(view.velocity) / max(view.speed, 1e-300)
    parts = [np.ones(view.n), speed, speed**2, *(1.0 / (1.0 + speed / low) for low in _FADING)]
    ways = [view.velocity > 0.0, view.velocity < 0.0]
    friction = [view.low_pass(way * part)[at] for way in ways if np.any(way) for part in parts]
    angle = view.position[at]
    weight = [np.sin(angle), np.cos(angle)] if np.any(view.weight) else []
    stacked = np.column_stack([view.acceleration[at], q, q**2, q**3, *weight, *friction])
    size = np.sqrt(np.mean(stacked**2, axis=0)) if at.size else np.ones(stacked.shape[1])
    size[size == 0.0] = 1.0
    return np.asarray(stacked / size)


def _minimum(x: Array, y: Array) -> float:
    """Where ``y`` is least, by the parabola through three points."""
    k = int(np.argmin(y))
    if k in {0, x.shape[0] - 1}:
        return float(x[k])
    low, mid, high = y[k - 1], y[k], y[k + 1]
    bend = low - 2.0 * mid + high
    return float(x[k] + (0.5 * (low - high) / bend if bend > 0.0 else 0.0) * (x[1] - x[0]))
