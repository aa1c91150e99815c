"""``fric model``: show model files, and list the effects, plants, excitations and methods that there are."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from fric.method_settings import declarations, own_settings

from .printed import console, plain_table

if TYPE_CHECKING:
    from fric.identification.result import Method

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    verbs = typer.Typer(no_args_is_help=True, help="Look at model files, and at what they can hold.")
    verbs.command("schema", epilog="Example: fric model schema > fric-model.json")(schema)
    verbs.command("show", no_args_is_help=True, epilog="Example: fric model show config/demo_axis.yaml")(show)
    verbs.command("effects", epilog="Example: fric model effects presliding")(effects)
    verbs.command("plants", epilog="Example: fric model plants")(plants)
    verbs.command("excitations", epilog="Example: fric model excitations")(excitations)
    verbs.command("methods", epilog="Example: fric model methods")(methods)
    app.add_typer(verbs, name="model")


def schema() -> None:
    """Print the JSON schema of model files."""
    from fric.model_file import json_schema

    typer.echo(json.dumps(json_schema(), indent=2))


def show(
    file: Annotated[Path, typer.Argument(help="A fric-model/1 file.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Print the equations and values of a model file."""
    from fric.model_file import read_model

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
    out = console()
    out.print(f"{model.plant.title} '{model.joint}': {model.plant.equation}")
    for held in model.terms:
        out.print(f"  {held.effect.title}: {held.effect.equation}  ({held.effect.source})")
    table = plain_table(("parameter", "symbol", "value", "std", "unit", ""), numbers=("value", "std"))
    for name, symbol, value, error, unit, doc in rows:
        table.add_row(name, symbol, f"{value:.6g}", "" if error is None else f"{error:.2g}", unit, doc)
    out.print(table)


def effects(
    names: Annotated[list[str] | None, typer.Argument(help="Which effects, with all there is to know; all in short.")] = None,
) -> None:
    """List the effects that a model can hold."""
    from fric.effects import EFFECTS
    from fric.errors import InputError
    from fric.parameter import Parameter
    from fric.record import Units

    if not names:
        _list(
            ("effect", "place", "equation", "parameters"),
            ((key, e.place.value, e.equation, ", ".join(p.name for p in e.parameters)) for key, e in EFFECTS.items()),
        )
        return

    def described(parameter: Parameter) -> str:
        least = max(parameter.lower, 0.0) if parameter.positive else parameter.lower
        bounds = f"{'(' if parameter.positive else '['}{least:g}, {parameter.upper:g}]"
        default = "" if parameter.default is None else f", default {parameter.default:g}"
        head = f"    {parameter.name}  {parameter.symbol} [{parameter.unit(Units())}]"
        return f"{head} in {bounds}{default}: {parameter.doc}"

    for name in names:
        chosen = [effect for effect in EFFECTS.values() if name in (effect.id, effect.key)]
        if not chosen:
            known = ", ".join(dict.fromkeys(effect.id for effect in EFFECTS.values()))
            raise InputError("fric model effects", f"no effect '{name}'", f"choose from {known}")
        for effect in chosen:
            typer.echo(f"{effect.key}: {effect.title} ({effect.place.value})\n  {effect.equation}\n  source: {effect.source}")
            typer.echo("\n".join(described(parameter) for parameter in effect.parameters))
            typer.echo(f"  shows in: {effect.regime}")
            for other, experiment in effect.looks_like.items():
                typer.echo(f"  looks like {other}: {experiment}")
            typer.echo()


def plants() -> None:
    """List the plants that a model can have."""
    from fric.plants import PLANTS

    _list(
        ("plant", "equation", "source", "measures besides"),
        ((key, p.equation, p.source, ", ".join(signal.name for signal in p.signals)) for key, p in PLANTS.items()),
    )


def excitations() -> None:
    """List the excitations that the node ``excitation`` can run."""
    from fric.excitation import EXCITATIONS

    _list(
        ("excitation", "shows", "parameters"),
        ((key, e.shows, ", ".join(p.name for p in e.parameters)) for key, e in EXCITATIONS.items()),
    )


def methods() -> None:
    """List the methods of identification: the experiment that each needs, and the settings that it uses."""
    from fric.identification import METHODS

    _list(
        ("method", "needs", "settings", "source"),
        ((key, each.needs, ", ".join(_settings_of(each)), each.source) for key, each in METHODS.items()),
    )


def _settings_of(method: Method) -> list[str]:
    """The options of ``fric identify`` that a method uses; its own ones as they are given with --set."""
    declared, own = declarations(method.settings), own_settings(method.settings)
    return [f"--set {name}" if name in own else declared[name][1].option for name in method.honoured]


def _list(head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:

    table = plain_table(head)
    for row in rows:
        table.add_row(*row)
    console().print(table)
