"""Complex Morlet transform by FFT, and the modes of a signal along its ridges.

psi^(w) = 2 exp(-(w/w_c - 1)^2 n^2/2) for w > 0: a cosine of amplitude A at w_c gives |W| = A. A decaying exponential stays one
of the same rate and frequency under any such window, so the slope of log |W| and of the phase along a row of constant
frequency are those of the mode itself, but for the ends. n is chosen by how close the modes are: two of them are apart when
their relative distance is well above 1/n, and the ends reach n/w into the record.

Source: Staszewski 1997; Ruzzene, Fasana, Garibaldi, Piombo 1997.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...record import Array
from ..statistics import sandwich_covariance
from .envelope import mirrored

__all__ = ["Mode", "low_pass", "modes", "morlet"]

_VOICES_PER_OCTAVE = 24
_FADED = 0.02  # of a mode's largest amplitude, where its ridge ends
_FAINT = 0.02  # of the largest mode


@lru_cache(maxsize=16)
def _windows(n: int, step: float, frequencies: tuple[float, ...], cycles: float) -> Array:
    w = 2.0 * np.pi * np.fft.fftfreq(n, step)
    centre = np.array(frequencies)[:, None]
    return np.where(w > 0, 2.0 * np.exp(-0.5 * (cycles * (w / centre - 1.0)) ** 2), 0.0)


def morlet(position: Array, step: float, frequencies: tuple[float, ...], cycles: float) -> Array:
    """Complex Morlet transform, shape ``(n_frequencies, n)``, of ``position``, shape ``(n,)``; ends mirrored.

    Args:
        position: evenly sampled [x].
        step: time between samples [s].
        frequencies: of the rows [rad/s].
        cycles: n, length of the window in radians of its own frequency.
    """
    n = position.shape[0]
    spectrum = np.fft.fft(mirrored(position))
    # Times of two stretches of one recording differ in the last bit; a window of its own for each would never be used again.
    window = _windows(spectrum.shape[0], float(f"{step:.12g}"), tuple(float(f"{f:.12g}") for f in frequencies), cycles)
    return np.asarray(np.fft.ifft(spectrum * window, axis=1)[:, :n])


def low_pass(position: Array, step: float, frequency: float, cycles: float) -> Array:
    """What a Gaussian window as long as the wavelet's leaves of ``position`` [x], shape ``(n,)``."""
    n = position.shape[0]
    spectrum = np.fft.rfft(mirrored(position))
    w = 2.0 * np.pi * np.fft.rfftfreq(2 * n - 2, step)
    return np.asarray(np.fft.irfft(spectrum * np.exp(-0.5 * (cycles * w / frequency) ** 2), 2 * n - 2)[:n])


@dataclass(frozen=True)
class Mode:
    """One mode of a decaying signal.

    Attributes:
        frequency: undamped natural frequency [rad/s].
        damping: ratio [1].
        amplitude: at the first sample [x].
        frequency_error: standard error [rad/s].
        damping_error: standard error [1].
    """

    frequency: float
    damping: float
    amplitude: float
    frequency_error: float
    damping_error: float


def _slope(time: Array, values: Array) -> tuple[float, float, float]:
    """Value at time 0 and slope of a straight line, with the slope's standard error, residual correlation included."""
    columns = np.stack([np.ones_like(time), time], axis=1)
    answer, *_ = np.linalg.lstsq(columns, values, rcond=None)
    covariance = sandwich_covariance(columns, values - columns @ answer, np.ones_like(time), np.zeros(1, dtype=np.int64))
    return float(answer[0]), float(answer[1]), float(np.sqrt(max(covariance[1, 1], 0.0)))


def modes(position: Array, step: float, number: int, cycles: float = 12.0) -> list[Mode]:
    """The strongest modes of a decaying signal with viscous damping, from the lowest frequency to the highest.

    Args:
        position: free decay from its first sample on [x], shape ``(n,)``.
        step: time between samples [s].
        number: how many modes at most.
        cycles: length of the wavelet's window in radians; longer for modes that are closer.
    """
    lowest, highest = 2.0 * cycles / (step * (position.shape[0] - 1)), 0.8 * np.pi / step
    count = max(int(_VOICES_PER_OCTAVE * np.log2(highest / lowest)), 8)
    rows: Array = np.asarray(np.geomspace(lowest, highest, count), dtype=np.float64)
    strength = np.array([float(np.max(np.abs(row))) for row in _interior(position, step, rows, cycles)])
    peaks = [k for k in range(1, count - 1) if strength[k - 1] < strength[k] >= strength[k + 1]]
    peaks = [k for k in peaks if strength[k] > _FAINT * float(np.max(strength))]
    chosen = sorted(peaks, key=lambda k: -strength[k])[:number]
    return [_mode(position, step, float(rows[k]), cycles) for k in sorted(chosen)]


def _interior(position: Array, step: float, rows: Array, cycles: float) -> list[Array]:
    """Rows of the transform without their ends; one at a time, since a long recording times all rows is large."""
    inside = []
    for frequency in rows.tolist():
        row = morlet(position, step, (frequency,), cycles)[0]
        cut = min(int(1.5 * cycles / frequency / step), (row.shape[0] - 2) // 2)
        inside.append(row[cut : row.shape[0] - cut])
    return inside


def _mode(position: Array, step: float, guess: float, cycles: float) -> Mode:
    frequency = guess
    time = step * np.arange(position.shape[0], dtype=np.float64)
    for _ in range(3):
        row = morlet(position, step, (frequency,), cycles)[0]
        cut = min(int(3.0 * cycles / frequency / step), row.shape[0] // 4)
        use = slice(cut, row.shape[0] - cut)
        size = np.abs(row[use])
        faded = np.flatnonzero(size < _FADED * size[0])
        use = slice(cut, cut + (int(faded[0]) if faded.size and faded[0] > 8 else size.shape[0]))
        turning = np.exp(-1j * frequency * time[use])
        _, off, off_error = _slope(time[use], np.unwrap(np.angle(row[use] * turning)))
        start, decay, decay_error = _slope(time[use], np.log(np.abs(row[use])))
        frequency += off
    undamped = float(np.hypot(frequency, decay))
    ratio = -decay / undamped
    # The window's gain for a decaying cosine at its centre: exp((n sigma/w)^2/2).
    gain = float(np.exp(0.5 * (cycles * decay / frequency) ** 2))
    return Mode(
        undamped, ratio, float(np.exp(start)) / gain, off_error, float(np.hypot(decay_error, ratio * off_error) / undamped)
    )
