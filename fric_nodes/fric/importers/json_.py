"""``.json``: an object of arrays or an array of objects; ``.jsonl``, ``.ndjson``: one object a line.

Nested names are joined by dots (``axis.position``), elements of an array that each object holds are ``position[0]`` and so on.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .cells import clock, midnight_of, number
from .errors import ImportingError, one_line
from .lines import Line, encoding_of, lines_of
from .table import Importer, Source, Table, TextOptions

__all__ = ["IMPORTER"]

_LINES = (".jsonl", ".ndjson")
_DEEPEST = 20  # levels of nesting
_MOST_COLUMNS = 5000  # objects whose names are data, such as times, would need memory with the square of their number
_LONGEST_ROW = 1000  # elements of an array within one record that become columns


def read(path: Path, options: TextOptions, wanted: Sequence[Source]) -> Table:
    """Read the signals.

    Raises:
        ImportingError: not JSON, or neither an object of arrays nor objects one after the other.
    """
    table = Table(path)
    encoding = encoding_of(path)
    if path.suffix.lower() in _LINES:
        _records(table, _by_line(table, encoding, options))
        return table
    try:
        content = json.loads(path.read_text(encoding=encoding, errors="replace"))
    except json.JSONDecodeError as error:
        if error.msg == "Extra data" and error.lineno > 1:  # objects one after the other, by another name
            _records(table, _by_line(table, encoding, options))
            return table
        what = f"line {error.lineno}, column {error.colno}: not JSON ({one_line(error.msg)})"
        raise ImportingError(
            path, what, "export it again; one object a line is read from a file that ends in .jsonl"
        ) from error
    except (OSError, ValueError, RecursionError) as error:
        raise ImportingError(path, f"is not readable JSON ({one_line(error)})", "export it again") from error
    if isinstance(content, list) and content and all(isinstance(entry, dict) for entry in content):
        _records(table, [(index, entry) for index, entry in enumerate(content)])
    elif isinstance(content, dict):
        _arrays(table, "", content, 0)
    else:
        raise ImportingError(path, "is neither an object of arrays nor an array of objects", "export it as one of these")
    return table


def _by_line(table: Table, encoding: str, options: TextOptions) -> list[tuple[int, dict[str, Any]]]:
    found: list[tuple[int, dict[str, Any]]] = []
    bad: list[Line] = []
    for line in lines_of(table.path, encoding, ""):
        if not line.text.strip():
            continue
        try:
            entry = json.loads(line.text)
        except (ValueError, RecursionError):
            entry = None
        if isinstance(entry, dict):
            found.append((line.at, entry))
        else:
            bad.append(line)
    if bad:
        what = f"line {bad[0].at} is no JSON object: '{one_line(bad[0].text)}' ({len(bad)} line(s) in all)"
        if not options.repair or len(bad) > len(found):
            remedy = "export it again" if options.repair else "drop such lines with --repair, or export it again"
            raise ImportingError(table.path, what, remedy)
        table.notes.append(f"{what}: dropped")
    return found


def _arrays(table: Table, prefix: str, content: dict[str, Any], depth: int) -> None:
    """The arrays of an object by their names."""
    for key, value in content.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict) and value and all(map(_is_index, value)):
            _column(table, name, list(value.values()), list(range(len(value))), "element")  # as pandas writes a column
        elif isinstance(value, dict) and depth < _DEEPEST:
            _arrays(table, f"{name}.", value, depth + 1)
        elif isinstance(value, list) and value and all(isinstance(entry, dict) for entry in value):
            inner = Table(table.path)
            _records(inner, list(enumerate(value)))
            table.columns |= {f"{name}.{part}": column for part, column in inner.columns.items()}
            table.unusable |= {f"{name}.{part}": reason for part, reason in inner.unusable.items()}
            table.clocks |= {f"{name}.{part}": start for part, start in inner.clocks.items()}
        elif isinstance(value, list) and value and all(isinstance(entry, list) for entry in value):
            _matrix(table, name, value)
        elif isinstance(value, list):
            _column(table, name, value, list(range(len(value))), "element")
        elif not isinstance(value, (dict, str, bool)) and value is not None:
            table.scalars[name] = _float(value)


def _is_index(key: str) -> bool:
    return key.isascii() and key.isdigit()


def _matrix(table: Table, name: str, rows: list[list[Any]]) -> None:
    if len({len(row) for row in rows}) > 1 or len(rows[0]) > max(_LONGEST_ROW, 1):
        table.unusable[name] = ("is an array of arrays of unequal or too great length", "export one array per signal")
        return
    for index in range(len(rows[0])):
        _column(table, f"{name}[{index}]", [row[index] for row in rows], list(range(len(rows))), "element")


def _records(table: Table, records: Sequence[tuple[int, dict[str, Any]]]) -> None:
    """Objects one after the other as rows; what one of them doesn't have is missing there."""
    rows: dict[str, list[Any]] = {}
    for index, (_, record) in enumerate(records):
        for name, value in _flat("", record, 0):
            column = rows.setdefault(name, [])
            if len(rows) > _MOST_COLUMNS:
                problem = f"has more than {_MOST_COLUMNS} names of signals"
                raise ImportingError(table.path, problem, "export an array of objects that all have the same names")
            if len(column) <= index:  # a name that comes twice counts once
                column.extend([None] * (index - len(column)))
                column.append(value)
    places = [at for at, _ in records]
    for name, column in rows.items():
        column.extend([None] * (len(records) - len(column)))
        _column(table, name, column, places, "line" if table.path.suffix.lower() in _LINES else "element")


def _flat(prefix: str, value: Any, depth: int) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and depth < _DEEPEST:
        for key, inner in value.items():
            yield from _flat(f"{prefix}.{key}" if prefix else str(key), inner, depth + 1)
    elif isinstance(value, list) and depth < _DEEPEST:
        for index, inner in enumerate(value[:_LONGEST_ROW]):
            yield from _flat(f"{prefix}[{index}]", inner, depth + 1)
    else:
        yield prefix, value


def _float(value: Any) -> float:
    try:
        return float(value)
    except OverflowError:  # an integer beyond all floating-point numbers
        return float("inf") if value > 0 else float("-inf")


def _column(table: Table, name: str, values: list[Any], places: Sequence[int], place: str) -> None:
    midnight = midnight_of([value if isinstance(value, str) else "0" for value in values[:50] if value is not None])
    found = np.full(len(values), np.nan)
    for index, value in enumerate(values):
        if value is None:
            continue
        if isinstance(value, str):
            parsed = clock(value, midnight) if midnight is not None else number(value)
        else:
            parsed = None if midnight is not None or isinstance(value, (bool, dict, list)) else _float(value)
        if parsed is None:
            what = f"{place} {places[index]}: '{one_line(value)}' is not a number"
            table.unusable[name] = (what, "map a column of numbers, or correct the file")
            return
        found[index] = parsed
    table.columns[name] = found
    if midnight is not None:
        table.as_clock(name, midnight)


IMPORTER = Importer("json", (".json", *_LINES), read)
