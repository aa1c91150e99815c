"""Too short: fewer strokes and changes of speed than there are things to find.

The value is the time in motion over the correlation time of the velocity, the time over which its autocorrelation falls to 1/e,
summed over all recordings: the number of independent pieces of motion. A short recording is no fault of the instruments, hence
a warning.
"""

from __future__ import annotations

import numpy as np

from ..check import Check, Evidence, Finding, Verdict
from ..view import View

__all__ = ["CHECK"]

_WARNING = 8.0
_LAGS = 400


def correlation_time(view: View) -> float:
    """Time over which the autocorrelation of the velocity, rests left out, falls to 1/e [s]."""
    thin = max(view.n // 4000, 1)
    v = np.where(view.moving, view.velocity, 0.0)[::thin]
    power = np.fft.rfft(v, 2 * v.size)
    correlation = np.fft.irfft(np.abs(power) ** 2)[: v.size]
    below = np.flatnonzero(correlation < correlation[0] / np.e)
    return float(below[0] if below.size else v.size) * thin * view.h


def _run(evidence: Evidence) -> list[Finding]:
    pieces, duration = 0.0, 0.0
    for view in evidence.views:
        duration += view.n * view.h
        if view.moves:
            pieces += float(np.sum(view.moving)) * view.h / correlation_time(view)
    if pieces == 0.0:
        return [Finding("length", "unknown", "it does not move, so that its length can't be judged")]
    verdict: Verdict = "warning" if pieces < _WARNING else "ok"
    detail = f"{duration:.3g} s hold {pieces:.0f} independent pieces of motion"
    remedy = "" if verdict == "ok" else f"record {max(2.0 * _WARNING / pieces, 2.0):.0f} times as long, with reversals"
    return [Finding("length", verdict, detail, pieces, "1", remedy=remedy)]


CHECK = Check("length", "long enough", "motion", _run)
