"""Two recordings of one excitation by different clocks: the offset and the ratio of the clocks that align them.

Both begin at different times and may run at different rates. The offset maximises the correlation of their velocities (that of
the positions is lost when one drifts), first over the samples of a common grid, then by Gauss-Newton steps on the positions
between the samples, together with the ratio of the clocks, an offset of the position and a drift of it. The standard errors of
offset and ratio are those of this fit, with the correlation of what remains counted in.

A simulation that drifts far from the machine has another motion, but the same force. Where the motions don't determine the
offset and the efforts correlate better than the velocities, the efforts align the two, to a sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, correlate, sosfiltfilt

from ..errors import InputError
from ..record import Array, Record

__all__ = ["BANDWIDTH", "LEAST_OVERLAP", "MOST_RATIO", "Alignment", "CompareError", "Z", "align", "velocity_of"]

BANDWIDTH = 140.0  # [rad/s] of the velocities that are compared, a physical scale
LEAST_OVERLAP = 1.0  # [s], a physical scale: a few motions of a slow axis
MOST_RATIO = 0.01  # of the clocks, a physical scale: quartz clocks differ by far less
Z = 1.96  # standard errors of a 95 % interval, a statistical level
_LEAST_CORRELATION = 0.5  # of the velocities, below which the two don't tell the same story
_ITERATIONS = 12


class CompareError(InputError):
    """Recordings that can't be compared."""


@dataclass(frozen=True)
class Alignment:
    """How the clocks of two recordings are related: real = offset + ratio * simulated.

    Attributes:
        offset: of the clocks [s].
        offset_error: its standard error [s].
        ratio: of the clocks.
        ratio_error: its standard error; NaN where the efforts align the two.
        motion_time: in which the velocity of the real one changes by its own size [s]; the scale of a shift in time.
        by_effort: True where the efforts align the two, since the motions differ too much.
    """

    offset: float
    offset_error: float
    ratio: float
    ratio_error: float
    motion_time: float
    by_effort: bool = False

    @property
    def offset_told(self) -> bool:
        """True where the recordings determine the offset of their clocks."""
        return bool(Z * self.offset_error < self.motion_time)

    @property
    def ratio_told(self) -> bool:
        """True where the recordings determine the ratio of their clocks."""
        return bool(Z * self.ratio_error < MOST_RATIO)

    @property
    def interval(self) -> tuple[float, float]:
        """In which the offset lies with 95 % confidence [s]."""
        return self.offset - Z * self.offset_error, self.offset + Z * self.offset_error

    @property
    def offset_in_words(self) -> str:
        """The offset with its uncertainty, or why it cannot be told."""
        if self.by_effort:
            return f"{self.offset:.6g} s ± {Z * self.offset_error:.2g} s, from the efforts: the motions differ too much"
        if self.offset_told:
            return f"{self.offset:.6g} s ± {Z * self.offset_error:.2g} s (95 %)"
        return (
            "cannot be told from this recording: the motions differ by more than a shift in time, and shifts of "
            f"{self.motion_time:.2g} s and more fit as well"
        )

    @property
    def ratio_in_words(self) -> str:
        """The ratio of the clocks with its uncertainty, or why it cannot be told."""
        if self.ratio_told:
            return f"{self.ratio:.8g} ± {Z * self.ratio_error:.2g} (95 %)"
        return f"cannot be told from this recording, since the motions differ: ±{100 * MOST_RATIO:g} % and more fit as well"


def align(simulated: Record, real: Record, efforts: bool) -> Alignment:
    """The clocks of both.

    Args:
        simulated: the one recording.
        real: the other one.
        efforts: True where both have an effort that changes.

    Raises:
        CompareError: they have no motion in common.
    """
    step = max(simulated.sample_time, real.sample_time)
    even = simulated.uniform(step), real.uniform(step)
    lag, score = _best_lag(velocity_of(even[1]), velocity_of(even[0]), step)
    effort_lag, effort_score = _best_lag(even[1].effort, even[0].effort, step) if efforts else (0, -1.0)
    if score < _LEAST_CORRELATION:
        raise CompareError(
            simulated.source,
            f"has no motion in common with {real.source}: their velocities correlate by {score:.2f} at best",
            "compare recordings of one excitation",
        )
    scale = _motion_time(real)
    offset, ratio, errors = _refined(simulated, real, lag * step)
    found = Alignment(offset, errors[0], ratio, errors[1], scale)
    if (found.offset_told and found.ratio_told) or effort_score <= score:
        return found
    # Somewhere within the step.
    return Alignment(effort_lag * step, step / math.sqrt(12.0), 1.0, math.nan, scale, by_effort=True)


def _motion_time(real: Record) -> float:
    """RMS of the velocity over RMS of the acceleration [s]."""
    velocity = velocity_of(real)[real.mask]
    acceleration = np.gradient(velocity_of(real), real.time)[real.mask]
    size = float(np.sqrt(np.mean(acceleration**2)))
    return float(np.sqrt(np.mean(velocity**2))) / size if size > 0.0 else math.inf


