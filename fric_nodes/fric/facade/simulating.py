"""The motion of a model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..control.closed_loop import closed_loop
from ..control.controller_file import read_controller
from ..errors import InputError
from ..identification.equations import surroundings
from ..identification.screen import screened
from ..model import Model
from ..record import Array, Record
from ..signals.initial_state import InitialState, initial_state
from ..simulation import simulate as _simulate
from .reading import records_of
from .structure import ModelLike, model_from

if TYPE_CHECKING:
    from .reading import Source

__all__ = ["free_run", "simulate"]


def simulate(
    model: ModelLike,
    force: ArrayLike | Source | None = None,
    period: float | None = None,
    *,
    reference: Source | None = None,
    controller: str | Path | None = None,
    position: float = 0.0,
    velocity: float = 0.0,
) -> Record:
    """The motion of a model under a force, or in closed loop under the reference of a recording.

    Args:
        model: a model, its file, or effects as for :func:`fric.identify` (which then have their start values).
        force: one value per sample [F], shape ``(n,)``, each held until the next; or a recording, whose force leads the model
            from its recorded state on.
        period: time from sample to sample [s]; for an array of forces.
        reference: in place of ``force``: the recording whose reference a ``controller`` follows.
        controller: a ``fric-controller/1`` file.
        position: where an array of forces starts [x].
        velocity: and how fast [x/s].

    Returns:
        Position, velocity and force of the simulation; under a recording's force, the recorded position is its reference.

    Raises:
        InputError: not exactly one of a force and a reference with its controller; a force without a period.

    Example:
        >>> from fric.model import build_model, term
        >>> axis = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=5.0)])
        >>> motion = simulate(axis, np.full(1001, 9.0), 1e-3)
        >>> round(float(motion.velocity[-1]), 6)  # (9 N - 5 N) / 2 kg for a second
        2.0
    """
    held = model_from(model)
    if (force is None) == (reference is None) or (reference is None) != (controller is None):
        raise InputError("simulate", "no single way to lead the model", "give a force, or a reference and a controller")
    if reference is not None and controller is not None:
        return closed_loop(held, read_controller(Path(controller)), _recorded(reference, held)).record
    if isinstance(force, (str, Path, Record)) or hasattr(force, "columns"):
        return free_run(held, _recorded(force, held))[0]
    if period is None or not period > 0.0:
        raise InputError("simulate", "an array of forces has no period", "give period=..., the time from sample to sample [s]")
    effort: Array = np.array(force, dtype=np.float64)
    if effort.ndim != 1 or effort.shape[0] < 2 or not np.all(np.isfinite(effort)):
        raise InputError("simulate", "the force is no row of two or more finite numbers", "give one value per sample")
    motion = _simulate(held, effort, period, position=position, velocity=velocity, hold="following")
    return Record(
        period * np.arange(effort.shape[0], dtype=np.float64),
        motion.position,
        effort,
        velocity=motion.velocity,
        joint=held.joint,
        units=held.units,
        source="simulation",
        effort_hold="following",
    )


def _recorded(source: Source, model: Model) -> Record:
    """The recording, evenly sampled, with the conditions at which the model's values hold."""
    (record,) = records_of(source)
    return replace(screened(record).uniform(), nominal=model.nominal)


def free_run(held: Model, record: Record) -> tuple[Record, InitialState]:
    """The motion of a model under the force of ``record``, from its recorded state on, and that state.

    Args:
        held: the model.
        record: evenly sampled; its position is the reference of what comes back.
    """
    begin = initial_state(record.time, record.position)
    load, temperature = (each[:-1] if each.shape[0] > 1 else each for each in surroundings(record))
    motion = _simulate(
        held,
        record.effort,
        record.sample_time,
        position=begin.position,
        velocity=begin.velocity,
        hold=record.hold,
        load=load,
        temperature=temperature,
    )
    found = replace(
        record,
        position=motion.position,
        velocity=motion.velocity,
        reference=record.position,
        valid=None,
        source="simulation",
        notes=(f"simulated under the force of {record.source}",),
    )
    return found, begin
