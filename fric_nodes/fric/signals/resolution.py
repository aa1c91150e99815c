"""Step of a rounded signal, and the standard deviation of its noise.

A rounded signal takes values that are whole multiples of one step apart. The smallest gap between two of its values is a few
steps at most where there are enough samples; it is then sharpened over longer and longer ranges, since the smallest gap alone
is known no better than floating point and unit conversions leave it.

The noise is taken from high differences, in which no smooth motion survives: of white noise of standard deviation s the d-th
difference has s sqrt(binomial(2 d, d)). The median makes it a matter of the usual sample, whatever happens at a few. Where
samples were taken unevenly, by 10 and 12 ms in turn, say, plain differences would take the motion between them for noise;
divided differences at the samples' own times take that off.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.special import comb

from ..record import Array, Mask

__all__ = ["noise_at_each", "noise_of", "step_of"]

_DIFFERENCES = 6  # of a signal, which leave its white noise and hardly any of its motion
_EVEN = 1e-3  # of a step, by which steps may differ and count as even
_ALIKE = 1.2  # times the least gap: gaps of one step differ by no more, those of two by more
_WHOLE = 0.05  # of a step, off the next whole number of steps: what rounding in a file or a unit leaves
_MOSTLY = 0.95  # share of the gaps that have to be whole
_FLOAT = 1e-9  # of the range: smaller gaps are what floating point leaves
_REACH = 200.0  # steps, over which the first estimate is good to a part of a step
_SHARPENED = 20.0  # times farther each time it is sharpened


def step_of(values: Array) -> float:
    """The step that ``values``, shape ``(n,)``, are whole multiples of apart; 0 when they show none."""
    levels = np.unique(values)
    gaps = np.diff(levels)
    gaps = gaps[gaps > _FLOAT * max(float(np.ptp(values)) if values.size else 0.0, 1e-300)]
    if gaps.size == 0:
        return 0.0
    step = float(np.median(gaps[gaps < _ALIKE * float(np.min(gaps))]))
    near = gaps[gaps < _REACH * step] / step
    if float(np.mean(np.abs(near - np.round(near)) < _WHOLE)) < _MOSTLY:
        return 0.0
    away = levels - levels[0]
    reach = _REACH
    while True:
        part = away[away < reach * step]
        whole = np.round(part / step)
        if whole.size > 1 and float(whole @ whole) > 0.0:
            step = float(part @ whole) / float(whole @ whole)
        if part.size == away.size:
            return step
        reach *= _SHARPENED


def noise_of(signal: Array, where: Mask | None = None, time: Array | None = None) -> float:
    """Standard deviation of the white noise of ``signal``, shape ``(n,)``, in its unit, from sixth differences.

    Args:
        signal: all of it.
        where: True for the samples of which it is told, shape ``(n,)``; None: for all.
        time: when its samples were taken [s], growing, shape ``(n,)``; None: evenly.
    """
    if signal.shape[0] <= _DIFFERENCES:
        return 0.0
    sizes = np.abs(noise_at_each(signal, time))
    if where is not None:
        sizes = sizes[where[_DIFFERENCES // 2 : -_DIFFERENCES // 2]]
    return float(np.median(sizes)) / 0.6745 if sizes.size else 0.0


def noise_at_each(signal: Array, time: Array | None = None) -> Array:
    """Sixth differences of ``signal``, shape ``(n,)``, with the variance of its white noise, shape ``(n - 6,)``.

    Args:
        signal: all of it.
        time: as for :func:`noise_of`.
    """
    usual = 0.0 if time is None else float(np.median(np.diff(time)))
    if time is None or float(np.ptp(np.diff(time))) < _EVEN * usual:
        return np.asarray(np.diff(signal, _DIFFERENCES) / math.sqrt(float(comb(2 * _DIFFERENCES, _DIFFERENCES))))
    points, values = (sliding_window_view(each, _DIFFERENCES + 1).T for each in (time / usual, signal))
    taken, size = np.zeros(points.shape[1]), np.zeros(points.shape[1])
    for k, (at, value) in enumerate(zip(points, values, strict=True)):
        # Of the divided difference, Abramowitz and Stegun 25.1.5.
        weight = 1.0 / np.prod(at - np.delete(points, k, axis=0), axis=0)
        taken += weight * value
        size += weight**2
    return np.asarray(taken / np.sqrt(size))
