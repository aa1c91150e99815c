"""``.npz``: arrays of numpy by name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .errors import ImportingError, one_line
from .table import Importer, Source, Table, TextOptions

__all__ = ["IMPORTER"]


def read(path: Path, options: TextOptions, wanted: Sequence[Source]) -> Table:
    """Read the arrays.

    Raises:
        ImportingError: not a readable file.
    """
    table = Table(path)
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as content:
            for name in content.files:
                try:
                    table.add(name, content[name])
                except ValueError as error:  # an array of Python objects: others may be fine
                    table.unusable[name] = (one_line(error), "save it with numpy.savez, numbers only")
    except Exception as error:  # the archive, its compression, the header of an array: many kinds
        remedy = "save it with numpy.savez, numbers only"
        raise ImportingError(path, f"is not a readable .npz file ({one_line(error)})", remedy) from error
    return table


IMPORTER = Importer("npz", (".npz",), read)
