"""``fric bench``: measure, on this machine, the figures that the README states."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer
from fric.errors import InputError

from .options import JsonOption, progress

if TYPE_CHECKING:
    from fric.bench import Benchmark

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("bench", epilog="Example: fric bench recordings fitting")(bench)


def bench(
    names: Annotated[
        list[str] | None, typer.Argument(help="Which benchmarks; all but the long ones when none is named.")
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="All, the long ones too.")] = False,
    listed: Annotated[bool, typer.Option("--list", help="Say what can be measured, and measure nothing.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Measure speed on this machine; exit status 1 when a goal is missed."""
    from fric.bench import BENCHMARKS
    from rich.console import Console
    from rich.table import Table

    if listed:
        _list(list(BENCHMARKS.values()), as_json)
        return
    chosen = names or [name for name, benchmark in BENCHMARKS.items() if everything or not benchmark.long]
    for name in chosen:
        if name not in BENCHMARKS:
            raise InputError("fric bench", f"no benchmark '{name}'", f"choose from {', '.join(BENCHMARKS)}")
    figures = []
    for name in chosen:
        progress(f"measuring {BENCHMARKS[name].title}")
        figures += BENCHMARKS[name].run()
    if as_json:
        typer.echo(
            json.dumps(
                [{"name": f.name, "value": f.value, "unit": f.unit, "goal": f.goal, "reached": f.reached} for f in figures]
            )
        )
    else:
        table = Table(box=None, pad_edge=False)
        table.add_column("figure")
        table.add_column("measured", justify="right")
        table.add_column("goal")
        for figure in figures:
            mark = "" if figure.reached is None else " reached" if figure.reached else " missed"
            unit = "" if figure.unit == "1" else f" {figure.unit}"
            table.add_row(figure.name, f"{figure.value:.4g}{unit}", f"{figure.goal}{unit}{mark}" if figure.goal else "")
        Console(highlight=False).print(table)
    left_out = [name for name in BENCHMARKS if name not in chosen] if not names else []
    if left_out:
        progress(f"left out, since they take long: {', '.join(left_out)} (name them, or --all)")
    if any(figure.reached is False for figure in figures):
        raise typer.Exit(1)


def _list(benchmarks: Sequence[Benchmark], as_json: bool) -> None:
    """Print the names of ``benchmarks``, what they measure, and which are long."""
    if as_json:
        typer.echo(json.dumps([{"name": each.id, "title": each.title, "long": each.long} for each in benchmarks]))
        return
    for each in benchmarks:
        typer.echo(f"{each.id:24}{each.title}{' (long)' if each.long else ''}")
