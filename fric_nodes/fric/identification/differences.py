"""Velocity and acceleration of a filtered position, as means about each sample that agree with those of the force."""

from __future__ import annotations

import numpy as np

from ..record import Array

__all__ = ["differentiated", "smooth_mean"]

_EIGHTH = (4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0)  # of differences k samples apart either way (Fornberg 1988)


def differentiated(position: Array, sample_time: float) -> tuple[Array, Array, Array]:
    """A filtered position, and its velocity and acceleration as means about each sample, falling to zero at the next ones.

    With these weights the mean acceleration is the second difference of the position, exactly, whatever happens between two
    samples, and the mean of a force that is held between them is that of the two around a sample. The velocity is taken by
    differences of eighth order and averaged likewise, which for what is smooth is (v_before + 10 v + v_after) / 12.
    """
    n, reach = position.shape[0], len(_EIGHTH)
    velocity = np.gradient(position, sample_time)
    velocity[reach:-reach] = (
        sum(
            weight * (position[reach + k : n - reach + k] - position[reach - k : n - reach - k])
            for k, weight in enumerate(_EIGHTH, 1)
        )
        / sample_time
    )
    acceleration = np.empty(n)
    acceleration[1:-1] = np.diff(position, 2) / sample_time**2
    acceleration[0], acceleration[-1] = acceleration[1], acceleration[-2]
    return position, smooth_mean(velocity), acceleration


def smooth_mean(values: Array) -> Array:
    """Mean of a smooth signal about each sample with weights that fall to zero at the next ones, shape ``(n,)``."""
    before, after = np.concatenate([values[:1], values[:-1]]), np.concatenate([values[1:], values[-1:]])
    return np.asarray((before + 10.0 * values + after) / 12.0, dtype=np.float64)