def velocity_of(record: Record) -> Array:
    """From the position, low-passed without phase, at the record's own stamps [x/s]."""
    even = record.uniform()
    rate = np.gradient(_low(even.position, even.sample_time), even.sample_time)
    return np.interp(record.time, even.time, rate)


def _low(signal: Array, step: float) -> Array:
    edge = BANDWIDTH * step / math.pi
    if edge >= 0.9:
        return signal
    result: Array = sosfiltfilt(butter(2, edge, output="sos"), signal)
    return result


def _best_lag(real: Array, simulated: Array, step: float) -> tuple[int, float]:
    """Lag at which two signals correlate most, in samples, and their correlation; overlaps of less than a fifth don't count."""
    a, b = real - np.mean(real), simulated - np.mean(simulated)
    cross = correlate(a, b, mode="full", method="fft")
    lag = np.arange(-(b.shape[0] - 1), a.shape[0])
    # Energies of both within the overlap, so that a short one isn't at a disadvantage.
    sums_a = np.concatenate([[0.0], np.cumsum(a**2)])
    sums_b = np.concatenate([[0.0], np.cumsum(b**2)])
    first, last = np.maximum(lag, 0), np.minimum(lag + b.shape[0], a.shape[0])
    energy = (sums_a[last] - sums_a[first]) * (sums_b[last - lag] - sums_b[first - lag])
    shorter = min(a.shape[0], b.shape[0])
    able = (last - first >= max(0.2 * shorter, LEAST_OVERLAP / step)) & (energy > 1e-4 * sums_a[-1] * sums_b[-1])
    score = np.where(able, cross / np.sqrt(np.maximum(energy, 1e-300)), -1.0)
    # Among peaks that are as good as equal, the one with the longest overlap: a periodic motion has many.
    beside = np.concatenate([[-1.0], score, [-1.0]])
    peak = (score >= beside[:-2]) & (score >= beside[2:])
    good = np.flatnonzero(peak & (score > np.max(score) - 0.02))
    best = int(good[np.argmax((last - first)[good] + score[good])])
    return int(lag[best]), float(score[best])


def _refined(simulated: Record, real: Record, rough: float) -> tuple[float, float, tuple[float, float]]:
    """Offset [s] and ratio of the clocks between the samples, and their standard errors."""
    rate = velocity_of(simulated)
    low_s, low_r = _resampled(simulated), _resampled(real)
    offset, ratio = rough, 1.0
    errors = (math.nan, math.nan)
    # A ratio of clocks is told from a drift only when there is time for it.
    for _ in range(_ITERATIONS):
        there = (real.time - offset) / ratio
        use = (there >= 0.0) & (there <= simulated.time[-1]) & real.mask
        if np.sum(use) < 50:
            break
        t = there[use]
        difference = low_r[use] - np.interp(t, simulated.time, low_s)
        v = np.interp(t, simulated.time, rate)
        centred = (t - np.mean(t)) / max(float(np.ptp(t)), 1e-12)
        columns = np.column_stack([-v, -v * centred, np.ones_like(t), centred])
        scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        found, *_ = np.linalg.lstsq(columns / scale, difference, rcond=None)
        rest = difference - columns / scale @ found
        inverse = np.linalg.pinv((columns / scale).T @ (columns / scale))
        variance = float(rest @ rest) / rest.size * _correlated(rest)
        spread = np.sqrt(np.maximum(np.diag(inverse), 0.0) * variance) / scale
        change = found / scale
        stretch = float(change[1]) / max(float(np.ptp(t)), 1e-12)
        # The clocks' ratio turns about the middle of the overlap.
        middle = float(np.mean(t))
        new_ratio = float(np.clip(ratio + stretch, 1.0 - MOST_RATIO, 1.0 + MOST_RATIO))
        moved = float(change[0]) - (new_ratio - ratio) * middle
        offset, ratio = offset + moved, new_ratio
        errors = (
            float(math.hypot(spread[0], spread[1] * middle / max(float(np.ptp(t)), 1e-12))),
            float(spread[1] / max(float(np.ptp(t)), 1e-12)),
        )
        if abs(moved) < 1e-9:
            break
    return offset, ratio, errors


def _resampled(record: Record) -> Array:
    """The position as a common band shows it, at the record's own stamps."""
    even = record.uniform()
    return np.interp(record.time, even.time, _low(even.position, even.sample_time))


def _correlated(rest: Array) -> float:
    """Factor by which correlated errors count more than independent ones in a variance."""
    if rest.size < 10 or not np.any(rest):
        return 1.0
    first = float(rest[1:] @ rest[:-1]) / float(rest @ rest)
    first = min(max(first, 0.0), 1.0 - 2.0 / rest.size)
    return (1.0 + first) / (1.0 - first)
