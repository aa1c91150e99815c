"""The command ``fric``: finds its verbs, and turns every refusal into one line and exit status 2."""

from __future__ import annotations

import importlib
import pkgutil
import sys

import typer
from fric.errors import InputError

__all__ = ["build_app", "main"]

_HELP = """Friction found, explained and compensated, on ROS 2.

Start with [bold]fric demo[/bold]; on a recording of your own, [bold]fric import[/bold] and [bold]fric identify[/bold]."""


def build_app() -> typer.Typer:
    """The command with all its verbs."""
    app = typer.Typer(
        name="fric",
        help=_HELP,
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode="rich",
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    package = importlib.import_module(__package__ or "fric_nodes.cli")
    for module_info in sorted(pkgutil.iter_modules(package.__path__), key=lambda info: info.name):
        register = getattr(importlib.import_module(f"{package.__name__}.{module_info.name}"), "register", None)
        if register is not None:
            register(app)
    return app


def main() -> None:
    """Entry point of the command ``fric``."""
    try:
        build_app()()
    except InputError as error:
        # One line whatever the text holds.
        print(f"fric: {' '.join(str(error).split())}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("fric: stopped", file=sys.stderr)
        sys.exit(130)
