"""The force during a free oscillation: none, a constant one, or that of a feedback u = u_0 - P q - D v with known gains.

With the gains known (given, or found by regression of the recorded force on position and velocity) a feedback is a spring and
a damper of known size: that is de Marchi's parametric harmonic oscillation, which makes overdamped axes swing and masses seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...record import Array, Index
from ..result import IdentificationError

__all__ = ["Feedback", "acting"]

_EXPLAINED = 0.9  # part of the force's variance that a feedback must explain to be one
_MATTERS = 0.02  # part of the restoring force


@dataclass(frozen=True)
class Feedback:
    """u = constant - P q - D v.

    Attributes:
        proportional: P [F/x].
        derivative: D [F s/x].
        constant: [F].
        known: True when the gains were given, or the force is zero; False when they were found by regression.
    """

    proportional: float = 0.0
    derivative: float = 0.0
    constant: float = 0.0
    known: bool = True


def _start(deviation: Array, usual: float) -> int:
    """First sample after the last one at which the force deviates from its law."""
    away = np.flatnonzero(np.abs(deviation) > usual)
    return int(away[-1]) + 1 if away.size else 0


def acting(
    source: str,
    force: Array,
    position: Array,
    velocity: Array,
    turns: Index,
    gains: tuple[float, float] | None,
    mass: float | None,
    step: float,
) -> tuple[Feedback, int]:
    """The feedback that acts, and the first sample from which nothing else does.

    Args:
        source: file, for messages.
        force: as recorded [F], shape ``(n,)``.
        position: [x], shape ``(n,)``.
        velocity: [x/s], shape ``(n,)``.
        turns: samples of the reversals.
        gains: P and D where known.
        mass: [F s^2/x]; None: whether a force matters isn't judged.
        step: time between samples [s].

    Raises:
        IdentificationError: the force follows no such law.
    """
    late = slice(int(turns[len(turns) // 3]), int(turns[-1]) + 1)
    scale = float(np.max(np.abs(force)))
    if scale == 0.0 or gains is not None:
        # Gains that are given hold whether or not the recorded force contains them.
        proportional, derivative = gains or (0.0, 0.0)
        return Feedback(proportional, derivative, 0.0), 0
    level = float(np.median(force[late]))
    around = force[late] - level
    if float(np.ptp(around)) <= 1e-9 * scale:
        return Feedback(0.0, 0.0, level), _start(force - level, 1e-6 * scale)
    columns = np.stack([np.ones_like(around), -position[late], -velocity[late]], axis=1)
    answer, *_ = np.linalg.lstsq(columns, force[late], rcond=None)
    left = force[late] - columns @ answer
    if float(np.var(left)) <= (1.0 - _EXPLAINED) * float(np.var(around)):
        law = answer[0] - answer[1] * position - answer[2] * velocity
        usual = max(8.0 * float(np.std(left)), 1e-3 * scale)
        return Feedback(float(answer[1]), float(answer[2]), float(answer[0]), known=False), _start(force - law, usual)
    usual = 8.0 * 1.4826 * float(np.median(np.abs(around)))
    start = _start(force - level, max(usual, 1e-6 * scale))
    if mass is not None:
        omega = np.pi / (float(np.median(np.diff(turns))) * step)
        restoring = mass * omega**2 * float(np.std(position[late]))
        # Noise of the force sensor averages out; what lasts over a tenth of a half cycle does not.
        width = max(int(np.median(np.diff(turns))) // 10, 1)
        smooth = np.convolve(around, np.full(width, 1.0 / width), "valid")
        white = 0.5 * float(np.mean(np.diff(around) ** 2)) / width
        lasting = float(np.sqrt(max(float(np.var(smooth)) - 2.0 * white, 0.0)))
        if lasting > _MATTERS * restoring:
            raise IdentificationError(
                source,
                f"a force still acts during the oscillation ({100 * lasting / restoring:.2g} % of the restoring force)"
                " and is no feedback of position and velocity",
                "switch the drive off before the release, or record the oscillation under P + D feedback alone",
            )
    return Feedback(0.0, 0.0, level), start
