"""Backlash from the backbone of a free oscillation.

With free play 2 d about the centre the spring pulls only beyond it: for |x| > d the body swings with w_0, in between it coasts
with the speed w_0 (A - d), so that a cycle of the amplitude A takes

    T = 2 pi/w_0 + 4 d/(w_0 (A - d)),   w(A) = w_0/(1 + (2/pi) d/(A - d)) :

the backbone, instantaneous frequency over amplitude, bends towards zero where the amplitude comes near d; with d = 0 it is a
vertical line. Amplitude and frequency are taken from the analytic signal at the reversals, where the signal is its own
envelope, whatever its wave form. Losses small in a cycle are assumed; the period of the lossless cycle is exact.

Source: Feldman 1997 (backbone of the Hilbert transform); the period derived here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal
from scipy.optimize import least_squares

from ...record import Array
from .envelope import cycle_mean, mirrored, phase_of
from .recording import Oscillation

__all__ = ["Backbone", "Play", "backbone", "free_play"]

_SURE = 4.0


@dataclass(frozen=True, eq=False)
class Backbone:
    """Frequency over amplitude, one point for each reversal but the first and the last; arrays of shape ``(n,)``.

    Attributes:
        amplitude: [x].
        frequency: over the cycle around the reversal [rad/s].
    """

    amplitude: Array
    frequency: Array


@dataclass(frozen=True)
class Play:
    """Free play seen in a backbone.

    Attributes:
        play: full width of the gap, 2 d [x].
        standard_error: of it [x].
        frequency: natural frequency with the gap closed, w_0 [rad/s].
        status: whether there is any, and what to do next.
    """

    play: float
    standard_error: float
    frequency: float
    status: str


def backbone(found: Oscillation) -> Backbone:
    """Backbone of ``found`` by the Hilbert transform."""
    first, last = int(found.turns[0]), int(found.turns[-1])
    position = found.position[first : last + 1]
    turns = found.turns - first
    # Smoothed over a small part of a half cycle: the phase at a reversal is as good as the velocity there.
    width = max(int(0.05 * found.half_period / found.sample_time) | 1, 5)
    smooth = signal.savgol_filter(position, width, 2)
    longest = int(np.max(turns[2:] - turns[:-2]))
    z = signal.hilbert(mirrored(smooth - cycle_mean(smooth, longest)))[: position.shape[0]]
    # The centre is that of neighbouring reversals; the envelope there is the distance from it.
    height = smooth[turns]
    size = 0.25 * np.abs(2.0 * height[1:-1] - height[:-2] - height[2:])
    phase = phase_of(z, found.time[first : last + 1], found.half_period)[turns]
    elapsed = found.sample_time * (turns[2:] - turns[:-2])
    return Backbone(size, (phase[2:] - phase[:-2]) / elapsed)


def free_play(curve: Backbone) -> Play:
    """Free play that bends the backbone ``curve``."""
    amplitude, period = curve.amplitude, 2.0 * np.pi / curve.frequency
    smallest = float(np.min(amplitude))

    def predicted(point: Array) -> Array:
        half = min(float(point[1]), 0.98) * smallest
        return np.asarray(2.0 * np.pi / point[0] + 4.0 * half / (point[0] * (amplitude - half)))

    best = None
    top = float(np.max(curve.frequency))
    for part in (0.02, 0.3, 0.7):
        answer = least_squares(
            lambda point: predicted(point) - period,
            [top, part],
            bounds=([0.2 * top, -0.5], [10.0 * top, 0.98]),
            x_scale=[top, 1.0],
        )
        best = answer if best is None or answer.cost < best.cost else best
    assert best is not None
    freedom = max(amplitude.shape[0] - 2, 1)
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * 2.0 * best.cost / freedom
    play, error = 2.0 * float(best.x[1]) * smallest, 2.0 * smallest * float(np.sqrt(max(covariance[1, 1], 0.0)))
    if play > _SURE * error and play > 0.0:
        status = f"the backbone bends as {play:.3g} +- {error:.2g} of free play would bend it; check with the term backlash"
    else:
        most = max(play, 0.0) + 2.0 * error
        status = f"no free play is found (at most {most:.2g}); to find less, record on to smaller amplitudes"
    return Play(play, error, float(best.x[0]), status)
