"""Files of other programs as tables: one importer per file format, found by being there.

A new format is a new file in this folder that defines ``IMPORTER``; see :class:`~fric.importers.table.Importer`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from ..registry import discover
from .errors import ImportingError
from .table import Importer, Source, Table, TextOptions

__all__ = ["Importer", "ImportingError", "Table", "TextOptions", "importers", "load_table", "suffixes"]


@cache
def importers() -> dict[str, Importer]:
    """Importers by what the names of their files end in."""
    found = discover(__name__, "IMPORTER", Importer)
    return {suffix: importer for importer in found for suffix in importer.suffixes}


def suffixes() -> tuple[str, ...]:
    """What the names of files end in that can be read."""
    return tuple(importers())


def load_table(path: Path, options: TextOptions, wanted: Sequence[Source] = ()) -> Table:
    """Read a file by what its name ends in.

    Args:
        path: the file.
        options: how to read a text table.
        wanted: names or numbers of the columns that are needed; what else the file holds does not matter. All when empty.

    Raises:
        ImportingError: not there, of an unknown kind, or not what its name says.
    """
    if not path.is_file():
        raise ImportingError(path, "is not there" if not path.exists() else "is not a file", "check the path")
    try:
        empty = path.stat().st_size == 0
        with path.open("rb") as file:
            file.read(1)
    except OSError as error:
        raise ImportingError(path, f"cannot be read ({error.strerror})", "check its permissions") from error
    if empty:
        raise ImportingError(path, "is empty (0 bytes)", "export it again")
    kind = path.suffix.lower()
    importer = importers().get(kind)
    if importer is None:
        raise ImportingError(path, f"files that end in '{kind}' are not read", f"give one of {', '.join(suffixes())}")
    table = importer.read(path, options, wanted)
    if not table.columns and not table.unusable:
        raise ImportingError(path, "holds no numeric column", "export the signals as numbers")
    return table
