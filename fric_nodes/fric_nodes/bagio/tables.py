"""Files of other programs as named columns: ``.mat``, ``.npz``, ``.parquet`` and text tables."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..record import Array
from .errors import ImportingError
from .units import unit

__all__ = ["Table", "TextOptions", "load_table"]

_TEXT = {".csv", ".txt", ".tsv", ".dat"}
_DELIMITERS = ("\t", ";", ",", "|", None)  # None: any run of blanks
_UNIT_WORDS = {"a", "v", "%", "bar", "pa", "-", "", "ma", "mv", "hz", "counts", "inc"}


@dataclass(frozen=True)
class TextOptions:
    """How to read a text table; what is None is found out."""

    delimiter: str | None = None
    decimal: str | None = None
    skip_rows: int | None = None
    header: bool | None = None


@dataclass
class Table:
    """Columns of a file, in its order, and its scalar variables."""

    path: Path
    columns: dict[str, Array] = field(default_factory=dict)
    scalars: dict[str, float] = field(default_factory=dict)

    def add(self, name: str, values: Any) -> None:
        """Take a numeric array as one column, as several (``name[0]`` ...), or as a scalar; leave anything else alone."""
        array = np.asarray(values)
        if array.dtype.kind == "M":  # dates: seconds from the first
            array = (array - array.flat[0]) / np.timedelta64(1, "s") if array.size else array.astype(np.float64)
        if array.dtype.kind not in "biuf" or array.size == 0:
            return
        array = np.squeeze(array).astype(np.float64)
        if array.ndim == 0:
            self.scalars[name] = float(array)
        elif array.ndim == 1:
            self.columns[name] = np.ascontiguousarray(array)
        elif array.ndim == 2:
            columns = array if array.shape[0] >= array.shape[1] else array.T
            for index in range(columns.shape[1]):
                self.columns[f"{name}[{index}]"] = np.ascontiguousarray(columns[:, index])


def load_table(path: Path, options: TextOptions) -> Table:
    """Read a file by what its name ends in.

    Raises:
        ImportingError: not there, of an unknown kind, or not what its name says.
    """
    if not path.is_file():
        raise ImportingError(path, "is not there" if not path.exists() else "is not a file", "check the path")
    if path.stat().st_size == 0:
        raise ImportingError(path, "is empty (0 bytes)", "export it again")
    kind = path.suffix.lower()
    readers = {".mat": _mat, ".npz": _npz, ".parquet": _parquet}
    if kind in readers:
        table = readers[kind](path)
    elif kind in _TEXT:
        table = _text(path, options)
    else:
        raise ImportingError(path, f"files that end in '{kind}' are not read", "give .mat, .csv, .npz or .parquet")
    if not table.columns:
        raise ImportingError(path, "holds no numeric column", "export the signals as numbers")
    return table


def _mat(path: Path) -> Table:
    from scipy.io import loadmat  # slow to import, and only this needs it

    table = Table(path)
    if path.read_bytes()[:512].startswith(b"MATLAB 7.3"):
        raise ImportingError(
            path, "is a MATLAB 7.3 file (HDF5), which is not read", "save it in MATLAB with save(FILE, '-v7') and import that"
        )
    try:
        content: Mapping[str, Any] = loadmat(str(path), squeeze_me=True, struct_as_record=False)
    except Exception as error:  # scipy raises many kinds, down to zlib's
        remedy = "save it again in MATLAB with save(FILE, '-v7')"
        raise ImportingError(path, f"is not a readable .mat file ({error})", remedy) from error
    for name, value in content.items():
        if not name.startswith("__"):
            _add_struct(table, name, value)
    return table


def _add_struct(table: Table, name: str, value: Any) -> None:
    """Fields of a MATLAB struct by their dotted names."""
    names = getattr(value, "_fieldnames", None)
    if names is None:
        table.add(name, value)
        return
    for inner in names:
        _add_struct(table, f"{name}.{inner}", getattr(value, inner))


def _npz(path: Path) -> Table:
    table = Table(path)
    try:
        with np.load(path, allow_pickle=False) as content:
            for name in content.files:
                table.add(name, content[name])
    except (OSError, ValueError, zipfile.BadZipFile, EOFError) as error:
        remedy = "save it with numpy.savez, numbers only"
        raise ImportingError(path, f"is not a readable .npz file ({error})", remedy) from error
    return table


def _parquet(path: Path) -> Table:
    import pyarrow as pa  # slow to import, and only this needs it
    import pyarrow.parquet as pq

    table = Table(path)
    try:
        content = pq.read_table(path)
        for name in content.column_names:
            column = content.column(name)
            if pa.types.is_integer(column.type) and column.null_count:
                column = column.cast(pa.float64())
            table.add(name, column.to_numpy())
    except (pa.ArrowException, OSError) as error:
        reason = str(error).splitlines()[0]
        raise ImportingError(path, f"is not a readable .parquet file ({reason})", "export it again") from error
    return table


def _decoded(path: Path) -> str:
    raw = path.read_bytes()
    if raw[:2] in {b"\xff\xfe", b"\xfe\xff"}:
        return raw.decode("utf-16", errors="replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _number(text: str, decimal: str) -> bool:
    try:
        float(text.strip().strip('"').replace(decimal, ".") if decimal != "." else text.strip().strip('"'))
    except ValueError:
        return False
    return True


def _split(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    return [part.strip() for part in next(csv.reader([line], delimiter=delimiter), [])]


def _numeric(line: str, delimiter: str | None, decimal: str) -> int:
    """Number of columns when all are numbers or empty, else 0."""
    parts = _split(line, delimiter)
    filled = [part for part in parts if part]
    return len(parts) if filled and all(_number(part, decimal) for part in filled) else 0


def _sniff(path: Path, lines: list[str], options: TextOptions) -> tuple[str | None, str]:
    """Delimiter and decimal sign: the pair that makes most numbers of the lines in the middle of the file."""
    sample = [line for line in lines[len(lines) // 2 :] if line.strip()][:50] or lines
    best: tuple[float, str | None, str] = (0.0, None, ".")
    blank = options.delimiter is not None and not options.delimiter.strip() and options.delimiter != "\t"
    delimiters = _DELIMITERS if options.delimiter is None else (None if blank else options.delimiter,)
    for delimiter in delimiters:
        for decimal in (".", ",") if options.decimal is None else (options.decimal,):
            if delimiter == decimal:
                continue
            score = float(np.median([_numeric(line, delimiter, decimal) for line in sample]))
            if score > best[0]:
                best = (score, delimiter, decimal)
    if not best[0]:
        raise ImportingError(
            path, "no delimiter splits its lines into numbers", "say how it is written: delimiter, decimal, skip_rows, header"
        )
    return best[1], best[2]


def _first_data_line(lines: list[str], delimiter: str | None, decimal: str) -> int:
    """First of two lines in a row that hold numbers in as many columns as the lines in the middle."""
    middle = [_numeric(line, delimiter, decimal) for line in lines[len(lines) // 2 :][:50]]
    width = max(middle)
    for index, line in enumerate(lines):
        after = lines[index + 1] if index + 1 < len(lines) else line
        if _numeric(line, delimiter, decimal) == width and _numeric(after, delimiter, decimal) == width:
            return index
    return 0


def _looks_like_units(parts: list[str]) -> bool:
    return all(unit(part.strip("[]()")) or part.strip("[]()").lower() in _UNIT_WORDS for part in parts)


def _names(lines: list[str], start: int, width: int, delimiter: str | None) -> list[str]:
    """Names of the columns from the header lines right above the data; a line of units below the names is passed over."""
    above: list[list[str]] = []
    for line in reversed(lines[:start]):
        parts = _split(line, delimiter)
        if len(parts) != width:
            break
        above.append(parts)
    if not above:
        return [str(index) for index in range(width)]
    chosen = above[1] if len(above) > 1 and _looks_like_units(above[0]) else above[0]
    names: list[str] = []
    for index, part in enumerate(chosen):
        name = part.strip().strip('"') or str(index)
        names.append(name if name not in names else f"{name}.{index}")
    return names


def _text(path: Path, options: TextOptions) -> Table:
    import pandas as pd  # slow to import, and only this needs it

    lines = [line for line in _decoded(path).splitlines() if line.strip()]
    skip = options.skip_rows or 0
    lines = lines[skip:]
    if not lines:
        raise ImportingError(path, f"has no lines after the {skip} skipped ones", "skip fewer rows")
    delimiter, decimal = _sniff(path, lines, options)
    start = _first_data_line(lines, delimiter, decimal) if options.header is None else int(options.header)
    width = len(_split(lines[start], delimiter)) if start < len(lines) else 0
    names = [str(index) for index in range(width)] if options.header is False else _names(lines, start, width, delimiter)
    separator = r"\s+" if delimiter is None else re.escape(delimiter) if len(delimiter) > 1 else delimiter
    body = io.StringIO("\n".join(line.strip(" \r") if delimiter is None else line for line in lines[start:]))
    try:
        frame = pd.read_csv(
            body,
            sep=separator,
            decimal=decimal,
            header=None,
            names=list(range(width)),
            index_col=False,
            skipinitialspace=True,
        )
    except (pd.errors.ParserError, pd.errors.EmptyDataError, ValueError) as error:
        remedy = "remove what follows the data, or set skip_rows"
        raise ImportingError(path, f"is not a table ({str(error).strip()})", remedy) from error
    table = Table(path)
    for index, name in enumerate(names):
        table.columns[name] = _numbers(path, name, frame[index].to_numpy(), start + skip)
    return table


def _numbers(path: Path, name: str, values: NDArray[Any], first_line: int) -> Array:
    if values.dtype.kind in "biuf":
        return values.astype(np.float64)
    numbers = np.full(values.size, np.nan)
    for index, value in enumerate(values):
        if value is None or (isinstance(value, float) and np.isnan(value)):
            continue
        try:
            numbers[index] = float(value)
        except (TypeError, ValueError):
            raise ImportingError(
                path,
                f"column '{name}', line {first_line + index + 1}: '{value}' is not a number",
                "correct the file, or say how it is written: delimiter, decimal, skip_rows",
            ) from None
    return numbers
