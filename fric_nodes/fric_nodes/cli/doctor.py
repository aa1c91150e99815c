"""``fric doctor``: check the installation, or recordings for faults of their instruments."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from fric.errors import InputError

from .groups import grouped
from .options import JsonOption, Reading, ReadingGroup, progress, read_all
from .printed import console, plain_table

if TYPE_CHECKING:
    from fric.instrument import Finding
    from fric.record import Record

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("doctor", epilog="Example: fric doctor    or: fric doctor bags/slide --model axis.yaml")(doctor)


@grouped
def doctor(
    recordings: Annotated[
        list[Path] | None,
        typer.Argument(help="Recordings of one joint to check. If none is given, the installation is checked."),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model", help="Model file with known mass and friction: the units of position and force are checked against it."
        ),
    ] = None,
    gear_ratio: Annotated[
        float | None,
        typer.Option("--gear-ratio", help="Gear ratio of the joint, to check whether it was left out or applied twice."),
    ] = None,
    reading: ReadingGroup = Reading(),
    as_json: JsonOption = False,
) -> None:
    """Check the installation, or recordings for faults of their instruments; exit status 1 when a fault is found."""
    if not recordings:
        _installation(as_json)
        return
    if gear_ratio is not None and not 0.0 < gear_ratio < float("inf"):
        raise InputError("--gear-ratio", f"is {gear_ratio}", "give a positive number")
    from fric.instrument import inspect
    from fric.model_file import read_model

    records = read_all(recordings, reading)
    nominal = None if model is None else read_model(model)
    settings = {} if gear_ratio is None else {"gear_ratio": gear_ratio}
    findings = inspect(records, nominal, settings)
    faulty = any(finding.verdict == "fault" for finding in findings)
    if as_json:
        entries: list[dict[str, Any]] = [finding.as_json() for finding in findings]
        typer.echo(json.dumps({"recordings": [str(path) for path in recordings], "faults": faulty, "checks": entries}))
    else:
        _print_findings(findings, [path.name for path in recordings], records)
    if faulty:
        raise typer.Exit(1)


def _print_findings(findings: tuple[Finding, ...], names: list[str], records: list[Record]) -> None:
    from fric.report.checks import checks_rows, checks_sentence

    shown = plain_table(("check", "verdict", "recording", "value", "what was found"))
    rows = checks_rows(findings, names)
    several = len(names) > 1
    for check, verdict, where, value, detail, _ in rows:
        shown.add_row(check, verdict, where if several else "", value, detail)
    out = console()
    out.print(shown)
    for record, name in zip(records, names, strict=True):
        for note in record.notes:
            out.print(f"- {name}: {note}")
    for check, _, _, _, _, remedy in rows:
        if remedy:
            out.print(f"- {check}: {remedy}")
    out.print(checks_sentence(findings))


def _installation(as_json: bool) -> None:
    from ..installation import examine

    progress("checking the installation")
    found = examine()
    broken = any(item.state == "fault" for item in found)
    if as_json:
        entries = [{"check": item.name, "verdict": item.state, "detail": item.detail, "remedy": item.remedy} for item in found]
        typer.echo(json.dumps({"faults": broken, "checks": entries}))
    else:
        for item in found:
            typer.echo(f"{item.state:7s}  {item.name}: {item.detail}")
            if item.remedy:
                typer.echo(f"         {item.remedy}")
    if broken:
        raise typer.Exit(1)
