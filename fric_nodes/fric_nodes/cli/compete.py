"""``fric compete``: methods of friction compensation against each other on axes that are recorded and identified anew."""

from __future__ import annotations

import json
import math
import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from .options import JsonOption, progress

__all__ = ["register"]

_QUICK_SEEDS, _SEEDS = 1, 3


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("compete", epilog="Example: fric compete --out competition.html")(compete)


def compete(
    axis: Annotated[list[str] | None, typer.Option("--axis", help="Which axes; all when none is named.")] = None,
    method: Annotated[list[str] | None, typer.Option("--method", help="Which methods; all when none is named.")] = None,
    seeds: Annotated[
        int | None,
        typer.Option(
            "--seeds", min=1, max=100, help=f"How many axes of each kind are drawn; {_SEEDS}, or {_QUICK_SEEDS} quick."
        ),
    ] = None,
    first: Annotated[int, typer.Option("--first-seed", min=0, help="Number of the first of them.")] = 1,
    quick: Annotated[bool, typer.Option("--quick", help="One seed and one method of each family; a minute.")] = False,
    aged: Annotated[bool, typer.Option("--aged", help="Let friction change within 20 % after the recording.")] = False,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Page (HTML) to write.")] = None,
    listed: Annotated[bool, typer.Option("--list", help="Say what there is, and measure nothing.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Compare methods of friction compensation, each tuned from a recording of an axis drawn within 20 % of nominal."""
    from fric.bench.compensation.catalogue import AXES
    from fric.bench.compensation.competition import compete as run
    from fric.bench.compensation.methods import METHODS, QUICK
    from fric.bench.compensation.page import circle_section, competition_page
    from fric.files import write_text

    if listed:
        for each in AXES.values():
            typer.echo(f"{each.id:12}{each.title}")
        typer.echo("methods: " + "; ".join(METHODS))
        return
    count = seeds if seeds is not None else (_QUICK_SEEDS if quick else _SEEDS)
    methods = method or (QUICK if quick else ())
    begin = time.monotonic()
    cells = run(range(first, first + count), axis or (), methods, aged=aged, told=progress)
    if out is not None:
        named = "".join(f" --axis {each}" for each in axis or ()) + "".join(f" --method '{each}'" for each in method or ())
        command = f"fric compete --seeds {count} --first-seed {first}{' --quick' if quick else ''}{' --aged' if aged else ''}"
        whole = f"{command}{named} --out {out.name}"
        further = []
        if not (quick or method) and "slide" in (axis or AXES):
            progress("circle test of two slides")
            further = [circle_section(first)]
        write_text(out, competition_page(cells, whole, time.monotonic() - begin, aged, further))
    if as_json:
        typer.echo(json.dumps([_plain(c.axis, c.method, [asdict(o) for o in c.outcomes]) for c in cells]))
        return
    _show(cells)
    if out is not None:
        typer.echo(f"written: {out}")


def _plain(axis: str, method: str, outcomes: list[dict[str, Any]]) -> dict[str, Any]:
    """One cell for programs: what isn't finite is null."""
    held = [
        {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in each.items()}
        for each in outcomes
    ]
    return {"axis": axis, "method": method, "outcomes": held}


def _show(cells: Any) -> None:
    from fric.bench.compensation.competition import table
    from rich.console import Console
    from rich.table import Table

    shown = Table(box=None, pad_edge=False)
    for column in ("axis", "method", "RMS", "gain (90 %)", "peak", "settling [s]", "hunts", "of the limit"):
        shown.add_column(column)
    for row in table(cells):
        shown.add_row(*row)
    console = Console(highlight=False)
    console.print(shown)
    console.print(
        "RMS and peak of the error in the axis's unit. gain: RMS of the first method over it; ns: its interval holds 1."
    )
