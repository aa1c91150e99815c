"""Where a joint rests: how slow that is beside its motion and its noise, and which rows it reaches into."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from ..record import Array, Mask

__all__ = ["MIN_ROWS", "SLOW", "Rests", "at_rest", "can_stand_for", "velocity_noise"]

SLOW = 0.02
"""Share of the fastest motion below which the joint may be at rest."""

MIN_ROWS = 20
"""Rows that are enough to learn from."""

_REST_TIME = 0.015  # [s] slower than the limit before it counts as rest
_REST_ROWS = 2
_FEW = 0.1  # share of the sliding rows, in each direction, below which clear ones can't stand for them


@dataclass(frozen=True, eq=False)
class Rests:
    """What tells where a joint rests, and which rows that reaches into.

    Attributes:
        velocity: of each stretch at full rate [x/s].
        sample_time: of each stretch [s].
        noise: speed that noise alone may show [x/s].
        edge: samples of a stretch before its first row.
        decimation: samples from row to row.
        reach: samples over which the filters of a row reach to either side.
        rounds: True where the filter on the position is too slow for reversals: it turns them later than the axis did.
    """

    velocity: tuple[Array, ...]
    sample_time: tuple[float, ...]
    noise: float
    edge: int
    decimation: int
    reach: int
    rounds: bool = False

    def clear(self, limit: float) -> Mask:
        """True for each row whose window holds no rest (slower than ``limit`` [x/s]), and no reversal where that counts.

        Friction jumps at a reversal, and so does the acceleration; of the smoothed motion the velocity is zero later than that.
        """
        parts = [
            ~_near(at_rest(velocity, limit, step) | (turns(velocity) & self.rounds), self.reach)[
                self.edge : velocity.shape[0] - self.edge : self.decimation
            ]
            for velocity, step in zip(self.velocity, self.sample_time, strict=True)
        ]
        return np.concatenate(parts)


def turns(velocity: Array) -> Mask:
    """True at the samples on either side of a reversal, shape ``(n,)``."""
    sign = np.sign(velocity)
    turned = sign[1:] != sign[:-1]
    return np.asarray(np.concatenate([turned, [False]]) | np.concatenate([[False], turned]), dtype=np.bool_)


def _near(mask: Mask, reach: int) -> Mask:
    """True for each sample within ``reach`` samples of one that is True in ``mask``."""
    return np.asarray(maximum_filter1d(mask.astype(np.uint8), 2 * reach + 1) > 0, dtype=np.bool_)


def can_stand_for(clear: Mask, sliding: Mask, velocity: Array) -> bool:
    """Whether enough rows are ``clear`` in each direction in which the joint slides."""
    return all(
        np.sum(clear & way) >= max(MIN_ROWS, _FEW * np.sum(sliding & way)) or np.sum(sliding & way) < MIN_ROWS
        for way in (velocity > 0.0, velocity < 0.0)
    )


def velocity_noise(raw: Array, position: Array, sample_time: float, band: float) -> float:
    """Standard deviation [x/s] of the filtered velocity due to noise and steps of the position signal, were it to stand still.

    White noise of s on the position gives s 2 pi band^1.5 sqrt(2/3 sample_time) after filtering to ``band`` [Hz] and
    differentiation. What the filter took away from the position is noise, and motion too quick for it: the quieter windows hold
    the noise.

    Args:
        raw: position as recorded [x].
        position: filtered [x].
        sample_time: [s].
        band: [Hz].
    """
    length = max(round(0.1 / sample_time), 4)
    away = raw - position
    windows = away[: away.shape[0] // length * length].reshape(-1, length)
    quiet = float(np.sqrt(np.quantile(np.mean(windows**2, axis=1), 0.25)))
    # Rounding of the position itself, which filters add up over many samples.
    rounding = 1e-13 * float(np.max(np.abs(raw)))
    return float((quiet + rounding) * 2.0 * np.pi * band**1.5 * np.sqrt(2.0 / 3.0 * sample_time))


def at_rest(velocity: Array, limit: float, row_time: float) -> Mask:
    """True where the joint stays slower than ``limit`` for a while; passing through zero at a reversal is no rest."""
    slow = np.abs(velocity) <= limit
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]]).astype(np.int8)))
    resting = np.zeros(velocity.shape[0], dtype=np.bool_)
    for first, last in zip(bounds[::2], bounds[1::2], strict=True):
        if (last - first) * row_time > _REST_TIME and last - first >= _REST_ROWS:
            resting[first:last] = True
    return resting
