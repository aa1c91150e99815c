"""``fric model``: the schema of model files, and what a model file says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    verbs = typer.Typer(no_args_is_help=True, help="Look at model files: schema, show, effects.")
    verbs.command("schema", epilog="Example: fric model schema > fric-model.json")(schema)
    verbs.command("show", no_args_is_help=True, epilog="Example: fric model show config/demo_axis.yaml")(show)
    verbs.command("effects", epilog="Example: fric model effects")(effects)
    app.add_typer(verbs, name="model")


def schema() -> None:
    """Print the JSON schema of model files."""
    from ..model_file import json_schema

    typer.echo(json.dumps(json_schema(), indent=2))


def show(
    file: Annotated[Path, typer.Argument(help="A fric-model/1 file.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Print the equations and values of a model file."""
    from rich.console import Console
    from rich.table import Table

    from ..model_file import read_model

    model = read_model(file)
    rows = [
        (
            p.name,
            p.declaration.symbol,
            p.value,
            model.standard_errors.get(p.name),
            p.declaration.unit(model.units),
            p.declaration.doc,
        )
        for p in model.parameters()
    ]
    if as_json:
        keys = ("name", "symbol", "value", "std", "unit", "doc")
        equations = {prefix: held.effect.equation for prefix, held in zip(model.prefixes, model.terms, strict=True)}
        described = {"joint": model.joint, "plant": model.plant.equation, "equations": equations}
        typer.echo(json.dumps(described | {"parameters": [dict(zip(keys, row, strict=True)) for row in rows]}))
        return
    console = Console(highlight=False)
    console.print(f"{model.plant.title} '{model.joint}': {model.plant.equation}", markup=False)
    for held in model.terms:
        console.print(f"  {held.effect.title}: {held.effect.equation}  ({held.effect.source})", markup=False)
    table = Table(box=None, pad_edge=False)
    for name, justify in (
        ("parameter", "left"),
        ("symbol", "left"),
        ("value", "right"),
        ("std", "right"),
        ("unit", "left"),
        ("", "left"),
    ):
        table.add_column(name, justify=justify)  # type: ignore[arg-type]
    for name, symbol, value, error, unit, doc in rows:
        table.add_row(name, symbol, f"{value:.6g}", "" if error is None else f"{error:.2g}", unit, doc)
    console.print(table)


def effects() -> None:
    """List the effects that a model can hold."""
    from rich.console import Console
    from rich.table import Table

    from ..effects import EFFECTS

    table = Table(box=None, pad_edge=False)
    for name in ("effect", "place", "equation", "parameters"):
        table.add_column(name)
    for key, effect in EFFECTS.items():
        table.add_row(key, effect.place.value, effect.equation, ", ".join(p.name for p in effect.parameters))
    Console(highlight=False).print(table)
