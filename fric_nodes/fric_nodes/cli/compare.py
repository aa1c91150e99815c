"""``fric compare``: align a simulated recording with a real one in time, and report by how much and where they differ."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from .groups import grouped
from .options import Reading, ReadingGroup, progress, read_all
from .results import Record, Results, ResultsGroup

__all__ = ["register"]

_RECORD = Record("report.json", form="fric-comparison/1")


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command(
        "compare",
        no_args_is_help=True,
        epilog="Example: fric compare bags/simulated bags/slide --out comparison",
    )(compare)


@grouped
def compare(
    simulated: Annotated[Path, typer.Argument(help="Recording of the simulation: a rosbag2 folder or file.")],
    real: Annotated[Path, typer.Argument(help="Recording of the machine.")],
    reading: ReadingGroup = Reading(),
    results: ResultsGroup = Results(Path("comparison")),
) -> None:
    """Align two recordings in time and say by how much and where they differ; writes report.html and report.json."""
    import fric

    results = results.claimed(_RECORD, ("report.html",))
    progress("reading 2 recordings")
    first, second = read_all([simulated, real], reading, as_recorded=True)
    found = fric.compare(first, second)
    results.write(_RECORD, found.files())
    if results.as_json:
        typer.echo(json.dumps(found.to_dict()))
        return
    typer.echo(found.summary())
    typer.echo(f"written: {results.out}/{{{', '.join(found.files())}}}")
