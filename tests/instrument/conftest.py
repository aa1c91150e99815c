"""A recording whose force is written down from its motion: no integrator has a part in it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from fric.record import Record
from numpy.typing import NDArray

Array = NDArray[np.float64]

MASS, COULOMB, VISCOUS = 2.0, 8.0, 10.0


def written(
    duration: float = 12.0,
    step: float = 1e-3,
    late: float = 0.0,
    growth: float = 0.0,
    seed: int = 3,
    top: float = 4.0,
    noise: float = 0.1,
    resolution: float = 1e-6,
) -> Record:
    """A multisine and the force that mass and friction need for it, ``late`` [s], more so by ``growth`` [s/s]."""
    random = np.random.default_rng(seed)
    frequency = np.geomspace(0.2, top, 6) * random.uniform(0.9, 1.1, 6)
    phase = random.uniform(0.0, 6.28, 6)
    rate = 2.0 * np.pi * frequency
    amplitude = 0.02 / frequency**0.8

    def motion(time: Array) -> tuple[Array, Array, Array]:
        angle = np.outer(time, rate) + phase
        return np.sin(angle) @ amplitude, np.cos(angle) @ (amplitude * rate), -np.sin(angle) @ (amplitude * rate**2)

    time = step * np.arange(round(duration / step))
    position, velocity, _ = motion(time)
    _, v, a = motion(time - late - growth * time)
    effort = MASS * a + COULOMB * np.sign(v) + VISCOUS * v + noise * random.standard_normal(time.size)
    return Record(time, np.round(position / resolution) * resolution, effort, reference=position, velocity=velocity)


@pytest.fixture(scope="session")
def write() -> Callable[..., Record]:
    """See :func:`written`."""
    return written
