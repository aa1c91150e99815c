"""Sampled too slowly: the position does not follow from its neighbours.

Every other sample is left out and put back by the cubic through its four neighbours. For a motion of angular frequency w that
errs by about 0.375 (w h)^3 of a step between samples, so that the error tells how many samples a period of the fastest motion
has: the value. Noise errs too, but as much when every second sample is missing altogether, where a motion's error grows
sixteenfold. Where the force jumps, the acceleration does, and the cubic errs there at whatever rate; but only at the few
samples that have the jump among their neighbours. So error and step are taken as medians over twice as many samples.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import median_filter

from ...record import Array
from ..check import Check, Evidence, Finding, Verdict, each
from ..view import View

__all__ = ["CHECK"]

_FAULT = 12.0
_WARNING = 18.0
_GROWTH = 2.5
_JUMP = 15  # samples: a jump is among the neighbours of seven
_WHOLE = 0.05  # of the position's own spread: then it isn't noise


def _miss(q: Array) -> tuple[float, float]:
    """Error of the cubic, and step between samples: rms of medians over a few samples."""
    guess = (-q[:-6] + 9.0 * q[2:-4] + 9.0 * q[4:-2] - q[6:]) / 16.0
    local = (median_filter(np.abs(values), size=_JUMP, mode="nearest") for values in (q[3:-3] - guess, np.diff(q)))
    error, step = (float(np.sqrt(np.mean(values**2))) for values in local)
    return error, step


def _judge(view: View, evidence: Evidence) -> Finding:
    q = view.even.position
    if view.travel == 0.0 or view.n < 40:
        return Finding("sampling", "unknown", "it does not move, or hardly a sample was taken")
    error, step = _miss(q)
    # What lies within the steps of the sensor is theirs.
    error = error if error > view.resolution else 0.0
    coarse = _miss(q[::2])[0]
    spread = float(np.std(q))
    motion = error > 0.0 and (coarse > _GROWTH * error or error > _WHOLE * spread)
    samples = 2.0 * math.pi / max((error / (0.375 * step)) ** (1.0 / 3.0), 0.02) if motion and error > 0.0 else math.inf
    rate = 1.0 / view.h
    if samples >= _WARNING:
        known = math.isfinite(samples)
        detail = (
            f"about {samples:.0f} samples in a period of the fastest motion" if known else "the motion is slow beside the rate"
        )
        return Finding("sampling", "ok", detail, samples if known else math.nan, "1")
    verdict: Verdict = "fault" if samples < _FAULT else "warning"
    detail = f"only about {samples:.2g} samples in a period of the fastest motion, at {rate:.4g} Hz"
    remedy = f"record at {math.ceil(rate * 2.0 * _WARNING / samples):.0f} Hz or more, or move more slowly"
    return Finding("sampling", verdict, detail, samples, "1", remedy=remedy)


CHECK = Check("sampling", "sampled fast enough", "motion", each(_judge))
