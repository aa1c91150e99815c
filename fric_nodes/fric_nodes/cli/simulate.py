"""``fric simulate``: the motion of a model under the forces of a recording, as a bag."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from .options import (
    EndOption,
    JointOption,
    JsonOption,
    ReadOptions,
    RepairOption,
    StartOption,
    TimeOption,
    TopicOption,
    read_all,
)

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command(
        "simulate",
        no_args_is_help=True,
        epilog="Example: fric simulate identified/model.yaml --force bags/slide --out bags/simulated",
    )(simulate)


def simulate(
    model: Annotated[Path, typer.Argument(help="A fric-model/1 file.")],
    force: Annotated[
        Path, typer.Option("--force", help="Recording whose force leads the model, and whose motion it is compared with.")
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder of the bag to write; must not exist.")],
    joint: JointOption = None,
    repair: RepairOption = False,
    time: TimeOption = "stamp",
    start: StartOption = None,
    end: EndOption = None,
    topic: TopicOption = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate a model in a free run under the recorded force; the recorded position becomes the reference of the new bag."""
    import numpy as np

    from .. import simulate as simulation
    from ..bagio.write import write_record
    from ..identification.equations import surroundings
    from ..identification.initial_state import initial_state
    from ..model_file import read_model

    held = read_model(model)
    record = read_all([force], ReadOptions(joint, repair, time, start, end, tuple(topic or ())))[0].uniform()
    record = replace(record, nominal=held.nominal)
    begin = initial_state(record.time, record.position)
    load, temperature = (each[:-1] if each.shape[0] > 1 else each for each in surroundings(record))
    motion = simulation.simulate(
        held,
        record.effort,
        record.sample_time,
        position=begin.position,
        velocity=begin.velocity,
        hold=record.effort_hold,
        load=load,
        temperature=temperature,
    )
    error = float(np.sqrt(np.mean((motion.position - record.position) ** 2)))
    simulated = replace(
        record,
        position=motion.position,
        velocity=motion.velocity,
        reference=record.position,
        valid=None,
        notes=(f"simulated from {model} under the force of {force}",),
    )
    write_record(simulated, out)
    if as_json:
        typer.echo(json.dumps({"bag": str(out), "samples": record.n_samples, "position_rmse": error}))
    else:
        unit = record.units.position
        typer.echo(f"{out}: {record.n_samples} samples; position RMSE against the recording {error:.3g} {unit}")
