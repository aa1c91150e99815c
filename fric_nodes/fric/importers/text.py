"""Text tables: ``.csv`` and the like, of any delimiter, decimal sign and header.

Only the columns that a mapping asks for are judged. A file in which every line has the same number of cells goes through
pyarrow's reader, which refuses whatever isn't as expected; then each line is looked at by itself. A line is

- blank, or a comment (``#``, ``%``, ``//``, ``;``, ``!``): passed over;
- data: as many cells as most lines have, numbers or nothing in the columns that are asked for;
- a damaged sample: some of these cells are numbers, others aren't, or cells are missing or too many;
- a message between the data: none or few of these cells are numbers.

Damaged samples and messages are refused with their line, or, with ``repair``, counted and said: a damaged sample stays as one
whose value is missing, so that samples at a constant rate keep their times; a message is no sample and goes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ..record import Array
from .cells import MISSING, clock, is_clock, midnight_of, number, numbers
from .errors import ImportingError, one_line
from .layout import Layout, find_layout
from .lines import Line, is_comment, last_lines, lines_of, split
from .table import Importer, Source, Table, TextOptions

__all__ = ["IMPORTER"]

_CHUNK = 100_000  # lines that are looked at together
_SMALL = 1 << 16  # [bytes] below, to start pyarrow's reader takes longer than to read
_BLOCK = 1 << 24  # [bytes] that pyarrow takes at a time
_TELLING = 10  # lines of equal decimals that show how a number is written


def read(path: Path, options: TextOptions, wanted: Sequence[Source]) -> Table:
    """Read a text table.

    Raises:
        ImportingError: no numbers in it, or lines or cells of the columns asked for that can't be read.
    """
    layout = find_layout(path, options, wanted)
    table = Table(
        path,
        order=layout.names,
        aliases=layout.aliases,
        head=[[_or_nan(number(cell, layout.decimal)) for cell in row] for row in layout.head],
    )
    table.hint = layout.hint
    if layout.early:
        lines = f"line {layout.early[0]}" + (f" and {len(layout.early) - 1} more" if len(layout.early) > 1 else "")
        table.notes.append(f"{lines} above the data, apart from them: not read, though of numbers")
    chosen = list(layout.wanted) if wanted else list(range(layout.width))
    if wanted and not chosen:
        return _only_names(table, layout)
    clocks = {index: midnight_of([row[index] for row in layout.head if index < len(row)]) for index in chosen}
    columns = _in_one_go(path, layout, chosen) if path.stat().st_size > _SMALL else None
    if columns is None:
        columns = _line_by_line(path, layout, chosen, clocks, table, options.repair, bool(wanted))
    _last_line(path, layout, chosen, columns, table)
    for index, values in zip(chosen, columns, strict=True):
        name = layout.names[index]
        table.columns[name] = values
        if (midnight := clocks[index]) is not None:
            table.as_clock(name, midnight)
    return table


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _only_names(table: Table, layout: Layout) -> Table:
    """A table of which no column is asked for by a name that is there: for the message that says which there are."""
    table.unusable |= dict.fromkeys(layout.names, ("isn't asked for", "map it"))
    return table


def _in_one_go(path: Path, layout: Layout, chosen: list[int]) -> list[Array] | None:
    """The columns by pyarrow's strict reader; None when a line isn't as expected."""
    import pyarrow as pa  # slow to import
    from pyarrow import csv

    if layout.encoding not in {"utf-8", "utf-8-sig", "cp1252"} or (layout.delimiter and len(layout.delimiter) > 1):
        return None
    names = [str(index) for index in range(layout.width)]
    spellings = sorted({form for word in MISSING for form in (word, word.upper(), word.capitalize())} | {"NaN"})
    try:
        source = path if layout.delimiter is not None else pa.BufferReader(_single_blanks(path, layout.start))
        reader = csv.open_csv(
            source,
            read_options=csv.ReadOptions(
                skip_rows=layout.start if layout.delimiter is not None else 0, column_names=names, block_size=_BLOCK
            ),
            parse_options=csv.ParseOptions(delimiter=layout.delimiter or " ", ignore_empty_lines=True),
            convert_options=csv.ConvertOptions(
                column_types=dict.fromkeys(names, pa.float64()),
                include_columns=[names[index] for index in chosen],
                null_values=spellings,
                quoted_strings_can_be_null=True,
                decimal_point=layout.decimal,
                check_utf8=False,
            ),
        )
        batches = list(reader)
    except (pa.ArrowException, OSError, ValueError, OverflowError):
        return None
    if not batches:
        return None
    content = pa.Table.from_batches(batches)
    columns = [column.to_numpy().astype(np.float64) for column in content.columns]
    # Whether a line without any of these values is a sample is seen from its other cells.
    return None if np.isnan(np.stack(columns)).all(axis=0).any() else columns


def _single_blanks(path: Path, start: int) -> bytes:
    """The data of a file with one blank between the cells."""
    with path.open("rb") as file:
        for _ in islice(file, start):
            pass
        content = file.read().replace(b"\r\n", b"\n")
    content = re.sub(rb"[ \t]+", b" ", content)
    return content.replace(b"\n ", b"\n").replace(b" \n", b"\n").strip(b" ")


@dataclass
class _Trouble:
    """What isn't as it should be, of one kind."""

    count: int = 0
    line: int = 0
    text: str = ""

    def add(self, line: int, text: str) -> None:
        """Count one."""
        if not self.count:
            self.line, self.text = line, text
        self.count += 1


