"""``fric greet NAME``: say hello to an axis."""

from __future__ import annotations

import typer


def register(app: typer.Typer) -> None:
    app.command("greet")(greet)


def greet(name: str) -> None:
    """Say hello to an axis."""
    typer.echo(f"hello, {name}")
