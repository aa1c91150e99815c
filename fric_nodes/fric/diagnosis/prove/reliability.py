"""Whether findings are right as often as they say: calibration error in bins of confidence, and what chance makes of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

__all__ = ["calibration_bins", "calibration_error", "error_by_chance"]

_BINS = 10
_DRAWS = 400


def calibration_bins(pairs: Sequence[tuple[float, bool]]) -> tuple[tuple[float, float, int], ...]:
    """Of findings as ``(confidence, right)``: mean confidence, share right and number in each of ten bins that isn't empty."""
    bins = []
    for k in range(_BINS):
        inside = [each for each in pairs if min(int(each[0] * _BINS), _BINS - 1) == k]
        if inside:
            n = len(inside)
            bins.append((sum(c for c, _ in inside) / n, sum(right for _, right in inside) / n, n))
    return tuple(bins)


def calibration_error(pairs: Sequence[tuple[float, bool]]) -> float:
    """The expected calibration error of findings as ``(confidence, right)``; NaN without any."""
    bins = calibration_bins(pairs)
    return sum(n * abs(said - right) for said, right, n in bins) / len(pairs) if pairs else math.nan


def error_by_chance(confidences: Sequence[float]) -> float:
    """The calibration error that remains in the mean if every one of ``confidences`` is exact; NaN without any.

    Few findings scatter: twenty that are right as often as they say come to 0.1 and more.
    """
    drawn = np.random.default_rng(0).random((_DRAWS, len(confidences)))
    errors = [calibration_error([(c, bool(r < c)) for c, r in zip(confidences, row, strict=True)]) for row in drawn]
    return float(np.mean(errors))
