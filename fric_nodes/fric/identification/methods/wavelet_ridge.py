"""Wavelet ridge: amplitude and frequency along the ridge of a complex Morlet transform; several modes at once.

With psi^(w) = 2 exp(-(a w - n)^2/2) for w > 0 at the scale a, a cosine of amplitude A and frequency w gives |W(a, t)| = A on
the ridge a = n/w: the amplitude is the largest modulus over the scales, the frequency the scale where it is. A short window (n
small) follows a quick decay, a long one separates close modes; its length is n/w [s] (standard deviation). The centre about
which the motion swings is what a Gaussian window of the same length leaves. The correction of the averaged readings, and of
what the window does to a decay with few cycles, is that of :mod:`.oscillation.matching`. Computed by FFT, with both ends
mirrored at a reversal; no wavelet library is needed for one wavelet.

Source: Staszewski 1997 and Ruzzene, Fasana, Garibaldi, Piombo 1997 (ridge, natural frequencies and dampings); the asymmetric
case derived here.
"""

from __future__ import annotations

import numpy as np

from ...record import Array, Mask
from ..oscillation.conclusion import ALL, free_oscillation_method
from ..oscillation.envelope import Envelope, phase_of
from ..oscillation.morlet import low_pass, morlet
from ..oscillation.recording import Oscillation
from ..oscillation.result import FreeOscillation
from ..oscillation.transformed import identify, inner_part

__all__ = ["METHOD", "wavelet_envelope", "wavelet_ridge"]

_CYCLES = 4.0  # n, the centre frequency of the wavelet in units of its bandwidth
_MARGIN = 0.75
_VOICES = 15
_SPAN = 1.3


def wavelet_envelope(time: Array, position: Array, half_period: float) -> Envelope:
    """Envelope of ``position`` [x], shape ``(n,)``, along its ridge, evenly sampled from one reversal to another."""
    step = float(time[1] - time[0])
    middle = np.pi / half_period
    frequencies = tuple((middle * np.geomspace(1.0 / _SPAN, _SPAN, _VOICES)).tolist())
    inner = inner_part(time, half_period, _MARGIN)
    transform = morlet(position, step, frequencies, _CYCLES)
    modulus = np.abs(transform)
    at = np.clip(np.argmax(modulus, axis=0), 1, _VOICES - 2)
    column = np.arange(time.shape[0])
    # Around the ridge the modulus is nearly a Gaussian of the frequency: its logarithm is a parabola.
    below, top, above = (np.log(np.maximum(modulus[at + shift, column], 1e-300)) for shift in (-1, 0, 1))
    bend = below - 2.0 * top + above
    offset = np.clip(0.5 * (below - above) / np.where(bend < 0, bend, -1.0), -1.0, 1.0)
    amplitude = np.exp(top - 0.25 * (below - above) * offset)
    # One row for the phase, always the same: along the ridge its steps from row to row would come on top.
    phase = phase_of(transform[_VOICES // 2], time, half_period)
    centre = low_pass(position, step, middle, _CYCLES)
    return Envelope(time, amplitude, phase, centre, inner)


def wavelet_ridge(found: Oscillation, asked: Mask = ALL, rng: np.random.Generator | None = None) -> FreeOscillation:
    """The natural parameters of ``found`` from its wavelet ridge.

    Args:
        found: the oscillation.
        asked: which natural parameters to fit, shape ``(5,)``; the others are zero.
        rng: of the noise that standard errors are found with; None: always the same.
    """
    return identify(found, wavelet_envelope, asked, np.random.default_rng(0) if rng is None else rng)


METHOD = free_oscillation_method(
    "wavelet", "wavelet ridge", "Ruzzene, Fasana, Garibaldi, Piombo 1997; de Marchi 1998", wavelet_ridge
)
