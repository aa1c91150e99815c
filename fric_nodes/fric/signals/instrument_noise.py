"""Errors of a recorded position as its instrument makes them: rounding, noise below the steps, stamps that jitter.

A draw takes the smoothed motion, rounds it anew from another origin and hands back what rounding changes, so that its colour is
that of the encoder on this very motion: at low speed a saw-tooth of the frequency v / step, no white noise. White noise that
the recording shows beyond the rounding is added.
"""

from __future__ import annotations

import math

import numpy as np

from ..record import Array
from .resolution import noise_of, step_of

__all__ = ["errors_like", "level_of"]

_FEWEST = 12  # samples
_FLOAT = 1e-13  # of the largest position: what double precision and filters leave


def level_of(position: Array, time: Array | None = None) -> float:
    """Standard deviation of the errors of ``position``, shape ``(n,)`` [x]; ``time`` [s] where it was sampled unevenly."""
    # Of fewer differences the median is no measure.
    noise = noise_of(position, time=time) if position.shape[0] >= _FEWEST else 0.0
    return max(noise, step_of(position) / math.sqrt(12.0)) + _FLOAT * float(np.max(np.abs(position)))


def errors_like(position: Array, smooth: Array, random: np.random.Generator, level: float | None = None) -> Array:
    """A draw of the errors of ``position`` [x], shape ``(n,)``.

    Args:
        position: as recorded [x], shape ``(n,)``.
        smooth: the motion without its errors [x], shape ``(n,)``.
        random: where draws come from.
        level: their standard deviation where ``position`` was brought onto an even grid, which takes part of them away [x].
    """
    if level is not None:
        return np.asarray(level * random.standard_normal(position.shape))
    step = step_of(position)
    white = math.sqrt(max(noise_of(position) ** 2 - step**2 / 12.0, 0.0))
    errors: Array = random.standard_normal(position.shape) * white
    if step > 0.0:
        moved = smooth + errors + step * random.random()
        errors = errors + step * np.round(moved / step) - moved
    return np.asarray(errors, dtype=np.float64)
