"""Controllers of the axes that other hands lead: what they do, and how they are drawn.

Three kinds that machines have. A *continuous* one is an analogue loop of position and speed. A *sampled* one does the same
on the encoder's rounded position at its own rate, with the speed from differences behind a first-order filter. A *cascade*
is sampled too: a proportional position loop around a speed loop with an integral part, which doesn't integrate while the
command is limited (anti-windup by clamping; Astrom, Hagglund 2006, section 3.5).

Command [N], with e the error of position and d that of speed: u = feedforward + stiffness e + damping d, and in a cascade
besides damping times integral times the integral of (stiffness/damping e + d).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..axis import Setting

__all__ = ["CONTINUOUS", "Controller", "drawn_controller"]

CONTINUOUS, SAMPLED, CASCADE = "continuous", "sampled", "cascade"
_RATES = (200.0, 5000.0)  # [Hz]: from a loop over a field bus to one in a drive
_LARGEST = 20.0  # times the usual force: a limit that only an error would meet


@dataclass(frozen=True)
class Controller:
    """Numbers of a controller.

    Attributes:
        kind: ``continuous``, ``sampled`` or ``cascade``.
        rate: of its samples [Hz]; 0 for a continuous one.
        stiffness: force over error of position [N/m].
        damping: force over error of speed [N s/m].
        integral: inverse of the time in which the integral part does as much as the proportional one [1/s].
        smoothing: time constant of the filter of its speed [s].
        largest: command [N].
    """

    kind: str
    rate: float
    stiffness: float
    damping: float
    integral: float
    smoothing: float
    largest: float


def drawn_controller(setting: Setting, sampled: bool, random: np.random.Generator) -> Controller:
    """A controller for the axis; one that is ``sampled`` where an analogue one would not do."""
    kinds = (SAMPLED, CASCADE) if sampled else (CONTINUOUS, SAMPLED, CASCADE)
    kind = kinds[int(random.integers(len(kinds)))]
    rate = float(math.exp(random.uniform(*np.log(_RATES))))
    # A loop that is no faster than a fifth of its sampling rate keeps its phase; in rad/s, as of the usual examiner.
    bandwidth = setting.bandwidth if kind == CONTINUOUS else min(setting.bandwidth, 0.2 * rate)
    mass = setting.physics.mass
    usual = setting.friction + mass * setting.acceleration
    return Controller(
        kind=kind,
        rate=0.0 if kind == CONTINUOUS else rate,
        stiffness=mass * bandwidth**2 * float(random.uniform(0.6, 1.1)),
        damping=mass * bandwidth * float(random.uniform(1.2, 1.7)),
        integral=bandwidth * float(random.uniform(0.05, 0.25)) if kind == CASCADE else 0.0,
        smoothing=0.06 / bandwidth,
        largest=_LARGEST * usual,
    )
