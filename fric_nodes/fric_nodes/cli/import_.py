"""``fric import``: convert a recording in another format (.mat, .csv, .npz, .parquet, ...) into a bag."""

from __future__ import annotations

import json
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from .options import JsonOption, RepairOption

__all__ = ["register"]


class Storage(str, Enum):
    """Storage formats of a bag."""

    MCAP = "mcap"
    SQLITE3 = "sqlite3"


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("import", no_args_is_help=True, epilog="Example: fric import run.csv --map map.yaml --out bags/run")(import_)


def import_(
    file: Annotated[Path, typer.Argument(help=".mat, .csv, .txt, .json, .jsonl, .npz or .parquet")],
    mapping: Annotated[Path, typer.Option("--map", help="YAML that says where each signal comes from, its unit and a factor.")],
    out: Annotated[Path, typer.Option("--out", help="Folder of the bag to write; must not exist.")],
    storage: Annotated[Storage, typer.Option("--storage", help="Format of the bag.")] = Storage.MCAP,
    repair: RepairOption = False,
    as_json: JsonOption = False,
) -> None:
    """Convert a recording into a rosbag2 bag, which every other command reads.

    The mapping names time, effort, and position or velocity; reference, normal_load, temperature and extra signals may follow.
    Only the columns that it names are checked. A signal that was sampled at other times has a time of its own, as in effort:
    {from: torque, unit: N m, time: {from: t2, unit: ms}}. Its effort_hold says when a force acts: following (a controller's
    output, held from its stamp to the next), preceding or mean (over the sample before), linear (a continuous force), or
    unknown (the default: fits find it from the motion).
    """
    from fric.bagio.importing import import_recording
    from fric.bagio.mapping import load_mapping
    from fric.bagio.write import write_record

    record = import_recording(file, load_mapping(mapping), repair=repair)
    write_record(record, out, storage=storage.value)
    if as_json:
        summary = {
            "bag": str(out),
            "joint": record.joint,
            "samples": record.n_samples,
            "duration": record.duration,
            "notes": record.notes,
        }
        typer.echo(json.dumps(summary))
        return
    typer.echo(
        f"{out}: joint '{record.joint}', {record.n_samples} samples, {record.duration:.2f} s at {1 / record.sample_time:.4g} Hz"
    )
    for note in record.notes:
        typer.echo(f"- {note}")
