"""Axes that turn or slide, written down from their motion, and what instruments do to such recordings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from fric.record import Record, Units
from numpy.typing import NDArray

Array = NDArray[np.float64]

INERTIA, COULOMB, VISCOUS = 0.02, 0.4, 0.06


def turned(
    duration: float = 12.0,
    rate: float = 1000.0,
    speed: float = 12.0,
    seed: int = 1,
    noise: float = 2e-5,
    force_noise: float = 0.01,
    unit: str = "rad",
) -> Record:
    """A joint that turns by several turns to and fro, at most about ``speed`` [rad/s], and the torque that this takes."""
    random = np.random.default_rng(seed)
    time = np.arange(round(duration * rate)) / rate
    frequency = np.array([0.11, 0.31, 0.83, 1.9]) * random.uniform(0.9, 1.1, 4)
    amplitude = speed * np.array([0.5, 0.25, 0.15, 0.1]) / (2.0 * np.pi * frequency)
    phase, omega = random.uniform(0.0, 6.28, 4), 2.0 * np.pi * frequency
    angle = np.outer(time, omega) + phase
    q = np.sin(angle) @ amplitude + random.uniform(-3.0, 3.0)
    v, a = np.cos(angle) @ (amplitude * omega), -np.sin(angle) @ (amplitude * omega**2)
    effort = INERTIA * a + COULOMB * np.sign(v) + VISCOUS * v + force_noise * random.standard_normal(time.size)
    return Record(
        time, q + noise * random.standard_normal(time.size), effort, velocity=v, reference=q, units=Units(unit, "N m")
    )


def folded(signal: Array, size: float, low: float) -> Array:
    """``signal`` kept from ``low`` to ``low + size``."""
    return (signal - low) % size + low


@pytest.fixture(scope="session")
def turn() -> Callable[..., Record]:
    """See :func:`turned`."""
    return turned


@pytest.fixture(scope="session")
def fold() -> Callable[[Array, float, float], Array]:
    """See :func:`folded`."""
    return folded
