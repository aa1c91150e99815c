"""Position and velocity at one sample of a recording, with their covariance: where a simulation from there on starts.

A difference of two samples has the encoder's step divided by the time between them as its error, and a low-pass filter distorts
the motion at the ends of a recording. So both are taken from a polynomial through the samples around, or behind, the one that
is asked for:

    q(t) = sum_k c_k (t - t_0)^k,     position c_0, velocity c_1, covariance s^2 (X'X)^-1

The more samples it is fitted to the smaller the noise, and the less a polynomial describes the motion. Windows grow until the
velocity of a parabola over a longer one contradicts those over shorter ones (intersection of confidence intervals: Lepski 1990,
Goldenshluger and Nemirovski 1997). The answer is that of a cubic over the last window that doesn't: its next term takes out the
bias that this choice leaves, and its larger standard error covers it (Calonico, Cattaneo and Titiunik 2014). Where force or
friction jumps within the window, no polynomial describes the motion; the change from parabola to cubic tells by how much it may
be off, and the square of that is added to the variance.

Errors of a coarse encoder aren't white: while its reading stays the same it gives no new information. s^2 is therefore
multiplied by the mean number of samples for which a reading stays; of an axis that doesn't move by a step the velocity is
known to one step per window.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..record import Array
from .instrument_noise import level_of

__all__ = ["InitialState", "initial_state"]

_SHORTEST = 4  # samples: of a cubic
_LONGER = 1.3  # times the window before: of intervals that differ less the longer one says little new
_APART = 2.0  # standard errors either side of an interval: it holds the velocity with 95 %
_CHOOSING, _ANSWERING = 2, 3  # degrees of the polynomials


class InitialState(NamedTuple):
    """State at one sample.

    Attributes:
        position: [x].
        velocity: [x/s].
        covariance: of both, shape ``(2, 2)``.
    """

    position: float
    velocity: float
    covariance: Array

    @property
    def standard_errors(self) -> Array:
        """Of position [x] and velocity [x/s], shape ``(2,)``."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)


def initial_state(time: Array, position: Array, at: int = 0, error: float | None = None) -> InitialState:
    """The state at sample ``at``.

    Args:
        time: of one contiguous part of a recording [s], shape ``(n,)``.
        position: measured then [x], shape ``(n,)``.
        at: number of the sample.
        error: standard deviation of the errors of ``position`` [x]; None: taken from it.

    Raises:
        ValueError: there are fewer than two samples.
    """
    n = position.shape[0]
    if n < 2:
        raise ValueError(f"a velocity takes two samples, there are {n}")
    error = level_of(position) if error is None else error
    low, high = -np.inf, np.inf
    chosen = _window(n, at, _SHORTEST)
    for length in _lengths(n):
        window = _window(n, at, length)
        found = _fitted(time[window], position[window], time[at], _CHOOSING, error)
        reach = _APART * found.standard_errors[1]
        low, high = max(low, found.velocity - reach), min(high, found.velocity + reach)
        if low > high:
            break
        chosen = window
    simple, found = (_fitted(time[chosen], position[chosen], time[at], degree, error) for degree in (_CHOOSING, _ANSWERING))
    change = np.array([found.position - simple.position, found.velocity - simple.velocity])
    return found._replace(covariance=found.covariance + np.outer(change, change))


def _lengths(n: int) -> list[int]:
    """Numbers of samples of the windows, the shortest first."""
    lengths = [min(_SHORTEST, n)]
    while lengths[-1] < n:
        lengths.append(min(int(np.ceil(_LONGER * lengths[-1])), n))
    return lengths


def _window(n: int, at: int, length: int) -> slice:
    """About ``length`` of ``n`` samples with as many before ``at`` as behind it, or what there is."""
    before = min(length // 2, at)
    behind = min(length - before, n - at)
    before = min(length - behind, at)
    return slice(at - before, at + behind)


def _fitted(time: Array, position: Array, at: float, degree: int, error: float) -> InitialState:
    """From a polynomial, of lower degree where the samples are too few for one of ``degree``."""
    n = position.shape[0]
    degree = min(degree, n - 1)
    length = max(float(time[-1] - at), float(at - time[0]))
    basis = np.vander((time - at) / length, degree + 1, increasing=True)
    # Relative to one sample, so that a large offset costs no digits.
    origin = float(position[0])
    coefficients, *_ = np.linalg.lstsq(basis, position - origin, rcond=None)
    inverse = np.linalg.pinv(basis)[:2]
    off = position - origin - basis @ coefficients
    left = float(off @ off) / max(n - degree - 1, 1)
    stays = n / (1.0 + float(np.count_nonzero(np.diff(position))))
    scale = np.array([1.0, 1.0 / length])
    covariance = stays * max(error**2, left) * (inverse @ inverse.T) * np.outer(scale, scale)
    return InitialState(origin + float(coefficients[0]), float(coefficients[1]) / length, covariance)
