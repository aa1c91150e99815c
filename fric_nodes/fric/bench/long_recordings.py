"""Recordings of hours, written piece by piece: an axis with known friction whose viscous part falls as the machine warms up.

The motion is a sum of sines without a common period, so that no two pieces are alike; position, speed and acceleration are
known in closed form, and with them the force. What is measured is the position in steps of an encoder, and the force with
noise, both at the same instant.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..bagio.encode import joint_state_messages
from ..bagio.types import JOINT_STATE
from ..bagio.write import BagWriter
from ..record import Array

__all__ = ["DRIFT", "TRUE", "true_values", "write_long_recording"]

TRUE = {"mass": 5.0, "coulomb.force": 12.0, "viscous.coefficient": 30.0, "bias.force": 0.5}
"""Parameters at the beginning [SI]."""
DRIFT = -0.1
"""Change of the viscous coefficient [N s/m per h]."""
_AMPLITUDES = np.array([0.030, 0.012, 0.004])  # [m]
_FREQUENCIES = np.array([0.2, 0.2 * np.sqrt(11.0), 0.2 * np.sqrt(97.0)])  # [Hz]
_STEP = 1e-6  # [m] of the encoder
_NOISE = 0.1  # [N], standard deviation
_RATE = 1000  # [Hz]
_AT_ONCE = 60  # [s] made and written at once
_FIRST = 1_772_323_200 * 10**9  # [ns since 1970]


def true_values(hours: float) -> dict[str, float]:
    """The mean of each parameter over a recording of so many hours [SI]."""
    return TRUE | {"viscous.coefficient": TRUE["viscous.coefficient"] + 0.5 * DRIFT * hours}


def _signals(t: Array, generator: np.random.Generator) -> tuple[Array, Array]:
    """Position [m] and force [N] at times ``t`` [s], shape ``(n,)``."""
    w = 2.0 * np.pi * _FREQUENCIES
    phase = np.outer(t, w)
    sine, cosine = np.sin(phase), np.cos(phase)
    q, v, a = sine @ _AMPLITUDES, cosine @ (_AMPLITUDES * w), -sine @ (_AMPLITUDES * w**2)
    viscous = TRUE["viscous.coefficient"] + DRIFT * t / 3600.0
    force = TRUE["mass"] * a + TRUE["coulomb.force"] * np.sign(v) + viscous * v + TRUE["bias.force"]
    measured = force + _NOISE * generator.standard_normal(t.size)
    return _STEP * np.round(q / _STEP), measured


def write_long_recording(path: Path, hours: float, seed: int = 1) -> Path:
    """Write a recording as MCAP with zstd chunks; no more than a minute of it is in memory at any time.

    Args:
        path: folder to create.
        hours: length [h].
        seed: of the noise.

    Returns:
        The folder.
    """
    generator = np.random.default_rng(seed)
    n_samples = round(3600.0 * hours * _RATE)
    custom = {"fric.joint": "slide", "fric.position_unit": "m", "fric.force_unit": "N", "fric.effort_hold": "linear"}
    topic = "/joint_states"
    with BagWriter(path, compression="zstd", metadata=custom, flush_period=None) as bag:
        bag.topic(topic, JOINT_STATE)
        for first in range(0, n_samples, _AT_ONCE * _RATE):
            index = np.arange(first, min(first + _AT_ONCE * _RATE, n_samples), dtype=np.int64)
            position, effort = _signals(index / _RATE, generator)
            stamps = _FIRST + index * (10**9 // _RATE)
            for at, message in zip(stamps.tolist(), joint_state_messages(stamps, "slide", position, None, effort), strict=True):
                bag.write(topic, at, message)
    return path
