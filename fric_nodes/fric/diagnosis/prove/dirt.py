"""What stands between a real axis and its recording, put on an examiner's clean recordings.

Coloured noise and mains in the force signal, the encoder's interpolation error, and stamps that jitter: where the clock
alone is late, and where the position is read late. Sizes are those of servo drives and machine tools: a few thousandths to a
hundredth of the friction level, an encoder step or two, some tens of microseconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...record import Record
from ...signals.pink_noise import pink_noise

__all__ = ["Dirt", "drawn_dirt"]

_PINK = (0.002, 0.012)  # of the friction level
_MAINS = (0.002, 0.01)  # of the friction level
_INTERPOLATION = (0.5, 2.0)  # encoder steps
_PERIODS = (40.0, 400.0)  # of the encoder's lines over the travel
_JITTER = (3e-6, 4e-5)  # [s]


@dataclass(frozen=True)
class Dirt:
    """Sizes of everything.

    Attributes:
        pink: standard deviation of 1/f noise of the force [N].
        mains: amplitude of 50 Hz in the force signal [N].
        interpolation: amplitude of the error within a line of the encoder [m].
        pitch: of the lines [m].
        jitter: standard deviation of a stamp, or of the time at which a position is read [s].
        read_late: True where the position is read late; False: the stamp alone is.
    """

    pink: float
    mains: float
    interpolation: float
    pitch: float
    jitter: float
    read_late: bool

    def on(self, record: Record, seed: int) -> Record:
        """``record`` as it would have been written."""
        random = np.random.default_rng(seed)
        n = record.n_samples
        position, time = record.position, record.time
        force = record.effort + self.pink * pink_noise(random, n)
        force = force + self.mains * np.sin(2.0 * math.pi * 50.0 * time + random.uniform(0.0, 2.0 * math.pi))
        phase = random.uniform(0.0, 2.0 * math.pi, 2)
        for order, share in ((1, 0.8), (2, 0.6)):  # of an interpolator's offset, and of its unequal amplitudes
            position = position + share * self.interpolation * np.sin(
                2.0 * math.pi * order * record.position / self.pitch + phase[order - 1]
            )
        # Stamps stay in order whatever is drawn.
        step = float(np.median(np.diff(time)))
        late = np.clip(self.jitter * random.standard_normal(n), -0.4 * step, 0.4 * step)
        if self.read_late:
            position = position + np.gradient(record.position, time) * late
        else:
            time = time + late
        return replace(record, time=time, position=position, effort=force)


def drawn_dirt(level: float, travel: float, resolution: float, random: np.random.Generator) -> Dirt:
    """The dirt of an axis with a friction of ``level`` [N], over ``travel`` [m], with encoder steps of ``resolution`` [m]."""

    def among(ends: tuple[float, float]) -> float:
        return float(np.exp(random.uniform(*np.log(ends))))

    return Dirt(
        pink=level * among(_PINK),
        mains=level * among(_MAINS),
        interpolation=resolution * among(_INTERPOLATION),
        pitch=travel / among(_PERIODS),
        jitter=among(_JITTER),
        read_late=bool(random.random() < 0.5),
    )