@dataclass
class _Rows:
    """Samples of a part of the lines; ``cells`` by column."""

    cells: list[list[str]]
    lines: list[int] = field(default_factory=list)
    text: list[str] = field(default_factory=list)


class _Reader:
    """One pass over the lines of a table.

    Args:
        layout: how it is written.
        chosen: numbers of the columns.
        clocks: of those of them that are clock times, since when they count.
        judged: False to take a cell that is no number as missing in silence, when no column was asked for.
    """

    def __init__(self, layout: Layout, chosen: list[int], clocks: dict[int, float | None], judged: bool) -> None:
        self.layout, self.chosen, self.judged = layout, chosen, judged
        self.midnights = [clocks[index] for index in chosen]
        self.messages, self.cells, self.cut, self.pending = _Trouble(), _Trouble(), _Trouble(), _Trouble()
        self.bad_column = ""
        self.bad = [0] * len(chosen)
        self.comments = 0
        self.samples = 0
        self._short: tuple[int, int] = (-1, 0)

    def chunk(self, lines: Iterator[Line]) -> list[Array] | None:
        """The columns of the next lines; None at the end of the file."""
        rows = _Rows([[] for _ in self.chosen])
        read = 0
        for line in islice(lines, _CHUNK):
            read += 1
            if not line.text.strip():
                continue
            if is_comment(line.text, self.layout.delimiter):
                self.comments += 1
                continue
            self._take(line, rows)
        if not read:
            return None
        kept = np.ones(len(rows.lines), dtype=np.bool_)
        columns = self._converted(rows, kept)
        self.samples += int(kept.sum())
        return [column[kept] for column in columns]

    def _take(self, line: Line, rows: _Rows) -> None:
        row = split(line.text, self.layout.delimiter)
        width = self.layout.width
        if not any(row):
            return
        if len(row) > width and not any(row[width:]):
            row = row[:width]
        if len(row) < width:
            row = self._shortened(line, row)
        elif len(row) > width:
            if not self._message(line, [row[k] for k in self.chosen]):
                self.cut.add(line.at, line.text)
                self._sample(line, [""] * len(self.chosen), rows)
            return
        self._sample(line, [row[k] for k in self.chosen], rows)

    def _shortened(self, line: Line, row: list[str]) -> list[str]:
        """A line that ends early, its last cells empty; where it stands alone, its last one may be cut, too."""
        size, at = self._short
        alone = not (len(row) == size and line.at - at <= 1)
        self._short = (len(row), line.at)
        if alone and not self._message(line, [cell for k, cell in enumerate(row) if k in self.chosen], dry=True):
            self.cut.add(line.at, line.text)
            row = row[:-1]
        return [*row, *[""] * (self.layout.width - len(row))]

    def _sample(self, line: Line, cells: list[str], rows: _Rows) -> None:
        for column, cell in zip(rows.cells, cells, strict=True):
            column.append(cell)
        rows.lines.append(line.at)
        rows.text.append(line.text)

    def _message(self, line: Line, cells: Sequence[str], whole: bool = False, dry: bool = False) -> bool:
        """Count a line of which fewer than half of the cells asked for are numbers as one between the data.

        Of a line with as many cells as the others (``whole``) half are enough to make it a sample that is damaged.
        """
        found = [number(cell, self.layout.decimal) if not is_clock(cell) else clock(cell) for cell in cells]
        good = sum(value is not None and not math.isnan(value) for value in found)
        words = sum(value is None for value in found)
        message = good < words or (good == words and not (whole and good))
        if message and not dry:
            self.pending.add(line.at, line.text)
        return message

    def _converted(self, rows: _Rows, kept: Any) -> list[Array]:
        decimal = self.layout.decimal
        columns = [numbers(cells, decimal, since) for cells, since in zip(rows.cells, self.midnights, strict=True)]
        if all(column is not None for column in columns):
            self._settle(bool(rows.lines))
            return [column for column in columns if column is not None]
        count = len(rows.lines)
        found = [np.empty(count) for _ in self.chosen]
        for k in range(count):
            cells = [column[k] for column in rows.cells]
            pairs = zip(cells, self.midnights, strict=True)
            values = [number(cell, decimal) if since is None else clock(cell, since) for cell, since in pairs]
            wrong = [index for index, value in enumerate(values) if value is None]
            if wrong and self.judged and self._message(Line(rows.lines[k], rows.text[k]), cells, whole=True):
                kept[k] = False
                continue
            if any(value is not None and not math.isnan(value) for value in values):
                self._settle(True)
            for index in wrong:
                self._wrong(index, rows.lines[k], cells[index])
            for column, value in zip(found, values, strict=True):
                column[k] = np.nan if value is None else value
        return found

    def _settle(self, data: bool) -> None:
        """Messages so far stand between the data once data follow."""
        if data and self.pending.count:
            if not self.messages.count:
                self.messages.line, self.messages.text = self.pending.line, self.pending.text
            self.messages.count += self.pending.count
            self.pending = _Trouble()

    def _wrong(self, index: int, line: int, cell: str) -> None:
        self.bad[index] += 1
        if not self.cells.count:
            self.bad_column = self.layout.names[self.chosen[index]]
        self.cells.add(line, cell)


