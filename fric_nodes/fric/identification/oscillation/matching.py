"""Correction of a biased reading, and its standard errors: the same reading is taken of the model.

A transform maps a motion x to curves r(x) (amplitude, centre and phase over time), smooth in x but not what the averaged
equations say of them. The estimate is the parameter vector p whose closed-form motion gives the reading nearest to the measured
one, min |W (r(x(p)) - r(x measured))| (indirect inference, Gourieroux, Monfort, Renault 1993): whatever bias the ends of the
window, the filter or the averaging have, both sides have it. With J = dr/dp and V the covariance of r under noise the
covariance is (J'W'WJ)^-1 J'W'W V W'WJ (J'W'WJ)^-1. V comes from readings of the model's motion with noise drawn from what it
leaves of the measured one: as large, and as correlated from one value to the next.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from ...record import Array, Mask
from .motion import Natural, plain_motion

__all__ = ["Matched", "matched"]

_DRAWS = 48
_CORRELATED = 2.0  # standard deviations of the autocorrelation of white noise


@dataclass(frozen=True, eq=False)
class Matched:
    """A corrected estimate.

    Attributes:
        natural: the parameters.
        covariance: of those that were asked for, in their order.
        first: time [s] and position [x] of the first reversal.
        left: what the model leaves of the motion [x], shape ``(n,)``.
        agrees: False when the search didn't end.
    """

    natural: Natural
    covariance: Array
    first: tuple[float, float]
    left: Array
    agrees: bool


def _noise(left: Array, n_parameters: int, rng: np.random.Generator) -> Callable[[], Array]:
    """Draws of noise like ``left``: white, or of first order where neighbours are correlated.

    The fit has taken the slow part out of what is left, so its degrees of freedom are put back; blocks of what is left would
    keep the lack.
    """
    n = left.shape[0]
    size = float(np.sqrt(np.sum(left**2) / max(n - n_parameters, 1)))
    together = float(left[1:] @ left[:-1]) / max(float(left @ left), 1e-300) + n_parameters / n
    along = min(together, 0.95) if together > _CORRELATED / np.sqrt(n) else 0.0

    def draw() -> Array:
        white: Array = np.asarray(size * rng.standard_normal(n))
        if along == 0.0:
            return white
        white[1:] *= np.sqrt(1.0 - along**2)
        return np.asarray(lfilter([1.0], [1.0, -along], white))

    return draw


def matched(
    read: Callable[[Array], Array],
    weight: Array,
    motion: tuple[Array, Array, float],
    start: tuple[Natural, float, float, int],
    asked: Mask,
    rng: np.random.Generator,
) -> Matched:
    """The natural parameters whose motion reads as the measured one does.

    Args:
        read: the reading, from positions of shape ``(n,)`` to figures ``(n_figures,)``.
        weight: of the figures, shape ``(n_figures,)``.
        motion: time [s] and position [x], each of shape ``(n,)``; each position an average over times of this deviation [s].
        start: parameters, time and position of the first reversal, and the direction after it.
        asked: which parameters to fit, shape ``(5,)``; the others are zero.
        rng: of the noise.
    """
    time, position, width = motion
    # Two points have the mean of an average over an interval, to the fourth order of its length.
    both = (time[:, None] + np.array([-width, width])).ravel()
    guess, first_time, first_position, direction = start
    base = np.where(asked, guess.values, 0.0)
    travel = float(np.ptp(position))
    size = np.array([guess.frequency, 0.01, 0.01, 0.05 * travel, 0.05 * travel])[asked]
    scale = np.concatenate([size, [1.0 / guess.frequency, travel]])
    target = read(position)

    def unpacked(point: Array) -> tuple[Natural, float, float]:
        values = base.copy()
        values[asked] = (point * scale)[:-2]
        values[0] = float(np.clip(values[0], 0.5 * guess.frequency, 2.0 * guess.frequency))
        return Natural.of(values), float(point[-2] * scale[-2]), float(point[-1] * scale[-1])

    def moved(point: Array) -> Array:
        natural, at, height = unpacked(point)
        return np.asarray(plain_motion(natural, both, at, height, direction).reshape(-1, 2).mean(axis=1))

    def off(point: Array) -> Array:
        return weight * (read(moved(point)) - target)

    answer = least_squares(
        off,
        np.concatenate([base[asked], [first_time, first_position]]) / scale,
        jac=lambda trial: _slopes(off, trial),
        method="lm",
        xtol=1e-10,
        ftol=1e-12,
        max_nfev=60,
    )
    model = moved(answer.x)
    left = position - model
    covariance = _covariance(read, weight, model, left, _slopes(off, answer.x) / scale, rng)
    natural, at, height = unpacked(answer.x)
    n_asked = int(np.sum(asked))
    agrees = bool(answer.status > 0 and np.all(np.isfinite(covariance)))
    return Matched(natural, covariance[:n_asked, :n_asked], (at, height), left, agrees)


def _covariance(
    read: Callable[[Array], Array], weight: Array, model: Array, left: Array, slopes: Array, rng: np.random.Generator
) -> Array:
    """Of the parameters, from readings of ``model`` with noise like ``left``; ``slopes`` are those of the weighted figures."""
    noise = _noise(left, slopes.shape[1], rng)
    draws = np.array([read(model + noise()) for _ in range(_DRAWS)]) * weight
    moves = (draws - np.mean(draws, axis=0)) @ np.linalg.pinv(slopes).T
    return np.asarray(moves.T @ moves / (_DRAWS - 1))


def _slopes(function: Callable[[Array], Array], point: Array) -> Array:
    """Central differences, shape ``(n_figures, n_parameters)``."""
    columns = []
    for k in range(point.shape[0]):
        step = np.zeros_like(point)
        step[k] = 1e-5 * max(abs(point[k]), 1e-2)
        columns.append((function(point + step) - function(point - step)) / (2.0 * step[k]))
    return np.stack(columns, axis=1)
