"""What the methods on a transform (Hilbert, wavelet) have in common: range, thinning, correction, result."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...record import Array, Mask
from ..methods.log_decrement import textbook
from .envelope import Envelope, binned, curves_of, natural_of, reading
from .matching import matched
from .recording import Oscillation
from .result import FreeOscillation, status_of

__all__ = ["identify", "inner_part", "thin_motion"]

_PER_HALF_CYCLE = 24


def thin_motion(found: Oscillation) -> tuple[Array, Array, float]:
    """Time and position from the first to the last reversal, averaged to about so many samples per half cycle.

    The last value [s] is the standard deviation of the times within an average, for :func:`.matching.matched`.
    """
    block = max(int(found.half_period / found.sample_time / _PER_HALF_CYCLE), 1)
    first, last = int(found.turns[0]), int(found.turns[-1]) + 1
    n = (last - first) // block
    part = slice(first, first + n * block)
    time, position = (values[part].reshape(n, block).mean(axis=1) for values in (found.time, found.position))
    return time, position, found.sample_time * float(np.sqrt((block**2 - 1.0) / 12.0))


def inner_part(time: Array, half_period: float, margin: float) -> Mask:
    """All but ``margin`` half cycles at either end; at least the middle third."""
    cut = min(margin * half_period, (float(time[-1]) - float(time[0])) / 3.0)
    return np.asarray((time >= time[0] + cut) & (time <= time[-1] - cut))


def identify(
    found: Oscillation, envelope: Callable[[Array, Array, float], Envelope], asked: Mask, rng: np.random.Generator
) -> FreeOscillation:
    """The natural parameters of ``found`` from ``envelope(time, position, half period)``.

    Args:
        found: the oscillation.
        envelope: the transform.
        asked: which natural parameters to fit, shape ``(5,)``; the others are zero.
        rng: of the noise that standard errors are found with.
    """
    time, position, width = thin_motion(found)
    half = found.half_period
    seen = envelope(time, position, half)
    plain = natural_of(reading(seen))
    # The solution is that of the readings; where the search for it starts is not part of the method.
    start = textbook(found.time[found.turns], found.position[found.turns], found.direction)
    turn = int(found.turns[0])
    # A phase counts as much as the arc that it is, at the amplitude there.
    level = binned(seen, half)
    n_bins = level.shape[0] // 3
    answer = matched(
        lambda values: binned(envelope(time, values, half), half),
        np.concatenate([np.ones(2 * n_bins), level[:n_bins]]),
        (time, position, width),
        (start, float(found.time[turn]), float(found.position[turn]), found.direction),
        asked,
        rng,
    )
    covariance = np.zeros((5, 5))
    covariance[np.ix_(asked, asked)] = answer.covariance
    block = float(time[1] - time[0]) / found.sample_time
    quiet = found.noise / np.sqrt(block)
    misfit = max(float(np.sqrt(np.mean(answer.left**2))) / max(quiet, 1e-12 * float(np.ptp(position))), 1e-3)
    n = found.turns.shape[0] - 1
    status, warnings = status_of(answer.natural, covariance, asked, n, misfit)
    if not answer.agrees:
        status = "not converged: no oscillation of the model matches the recorded one; use log-decrement"
    return FreeOscillation(
        natural=answer.natural,
        covariance=covariance,
        first=answer.first,
        direction=found.direction,
        half_cycles=n,
        misfit=misfit,
        curves=curves_of(seen, half),
        status=status,
        warnings=warnings,
        plain=plain,
    )
