"""Whether a method that works on the raw samples agrees with the filtered equations, and wider intervals if it doesn't.

Output error and prediction error use what inverse dynamics filters away, which makes them sharper where a recording is what
they take it for: forces known between the samples, white errors, even stamps. Both kinds estimate the same parameters, so that
their difference d is, where all holds, within the sum C of their uncertainties: d' C^-1 d stays below chi-squared (Hausman
1978, who takes the difference of both for a method known to be the sharper one). Where that is exceeded the covariance is
enlarged by d d'; where the recording is known to be of another kind, that of the filtered equations stands for it. The
warning says why.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from ..model import Model
from ..record import Array, Record
from ..signals.resolution import noise_of, step_of
from .conclusion import Fitted
from .free_parameters import FreeParameters

__all__ = ["reconciled", "unsuited"]

_LEVEL = 0.99  # of the test
_MOVES = 1.0  # steps of the encoder from sample to sample, below which its rounding isn't white
_DITHER = 0.5  # steps of noise that make it white all the same


def unsuited(records: Sequence[Record]) -> str:
    """Why no method may rely on single samples of ``records``; empty where one may."""
    for record in records:
        if record.timing_error > 0.0 and record.hold == "linear":
            return "how the force is held between samples isn't known"
        step = step_of(record.position)
        moves = float(np.median(np.abs(np.diff(record.position))))
        if step > 0.0 and moves < _MOVES * step and noise_of(record.position) < _DITHER * step:
            return f"the encoder is coarse: the axis usually moves {moves / step:.2g} of its steps from sample to sample"
    return ""


def reconciled(
    model: Model, free: FreeParameters, covariance: Array, begun: Fitted, reason: str = ""
) -> tuple[Array, list[str]]:
    """The covariance to go by, shape ``(n_free, n_free)``, and a warning where the methods don't agree.

    Args:
        model: found by the method on raw samples.
        free: its free parameters.
        covariance: of their estimates.
        begun: the fit of the filtered equations.
        reason: why the recording doesn't suit the method; empty where it does.
    """
    covariance = covariance.copy()
    at = [begun.free.names.index(name) for name in free.names]
    own = begun.covariance[np.ix_(at, at)]
    if begun.timing is not None:
        covariance += begun.timing[np.ix_(at, at)]
    if model.has_slip_dynamics:
        return covariance, []  # there the filtered equations are the rougher guess
    known = np.flatnonzero(np.isfinite(np.diag(own)) & (np.diag(own) > 0.0))
    if not known.size:
        return covariance, []
    off = model.values[free.index] - begun.model.values[begun.free.index[at]]
    part = np.ix_(known, known)
    both = own[part] + np.nan_to_num(covariance[part])
    size = np.sqrt(np.diag(both))
    apart = off[known] / size
    distance = float(apart @ np.linalg.pinv(both / np.outer(size, size), rcond=1e-6, hermitian=True) @ apart)
    differs = distance > float(chi2.ppf(_LEVEL, known.size))
    if not (differs or reason):
        return covariance, []
    if reason:
        covariance[part] = own[part]
    if differs:
        covariance[part] += np.outer(off[known], off[known])
    worst = free.names[int(known[np.argmax(np.abs(apart))])]
    there = begun.model.value(worst)
    why = reason or "something acts that the method's assumptions exclude"
    said = (
        f"{why}, so that single samples can't be relied on; the intervals are as wide as those of the filtered equations "
        f"(inverse-dynamics), which give {worst} = {there:.5g} where this method gives {model.value(worst):.5g}"
    )
    return covariance, [said]
