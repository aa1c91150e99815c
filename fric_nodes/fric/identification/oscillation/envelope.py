"""Amplitude, frequency and centre over time, and the natural parameters that averaging reads off them.

For slowly varying amplitude A and phase phi, averaging m x'' + c(v) x' + k x + f(v) = 0 over a cycle gives

    A' = -zeta omega_0 A - (2/pi) omega_0 x_k,    phi' = omega_0 sqrt(1 - zeta^2),    centre = -D_x - (4/pi) D_zeta A :

viscous damping shows as an exponential, kinetic friction as a straight line, a difference of kinetic friction as a constant
offset, and a difference of the damping as an offset in proportion to the amplitude. A(t) is fitted in integral form,
A = A_0 - sigma int A dt - s t, which is linear and needs no derivative of a noisy envelope.

With few cycles to the stop, averaging is coarse, and a transform has its ends: these readings are biased by per cents. They are
corrected in :mod:`.matching`.
Source: Feldman 1994 (FREEVIB) and Braun, Feldman 1997 for the symmetric case; the asymmetric terms derived here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...record import Array, Mask
from .motion import Natural
from .result import Curves

__all__ = ["Envelope", "binned", "curves_of", "cycle_mean", "mirrored", "natural_of", "phase_of", "reading"]


@dataclass(frozen=True, eq=False)
class Envelope:
    """Slow quantities of an oscillation; all of shape ``(n,)``.

    Attributes:
        time: [s].
        amplitude: [x].
        phase: unwrapped [rad].
        centre: [x].
        inner: where the ends of the transform do little.
    """

    time: Array
    amplitude: Array
    phase: Array
    centre: Array
    inner: Mask


def mirrored(values: Array) -> Array:
    """``values`` and their mirror image, shape ``(2 n - 2,)``: periodic, and smooth where they begin and end at a reversal."""
    return np.concatenate([values, values[-2:0:-1]])


def phase_of(analytic: Array, time: Array, half_period: float) -> Array:
    """Unwrapped phase [rad], shape ``(n,)``, of a complex signal that begins at a reversal: near 0 there, or near pi."""
    first = 0.0 if analytic[0].real > 0 else np.pi
    expected = first + np.pi / half_period * (time - time[0])
    return np.asarray(np.unwrap(np.angle(analytic * np.exp(-1j * expected))) + expected)


def cycle_mean(values: Array, length: int) -> Array:
    """Mean over ``length`` samples around each, ends mirrored, shape ``(n,)``: what varies within a half cycle goes."""
    half = max(length // 2, 1)
    padded = np.concatenate([values[half:0:-1], values, values[-2 : -half - 2 : -1]])
    total = np.concatenate([[0.0], np.cumsum(padded)])
    return np.asarray((total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1))


def _integral(values: Array, step: float) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))]) * step


def reading(envelope: Envelope) -> Array:
    """Frequency, phase, decay rate, initial amplitude, slope, and offset and slope (over A) of the centre, ``(7,)``."""
    step = float(envelope.time[1] - envelope.time[0])
    use = envelope.inner
    time = envelope.time[use] - envelope.time[0]
    middle = float(np.mean(time))
    amplitude = envelope.amplitude[use]
    frequency, phase = np.polyfit(time - middle, envelope.phase[use], 1)
    swept = _integral(envelope.amplitude, step)[use]
    columns = np.stack([-swept, np.ones_like(time), -time], axis=1)
    (decay, start, slope), *_ = np.linalg.lstsq(columns, amplitude, rcond=None)
    sides = np.stack([np.ones_like(time), amplitude], axis=1)
    (centre, lean), *_ = np.linalg.lstsq(sides, envelope.centre[use], rcond=None)
    return np.array([frequency, phase, decay, start, slope, centre, lean])


def binned(envelope: Envelope, half_period: float) -> Array:
    """Amplitude [x], centre [x] and phase, one after the other, each averaged over stretches of a quarter of a cycle."""
    time = envelope.time[envelope.inner]
    number = max(round((float(time[-1]) - float(time[0])) / (0.5 * half_period)), 3)
    n = time.shape[0]
    edges = np.linspace(0, n, number + 1).astype(np.int64)[:-1]
    count = np.diff(np.append(edges, n))

    def means(values: Array) -> Array:
        return np.asarray(np.add.reduceat(values[envelope.inner], edges) / count)

    return np.concatenate([means(envelope.amplitude), means(envelope.centre), means(envelope.phase)])


def natural_of(figures: Array) -> Natural:
    """The natural parameters that the averaged equations read off :func:`reading`."""
    frequency, _, decay, _, slope, centre, lean = (float(value) for value in figures)
    omega = float(np.hypot(frequency, decay))
    return Natural(omega, decay / omega, -0.25 * np.pi * lean, 0.5 * np.pi * slope / omega, -centre)


def curves_of(envelope: Envelope, half_period: float) -> Curves:
    """What depends on the amplitude, smoothed over a cycle; where the ends of the transform do little."""
    step = float(envelope.time[1] - envelope.time[0])
    cycle = max(round(2.0 * half_period / step), 3)
    amplitude = cycle_mean(envelope.amplitude, cycle)
    frequency = cycle_mean(np.gradient(envelope.phase, step), cycle)
    loss = -np.gradient(amplitude, step) / (amplitude * frequency)
    # A mean over a cycle reaches half a cycle beyond; a record of few cycles keeps what there is.
    use = envelope.inner.copy()
    if int(np.sum(use)) > 2 * cycle:
        use[:cycle] = use[-cycle:] = False
    return Curves(envelope.time[use], amplitude[use], frequency[use], loss[use], cycle_mean(envelope.centre, cycle)[use])
