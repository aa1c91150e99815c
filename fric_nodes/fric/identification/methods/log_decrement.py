"""Logarithmic decrement, extended to asymmetric kinetic and viscous friction.

Every reversal of the recording is used: peaks (t_n, X_n) with covariances from :mod:`.oscillation.peaks`, and the recursion of
:mod:`.oscillation.motion`, which the true peaks obey exactly. With errors in all of them (each X_n stands on both sides of
the recursion) the estimate is the parameter vector, with the first peak's own time and height in it, whose chain of peaks is
nearest to the measured ones in the metric of their covariances. The start is the textbook estimate: for each direction the
straight line X_n = -q X_{n-1} - (1 + q)(D_x + s x_k) through pairs of successive peaks. The last stop is no peak: there the
static friction, not the kinetic, holds the body.

Source: de Marchi 1998 (extended logarithmic decrement); the derivation and corrections to it in :mod:`.oscillation.motion`.
"""

from __future__ import annotations

import numpy as np
from scipy import stats
from scipy.optimize import least_squares

from ...record import Array, Mask
from ..oscillation.conclusion import ALL, free_oscillation_method
from ..oscillation.motion import Natural, chain
from ..oscillation.peaks import Peaks, find_peaks
from ..oscillation.recording import Oscillation
from ..oscillation.result import Curves, FreeOscillation, status_of

__all__ = ["METHOD", "log_decrement", "textbook"]


def textbook(time: Array, position: Array, direction: int) -> Natural:
    """The natural parameters from straight lines through successive peaks, each of shape ``(n,)``; no weights, no errors."""
    half = np.diff(time)
    ratios, centres = {}, {}
    for first, s in ((0, direction), (1, -direction)):
        before, after = position[first:-1:2], position[first + 1 :: 2]
        if before.shape[0] >= 2:
            slope = np.polyfit(before, after, 1)[0]
            q = float(np.clip(-slope, 1e-3, 0.999999))
            ratios[s], centres[s] = q, float(np.mean(after) + q * np.mean(before)) / (1.0 + q)
    decrement = {s: -np.log(q) / np.pi for s, q in ratios.items()}
    zeta = {s: b / np.sqrt(1.0 + b**2) for s, b in decrement.items()}
    mean, difference = 0.5 * (zeta[1] + zeta[-1]), 0.5 * (zeta[1] - zeta[-1])
    frequency = np.pi / float(np.mean(half)) / np.sqrt(1.0 - mean**2)
    return Natural(
        float(frequency), float(mean), float(difference), 0.5 * (centres[-1] - centres[1]), -0.5 * (centres[1] + centres[-1])
    )


def _whiteners(peaks: Peaks) -> Array:
    """Inverse square roots of the covariances, shape ``(n, 2, 2)``."""
    return np.linalg.inv(np.linalg.cholesky(peaks.covariance))


def _fit_chain(peaks: Peaks, start: Natural, asked: Mask) -> tuple[Natural, Array, Array, Array]:
    """Natural parameters, first peak, their joint covariance ``(n_asked + 2, ...)`` and whitened residuals ``(n, 2)``."""
    n = peaks.time.shape[0]
    whiten = _whiteners(peaks)
    travel, half = float(np.ptp(peaks.position)), float(np.mean(np.diff(peaks.time)))
    scale = np.concatenate([np.array([start.frequency, 0.01, 0.01, 0.1 * travel, 0.1 * travel])[asked], [half, travel]])
    base = np.where(asked, start.values, 0.0)

    def unpacked(point: Array) -> tuple[Natural, float, float]:
        values = base.copy()
        values[asked] = (point * scale)[:-2]
        return Natural.of(values), float(point[-2] * scale[-2]), float(point[-1] * scale[-1])

    def residual(point: Array) -> Array:
        times, positions = chain(*unpacked(point), peaks.direction, n)
        off = np.stack([times - peaks.time, positions - peaks.position], axis=1)
        return np.asarray(np.einsum("nij,nj->ni", whiten, off).ravel())

    first = np.concatenate([base[asked], [peaks.time[0], peaks.position[0]]]) / scale
    answer = least_squares(residual, first, method="lm", xtol=1e-12, ftol=1e-12, max_nfev=400)
    natural, time, position = unpacked(answer.x)
    jacobian = answer.jac / scale
    covariance = np.linalg.pinv(jacobian.T @ jacobian)
    return natural, np.array([time, position]), covariance, np.asarray(answer.fun).reshape(n, 2)


def _curves(peaks: Peaks, natural: Natural) -> Curves:
    """One point per half cycle: from one peak to the next."""
    times, positions = peaks.time, peaks.position
    middle = 0.5 * (positions[1:-1] + 0.5 * (positions[:-2] + positions[2:]))
    size = 0.25 * np.abs(2.0 * positions[1:-1] - positions[:-2] - positions[2:])
    frequency = 2.0 * np.pi / (times[2:] - times[:-2])
    swing = np.abs(np.diff(positions))
    loss = -np.log(swing[1:] / swing[:-1]) / np.pi
    return Curves(times[1:-1], size, frequency, loss, middle)


def log_decrement(found: Oscillation, asked: Mask = ALL) -> FreeOscillation:
    """The natural parameters of ``found`` by the extended logarithmic decrement.

    Args:
        found: the oscillation.
        asked: which natural parameters to fit, shape ``(5,)``; the others are zero.
    """
    time, position = found.time[found.turns], found.position[found.turns]
    plain = textbook(time, position, found.direction)
    natural = plain
    for _ in range(2):
        peaks = find_peaks(found, natural)
        natural, first, covariance, left = _fit_chain(peaks, natural, asked)
    n = peaks.time.shape[0]
    freedom = 2 * n - int(np.sum(asked)) - 2
    misfit = float(np.sqrt(np.sum(left**2) / max(freedom, 1)))
    if np.sum(left**2) > stats.chi2.ppf(0.999, freedom):
        # More than noise is left: what is found holds on average, and as well as the half cycles agree on it.
        covariance = covariance * misfit**2
    whole = np.zeros((5, 5))
    n_asked = int(np.sum(asked))
    whole[np.ix_(asked, asked)] = covariance[:n_asked, :n_asked]
    status, warnings = status_of(natural, whole, asked, n - 1, misfit)
    return FreeOscillation(
        natural=natural,
        covariance=whole,
        first=(float(first[0]), float(first[1])),
        direction=found.direction,
        half_cycles=n - 1,
        misfit=misfit,
        curves=_curves(peaks, natural),
        status=status,
        warnings=warnings,
        plain=plain,
    )


METHOD = free_oscillation_method("log-decrement", "extended logarithmic decrement", "de Marchi 1998", log_decrement)
