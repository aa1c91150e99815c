"""``fric bench``: measure the speed and the accuracy of fric on this machine, against the figures in the README."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer
from fric.errors import InputError

from .options import JsonOption, progress
from .printed import console, plain_table

if TYPE_CHECKING:
    from fric.bench import Benchmark
    from fric.figure import Figure

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("bench", epilog="Example: fric bench recordings fitting")(bench)


def bench(
    names: Annotated[
        list[str] | None, typer.Argument(help="Names of benchmarks. If none is given: all but the long ones.")
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="All benchmarks, the long ones too.")] = False,
    listed: Annotated[bool, typer.Option("--list", help="List the benchmarks, and measure nothing.")] = False,
    graph: Annotated[bool, typer.Option("--graph", help="With 'faults': in the running graph; takes half an hour.")] = False,
    recordings: Annotated[int | None, typer.Option("--recordings", help="With 'batch': how many to make and work on.")] = None,
    hours: Annotated[
        int | None, typer.Option("--hours", help="With 'long-recordings': the length of the only recording, in h.")
    ] = None,
    cases: Annotated[int | None, typer.Option("--cases", help="With 'sparse-regression': how many simulated axes.")] = None,
    minutes: Annotated[
        int | None, typer.Option("--minutes", help="With 'soak' and 'soak-wall': how long the graph runs, in min.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure speed and accuracy on this machine; exit status 1 when a goal is missed."""
    from fric.bench import BENCHMARKS

    if listed:
        _list(list(BENCHMARKS.values()), as_json)
        return
    if graph and "faults" not in (names or []):
        raise InputError("fric bench", "--graph goes with the benchmark 'faults'", "fric bench faults --graph")
    if graph:
        names = [f"{name}-graph" if name == "faults" else name for name in names or []]
    chosen = names or [name for name, benchmark in BENCHMARKS.items() if everything or not benchmark.long]
    for name in chosen:
        if name not in BENCHMARKS:
            raise InputError("fric bench", f"no benchmark '{name}'", f"choose from {', '.join(BENCHMARKS)}")
    sizes = {"recordings": recordings, "hours": hours, "cases": cases, "minutes": minutes}
    for what, size in sizes.items():
        takers = [name for name, benchmark in BENCHMARKS.items() if benchmark.sized and benchmark.size == what]
        if size is not None and (size < 1 or not set(takers) & set(chosen)):
            raise InputError(
                f"--{what}", f"is 1 or more, and goes with: {', '.join(takers)}", f"fric bench {takers[0]} --{what} 24"
            )
    figures = []
    for name in chosen:
        progress(f"measuring {BENCHMARKS[name].title}")
        sized, size = BENCHMARKS[name].sized, sizes[BENCHMARKS[name].size]
        figures += BENCHMARKS[name].run() if sized is None or size is None else sized(size)
    _print(figures, as_json)
    left_out = [name for name in BENCHMARKS if name not in chosen] if not names else []
    if left_out:
        progress(f"left out, since they take long: {', '.join(left_out)} (name them, or --all)")
    if any(figure.reached is False for figure in figures):
        raise typer.Exit(1)


def _print(figures: Sequence[Figure], as_json: bool) -> None:
    """Print what was measured, and why the rest was not."""
    if as_json:
        typer.echo(json.dumps([_as_json(figure) for figure in figures]))
        return
    table = plain_table(("figure", "measured", "goal"), numbers=("measured",))
    for figure in figures:
        mark = "" if figure.reached is None else " reached" if figure.reached else " missed"
        unit = "" if figure.unit == "1" else f" {figure.unit}"
        spread = "" if figure.low is None or figure.high is None else f" ({figure.low:.3g} to {figure.high:.3g})"
        measured = "skipped" if figure.skipped else f"{figure.value:.4g}{spread}{unit}"
        table.add_row(figure.name, measured, f"{figure.goal}{unit}{mark}" if figure.goal else "")
    console().print(table)
    for figure in figures:
        if figure.skipped:
            typer.echo(f"skipped: {figure.name}: {figure.skipped}")


def _as_json(figure: Figure) -> dict[str, object]:
    """A figure; ``low`` and ``high`` where it was repeated, ``skipped`` where it was not measured."""
    found: dict[str, object] = {
        "name": figure.name, "value": None if figure.skipped else figure.value, "unit": figure.unit,
        "goal": figure.goal, "reached": figure.reached,
    }  # fmt: skip
    if figure.low is not None:
        found |= {"low": figure.low, "high": figure.high}
    return found | ({"skipped": figure.skipped} if figure.skipped else {})


def _list(benchmarks: Sequence[Benchmark], as_json: bool) -> None:
    """Print the names of ``benchmarks``, what they measure, and which are long."""
    if as_json:
        typer.echo(json.dumps([{"name": each.id, "title": each.title, "long": each.long} for each in benchmarks]))
        return
    for each in benchmarks:
        typer.echo(f"{each.id:24}{each.title}{' (long)' if each.long else ''}")
