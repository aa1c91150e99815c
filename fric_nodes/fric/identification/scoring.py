"""How well a model explains recordings: the force it predicts, and where it ends up in a free run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model import Model
from ..record import Array, Record
from ..signals.initial_state import initial_state
from ..simulation import Predictor, intervals, respond, simulate
from .equations import Equations, equations
from .result import Options, Score
from .stretch import FINER, Motion, Stretch

__all__ = ["driving_force", "force_along", "force_over_intervals", "free_run", "score"]


def score(model: Model, records: Sequence[Record], options: Options, found: Equations | None = None) -> Score:
    """Score of ``model`` on ``records``: every valid row counts but those that a rest reaches into, whatever weight it had.

    At rest a static friction law leaves the force open, so that there is nothing to compare; leaving rest out for every
    structure keeps the scores of different structures comparable.

    Args:
        model: with its values.
        records: the recordings.
        options: filter settings, as used in the fit.
        found: the equations of ``records``, when they are at hand.
    """
    found = equations(list(records), options) if found is None else found

    use = found.clear
    force = driving_force(model, found)[use]
    error = force - found.rows(lambda stretch: force_along(model, stretch))[use]
    if not np.any(force):
        # A free motion: the error of m a = u - F is the same on both sides, and is related to the one that isn't zero.
        force = found.rows(lambda stretch: force_along(model.with_terms(()), stretch))[use]
    spread = force - float(np.mean(force))
    off = np.concatenate([free_run(model, stretch) - stretch.raw_position for stretch in found.stretches])
    return Score(
        noe=100.0 * float(error @ error) / float(spread @ spread),
        relative_force_error_percent=100.0 * float(np.linalg.norm(error) / np.linalg.norm(force)),
        force_rmse=float(np.sqrt(np.mean(error**2))),
        position_rmse=float(np.sqrt(np.mean(off**2))),
        n_samples=int(error.shape[0]),
    )


def driving_force(model: Model, found: Equations) -> Array:
    """The force of every row that acts when the recorded effort goes through the model's command path, shape ``(n_rows,)``."""
    if not model.has_command_path:
        return found.force

    def acting(stretch: Stretch) -> Array:
        given = respond(model, intervals(stretch.effort, stretch.hold), stretch.sample_time)
        around = np.concatenate([given[:1], given, given[-1:]])
        return stretch.smooth(0.5 * (around[:-1] + around[1:]))

    return found.rows(acting)


def force_along(model: Model, stretch: Stretch) -> Array:
    """Force that ``model`` needs along the motion of a stretch at full rate [F], shape ``(n,)``."""
    if not model.has_slip_dynamics:
        return _along(model, stretch.motion)
    fine = _along(model, stretch.fine_motion).reshape(-1, FINER)
    # The mean about a sample, falling to zero at the next ones, as of the measured motion.
    rising = (np.arange(FINER) + 0.5) / FINER
    before, after = fine @ rising / FINER, fine @ rising[::-1] / FINER
    return np.concatenate([2.0 * after[:1], before[:-1] + after[1:], 2.0 * before[-1:]])


def force_over_intervals(model: Model, stretch: Stretch) -> Array:
    """Mean force that ``model`` needs from each sample to the next [F], ``(n - 1,)``, its friction led along the finer path."""
    return np.asarray(np.mean(_along(model, stretch.fine_motion).reshape(-1, FINER), axis=1), dtype=np.float64)


def _along(model: Model, motion: Motion) -> Array:
    effort, _ = Predictor(model).run(
        motion.time, motion.position, motion.velocity, motion.acceleration, motion.step, motion.load, motion.temperature
    )
    return effort


def free_run(model: Model, stretch: Stretch) -> Array:
    """Position of ``model`` [x], shape ``(n,)``, led by the measured force alone from the stretch's first state."""
    begin = initial_state(stretch.time, stretch.raw_position, error=stretch.position_error)
    motion = simulate(
        model,
        stretch.effort,
        stretch.sample_time,
        position=begin.position,
        velocity=begin.velocity,
        hold=stretch.hold,
        load=stretch.load[:-1] if stretch.load.shape[0] > 1 else stretch.load,
        temperature=stretch.temperature[:-1] if stretch.temperature.shape[0] > 1 else stretch.temperature,
    )
    return motion.position
