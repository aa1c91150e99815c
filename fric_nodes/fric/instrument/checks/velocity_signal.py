"""The recorded velocity against the derivative of the position: scale, sign, lag.

The recorded velocity w is compared with w(t) = s v(t - tau), v the derivative of the position, both through one filter. For
each shift that is whole in samples the best factor s leaves a misfit

    J(tau) = sum w(t + tau)^2 - (sum v(t) w(t + tau))^2 / sum v(t)^2 ,

summed over the same samples t for every tau, and normalised by the energy of what was shifted: a bare correlation has its
peak where the motion happens to be larger. Every tau with J(tau)/J_min - 1 < F/nu is as likely as the best one (likelihood
ratio at 0.1 %; nu = 2 B T independent values behind a filter to B, T the time in which it moves). The velocity is late when
no such tau lies within a few samples of zero, and when it matters: the shift changes the velocity by more than a fiftieth of
its rms. For a periodic motion, or a ramp, many tau are as likely, zero among them. The factor is judged at the lag in the
same way.

Fits take the derivative of the position, so that a wrong velocity does no harm there, but tells of a unit or a filter that
other signals may share.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy import stats

from ...record import Array, Index
from ..check import Check, Correction, Evidence, Finding, each
from ..view import View
from .units import named

__all__ = ["CHECK"]

_SCALE = 0.05  # a factor this near to 1 is a matter of calibration
_LAG_SAMPLES = 2.5  # a difference over a sample or two is late by that much
_MATTERS = 0.02  # of the velocity's rms
_ALIKE = 0.9
_CHANGES = 0.15  # of the high speed: a velocity that changes less shows no lag
_LEVEL = 0.001
_BAND = 0.05  # of the rate
_DIFFERENCE = 0.02  # by which a central difference may be short of the derivative: 1.6 % at that band's end
_REACH = 0.5  # [s] longest lag
_PERIODS = 4.0  # of the filter's cutoff, at least, that have to be left


class _Shifted(NamedTuple):
    """Sums over the samples compared, for every shift: factor, misfit J, energy; the best, and all as likely ones."""

    tau: Array
    factor: Array
    misfit: Array
    energy: Array
    best: int
    likely: Index
    freedom: float


def _shifted(view: View, recorded: Array, cutoff: float, steady: bool) -> _Shifted | None:
    """The sums; None where too little is left of the recording. A ``steady`` motion is compared as it is alone."""
    v = np.gradient(view.low_pass(view.even.position, cutoff), view.h)
    w = view.low_pass(recorded, cutoff)
    edge = math.ceil(1.0 / (cutoff * view.h))
    reach = 0 if steady else min(math.ceil(_REACH / view.h), max(view.n // 8, 4))
    use = view.even.mask.copy()
    use[: edge + reach] = False
    use[view.n - edge - reach :] = False
    seconds = float(np.sum(use)) * view.h
    if seconds * cutoff < _PERIODS:
        return None
    size = 1 << math.ceil(math.log2(2 * view.n))
    shifts = np.arange(-reach, reach + 1)

    def over(kept: Array, moved: Array) -> Array:
        product = np.fft.irfft(np.conj(np.fft.rfft(kept, size)) * np.fft.rfft(moved, size), size)
        return np.asarray(product[shifts % size])

    power = float(np.sum(v[use] ** 2))
    energy = np.maximum(over(np.asarray(use, dtype=np.float64), w**2), 1e-300)
    product = over(np.where(use, v, 0.0), w)
    # Rounding of the transform: an exact velocity would leave less.
    misfit = np.maximum(energy - product**2 / power, 1e-10 * energy)
    share = misfit / energy
    # A factor of the other sign is another fault; half a period late is none.
    sign = product * (1.0 if product[reach] >= 0.0 else -1.0) > 0.0
    best = int(np.argmin(np.where(sign, share, np.inf))) if np.any(sign) else reach
    # Where it moves in bursts, only they count: the effective number of samples of the energy.
    burst = power**2 / max(float(np.sum(v[use] ** 4)), 1e-300)
    freedom = max(2.0 * cutoff * view.h * burst - 2.0, 3.0)
    limit = share[best] * (1.0 + float(stats.f.isf(_LEVEL, 1.0, freedom)) / freedom)
    return _Shifted(
        np.asarray(shifts * view.h), product / power, share, energy, best, np.flatnonzero(sign & (share <= limit)), freedom
    )


def _judge(view: View, evidence: Evidence) -> Finding:
    recorded = view.even.velocity
    if recorded is None:
        return Finding("velocity_signal", "unknown", "no velocity was recorded")
    if not view.moves:
        return Finding("velocity_signal", "unknown", "it does not move")
    steady = float(np.std(view.velocity[view.usable])) < _CHANGES * view.speed
    found = _shifted(view, recorded, min(view.cutoff, _BAND / view.h), steady)
    if found is None:
        return Finding("velocity_signal", "unknown", "too short: the ends of the filter cover all of it")
    zero, best = int(np.argmin(np.abs(found.tau))), found.best
    if found.energy[zero] <= 1e-290:
        return Finding("velocity_signal", "fault", "the velocity is 0 throughout although it moves", 0.0, "1")
    within = np.abs(found.tau[found.likely]) <= _LAG_SAMPLES * view.record.sample_time
    late = found.likely.size > 0 and not np.any(within) and _effect(found, zero) > _MATTERS
    at = best if late else zero
    alike = math.copysign(math.sqrt(max(1.0 - found.misfit[at], 0.0)), found.factor[at])
    if abs(alike) < _ALIKE:
        below = _alike_below(view, recorded, steady)
        if below is not None:
            detail = f"the velocity is that of the position only below {below:.2g} Hz (correlation {alike:.2f} further up)"
            remedy = "one of them is repeated, coarse or filtered; read both at once, at an even rate"
            return Finding("velocity_signal", "warning", detail, float(found.factor[at]), "1", remedy=remedy)
        detail = f"the velocity is not that of the position (correlation {alike:.2f})"
        remedy = "check which joint or which side of the gear it belongs to; fits use the position's derivative"
        return Finding("velocity_signal", "warning", detail, float(found.factor[at]), "1", remedy=remedy)
    scale = float(found.factor[at])
    # Whichever of the two is the noisy one, the factor lies between the regressions of either on the other.
    other = scale / max(1.0 - float(found.misfit[at]), 1e-12)
    half = abs(scale) * float(stats.t.isf(0.5 * _LEVEL, found.freedom)) * math.sqrt(found.misfit[at] / found.freedom)
    interval = (min(scale, other) - half, max(scale, other) + half)
    if not interval[0] - _SCALE <= 1.0 <= interval[1] + _SCALE:
        return _scaled(scale, interval, evidence)
    if late:
        return _late(found)
    if interval[0] < 0.5 or interval[1] > 1.5:
        return Finding("velocity_signal", "unknown", "the position is too coarse to compare it with", scale, "1", interval)
    return Finding("velocity_signal", "ok", f"the position's derivative, times {scale:.4g}", scale, "1", interval)


def _alike_below(view: View, recorded: Array, steady: bool) -> float | None:
    """The highest frequency [Hz], by halves, below which the velocity is the derivative of the position; None where none is."""
    cutoff = 0.5 * min(view.cutoff, _BAND / view.h)
    while (found := _shifted(view, recorded, cutoff, steady)) is not None:
        alike = 1.0 - float(found.misfit[found.best])
        if alike > _ALIKE**2 and found.factor[found.best] > 0.0:
            return cutoff
        cutoff *= 0.5
    return None


def _effect(found: _Shifted, zero: int) -> float:
    """By how much of its rms the velocity comes nearer to the derivative when it is shifted from no lag to the best."""
    return math.sqrt(max(float(found.misfit[zero] - found.misfit[found.best]), 0.0))


def _scaled(scale: float, interval: tuple[float, float], evidence: Evidence) -> Finding:
    low, high = sorted(abs(limit) for limit in interval)
    # A name for what is within a factor of two of 1 would be a guess.
    name = named(low * (1.0 - _DIFFERENCE), high * (1.0 + _DIFFERENCE), evidence.settings) if scale else ""
    sign = "with the opposite sign, " if scale < 0 else ""
    detail = f"the velocity is {sign}{abs(scale):.4g} times the derivative of the position"
    detail += f": a likely reason is {name}" if name and abs(math.log(abs(scale))) > math.log(2.0) else ""
    remedy = "correct its unit or sign in the import's mapping; fits use the position's derivative"
    correction = Correction(velocity_factor=1.0 / scale)
    return Finding("velocity_signal", "fault", detail, scale, "1", interval, remedy, correction=correction)


def _late(found: _Shifted) -> Finding:
    lag, step = float(found.tau[found.best]), float(found.tau[1] - found.tau[0])
    low, high = float(found.tau[found.likely[0]]) - 0.5 * step, float(found.tau[found.likely[-1]]) + 0.5 * step
    if 0 < found.best < found.tau.size - 1:
        before, at, after = found.misfit[found.best - 1 : found.best + 2]
        bend = before - 2.0 * at + after
        lag += float(0.5 * (before - after) / bend * step) if bend > 0.0 else 0.0
    detail = f"the velocity comes {1e3 * abs(lag):.3g} ms {'after' if lag > 0 else 'before'} the derivative of the position"
    if low < 0.0 < high:
        detail = "the velocity is shifted against the derivative of the position; the motion is periodic: the shift is open"
    remedy = "it is filtered or stamped late: don't use it with this position; fits use the position's derivative"
    return Finding("velocity_signal", "warning", detail, lag, "s", (low, high), remedy)


CHECK = Check("velocity_signal", "velocity against position", "a recorded velocity", each(_judge))
