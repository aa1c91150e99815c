"""The recorded velocity against the derivative of the position: scale, sign, lag.

The value is the factor between them; the lag is the shift at which they agree best. Fits take the derivative of the position,
so that a wrong velocity does no harm there, but tells of a unit or a filter that other signals may share.
"""

from __future__ import annotations

import math

import numpy as np

from ..record import Array
from .check import Check, Correction, Evidence, Finding, each
from .units import name_of
from .view import View

__all__ = ["CHECK"]

_SCALE = 0.05
_LAG_SAMPLES = 2.5
_ALIKE = 0.9
_CHANGES = 0.15


def _lag(view: View, other: Array) -> float:
    """Time by which ``other`` comes after the velocity [s], by the correlation's peak."""
    reach = int(np.clip(0.5 / view.h, 4, view.n // 4))
    a, b = (view.velocity - np.mean(view.velocity)) * view.usable, other - np.mean(other)
    size = 1 << int(np.ceil(np.log2(2 * view.n)))
    product = np.fft.irfft(np.conj(np.fft.rfft(a, size)) * np.fft.rfft(b, size))
    near = np.concatenate([product[-reach:], product[: reach + 1]])
    k = int(np.clip(np.argmax(np.abs(near)), 1, near.size - 2))
    low, mid, high = np.abs(near[k - 1 : k + 2])
    bend = low - 2.0 * mid + high
    return float(k - reach + (0.5 * (low - high) / bend if bend < 0.0 else 0.0)) * view.h


def _judge(view: View, evidence: Evidence) -> Finding:
    recorded = view.even.velocity
    if recorded is None:
        return Finding("velocity_signal", "unknown", "no velocity was recorded")
    if not view.moves:
        return Finding("velocity_signal", "unknown", "it does not move")
    other = view.low_pass(recorded)
    # A velocity that hardly changes shows no lag.
    steady = float(np.std(view.velocity[view.usable])) < _CHANGES * view.speed
    lag = 0.0 if steady else _lag(view, other)
    grid = np.arange(view.n) * view.h
    aligned = np.interp(grid + lag, grid, other)
    use = view.usable
    power = float(np.sum(view.velocity[use] ** 2))
    product = float(np.sum(view.velocity[use] * aligned[use]))
    scale = product / power
    alike = product / max(math.sqrt(power * float(np.sum(aligned[use] ** 2))), 1e-300)
    if abs(alike) < _ALIKE:
        detail = f"the velocity is not that of the position (correlation {alike:.2f})"
        remedy = "check which joint or which side of the gear it belongs to; fits use the position's derivative"
        return Finding("velocity_signal", "warning", detail, scale, "1", remedy=remedy)
    if abs(scale - 1.0) > _SCALE:
        name = "" if abs(scale) in {0.0, 1.0} else name_of(abs(scale), evidence.settings)
        sign = "with the opposite sign, " if scale < 0 else ""
        detail = f"the velocity is {sign}{abs(scale):.4g} times the derivative of the position"
        detail += f": suspected is {name}" if name and abs(math.log(abs(scale))) > math.log(2.0) else ""
        remedy = "correct its unit or sign in the import's mapping; fits use the position's derivative"
        correction = Correction(velocity_factor=1.0 / scale)
        return Finding("velocity_signal", "fault", detail, scale, "1", remedy=remedy, correction=correction)
    if abs(lag) > _LAG_SAMPLES * view.record.sample_time:
        detail = f"the velocity comes {1e3 * abs(lag):.3g} ms {'after' if lag > 0 else 'before'} the derivative of the position"
        remedy = "it is filtered or stamped late: don't use it with this position; fits use the position's derivative"
        return Finding("velocity_signal", "warning", detail, lag, "s", remedy=remedy)
    return Finding("velocity_signal", "ok", f"the position's derivative, times {scale:.4g}", scale, "1")


CHECK = Check("velocity_signal", "velocity against position", "a recorded velocity", each(_judge))
