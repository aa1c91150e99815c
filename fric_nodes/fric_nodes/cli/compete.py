"""``fric compete``: methods of friction compensation against each other on axes that are recorded and identified anew."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

import typer

from .options import JsonOption, progress

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("compete", epilog="Example: fric compete --axis slide --seeds 3")(compete)


def compete(
    axis: Annotated[list[str] | None, typer.Option("--axis", help="Which axes; all when none is named.")] = None,
    method: Annotated[list[str] | None, typer.Option("--method", help="Which methods; all when none is named.")] = None,
    seeds: Annotated[int, typer.Option("--seeds", min=1, max=100, help="How many axes of each kind are drawn.")] = 2,
    first: Annotated[int, typer.Option("--first-seed", min=0, help="Number of the first of them.")] = 1,
    aged: Annotated[bool, typer.Option("--aged", help="Let friction change within 20 % after the recording.")] = False,
    listed: Annotated[bool, typer.Option("--list", help="Say what there is, and measure nothing.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Compare methods of friction compensation, each tuned from a recording of an axis drawn within 20 % of nominal."""
    from fric.bench.compensation.axes import AXES
    from fric.bench.compensation.competition import compete as run
    from fric.bench.compensation.competition import table
    from fric.bench.compensation.methods import METHODS
    from rich.console import Console
    from rich.table import Table

    if listed:
        for each in AXES.values():
            typer.echo(f"{each.id:12}{each.title}")
        typer.echo("methods: " + "; ".join(METHODS))
        return
    cells = run(range(first, first + seeds), axis or (), method or (), aged=aged, told=progress)
    if as_json:
        typer.echo(
            json.dumps([{"axis": c.axis, "method": c.method, "outcomes": [asdict(o) for o in c.outcomes]} for c in cells])
        )
        return
    shown = Table(box=None, pad_edge=False)
    for column in ("axis", "method", "tracking RMS", "of the seeds", "gain (90 %)", "peak at reversal", "command RMS"):
        shown.add_column(column)
    for row in table(cells):
        shown.add_row(*row)
    console = Console(highlight=False)
    console.print(shown)
    console.print("gain: RMS of the first method over it; ns: its interval holds 1. Units are those of the axis.")
