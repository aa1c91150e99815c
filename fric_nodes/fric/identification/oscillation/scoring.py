"""Score of a model on free oscillations: there is no force to compare with, so it is the inertial force that is predicted.

Of m a = u - F the error is the same on both sides; it is related to m a where the recorded force is zero or that of a feedback,
which a spring can't be told from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...model import Model
from ...record import Array, Record
from ...simulation import simulate
from ..equations import equations
from ..result import Options, Score
from ..scoring import force_along
from .recording import Oscillation

__all__ = ["score_of"]

_HARMONICS = 20.0


def _middle(found: Oscillation) -> int:
    """The sample between the first two reversals."""
    return int(found.turns[0] + found.turns[1]) // 2


def _free_part(record: Record, found: Oscillation, gains: tuple[float, float] | None) -> Record:
    """From the middle of the first half cycle on; with a feedback's force where its gains were given, not recorded."""
    start = float(found.time[_middle(found)])
    if gains is not None:
        velocity = np.gradient(record.position, record.time)
        effort = -gains[0] * record.position - gains[1] * velocity
        record = replace(record, effort=effort, effort_hold="linear")
    return record.between(start, float(found.time[-1]))


def _free_run(model: Model, part: Record, found: Oscillation) -> Array:
    """Simulated less recorded position [x], shape ``(n,)``, from the middle of the first half cycle on."""
    near = max(int(0.15 * found.half_period / found.sample_time), 3)
    at = _middle(found)
    around = slice(at - near, at + near + 1)
    # Between reversals the motion is smooth: a polynomial says where it is and how fast.
    *_, velocity, position = np.polyfit(found.time[around] - found.time[at], found.position[around], 3).tolist()
    motion = simulate(model, part.effort, part.sample_time, position=position, velocity=velocity, hold=part.hold)
    return motion.position - part.position


def score_of(
    model: Model, records: Sequence[Record], oscillations: Sequence[Oscillation], options: Options
) -> tuple[Score, tuple[str, ...]]:
    """Score of ``model`` on the free parts of ``records``, and what was left out."""
    if options.cutoff is None:
        slowest = max(found.half_period for found in oscillations)
        rate = 1.0 / max(record.sample_time for record in records)
        options = replace(options, cutoff=min(_HARMONICS / (2.0 * slowest), 0.4 * rate))
    gains = options.gains or [None] * len(records)
    parts = [_free_part(*each) for each in zip(records, oscillations, gains, strict=True)]
    found = equations(parts, options)
    use = found.sliding
    error = (found.force - found.rows(lambda stretch: force_along(model, stretch)))[use]
    inertial = found.rows(lambda stretch: force_along(model.with_terms(()), stretch))[use]
    spread = inertial - float(np.mean(inertial))
    off = np.concatenate([_free_run(model, part.uniform(), each) for part, each in zip(parts, oscillations, strict=True)])
    score = Score(
        noe=100.0 * float(error @ error) / float(spread @ spread),
        relative_force_error_percent=100.0 * float(np.linalg.norm(error) / np.linalg.norm(inertial)),
        force_rmse=float(np.sqrt(np.mean(error**2))),
        position_rmse=float(np.sqrt(np.mean(off**2))),
        n_samples=int(error.shape[0]),
    )
    return score, ("force errors are relative to the inertial force: no other force acts in a free oscillation",)
