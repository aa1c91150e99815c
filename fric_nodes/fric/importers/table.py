"""The columns of a file, whatever its format: what an importer gives and a mapping asks for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from ..record import Array
from .cells import first_bad, midnight_of, numbers, past_midnight
from .errors import ImportingError, one_line

__all__ = ["Importer", "Source", "Table", "TextOptions", "closest"]

Source = str | int
_MOST_LISTED = 40  # names of columns in a message
_MOST_COLUMNS = 1000  # of one matrix; one that is wider in both directions is an image or a network, not signals


@dataclass(frozen=True)
class TextOptions:
    """How to read a text table; what is None is found out.

    Attributes:
        delimiter: between the cells of a line; a blank for any run of blanks.
        decimal: ``.`` or ``,``.
        skip_rows: lines at the top to pass over.
        header: whether the first line after those holds names.
        repair: take lines and cells that can't be read as missing, and say so, instead of refusing the file.
    """

    delimiter: str | None = None
    decimal: str | None = None
    skip_rows: int | None = None
    header: bool | None = None
    repair: bool = False


@dataclass
class Table:
    """Columns of a file, in its order, and its scalar variables.

    Attributes:
        path: the file.
        columns: numeric columns by name, each of shape ``(n_samples,)``.
        scalars: single numbers by name.
        clocks: columns that are clock times or dates, in seconds whatever a mapping says, and since when [s since 1970]: a
            number since then would leave too few digits for what comes after the point.
        unusable: names that are there but can't be used, with the reason and what to do.
        aliases: further names of columns.
        notes: what was dropped or taken as missing on the way, and why.
        order: names of all columns of a text table, as they are counted from 0.
        hint: why names may be missing.
        head: the first rows of a text table, NaN for what is no number.
    """

    path: Path
    columns: dict[str, Array] = field(default_factory=dict)
    scalars: dict[str, float] = field(default_factory=dict)
    clocks: dict[str, float] = field(default_factory=dict)
    unusable: dict[str, tuple[str, str]] = field(default_factory=dict)
    aliases: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    order: list[str] = field(default_factory=list)
    hint: str = ""
    head: list[list[float]] = field(default_factory=list)

    def add(self, name: str, values: Any) -> None:
        """Take a numeric array as one column, as several (``name[0]`` ...), or as a scalar; texts where they are numbers."""
        array = np.asarray(values)
        if array.dtype.kind in "Mm" and array.ndim == 1 and array.size and not np.isnat(array).all():
            array = array.astype(f"{array.dtype.kind}8[ns]")
            known = array[~np.isnat(array)]
            # Dates from the midnight before the first, durations as they are.
            start = known[0].astype("M8[D]").astype("M8[ns]") if array.dtype.kind == "M" else np.timedelta64(0, "ns")
            self.columns[name] = np.where(np.isnat(array), np.nan, (array - start) / np.timedelta64(1, "s"))
            self.clocks[name] = float(start.astype(np.int64)) * 1e-9
            return
        if array.dtype.kind in "OUS" and array.ndim == 1 and array.size > 1:
            self.add_cells(name, ["" if cell is None else str(cell) for cell in array.tolist()])
            return
        if array.dtype.kind == "c":
            self.unusable[name] = ("holds complex numbers", "export its real part")
            return
        if array.dtype.kind not in "biuf":
            self.unusable[name] = (f"holds no numbers ({one_line(array.dtype)})", "export it as numbers")
            return
        array = np.squeeze(array)
        if array.ndim == 0:
            self.scalars[name] = float(array)
        elif array.size == 0:
            self.unusable[name] = ("is empty", "export the signal")
        elif array.ndim == 1:
            self.columns[name] = np.ascontiguousarray(array, dtype=np.float64)
        elif array.ndim == 2 and min(array.shape) <= _MOST_COLUMNS:
            columns = array if array.shape[0] >= array.shape[1] else array.T
            for index in range(columns.shape[1]):
                self.columns[f"{name}[{index}]"] = np.ascontiguousarray(columns[:, index], dtype=np.float64)
        else:
            self.unusable[name] = (f"has the shape {array.shape}", "export one column per signal")

    def add_cells(self, name: str, cells: Sequence[str], lines: Sequence[int] | None = None) -> None:
        """Take texts as a column when they are numbers or clock times, and as unusable when they aren't."""
        midnight = midnight_of(cells[:50])
        found = numbers(cells, midnight=midnight)
        if found is None:
            at = first_bad(cells, midnight is not None)
            place = f"line {lines[at]}" if lines is not None else f"row {at}"
            self.unusable[name] = (
                f"{place}: '{one_line(cells[at])}' is not a number",
                "map a column of numbers, or correct the file",
            )
            return
        self.columns[name] = found
        if midnight is not None:
            self.as_clock(name, midnight)

    def as_clock(self, name: str, midnight: float) -> None:
        """Take a column as clock times since ``midnight`` [s since 1970]."""
        self.columns[name] = past_midnight(self.columns[name])
        self.clocks[name] = midnight

    def find(self, signal: str, source: Source) -> str:
        """The name of the column that a mapping asks for, by its name or its number from 0.

        Raises:
            ImportingError: not there, or no numbers.
        """
        name = self.name_of(source)
        if name in self.columns:
            return name
        if name in self.unusable:
            what, remedy = self.unusable[name]
            raise ImportingError(self.path, f"signal '{signal}': column '{one_line(source)}', {what}", remedy)
        inside = next((part for part in self.unusable if str(source).startswith((f"{part}.", f"{part}["))), None)
        if inside is not None:
            what, remedy = self.unusable[inside]
            raise ImportingError(self.path, f"signal '{signal}': '{inside}' {what}", remedy)
        hint = f" ({self.hint})" if self.hint else ""
        near = closest(str(source), [*self.columns, *self.aliases])
        raise ImportingError(
            self.path,
            f"signal '{signal}' is to come from '{one_line(source)}', which is not there{near}{hint}",
            f"columns there: {_listed(self.order or list(self.columns))}",
        )

    def name_of(self, source: Source) -> str:
        """The name that a column has here, whether it is there or not."""
        names = self.order or list(self.columns)
        text = str(source)
        if isinstance(source, str):
            # A struct array of one element reads like a struct.
            for name in (text, self.aliases.get(text, text), text.replace("[0]", "")):
                if name in self.columns or name in self.unusable:
                    return name
        number = source if isinstance(source, int) else int(text) if text.isascii() and text.isdigit() else None
        return names[number] if number is not None and 0 <= number < len(names) else text


@dataclass(frozen=True)
class Importer:
    """A file format.

    Attributes:
        id: its name.
        suffixes: what names of such files end in, lower case.
        read: gives the table of a file; ``wanted`` are the columns that a mapping asks for.
    """

    id: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, TextOptions, Sequence[Source]], Table]


def closest(name: str, among: Sequence[str]) -> str:
    """``, the closest is 'x'`` for messages; nothing when nothing is close."""
    match = get_close_matches(name, among, n=1, cutoff=0.6)
    return f", the closest is '{one_line(match[0])}'" if match else ""


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(one_line(name) for name in names[:_MOST_LISTED])
    return f"{shown} and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else shown or "none"
