"""First harmonics of a steady run under a sinusoidal force: of force, position, and what friction goes by.

The harmonic of sgn(v) is taken from the motion as it was measured, over whole periods of a grid of their own. Where the body
rests at its turns, friction is what holds it, F = u - F_0 - (k + P) q, until that reaches F_C and the body goes on. So a first
pass takes the turn for symmetric; each further one, given the values found before it, takes sgn(v) until the body comes to
rest, and behind it the holding force over F_C, cut at one: where the body doesn't rest at all, it is sgn(v) again. Turns
are where the velocity is less than a hundredth of its peak.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import signal
from scipy.ndimage import binary_dilation
from scipy.optimize import minimize_scalar

from ...record import Array, Record
from ...signals.instrument_noise import level_of
from ..oscillation_effort import at_stamps
from ..result import IdentificationError

__all__ = ["Harmonics", "Held", "harmonics_of", "main_frequency"]

_FEWEST = 4  # periods; statistical: fewer tell no scatter
_PER_PERIOD = 20.0  # samples; numerical: of fewer the turns aren't shown
_STEADY = 0.02  # relative difference of a period's amplitude from the later ones' that counts as steady; physical
_SURE = 3.0  # standard deviations of a period's harmonic; statistical
_NOTHING = 1e-4  # of the amplitude; numerical: what is left of a transient below it is no error beside the harmonics' own
_SLOW = 0.01  # of the top speed; physical: below it a body may rest
_CLEAR = 4.0  # standard deviations of the velocity's noise, at least; statistical
_WIDEST = 24.0  # of a period is the longest window of the velocity; numerical: a sine loses 0.1 % of its peak in it
_NEWTON = 4  # numerical: steps, each of which doubles the digits
_NARROWEST = 5  # samples of the window of the velocity: of a parabola with a rest


@dataclass(frozen=True)
class Held:
    """What tells the friction of a resting body.

    Attributes:
        stiffness: of its spring and of a feedback that isn't in the force, k + P [F/x].
        constant: force that is left at q = 0, F_0 [F].
        coulomb: F_C [F].
    """

    stiffness: float
    constant: float
    coulomb: float

    def share(self, force: Array, position: Array) -> Array:
        """Friction over F_C of a body that rests under ``force`` [F] at ``position`` [x]."""
        return np.asarray(np.clip((force - self.constant - self.stiffness * position) / self.coulomb, -1.0, 1.0))


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Means and first harmonics of the steady periods of one run, each of shape ``(n_periods,)``, complex where a harmonic.

    Attributes:
        frequency: w [rad/s].
        force: F_1 [F].
        position: Q_1 [x].
        sign: S_1 [1].
        speed: V_1 [x/s].
        means: of force, position, sgn(v) and |v|, shape ``(n_periods, 4)``.
        resting: part of the time in which the body rests [1].
        source: the recording's file.
        left_out: time before it was steady [s].
    """

    frequency: float
    force: np.ndarray
    position: np.ndarray
    sign: np.ndarray
    speed: np.ndarray
    means: Array
    resting: float
    source: str
    left_out: float


def main_frequency(record: Record) -> float:
    """Frequency of the strongest line in the position [rad/s], refined by least squares.

    Raises:
        IdentificationError: the joint doesn't move, or moves for less than two periods of it.
    """
    even = record.uniform()
    # A transient swings at another frequency: it is the later half that counts.
    even = even.slice(even.n_samples // 2, even.n_samples)
    position = even.position - np.mean(even.position)
    if not np.any(position):
        raise IdentificationError(record.source, "the joint does not move", "force it harder")
    spectrum = np.abs(np.fft.rfft(position * np.hanning(position.shape[0])))
    line = 2.0 * np.pi / even.duration
    peak = int(np.argmax(spectrum[1:])) + 1
    if peak < 2:
        raise IdentificationError(record.source, "shorter than two periods of its oscillation", "record for longer")

    def left(frequency: float) -> float:
        angle = frequency * even.time
        columns = np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle)], axis=1)
        answer, *_ = np.linalg.lstsq(columns, position, rcond=None)
        return float(np.sum((position - columns @ answer) ** 2))

    found = minimize_scalar(left, bounds=((peak - 1.0) * line, (peak + 1.0) * line), method="bounded", options={"xatol": 1e-9})
    return float(found.x)


