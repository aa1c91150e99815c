"""How a text table is written: delimiter, decimal sign, where the data begin, names of the columns.

Every delimiter is tried on lines from the start, the middle and the end of the file. What counts is how many of these lines
give numbers in the columns that the mapping asks for; what else a line holds (words, hexadecimal numbers, dates) doesn't
matter. The decimal sign then follows from all cells of these columns together, see
:func:`~fric.importers.cells.comma_is`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .cells import MISSING, clock, comma_is, is_clock, number
from .errors import ImportingError, one_line
from .lines import Line, encoding_of, is_comment, sample_lines, split, uncommented
from .table import Source, TextOptions
from .units import unit

__all__ = ["Layout", "find_layout"]

_DELIMITERS = ("\t", ";", ",", "|", None)  # None: any run of blanks
_HEAD = 50  # rows that are kept
_SAMPLE = 100  # lines that are looked at in each part of the file


@dataclass(frozen=True)
class Layout:
    """How a text table is written.

    Attributes:
        encoding: of the file.
        delimiter: None for any run of blanks.
        decimal: ``.`` or ``,``.
        start: lines before the first one of data.
        width: cells of a line.
        names: of the columns, their numbers where there is no header.
        aliases: further names, such as those of other header lines.
        wanted: numbers of the columns that are asked for and there.
        head: cells of the first rows.
        early: numbers of the lines of numbers that stand above the data, apart from them.
        hint: why there are no names though there are lines above the data.
    """

    encoding: str
    delimiter: str | None
    decimal: str
    start: int
    width: int
    names: list[str]
    aliases: dict[str, str] = field(default_factory=dict)
    wanted: tuple[int, ...] = ()
    head: list[list[str]] = field(default_factory=list)
    hint: str = ""
    early: tuple[int, ...] = ()


@dataclass
class _Candidate:
    """One way to read the lines, and how well it does."""

    layout: Layout
    resolved: bool
    score: float
    general: float
    ambiguous: str | None = None


def find_layout(path: Path, options: TextOptions, wanted: Sequence[Source]) -> Layout:
    """Find out how a table is written.

    Raises:
        ImportingError: no lines, no numbers, or a comma that may be a decimal sign or stand between thousands.
    """
    encoding = encoding_of(path)
    first, later = sample_lines(path, encoding, options.skip_rows or 0, _SAMPLE)
    if not first:
        raise ImportingError(path, f"has no lines after the {options.skip_rows or 0} skipped ones", "skip fewer rows")
    delimiters: Sequence[str | None] = _DELIMITERS
    if options.delimiter is not None:
        # Blanks, unless the one blank asked for is a tab.
        delimiters = (None if not options.delimiter.strip() and options.delimiter != "\t" else options.delimiter,)
    found = [
        candidate
        for delimiter in delimiters
        if (candidate := _candidate(encoding, first, later, delimiter, options, wanted)) is not None
    ]
    if not found:
        how = "say how it is written (delimiter, decimal, skip_rows, header), or export the signals as numbers"
        raise ImportingError(path, "no delimiter splits its lines into numbers", how)
    best = max(
        found, key=lambda one: (one.resolved and one.score > 0, one.score if one.resolved else 0, one.general, one.resolved)
    )
    if best.ambiguous is not None and best.resolved:
        raise ImportingError(
            path,
            f"the comma in '{one_line(best.ambiguous)}' may be a decimal sign or stand between thousands",
            "say which in the mapping: decimal: ',' or decimal: '.'",
        )
    return best.layout


def _any_number(cell: str) -> bool:
    return cell.lower() not in MISSING and (number(cell) is not None or number(cell, ",") is not None or is_clock(cell))


def _candidate(
    encoding: str,
    first: list[Line],
    later: list[str],
    delimiter: str | None,
    options: TextOptions,
    wanted: Sequence[Source],
) -> _Candidate | None:
    rows = [split(text, delimiter) for text in later if not is_comment(text, delimiter)]
    filled = [row for row in rows if any(map(_any_number, row))]
    if not filled:
        return None
    width = Counter(map(len, filled)).most_common(1)[0][0]
    body = [row for row in filled if len(row) == width]
    if width > 1 and all(not row[-1] for row in body):
        width -= 1  # the delimiter ends each line
    mask = [
        k
        for k in range(width)
        if sum(_any_number(row[k]) for row in body) * 2 > sum(row[k].lower() not in MISSING for row in body)
    ]
    if not mask:
        return None
    index = _start(first, delimiter, width, mask) if options.header is None else min(int(options.header), len(first) - 1)
    above = [] if options.header is False else [line.text for line in first[:index]]
    if any(len(row := split(text, delimiter)) == width + 1 and row[-1] for text in above) and len(body[0]) > width:
        width += 1  # the last column has a name, and is empty in most lines
    headers = _headers(above, delimiter, width)
    rows_above = ((line.at, split(line.text, delimiter)) for line in first[:index] if not is_comment(line.text, delimiter))
    early = () if options.header is not None else tuple(at for at, row in rows_above if _shares(row, width, mask) == 1.0)
    names, aliases = _names(headers, width)
    hint = (
        f"the line above the data has {len(split(above[-1], delimiter))} names for {width} columns"
        if above and not headers
        else ""
    )
    numbers = [_index(source, names, aliases) for source in wanted]
    resolved = all(column is not None for column in numbers)
    columns = sorted({column for column in numbers if column is not None})
    data = [split(line.text, delimiter) for line in first[index:][:_SAMPLE] if not is_comment(line.text, delimiter)]
    cells = [[row[k] for row in (*data, *body) if k < len(row)] for k in columns]
    decimal, ambiguous = (options.decimal, None) if options.decimal else _decimal(cells, columns, mask)
    good = sum(_fits(row, columns, decimal) for row in rows) / len(rows)
    # Without names that fit, what the mapping asks for can't be judged: the columns that hold numbers are.
    general = sum(len(row) == width and _fits(row, mask, decimal) for row in rows) / len(rows) * len(mask)
    start = first[index].at - 1
    layout = Layout(encoding, delimiter, decimal, start, width, names, aliases, tuple(columns), data[:_HEAD], hint, early)
    return _Candidate(layout, resolved, good, general, ambiguous)


def _start(first: list[Line], delimiter: str | None, width: int, mask: Sequence[int]) -> int:
    """First of two lines in a row that hold numbers where most lines do, with damaged ones right before it.

    Comments and blank lines don't count. A line above of which more than half of these cells are numbers is no header.
    """
    lines = [(index, split(line.text, delimiter)) for index, line in enumerate(first) if not is_comment(line.text, delimiter)]
    good = [_shares(row, width, mask) for _, row in lines]
    start = next((at for at in range(len(lines) - 1) if good[at] == good[at + 1] == 1.0), None)
    start = start if start is not None else next((at for at in range(len(lines)) if good[at] == 1.0), 0)
    while start > 0 and good[start - 1] > 0.5:
        start -= 1
    return lines[start][0] if lines else 0


def _shares(row: Sequence[str], width: int, mask: Sequence[int]) -> float:
    """Share of the cells where numbers are expected that hold one; those that are empty count as such when not all are."""
    if len(row) < min(width, mask[-1] + 1):
        return 0.0
    cells = [row[k] for k in mask]
    numbers = sum(map(_any_number, cells))
    return (numbers + sum(cell.lower() in MISSING for cell in cells)) / len(cells) if numbers else 0.0


def _fits(row: Sequence[str], columns: Sequence[int], decimal: str) -> bool:
    cells = [row[k] for k in columns if k < len(row)]
    found = [clock(cell) if is_clock(cell) else number(cell, decimal) for cell in cells]
    return (
        bool(found)
        and all(value is not None for value in found)
        and any(value is not None and not math.isnan(value) for value in found)
    )


def _decimal(cells: list[list[str]], columns: Sequence[int], mask: Sequence[int]) -> tuple[str, str | None]:
    """The decimal sign by the cells of the columns together, and a cell that may be read both ways when nothing decides."""
    said = {column: comma_is(column_cells) for column, column_cells in zip(columns, cells, strict=True) if column in mask}
    verdicts = set(said.values()) - {""}
    if "," in verdicts or "." in verdicts:
        return ("," if "," in verdicts else "."), None
    if not verdicts:
        return ".", None
    unsure = next(
        cell for column, part in zip(columns, cells, strict=True) if said.get(column) == "?" for cell in part if "," in cell
    )
    return ",", unsure


def _headers(above: list[str], delimiter: str | None, width: int) -> list[list[str]]:
    """Header lines right above the data, the nearest first."""
    headers: list[list[str]] = []
    for text in reversed(above):
        comment = is_comment(text, delimiter)
        row = split(uncommented(text) if comment else text, delimiter)
        if len(row) > width and all(not cell for cell in row[width:]):
            row = row[:width]
        if len(row) != width:
            if comment or (headers and delimiter is None):
                continue
            break
        headers.append(row)
    return headers


def _is_units(row: Sequence[str]) -> bool:
    texts = [cell.strip("[]()<>") for cell in row]
    return all(not text or unit(text) is not None or number(text) is not None for text in texts)


def _telling(row: Sequence[str]) -> int:
    """How many different names a header line has that are neither units nor numbers."""
    return sum(not _is_units([cell]) for cell in set(row))


def _names(headers: list[list[str]], width: int) -> tuple[list[str], dict[str, str]]:
    """Names of the columns, from the header line that tells most of them apart, and what else each may be called."""
    numbered = [str(index) for index in range(width)]
    texts = [row for row in headers if not _is_units(row)] or headers[-1:]  # names stand above their units
    if not texts:
        return numbered, {}
    # Where several lines tell as many apart, the nearest to the data counts.
    chosen = max(texts, key=_telling)
    names: list[str] = []
    for index, cell in enumerate(chosen):
        name = cell.strip('"') or str(index)
        names.append(name if name not in names else f"{name}.{index}")
    others: dict[str, list[str]] = {}
    for level, row in enumerate(texts):
        groups = [_spread(upper) for upper in texts[level + 1 :]]
        for column, (name, cell) in enumerate(zip(names, row, strict=True)):
            under = {f"{group[column]}.{cell}" for group in groups}
            for alias in {cell, cell.split("[")[0].strip(), cell.split("(")[0].strip(), *under} - {""}:
                others.setdefault(alias, []).append(name)
    return names, {alias: found[0] for alias, found in others.items() if len(set(found)) == 1 and alias not in names}


def _spread(row: Sequence[str]) -> list[str]:
    """A header line whose titles stand over the first of several columns, repeated over all of them."""
    spread: list[str] = []
    for cell in row:
        spread.append(cell or (spread[-1] if spread else ""))
    return spread


def _index(source: Source, names: list[str], aliases: dict[str, str]) -> int | None:
    text = aliases.get(source, source) if isinstance(source, str) else source
    if isinstance(text, str):
        if text in names:
            return names.index(text)
        if not (text.isascii() and text.isdigit()):
            return None
    return int(text) if 0 <= int(text) < len(names) else None
