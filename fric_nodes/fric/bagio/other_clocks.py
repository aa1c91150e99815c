"""Signals of one file that turn out to have different clocks, though the mapping gives them one time.

Scopes and data loggers write a column of time beside each signal. With signals of different rates the shorter ones end early,
and with the same number of rows nothing is amiss but that the rows were not taken together. Both show in the file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..importers import ImportingError, Table, TextOptions, load_table
from ..importers.errors import one_line
from ..importers.table import Source
from ..record import Array

__all__ = ["Taken", "explain_clocks", "lengths_differ", "refuse_pairs"]

_LEAST = 10  # rows that show whether a column is a clock


class Taken(NamedTuple):
    """A column that a mapping takes, and its unit."""

    source: Source
    unit: str


def _end(values: Array) -> int:
    """Rows up to the last finite one when all before it are finite, else 0."""
    rows = np.flatnonzero(np.isfinite(values))
    return int(rows.size) if rows.size and rows[-1] == rows.size - 1 else 0


def explain_clocks(table: Table, columns: Mapping[str, Taken], signals: Mapping[str, Array], options: TextOptions) -> None:
    """Look for the clock of a signal that ends before the others.

    Raises:
        ImportingError: there is a column that rises and ends where the signal does.
    """
    for name, signal in signals.items():
        end = _end(signal)
        if name not in columns or not _LEAST <= end < signal.size:
            continue
        everything = load_table(table.path, options, ())
        taken = {table.find(other, column.source) for other, column in columns.items()}
        own = table.find(name, columns[name].source)
        order = everything.order or list(everything.columns)
        clocks = [
            column
            for column in order
            if column in everything.columns
            and column not in taken
            and _end(everything.columns[column]) == end
            and np.all(np.diff(everything.columns[column][:end]) > 0)
        ]
        if clocks and own in order:
            at = order.index(own)
            # The nearest to the left, as such files are written.
            clock = min(clocks, key=lambda column: (order.index(column) > at, abs(order.index(column) - at)))
            problem = (
                f"signals have different clocks: '{name}' ends after {end} of {signal.size} rows, "
                f"as column '{one_line(clock)}' beside it does, which rises throughout"
            )
            raise _refusal(table, problem, name, columns, order.index(clock) if everything.order else clock)


def lengths_differ(table: Table, name: str, columns: Mapping[str, Taken], size: int, wanted: int) -> ImportingError:
    """The error for a signal of another length than the time, with its own time where the file has one of its length."""
    what = f"signal '{name}' has {size} samples, time has {wanted}"
    taken = {table.name_of(column.source) for column in columns.values()}
    clocks = [
        column
        for column, values in table.columns.items()
        if column not in taken and values.size == size >= _LEAST and np.all(np.diff(values) > 0)
    ]
    if clocks and name in columns:
        own = table.name_of(columns[name].source)
        # That with most of the name in common: S2.time for S2.signals.values.
        clock = max(clocks, key=lambda column: _alike(column, own))
        return _refusal(table, f"signals have different clocks: {what}, as long as '{one_line(clock)}'", name, columns, clock)
    remedy = f"map columns of one length, or give {name} a time of its own in the mapping: time: {{from: NAME, unit: s}}"
    return ImportingError(table.path, what, remedy)


def _alike(first: str, second: str) -> int:
    """Letters that two names have in common from their start."""
    return next((at for at, (a, b) in enumerate(zip(first, second, strict=False)) if a != b), min(len(first), len(second)))


def refuse_pairs(table: Table, columns: Mapping[str, Taken], wanted: Sequence[Source]) -> None:
    """Look for a time beside each signal, when the mapping gives them one.

    Raises:
        ImportingError: every mapped signal has a rising column on its left, one of them the time of the mapping, another not.
    """
    signals = [name for name in columns if name != "time"]
    if "time" not in columns or len(signals) < 2 or not table.head:
        return
    order = table.order
    places = {name: order.index(table.find(name, column.source)) for name, column in columns.items()}
    asked = {order.index(column) for source in wanted if (column := table.name_of(source)) in order}
    left = {name: places[name] - 1 for name in signals}
    if places["time"] not in left.values() or min(left.values()) < 0:
        return
    rising = {place: _rises(table.head, place) for place in set(left.values())}
    if any(values is None for values in rising.values()):
        return
    time = rising[places["time"]]
    for name, place in left.items():
        beside = rising[place]
        if place in asked or beside is None or time is None:
            continue
        if not _named_alike(order[place], order[places["time"]], beside):
            continue
        step = float(np.median(np.diff(time)))
        if np.max(np.abs(beside - time)) > 0.5 * step:
            problem = f"signals have different clocks: column '{one_line(order[place])}' is a time of its own of '{name}'"
            raise _refusal(table, problem, name, columns, place)


def _named_alike(name: str, time: str, values: Array) -> bool:
    """True when a column beside a signal is named like the time of the mapping, or has no name and doesn't just count rows."""
    plain = [re.sub(r"\.\d+$|[\[(].*|[\d_\s]+", "", part).lower() for part in (name, time)]
    if any(plain):
        return plain[0] == plain[1] or "time" in plain[0] or plain[0] in {"t", "zeit"}
    return not bool(np.all(np.diff(values) == 1.0))


def _rises(head: Sequence[Sequence[float]], column: int) -> Array | None:
    """The first values of a column when they are numbers that rise."""
    values = np.array([row[column] for row in head if column < len(row)])
    rises = values.size >= _LEAST and bool(np.all(np.isfinite(values))) and bool(np.all(np.diff(values) > 0))
    return values if rises else None


def _refusal(table: Table, problem: str, name: str, columns: Mapping[str, Taken], clock: Source) -> ImportingError:
    """The error with the entry of the mapping that mends it; the unit of the own time is most likely that of the other one."""
    own, shown = columns[name], clock if isinstance(clock, int) else one_line(clock)
    unit = columns["time"].unit if "time" in columns else "s"
    entry = f"{name}: {{from: {own.source}, unit: {own.unit}, time: {{from: {shown}, unit: {unit}}}}}"
    return ImportingError(table.path, problem, f"name its own time in the mapping, as in {entry}")
