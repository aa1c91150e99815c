"""Where a command writes its results, and what it may replace there.

A run replaces the results of an earlier run of the same command: that is how one works. What somebody else put there, a file of
the same name from another command, one written by hand or one edited since, is replaced only with ``--force`` or after a yes on
a terminal. A command's own results are those beside its record (the JSON file that it writes last) and not newer than it.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer
from fric.errors import InputError

from .groups import Group

__all__ = ["Record", "Results", "ResultsGroup"]


@dataclass(frozen=True)
class Record:
    """The JSON file that a command writes last.

    Attributes:
        name: of the file.
        keys: that its object holds; a file without them is another command's.
        form: value of its key ``format``, where it has one.
    """

    name: str
    keys: tuple[str, ...] = ()
    form: str = ""

    def time(self, folder: Path) -> int:
        """When it was written [ns]; -1 when there is none of this command."""
        path = folder / self.name
        try:
            held: Any = json.loads(path.read_text(encoding="utf-8"))
            written = path.stat().st_mtime_ns
        except (OSError, ValueError):
            return -1
        own = isinstance(held, dict) and all(key in held for key in self.keys) and held.get("format", "") == self.form
        return written if own else -1


@dataclass(frozen=True)
class Results:
    """Where results go and how they are printed."""

    out: Annotated[Path, typer.Option("--out", help="Folder for the results; made when missing.")]
    force: Annotated[
        bool,
        typer.Option("--force", help="Replace files of other commands, or edited files, of the same names without asking."),
    ] = False
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output, for programs.")] = False

    def claimed(self, record: Record, names: tuple[str, ...]) -> Results:
        """Ask before foreign files of these names are replaced; called before the work, so that nobody waits for a refusal.

        Returns:
            The same, with ``force`` set after a yes.

        Raises:
            InputError: they may not be replaced.
        """
        if (self.out / "metadata.yaml").exists():
            raise InputError(self.out, "is the folder of a bag", "choose another --out")
        written = record.time(self.out)
        foreign = [
            name
            for name in (*names, record.name)
            if (self.out / name).exists() and (written < 0 or (self.out / name).stat().st_mtime_ns > written)
        ]
        if not foreign or self.force:
            return self
        listed = ", ".join(foreign)
        what = "was edited since this command wrote it" if written >= 0 else "was not written by this command"
        what = what if len(foreign) == 1 else what.replace("was", "were", 1).replace(" it", " them")
        if sys.stdin.isatty() and sys.stderr.isatty() and typer.confirm(f"{self.out}: {listed} {what}. Replace?", err=True):
            return replace(self, force=True)
        raise InputError(self.out, f"{listed} {what}", "choose another --out, or replace with --force")

    def write(self, record: Record, texts: Mapping[str, str]) -> None:
        """Write every text under its name, the record last.

        Raises:
            InputError: a file can't be written, or an attachment would replace a foreign file.
        """
        from fric.files import write_text

        self.claimed(record, tuple(name for name in texts if name != record.name))
        for name in sorted(texts, key=lambda name: name == record.name):
            write_text(self.out / name, texts[name])


ResultsGroup = Annotated[Results, Group("Results")]
"""Where results go, as a parameter of a command."""
