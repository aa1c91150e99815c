"""``.mat`` up to version 7: variables, fields of structs by dots, elements of struct arrays and cells by ``[0]``, ``[1]`` ...

Simulink's "Structure With Time" is ``ScopeData.time`` and ``ScopeData.signals[0].values``; a matrix of values is
``ScopeData.signals[0].values[0]`` and so on, one per column. What MATLAB stores as objects (timetable, timeseries, table) is
opaque to every other program and is named with what to do.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .errors import ImportingError, one_line
from .mat_format import Cells, MatError, Opaque, Structs, Text, values_of
from .table import Importer, Source, Table, TextOptions

__all__ = ["IMPORTER"]

_RESAVE = "save it again in MATLAB with save(FILE, '-v7')"
_CONVERT = "store its columns in a struct first, as in s.t = seconds(T.Time); s.q = T.q; save(FILE, 's', '-v7')"
_MOST_ELEMENTS = 2000  # of a struct array or a cell array that are listed


def read(path: Path, options: TextOptions, wanted: Sequence[Source]) -> Table:
    """Read the variables.

    Raises:
        ImportingError: not a readable file, or one of version 7.3.
    """
    table = Table(path)
    try:
        content = path.read_bytes()
        if content.startswith((b"MATLAB 7.3", b"\x89HDF")) or content[512:516] == b"\x89HDF":
            what = "is a MATLAB 7.3 file (HDF5), which is not read"
            raise ImportingError(path, what, "save it in MATLAB with save(FILE, '-v7') and import that")
        for name, value in values_of(content):
            _add(table, name, value)
    except (MatError, OSError, MemoryError) as error:
        raise ImportingError(path, f"is not a readable .mat file ({one_line(error)})", _RESAVE) from error
    return table


def _add(table: Table, name: str, value: Any) -> None:
    """Take a variable, and what it holds by its dotted names."""
    if isinstance(value, Opaque):
        what = f"is a MATLAB object of the class {one_line(value.kind)}, which only MATLAB reads"
        remedy = f"save it as full({name})" if value.kind == "sparse" else _CONVERT
        table.unusable[name] = (what, remedy)
    elif isinstance(value, Text):
        table.unusable[name] = ("holds text", "map a variable of numbers")
    elif isinstance(value, Structs):
        for place, fields in _placed(name, value):
            for inner, content in fields.items():
                _add(table, f"{place}.{inner}", content)
    elif isinstance(value, Cells):
        if value.values and all(isinstance(content, np.ndarray) and content.size == 1 for content in value.values):
            numbers = np.array([content.flat[0] for content in value.values])
            table.add(name, numbers.reshape(value.shape, order="F"))  # a cell array of single numbers
            return
        for place, content in _placed(name, value):
            _add(table, place, content)
    else:
        table.add(name, value)


def _placed(name: str, value: Structs | Cells) -> list[tuple[str, Any]]:
    """The elements of an array by their names: without an index when there is one, with one when it is a row or a column."""
    longer = [axis for axis, extent in enumerate(value.shape) if extent > 1]
    found: list[tuple[str, Any]] = []
    for count, content in enumerate(value.values[:_MOST_ELEMENTS]):
        index = np.unravel_index(count, value.shape, order="F")
        found.append((name + "".join(f"[{index[axis]}]" for axis in longer), content))
    return found


IMPORTER = Importer("mat", (".mat",), read)
