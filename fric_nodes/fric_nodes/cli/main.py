"""The command ``fric``: lists its verbs, imports the one that is called, and prints a refusal as one line with status 2.

A verb is a file of this folder, or of the folder ``cli`` of a plugin (:mod:`fric.registry`), whose docstring begins with
``fric VERB`` in quotes and what it does, and which has a function ``register(app)``. The list of ``fric --help`` is made from
these lines without importing the verbs, or what they are built on.
"""

from __future__ import annotations

import importlib
import importlib.util
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from fric import __version__
from fric.errors import InputError
from fric.registry import plugins
from typer.core import TyperCommand, TyperGroup

__all__ = ["build_app", "main", "verbs"]

_HELP = """Friction of mechanical axes: recorded, identified, compensated and diagnosed, on ROS 2.

Start with 'fric demo'; with a recording of your own, 'fric import' and 'fric identify'. Every command explains itself:
'fric COMMAND --help'."""

_HEAD = re.compile(r'"""``fric (?P<verb>[a-z]+)(?: [A-Z]+)?``: (?P<text>.+?)(?:\.?"""|\.?\n)')


_UsageError: Any = typer.BadParameter.__mro__[1]
"""A wrong option or argument; typer has no public name for it."""


def _folders() -> Iterator[tuple[str, Path]]:
    """Package and folder of verbs: those of plugins first, so that none of theirs takes the place of one of fric's own."""
    for _, package in plugins():
        found = importlib.util.find_spec(package)
        for folder in (found.submodule_search_locations or ()) if found is not None else ():
            yield f"{package}.cli", Path(folder) / "cli"
    yield f"{__package__}", Path(__file__).parent


@cache
def verbs() -> dict[str, tuple[str, str]]:
    """Module and short help of every verb, by its name."""
    found = {}
    for package, path in ((package, path) for package, folder in _folders() for path in sorted(folder.glob("*.py"))):
        with path.open(encoding="utf-8") as file:
            head = _HEAD.match(file.readline())
        # import_.py holds the verb import, which is no name that Python takes.
        if head is not None and head["verb"] == path.stem.rstrip("_"):
            text = head["text"].replace("``", "")
            found[head["verb"]] = (f"{package}.{path.stem}", f"{text[0].upper()}{text[1:]}.")
    return dict(sorted(found.items()))


@cache
def _loaded(name: str) -> Any:
    """The command of a verb, which is imported for it."""
    from fric.threads import keep_linear_algebra_in_one  # not for the list of verbs: it takes time to import

    keep_linear_algebra_in_one()
    app = typer.Typer(rich_markup_mode="rich")
    module = verbs()[name][0]
    try:
        importlib.import_module(module).register(app)
    except ImportError as error:
        if module.startswith(f"{__package__}."):
            raise
        raise InputError(f"fric {name}", f"{module} can't be imported: {error}", "mend the plugin, or uninstall it") from error
    return typer.main.get_group(app).commands[name]


class _Verbs(TyperGroup):
    """The verbs, each of which is imported when it is called."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Their names."""
        return list(verbs())

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A verb as the list shows it."""
        return TyperCommand(cmd_name, short_help=verbs()[cmd_name][1]) if cmd_name in verbs() else None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The verb that is called, and what follows its name."""
        name, _, rest = super().resolve_command(ctx, args)
        return name, None if name is None else _loaded(name), rest


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"fric {__version__}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and exit.", is_eager=True, callback=_show_version)
    ] = False,
) -> None:
    pass


def build_app() -> typer.Typer:
    """The command with all its verbs."""
    app = typer.Typer(
        name="fric",
        cls=_Verbs,
        help=_HELP,
        no_args_is_help=True,
        rich_markup_mode=None,  # a plain list: what draws the frames takes longer to import than all the rest
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_options)
    return app


def _refuse(text: str) -> NoReturn:
    """One line whatever the text holds."""
    print(f"fric: {' '.join(text.split())}", file=sys.stderr)
    sys.exit(2)


def main() -> None:
    """Entry point of the command ``fric``."""
    try:
        status = build_app()(prog_name="fric", standalone_mode=False)
        sys.exit(status if isinstance(status, int) else 0)
    except InputError as error:
        _refuse(str(error))
    except _UsageError as error:
        if type(error).__name__ == "NoArgsIsHelpError":
            error.show()
            sys.exit(2)
        path = error.ctx.command_path if error.ctx is not None else "fric"
        subject = f"{path.removeprefix('fric ')}: " if " " in path else ""
        _refuse(f"{subject}{error.format_message().rstrip('.')}; see '{path} --help'")
    except (KeyboardInterrupt, typer.Abort):
        print("fric: stopped", file=sys.stderr)
        sys.exit(130)
