"""``fric compare``: a simulated recording against the real one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from .options import (
    EndOption,
    JointOption,
    JsonOption,
    OutOption,
    ReadOptions,
    RepairOption,
    StartOption,
    TimeOption,
    TopicOption,
    progress,
    read_all,
)

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command(
        "compare",
        no_args_is_help=True,
        epilog="Example: fric compare bags/simulated bags/slide --out comparison",
    )(compare)


def compare(
    simulated: Annotated[Path, typer.Argument(help="Recording of the simulation: a rosbag2 folder or file.")],
    real: Annotated[Path, typer.Argument(help="Recording of the machine.")],
    out: OutOption = Path("comparison"),
    joint: JointOption = None,
    repair: RepairOption = False,
    time: TimeOption = "stamp",
    start: StartOption = None,
    end: EndOption = None,
    topic: TopicOption = None,
    as_json: JsonOption = False,
) -> None:
    """Align two recordings in time and say by how much and where they differ; writes report.html and report.json."""
    from fric.diagnosis.compare import compare as align
    from fric.files import write_text
    from fric.report.compare import comparison_report

    reading = ReadOptions(joint, repair, time, start, end, tuple(topic or ()))
    progress("reading 2 recordings")
    first, second = read_all([simulated, real], reading)
    found = align(first, second)
    page = comparison_report(found)
    write_text(out / "report.json", json.dumps(found.report(), indent=2) + "\n")
    write_text(out / "report.html", page)
    if as_json:
        typer.echo(json.dumps(found.report()))
        return
    typer.echo(found.sentence)
    typer.echo(
        f"offset {found.offset:.6g} s +- {1.96 * found.offset_error:.2g} s (95 %), ratio of the clocks {found.ratio:.8g} "
        f"+- {1.96 * found.ratio_error:.2g}"
    )
    for note in found.notes:
        typer.echo(f"- {note}")
    typer.echo(f"written: {out}/{{report.html, report.json}}")
