"""The error of an encoder within its lines, found in the position and told from a motion of the axis.

An interpolating encoder errs by a function of the position that repeats with its lines, e(q) = sum_h a_h sin(2 pi h q / p) +
b_h cos(2 pi h q / p), of the pitch p. Summed up over the position, what is faster than the motion has a spectral line at 1/p,
however the speed varies. A force that repeats over the position, as a cogging motor's does, moves the axis with the same
period. Both differ by their acceleration: an error of constant size has one that grows as the square of the speed, a force
one of constant size that grows with the force alone. The acceleration of the position is explained by both at once,

    q''(f) = g u(f) + s e''(f) + forces over q, either sign of v + friction steps + noise(f),

over the frequencies f above the motion, each weighted by what is left there. The share s of the error is 1 where the sensor
errs, and 0 where the axis moves.

Source: errors of sinusoidal interpolation, of offset, amplitude and phase, are of the first two harmonics (Heydemann 1981).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, median_filter, minimum_filter1d

from ..record import Array
from .view import View

__all__ = ["Line", "PositionError", "error_again", "error_found", "share_of_sensor"]

_HARMONICS = (1, 2)
_FEWEST_LINES = 5.0  # in the travel: fewer are a shape of it
_STEPS = 4.0  # of the encoder in a line, at least
_CHANCE = 1e-4  # that noise shows a line anywhere
_AROUND = 101  # places of the spectrum that tell what is usual
_FINER = np.linspace(-1.0, 1.0, 41)  # places of the spectrum to either side, where the pitch is looked for
_PEAKS = 3
_BANDS = 24  # parts of a recording, or of its frequencies, that err independently
_AGAIN = 3.0  # standard errors
_ALIKE = 0.3  # of its amplitude, by which that of an error may differ in another recording
_SLOWER = 0.1  # times the band of a clean position: what else moves the axis there counts by its weight
_ROUNDS = 3  # of weights
_HIGHEST = 0.4  # of the rate: above it differences of samples are no derivatives
_LARGEST = 2**17  # places of the spectrum


@dataclass(frozen=True)
class PositionError:
    """Error of a position that repeats over the position.

    Attributes:
        pitch: period [x].
        sines: of each harmonic from the first on [x].
        cosines: likewise [x].
    """

    pitch: float
    sines: tuple[float, ...]
    cosines: tuple[float, ...]

    @property
    def amplitude(self) -> float:
        """Root of twice the mean square [x]: the amplitude of a sine that is as large."""
        return float(np.sqrt(np.sum(np.square((*self.sines, *self.cosines)))))

    def at(self, position: Array) -> Array:
        """The error at ``position``, shape ``(n,)`` [x]."""
        columns = _columns(position, self.pitch)
        return np.asarray(columns @ np.array((*self.sines, *self.cosines)))

    def taken_off(self, position: Array) -> Array:
        """``position`` without it, shape ``(n,)`` [x]."""
        # It is a function of the true position, which is known to within the error itself.
        return np.asarray(position - self.at(position - self.at(position)))


@dataclass(frozen=True)
class Line:
    """A spectral line over the position.

    Attributes:
        error: what it would be, if the sensor erred.
        share: of it that is no motion [1]; about 1 for an error of the sensor, about 0 for a motion.
        deviation: standard error of ``share`` [1].
    """

    error: PositionError
    share: float = field(default=math.nan)
    deviation: float = field(default=math.inf)


def _columns(position: Array, pitch: float) -> Array:
    """Sines, then cosines, of all harmonics at ``position``, shape ``(n, 2 len(harmonics))``."""
    angle = 2.0 * np.pi / pitch * np.outer(position, _HARMONICS)
    return np.concatenate([np.sin(angle), np.cos(angle)], axis=1)


def error_found(view: View) -> PositionError | None:
    """What repeats over the position, faster than the motion of ``view``; None where nothing does."""
    at = np.flatnonzero(view.moving & view.usable)
    if at.size < 2 * _AROUND:
        return None
    # Lines may pass faster than samples come: they add up over the position all the same.
    fastest = 1.0 / max(_STEPS * view.resolution, _STEPS * view.noise)  # lines per position
    lowest = _lowest(view)
    if fastest <= lowest:
        return None
    position = view.even.position
    fast = position - view.low_pass(position)
    peaks = _peaks(position[at], fast[at], view.travel, lowest, fastest)
    candidates = {round(pitch, 15): pitch for peak in peaks for pitch in (1.0 / peak, 2.0 / peak)}
    fitted = [_fitted(view, fast, pitch) for pitch in candidates.values() if 1.0 / pitch >= 0.5 * lowest]
    error, energy = max(fitted, key=lambda each: each[1], default=(None, 0.0))
    return error if energy > 0.0 else None


def error_again(view: View, shown: PositionError) -> PositionError | None:
    """The error ``shown`` by another recording of the same encoder; None where it isn't found again with about its size.

    What is known to be there needs less to be seen than what is looked for among all pitches. Where the lines lie is another
    matter: an encoder may count from where it was switched on.
    """
    if not view.moves or 2.0 / shown.pitch < _lowest(view):  # the second harmonic at least is faster than the motion
        return None
    position = view.even.position
    error, energy = _fitted(view, position - view.low_pass(position), shown.pitch, surely=1.0)
    return error if energy > 0.0 and abs(error.amplitude - shown.amplitude) < _ALIKE * shown.amplitude else None


def _lowest(view: View) -> float:
    """Lines per position [1/x] that there must be, for their error to be no part of the motion."""
    return max(_FEWEST_LINES / view.travel, view.cutoff / view.speed)


def _peaks(position: Array, fast: Array, travel: float, lowest: float, fastest: float) -> list[float]:
    """Lines per position [1/x] at which ``fast`` stands out of what is usual around, refined; the strongest first."""
    n_places = min(2 ** math.ceil(math.log2(4.0 * travel * fastest)), _LARGEST)
    place = (position - float(np.min(position))) / travel
    summed = np.bincount(np.minimum((place * n_places).astype(np.int64), n_places - 1), fast, n_places)
    power = np.abs(np.fft.rfft(summed, 2 * n_places)) ** 2
    frequency = np.arange(power.size) / (2.0 * travel)
    usual = median_filter(power, size=_AROUND, mode="nearest") / math.log(2.0)
    inside = (frequency >= lowest) & (frequency <= min(fastest, 0.25 * n_places / travel))
    ratio = np.where(inside & (usual > 0.0), power / np.where(usual > 0.0, usual, 1.0), 0.0)
    least = math.log(max(float(np.sum(inside)), 1.0) / _CHANCE)  # of a squared sum of noise, exponential
    found: list[float] = []
    for _ in range(_PEAKS):
        k = int(np.argmax(ratio))
        if ratio[k] < least:
            break
        near = (k + 2.0 * _FINER) / (2.0 * travel)
        strength = [abs(np.sum(fast * np.exp(-2j * np.pi * each * position))) for each in near]
        found.append(float(near[int(np.argmax(strength))]))
        ratio[max(k - 4, 0) : k + 5] = 0.0
    return found


def _fitted(view: View, fast: Array, pitch: float, surely: float = _AGAIN) -> tuple[PositionError, float]:
    """The error of ``pitch`` that fits what is faster than the motion best, and the energy it explains [x^2].

    Nothing, where parts of the recording don't find it again in each other, by ``surely`` standard errors. Samples count where
    at least two come to a line: at a steady speed the steps of an encoder beat with the samples, and the beat repeats over the
    position, too.
    """
    at = np.flatnonzero(view.moving & view.usable & (np.abs(view.velocity) * view.h < 0.5 * pitch))
    columns = np.column_stack([each - view.low_pass(each) for each in _columns(view.even.position, pitch).T])[at]
    part = np.arange(at.size) * _BANDS // max(at.size, 1)
    gram, moment = np.zeros((_BANDS, columns.shape[1], columns.shape[1])), np.zeros((_BANDS, columns.shape[1]))
    np.add.at(gram, part, columns[:, :, None] * columns[:, None, :])
    np.add.at(moment, part, columns * fast[at, None])
    elsewhere = np.linalg.pinv(gram.sum(axis=0) - gram, hermitian=True) @ (moment.sum(axis=0) - moment)[..., None]
    found_again = np.swapaxes(elsewhere, 1, 2)
    gain = (2.0 * found_again @ moment[..., None] - found_again @ gram @ elsewhere)[:, 0, 0]
    values = np.linalg.pinv(gram.sum(axis=0), hermitian=True) @ moment.sum(axis=0)
    n = len(_HARMONICS)
    error = PositionError(pitch, tuple(values[:n].tolist()), tuple(values[n:].tolist()))
    again = float(np.mean(gain)) > surely * float(np.std(gain)) / math.sqrt(_BANDS)
    return error, float(values @ moment.sum(axis=0)) if again else 0.0


def share_of_sensor(view: View, error: PositionError) -> Line:
    """``error`` with the share of it that the sensor makes; not known where the recording doesn't tell.

    Args:
        view: of the recording.
        error: that was found in it.
    """
    position, n = view.even.position, view.n
    direction = np.sign(view.velocity) * view.moving
    over = _columns(position, error.pitch).T
    forces = [view.force, direction, *over, *(direction * each for each in over)]
    frequency = np.fft.rfftfreq(n, view.h)
    fastest = 1.2 * max(_HARMONICS) * view.speed / error.pitch
    slowest = _SLOWER * view.cutoff
    band = (frequency > slowest) & (frequency < min(fastest, _HIGHEST / view.h))
    if int(np.sum(band)) < _BANDS * (1 + len(forces)):
        return Line(error)
    # A window that begins and ends softly keeps what is slower than the band out of it.
    soft = 0.5 / (slowest * view.h)
    good = minimum_filter1d(view.usable.astype(np.float64), 2 * math.ceil(3.0 * soft) + 1, mode="constant")
    window = np.hanning(n) * gaussian_filter1d(good, soft)

    def seen(values: Array) -> NDArray[np.complex128]:
        return np.asarray(np.fft.rfft(window * values)[band])

    def accelerated(values: Array) -> Array:
        return np.asarray(np.gradient(np.gradient(values, view.h), view.h))

    columns = np.column_stack([seen(accelerated(error.at(position))), *(seen(each) for each in forces)])
    return _weighed(error, seen(accelerated(position)), columns)


def _weighed(error: PositionError, seen: NDArray[np.complex128], columns: NDArray[np.complex128]) -> Line:
    """The share by least squares over frequencies, weighted by what is left in each band; the error's column is the first."""
    band = np.arange(seen.size) * _BANDS // seen.size
    weight = np.ones(seen.size)
    for _ in range(_ROUNDS):
        rows = weight[:, None] * columns
        size = np.sqrt(np.mean(np.abs(rows) ** 2, axis=0))
        rows = rows / np.where(size > 0.0, size, 1.0)
        inverse = np.linalg.pinv((rows.conj().T @ rows).real, rcond=1e-10, hermitian=True)
        values = inverse @ (rows.conj().T @ (weight * seen)).real
        left = weight * seen - rows @ values
        power = np.bincount(band, np.abs(left / weight) ** 2, _BANDS) / np.bincount(band, minlength=_BANDS)
        if not np.all(power > 0.0) or size[0] == 0.0:
            return Line(error)
        score = np.zeros((_BANDS, values.size))
        np.add.at(score, band, (rows.conj() * left[:, None]).real)
        weight = 1.0 / np.sqrt(power[band])
    spread = _BANDS / (_BANDS - values.size) * (inverse @ (score.T @ score) @ inverse)
    return Line(error, float(values[0] / size[0]), float(math.sqrt(max(spread[0, 0], 0.0)) / size[0]))