def _line_by_line(
    path: Path, layout: Layout, chosen: list[int], clocks: dict[int, float | None], table: Table, repair: bool, judged: bool
) -> list[Array]:
    reader = _Reader(layout, chosen, clocks, judged)
    lines = lines_of(path, layout.encoding, layout.delimiter, layout.start)
    parts: list[list[Array]] = []
    while (part := reader.chunk(lines)) is not None:
        parts.append(part)
    columns = [np.concatenate([part[k] for part in parts]) if parts else np.empty(0) for k in range(len(chosen))]
    if judged:
        _judge(path, reader, table, repair)
    else:
        for index, bad in zip(chosen, reader.bad, strict=True):
            if bad:
                table.unusable[layout.names[index]] = (
                    "holds what is no number",
                    "map a column of numbers, or correct the file",
                )
    return columns


def _judge(path: Path, reader: _Reader, table: Table, repair: bool) -> None:
    """Refuse what isn't as it should be, or say what was done about it."""
    cells, cut, messages = reader.cells, reader.cut, reader.messages
    for index, bad in enumerate(reader.bad):
        if 2 * bad > reader.samples:
            name = one_line(reader.layout.names[reader.chosen[index]])
            which = f"{bad} of {reader.samples} cells, such as '{one_line(cells.text)}'"
            problem = f"column '{name}' is no column of numbers: {which}"
            raise ImportingError(path, problem, "map another column, or say how it is written: delimiter, decimal")
    if not reader.samples or messages.count > reader.samples:
        trouble = messages if messages.count else reader.pending
        first = f"first line {trouble.line}: '{one_line(trouble.text)}'"
        problem = f"{trouble.count} of its lines hold no numbers where the mapping asks for them, {first}"
        raise ImportingError(path, problem, "say how it is written (delimiter, decimal, skip_rows), or remove these lines")
    found = (
        (
            cells,
            f"column '{one_line(reader.bad_column)}', line {cells.line}: '{one_line(cells.text)}' is not a number",
            "taken as missing",
        ),
        (cut, f"line {cut.line} has too few or too many cells: '{one_line(cut.text)}'", "taken as missing what can't be told"),
        (messages, f"line {messages.line} is a message between the data: '{one_line(messages.text)}'", "dropped"),
    )
    for trouble, problem, done in found:
        if not trouble.count:
            continue
        more = f" ({trouble.count} in all)" if trouble.count > 1 else ""
        if not repair:
            way = "drop such lines" if trouble is messages else "take such values as missing"
            raise ImportingError(path, problem + more, f"{way} with --repair, or correct the file")
        table.notes.append(f"{problem}{more}: {done}")
    if reader.comments:
        table.notes.append(f"{reader.comments} comment line(s) passed over")
    if reader.pending.count:
        last = reader.pending
        table.notes.append(
            f"{last.count} line(s) after the data passed over, the first line {last.line}: '{one_line(last.text)}'"
        )


def _last_line(path: Path, layout: Layout, chosen: list[int], columns: list[Array], table: Table) -> None:
    """Leave out a last sample that was cut in the middle of a number, as where the power of a logger failed.

    A file that ends without the end of a line is cut when its last number has fewer decimals than all before it have.
    """
    with path.open("rb") as file:
        file.seek(-1, 2)
        if file.read(1) in {b"\n", b"\r"}:
            return
    rows = [row for text in last_lines(path, layout.encoding) if len(row := split(text, layout.delimiter)) == layout.width]
    if len(rows) < _TELLING or columns[0].size < 2 or number(rows[-1][-1], layout.decimal) is None:
        return
    *before, last = [len(row[-1].rpartition(layout.decimal)[2]) for row in rows]
    if len(set(before)) == 1 and last < before[0] and layout.width - 1 in chosen:
        for place, column in enumerate(columns):
            columns[place] = column[:-1]
        table.notes.append(f"the last line ends within a number ('{one_line(rows[-1][-1])}'): left out")


IMPORTER = Importer("text", (".csv", ".txt", ".tsv", ".tab", ".dat", ".asc", ".log", ".prn"), read)
