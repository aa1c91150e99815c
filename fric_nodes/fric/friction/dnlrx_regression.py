"""What a fit of a DNLRX needs: for given thresholds the force is linear in everything else (Amthor et al. 2008, Eq. 17).

    u(k) = Phi' [x(k) ... x(k-n); delta'(k) ... delta'(k-n_delta); 1]' + e(k),  k = lambda ... N - 1

The deformations at the first sample of a record are unknown, but not at a sample t_sl where all springs slide: there
delta_i = sgn Delta_i, with the sign of the motion that led there. The paper takes the dominant extremum of the displacement and
the sign of x(t_sl), which is the same for a motion about zero; its text says delta_1 where it means every delta_i. Here t_sl is
where the longest travel away from an earlier extremum ends, and the sign is that travel's. After a travel L
every spring slides whose threshold is below L/2, whatever its deformation was before; larger thresholds can't be told from such
a record. Samples before t_sl aren't used.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..record import Array
from . import dnlrx_loops
from .dnlrx import DnlrxError, DnlrxModel

__all__ = ["Sliding", "deformations", "from_coefficients", "noe", "regressors", "sliding_start", "spread_thresholds"]


class Sliding(NamedTuple):
    """A sample at which all springs slide.

    Attributes:
        sample: t_sl, as an index.
        direction: +1.0 or -1.0.
        travel: way in this direction that ends there [x]; thresholds up to half of it are surely sliding.
    """

    sample: int
    direction: float
    travel: float


def sliding_start(position: Array) -> Sliding:
    """Where the longest travel away from an earlier extremum ends, for positions [x] of shape ``(n_samples,)``.

    Raises:
        DnlrxError: the body doesn't move.
    """
    up = position - np.minimum.accumulate(position)
    down = np.maximum.accumulate(position) - position
    longest = max(float(up.max()), float(down.max()))
    if longest <= 0.0:
        raise DnlrxError("DNLRX position", "the body doesn't move", "use a recording with motion in both directions")
    # Of travels that are as long but for noise, the first: it leaves the most samples.
    near = 0.98 * longest
    first = int(np.argmax(np.maximum(up, down) >= near))
    direction = 1.0 if up[first] >= near else -1.0
    way = up if direction > 0.0 else down
    turned = way[first:] < 0.9 * longest
    end = first + int(np.argmax(turned)) if turned.any() else position.shape[0]
    index = first + int(np.argmax(way[first:end]))
    return Sliding(index, direction, float(way[index]))


def spread_thresholds(travel: float, n_springs: int) -> Array:
    """Thresholds to start a search from: evenly spread below half of ``travel``, shape ``(n_springs,)``."""
    return 0.5 * travel * np.arange(1, n_springs + 1) / (n_springs + 1)


def deformations(position: Array, thresholds: Array, deformation: Array | None = None) -> Array:
    """Deformations of the springs at every sample (Eq. 11), shape ``(n_samples, M)``.

    Args:
        position: [x], shape ``(n_samples,)``.
        thresholds: Delta [x], shape ``(M,)``.
        deformation: at the first sample, shape ``(M,)``; None: none.
    """
    thresholds = np.ascontiguousarray(thresholds, dtype=np.float64)
    found = np.empty((position.shape[0], thresholds.shape[0]))
    state = np.zeros(thresholds.shape[0]) if deformation is None else np.array(deformation, dtype=np.float64)
    if position.shape[0]:
        x = np.ascontiguousarray(position, dtype=np.float64)
        dnlrx_loops.deform(x, float(x[0]), thresholds, state, found)
    return found


def regressors(position: Array, thresholds: Array, n: int, n_delta: int, deformation: Array | None = None) -> Array:
    """The matrix of Eq. 17, shape ``(n_samples - lambda, n + 1 + (n_delta + 1) M + 1)`` with lambda = max(n, n_delta).

    Args:
        position: [x], shape ``(n_samples,)``.
        thresholds: Delta [x], shape ``(M,)``.
        n: order of the displacement's filter.
        n_delta: order of the deformations' filter.
        deformation: at the first sample, shape ``(M,)``: ``direction * thresholds`` when the record starts at t_sl; None: none.

    Raises:
        DnlrxError: an order below 0, or no sample left.
    """
    first = max(n, n_delta)
    n_samples = position.shape[0]
    if min(n, n_delta) < 0 or n_samples <= first:
        raise DnlrxError("DNLRX", f"{n_samples} samples for the orders {n} and {n_delta}", "give a longer record")
    delta = deformations(position, thresholds, deformation)
    columns = [position[first - j : n_samples - j, None] for j in range(n + 1)]
    columns += [delta[first - j : n_samples - j] for j in range(n_delta + 1)]
    return np.hstack([*columns, np.ones((n_samples - first, 1))])


def from_coefficients(coefficients: Array, thresholds: Array, n: int, n_delta: int, sample_time: float) -> DnlrxModel:
    """The DNLRX with these ``coefficients`` of the columns of :func:`regressors`."""
    n_springs = thresholds.shape[0]
    theta = coefficients[n + 1 : -1].reshape(n_delta + 1, n_springs)
    return DnlrxModel(sample_time, thresholds, coefficients[: n + 1], theta, float(coefficients[-1]))


def noe(measured: Array, predicted: Array) -> float:
    """Normalised output error, Eq. 19 [%]: 100 sum (u - u_hat)^2 / sum (u - mean u)^2, arrays of shape ``(n_samples,)``."""
    error = measured - predicted
    spread = measured - np.mean(measured)
    return 100.0 * float(error @ error) / float(spread @ spread)
