"""``fric verify``: check the implemented physics against papers, closed forms and conservation laws."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from fric.errors import InputError

from .options import JsonOption, progress

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("verify", epilog="Example: fric verify --out verification.html")(verify)


def verify(
    names: Annotated[list[str] | None, typer.Argument(help="Names of verifications. If none is given: all.")] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Page to write.")] = Path("verification.html"),
    as_json: JsonOption = False,
) -> None:
    """Verify the physics; exit status 1 when a goal is missed."""
    from fric.files import write_text
    from fric.report.verification import TITLE, goal, quantity, verification_page
    from fric.verification import VERIFICATIONS

    if out.exists() and (out.is_dir() or f"<title>{TITLE}</title>" not in out.read_text(encoding="utf-8", errors="replace")):
        raise InputError(out, "is not a page of this command", "choose another --out")
    chosen = names or list(VERIFICATIONS)
    for name in chosen:
        if name not in VERIFICATIONS:
            raise InputError("fric verify", f"no verification '{name}'", f"choose from {', '.join(VERIFICATIONS)}")
    found = []
    for name in chosen:
        progress(f"verifying {VERIFICATIONS[name].title}")
        found.append((VERIFICATIONS[name], VERIFICATIONS[name].run()))
    write_text(out, verification_page(found))
    figures = [(check.id, figure) for check, evidence in found for figure in evidence.figures]
    if as_json:
        typer.echo(
            json.dumps(
                [
                    {"verification": at, "name": f.name, "value": f.value, "unit": f.unit, "goal": f.goal, "reached": f.reached}
                    for at, f in figures
                ]
            )
        )
    else:
        for check, evidence in found:
            with_goal = [f for f in evidence.figures if f.reached is not None]
            typer.echo(f"{check.id}: {sum(f.reached is True for f in with_goal)} of {len(with_goal)} goals reached")
            for f in evidence.figures:
                if names or f.reached is False:
                    mark = "" if f.reached is None else f"  ({goal(f)}: {'reached' if f.reached else 'MISSED'})"
                    typer.echo(f"  {f.name}: {quantity(f.value, f.unit)}{mark}")
        typer.echo(f"written: {out}")
    if any(f.reached is False for _, f in figures):
        raise typer.Exit(1)
