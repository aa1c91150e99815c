"""1/f noise."""

from __future__ import annotations

import numpy as np

from ..record import Array

__all__ = ["pink_noise"]


def pink_noise(random: np.random.Generator, n: int) -> Array:
    """Noise of shape ``(n,)`` whose power falls with the inverse of frequency, with mean zero and standard deviation one."""
    spectrum = np.fft.rfft(random.standard_normal(n))
    spectrum[1:] /= np.sqrt(np.arange(1, spectrum.shape[0]))
    spectrum[0] = 0.0
    values = np.fft.irfft(spectrum, n)
    return np.asarray(values / np.std(values))