def harmonics_of(record: Record, frequency: float | None = None, held: Held | None = None) -> Harmonics:
    """The steady periods of a forced run.

    Args:
        record: of one run; a transient at its beginning is left out.
        frequency: of the force [rad/s]; None: the strongest line.
        held: tells the friction of the body where it rests; None: it isn't known, and counts as none.

    Raises:
        IdentificationError: fewer than four steady periods, or the body does not move.
    """
    even = at_stamps(record.uniform())
    w = main_frequency(even) if frequency is None else frequency
    step = even.sample_time
    period = 2.0 * np.pi / w
    n_periods = int(even.duration / period)
    if n_periods < _FEWEST:
        raise IdentificationError(
            record.source, f"{n_periods} periods of the force, at least {_FEWEST} are needed", "record for longer"
        )
    if period / step < _PER_PERIOD:
        raise IdentificationError(
            record.source,
            f"sampled too slowly: {period / step:.3g} samples in a period",
            f"record at {_PER_PERIOD / period:.3g} Hz",
        )
    velocity, slow, width = _velocity(even, w)
    smooth = np.clip(velocity / slow, -1.0, 1.0)
    if held is not None and held.coulomb > 0.0:
        smooth = _turning(velocity, slow, width, w * step, held.share(even.effort, even.position))
    signals = np.stack([even.effort, even.position, smooth, np.abs(velocity)], axis=1)
    # From the end backwards, so that the last periods are whole; a grid of their own makes the sums exact.
    per = int(np.ceil(period / step))
    end = even.time[-1]
    angle = 2.0 * np.pi * np.arange(per) / per
    lines, means, still = [], [], []
    for number in range(n_periods, 0, -1):
        at = end - number * period + angle / w
        values = np.stack([np.interp(at, even.time, column) for column in signals.T], axis=1)
        lines.append(2.0 * np.mean(values * np.exp(-1j * (w * at))[:, None], axis=0))
        means.append(np.mean(values, axis=0))
        still.append(float(np.mean(values[:, 3] < slow)))
    found, mean = np.array(lines), np.array(means)
    first = _first_steady(found[:, 1] * np.exp(-1j * np.angle(found[:, 0])))
    if n_periods - first < _FEWEST:
        raise IdentificationError(
            record.source,
            f"only {n_periods - first} of {n_periods} periods are steady",
            "wait until the oscillation is steady, and record some ten periods of it",
        )
    # Slower than a hundredth of the top speed for longer than a sine is, near its turns.
    resting = float(np.mean(still[first:])) - 2.0 / np.pi * slow / float(np.max(np.abs(velocity)))
    kept = found[first:]
    if record.hold != "linear":
        # A force held for a sample has sin(x)/x of its values' harmonic, and the mean of two of them cos(x), x = w h/2.
        kept[:, 0] *= np.tan(0.5 * w * step) / (0.5 * w * step)
    return Harmonics(
        w, kept[:, 0], kept[:, 1], kept[:, 2], kept[:, 3], mean[first:], max(resting, 0.0), record.source,
        first * period,
    )  # fmt: skip


def _velocity(even: Record, w: float) -> tuple[Array, float, int]:
    """Velocity [x/s], shape ``(n,)``, the speed below which the body may rest [x/s], and the window of the velocity [samples].

    Over the shortest window in which noise stays below that speed, since a rest is no longer than a few hundredths of a period.

    Raises:
        IdentificationError: the body does not move.
    """
    if float(np.ptp(even.position)) == 0.0:
        raise IdentificationError(even.source, "the body does not move", "let a larger force act on it")
    step, n = even.sample_time, even.n_samples
    noise = level_of(even.position)
    peak = 0.5 * w * float(np.ptp(even.position[n // 2 :]))
    longest = max(int(2.0 * np.pi / w / step / _WIDEST) | 1, _NARROWEST)
    wanted = _CLEAR * noise / (step * _SLOW * peak) if peak > 0.0 else np.inf
    width = int(min(max(wanted, _NARROWEST), longest)) | 1
    velocity = np.asarray(signal.savgol_filter(even.position, width, 2, deriv=1, delta=step), dtype=np.float64)
    return velocity, max(_SLOW * float(np.max(np.abs(velocity))), _CLEAR * noise / (step * width)), width


def _turning(velocity: Array, slow: float, width: int, angle: float, share: Array) -> Array:
    """Friction over F_C, shape ``(n,)``.

    Args:
        velocity: shape ``(n,)`` [x/s].
        slow: below which the body may rest [x/s].
        width: window of the velocity [samples].
        angle: of the force from sample to sample [rad].
        share: friction over F_C of a body at rest, shape ``(n,)``.

    The window rounds the corner at which the body comes to rest or turns. So the instant is where the wave through the
    velocity before the corner, over twice as many samples as the window has, reaches zero.
    """
    friction: Array = np.sign(velocity)
    turns = np.abs(velocity) < slow
    turns[1:] |= friction[1:] != friction[:-1]
    still = binary_dilation(turns, iterations=width // 2 + 1)
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    for first, last in zip(bounds[::2].tolist(), bounds[1::2].tolist(), strict=True):
        if first < 2 * width:
            continue
        sign = float(np.sign(velocity[first - 1]))
        stop = first + _zero(velocity[first - 2 * width : first], angle, float(last - first))
        after = np.clip(np.arange(first, last) - stop + 0.5, 0.0, 1.0)
        friction[first:last] = (1.0 - after) * sign + after * share[first:last]
    return friction


def _zero(values: Array, angle: float, latest: float) -> float:
    """Sample, from the end of ``values`` on, at which a wave through them is zero: no later than ``latest``.

    The wave has a mean, and ``angle`` from sample to sample [rad]. Where it goes away from zero, the answer is 0.
    """
    x = angle * np.arange(-values.shape[0], 0)
    (level, slope, bend), *_ = np.linalg.lstsq(
        np.stack([np.ones_like(x), np.sin(x), 1.0 - np.cos(x)], axis=1), values, rcond=None
    )
    found = 0.0
    for _ in range(_NEWTON):
        rate = slope * math.cos(found) + bend * math.sin(found)
        if rate * level >= 0.0:
            return 0.0
        found -= (level + slope * math.sin(found) + bend * (1.0 - math.cos(found))) / rate
    return min(max(found / angle, 0.0), latest)


def _first_steady(position: np.ndarray) -> int:
    """Number of the first period from which the first harmonic stays what the second half has it.

    Its phase is that against the force: against the clock, a frequency that is a little off would look like a transient.
    A transient that is still larger than the scatter of the later periods would bias their mean, so the first half is also
    held against that scatter; where the second half still has a transient, that is the scatter.
    """
    half = position.shape[0] // 2
    later = np.mean(position[half:])
    off = np.abs(position - later)
    away = np.flatnonzero(off > _STEADY * abs(later))
    first = int(away[-1]) + 1 if away.size else 0
    scatter = float(np.sqrt(np.mean(off[half:] ** 2)))
    moved = np.flatnonzero(off[:half] > max(_SURE * scatter, _NOTHING * abs(later)))
    return max(first, int(moved[-1]) + 1 if moved.size else 0)
