"""Where and when the motion reverses, from fits of the analytic half cycles on both sides of each peak.

A single largest sample is biased by noise (it is the largest), by the sampling and by the encoder's steps. Around the peak
(t_n, X_n) the motion is

    x = X_n - a_s (1 - g_s(t - t_n)),   a_s = X_n + D_x + s x_k,

with g of :mod:`.motion` and the direction s before and after. It is linear in X_n and in a_s of both sides. Four numbers (t_n,
X_n and both a_s) are fitted to half a half cycle on either side. Only the shape g is taken from an estimate of frequency and
damping; the amplitudes stay free, so that the peaks give information on friction of their own. Neighbouring windows don't
overlap.

The noise is one for all peaks: its variance, and how much more its correlation in time lets the estimates vary than white noise
would, are means over the windows. A covariance from each window alone would weight the peaks by chance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...record import Array
from ..statistics import bartlett_lag, sandwich_covariance
from .motion import Natural, half_cycle, shape
from .recording import Oscillation

__all__ = ["Peaks", "find_peaks"]

_REACH = 0.5  # of a half cycle, on either side


@dataclass(frozen=True, eq=False)
class Peaks:
    """The reversals of an oscillation.

    Attributes:
        time: [s], shape ``(n,)``.
        position: [x], shape ``(n,)``.
        covariance: of time and position of each, shape ``(n, 2, 2)``.
        direction: in which the body moves after the first, 1 or -1.
        noise: standard deviation of the position signal around the fits [x].
    """

    time: Array
    position: Array
    covariance: Array
    direction: int
    noise: float


class _Fit(NamedTuple):
    """One peak: time and position, Jacobian (position, both amplitudes, time) and residual."""

    value: Array
    jacobian: Array
    left: Array

    def covariance(self, correlated: bool) -> Array:
        """Of position and time: under white noise of unit variance, or with the correlation of the residual."""
        if not correlated:
            return np.asarray(np.linalg.pinv(self.jacobian.T @ self.jacobian)[np.ix_([3, 0], [3, 0])], dtype=np.float64)
        weight, starts = np.ones_like(self.left), np.zeros(1, dtype=np.int64)
        # The fit has taken the slowest part out of the residual, as much as it has parameters: what correlation adds up
        # over so many neighbours lacks it.
        lack = 1.0 + self.jacobian.shape[1] * bartlett_lag(self.left) / self.left.shape[0]
        return np.asarray(lack * sandwich_covariance(self.jacobian, self.left, weight, starts)[np.ix_([3, 0], [3, 0])])


def _fit(time: Array, position: Array, start: float, natural: Natural, direction: int) -> _Fit:
    """Time and position of one peak; ``direction`` is that of the motion after it."""
    before, after = half_cycle(natural, -direction), half_cycle(natural, direction)
    at = start
    reach = 0.5 * (float(time[-1]) - float(time[0]))
    columns = np.empty((time.shape[0], 4))
    for _ in range(8):
        later = time >= at
        columns[:, :] = 0.0
        columns[:, 0] = 1.0
        slope = np.empty((time.shape[0], 2))
        for number, (side, use) in enumerate(((before, ~later), (after, later))):
            g, rate = shape(time[use] - at, side[0], side[1])
            columns[use, 1 + number] = g - 1.0
            slope[use, number] = rate
        linear, *_ = np.linalg.lstsq(columns[:, :3], position, rcond=None)
        size = np.where(later, linear[2], linear[1])
        columns[:, 3] = -size * np.where(later, slope[:, 1], slope[:, 0])
        left = position - columns[:, :3] @ linear
        update, *_ = np.linalg.lstsq(columns, left, rcond=None)
        move = float(np.clip(update[3], -0.2 * reach, 0.2 * reach))
        at += move
        if abs(move) < 1e-9 * reach:
            break
    left = left - columns @ update
    return _Fit(np.array([at, linear[0] + update[0]]), columns, left)


def find_peaks(found: Oscillation, natural: Natural) -> Peaks:
    """The peaks of ``found``, with the shape of their half cycles from ``natural``."""
    half = np.pi / natural.frequency
    fits = []
    direction = found.direction
    for turn in found.turns:
        middle = found.time[turn]
        first, last = np.searchsorted(found.time, [middle - _REACH * half, middle + _REACH * half])
        window = slice(int(first), int(last))
        fits.append(_fit(found.time[window], found.position[window], float(middle), natural, direction))
        direction = -direction
    peaks = np.array([each.value for each in fits])
    freedom = sum(each.left.shape[0] - 4 for each in fits)
    variance = sum(float(each.left @ each.left) for each in fits) / max(freedom, 1)
    white = np.array([each.covariance(False) for each in fits])
    correlated = np.array([each.covariance(True) for each in fits])
    # One factor each for time and position: a slow residual moves the height, one as quick as the peak its time.
    factor = np.sqrt([float(np.mean(correlated[:, k, k] / white[:, k, k])) for k in range(2)])
    spread = white * np.outer(factor, factor)
    noise = float(np.sqrt(variance))
    # Noiseless data leave nothing: a floor keeps the weights finite.
    floor = 1e-12 * float(np.ptp(found.position))
    spread[:, 0, 0] += (floor * half) ** 2 / max(float(np.ptp(found.position)) ** 2, 1e-300)
    spread[:, 1, 1] += floor**2
    return Peaks(peaks[:, 0], peaks[:, 1], spread, found.direction, noise)
