"""``fric compile``: compile ahead what every diagnosis needs, so that the first one doesn't wait for it."""

from __future__ import annotations

import typer

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the verb to ``app``."""
    app.command("compile", epilog="Example: fric compile")(compile_)


def compile_() -> None:
    """Compile the equations that every diagnosis needs and keep them on disk: about a minute, once on a machine."""
    from fric.compiling import compile_all
    from fric.engine.compile import cache_folder
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task("", total=None)

        def told(done: int, of: int, name: str) -> None:
            shown.update(task, completed=done, total=of, description=name)

        compile_all(told)
    folder = cache_folder()
    typer.echo(f"compiled and kept in {folder.path}" if folder.kept else "compiled, but no folder can be written to keep it in")
