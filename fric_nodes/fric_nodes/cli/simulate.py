"""``fric simulate``: simulate a model under a recorded force or reference, and write the motion as a bag."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer
from fric.errors import InputError

from .groups import grouped
from .options import JsonOption, Reading, ReadingGroup, read_all

if TYPE_CHECKING:
    from fric.model import Model
    from fric.record import Record

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command(
        "simulate",
        no_args_is_help=True,
        epilog="Example: fric simulate identified/model.yaml --force bags/slide --out bags/simulated",
    )(simulate)


@grouped
def simulate(
    model: Annotated[Path, typer.Argument(help="A fric-model/1 file.")],
    out: Annotated[Path, typer.Option("--out", help="Folder of the bag to write; must not exist.")],
    force: Annotated[
        Path | None, typer.Option("--force", help="Free run: the recording whose force drives the model.", show_default=False)
    ] = None,
    closed_loop: Annotated[
        Path | None,
        typer.Option("--closed-loop", help="Closed loop: controller file (fric-controller/1) that drives the model."),
    ] = None,
    reference: Annotated[
        Path | None, typer.Option("--reference", help="Closed loop: the recording whose reference the controller follows.")
    ] = None,
    reading: ReadingGroup = Reading(),
    as_json: JsonOption = False,
) -> None:
    """Simulate a model in a free run under a recorded force, or in closed loop under a recorded reference.

    It starts in the recorded state and is compared with the recorded motion. In a free run the recorded position becomes the
    reference of the new bag.
    """
    from fric.model_file import read_model

    if (force is None) == (closed_loop is None) or (closed_loop is None) != (reference is None):
        raise InputError(
            "fric simulate",
            "needs one source of the force",
            "give --force BAG, or --closed-loop CONTROLLER.yaml --reference BAG",
        )
    held = read_model(model)
    if closed_loop is not None and reference is not None:
        shown = _in_closed_loop(held, model, closed_loop, _recorded(reference, reading, held), out)
    else:
        assert force is not None
        shown = _free_run(held, model, force, _recorded(force, reading, held), out)
    typer.echo(json.dumps(shown.as_json) if as_json else shown.text)


class _Shown(NamedTuple):
    """What is printed."""

    as_json: dict[str, object]
    text: str


def _recorded(path: Path, reading: Reading, model: Model) -> Record:
    """The recording, evenly sampled, with the conditions at which the model's values hold."""
    return replace(read_all([path], reading)[0].uniform(), nominal=model.nominal)


def _free_run(held: Model, model: Path, force: Path, record: Record, out: Path) -> _Shown:
    import numpy as np
    from fric.bagio.write import write_record
    from fric.facade.simulating import free_run

    simulated, begin = free_run(held, record)
    error = float(np.sqrt(np.mean((simulated.position - record.position) ** 2)))
    simulated = replace(simulated, notes=(f"simulated from {model} under the force of {force}",))
    write_record(simulated, out)
    unsure = float(begin.standard_errors[1])
    unit = record.units.position
    return _Shown(
        {
            "bag": str(out),
            "samples": record.n_samples,
            "position_rmse": error,
            "start_velocity": {"value": begin.velocity, "std": unsure, "unit": f"{unit}/s"},
        },
        f"{out}: {record.n_samples} samples from {begin.velocity:.3g} ± {unsure:.2g} {unit}/s on;"
        f" position RMSE against the recording {error:.3g} {unit}",
    )


def _in_closed_loop(held: Model, model: Path, controller: Path, record: Record, out: Path) -> _Shown:
    from fric.bagio.write import write_record
    from fric.control.closed_loop import closed_loop
    from fric.control.controller_file import read_controller

    found = closed_loop(held, read_controller(controller), record)
    note = f"simulated from {model} in closed loop with {controller} under the reference of {record.source}"
    write_record(replace(found.record, notes=(note,)), out)
    unit = record.units.position
    return _Shown(
        {
            "bag": str(out),
            "samples": record.n_samples,
            "position_rmse": found.position_rmse,
            "relative_force_error_percent": found.relative_force_error_percent,
            "tracking_rms": found.tracking_rms,
            "recorded_tracking_rms": found.recorded_tracking_rms,
            "saturated": found.saturated,
        },
        f"{out}: {record.n_samples} samples in closed loop; against the recording: position RMSE {found.position_rmse:.3g}"
        f" {unit}, force error {found.relative_force_error_percent:.3g} %\n"
        f"tracking error (RMS) {found.tracking_rms:.3g} {unit}, as recorded {found.recorded_tracking_rms:.3g} {unit}",
    )
