"""Numbers and clock times as programs write them into text.

Numbers: ``1.5``, ``1,5``, ``1e-3``, ``1.5D-3`` (Fortran), ``−1`` (the mathematical minus), thousands (``1,234.5``, ``1.234,5``,
``1'234.5``, ``1 234,5``), ``inf``. Missing: nothing, ``NaN``, ``NA``, ``n/a``, ``null``, ``none``, ``-``, ``?`` and the like.
Clock times: ``12:30:01.5``, also with a comma, and ISO 8601 (``2024-05-01T12:30:01.5Z``) or ``01.05.2024 12:30:01``, in seconds
since midnight or since 1970.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from datetime import datetime, timezone
from functools import lru_cache

import numpy as np

from ..record import Array

__all__ = ["DAY", "MISSING", "clock", "comma_is", "first_bad", "is_clock", "midnight_of", "number", "numbers", "past_midnight"]

MISSING = frozenset(
    {"", "nan", "na", "n/a", "#n/a", "null", "none", "nil", "-", "--", "?", "1.#qnan", "-1.#ind", "nan(ind)", "-nan"}
)
_INFINITE = {"inf": np.inf, "+inf": np.inf, "-inf": -np.inf, "infinity": np.inf, "-infinity": -np.inf, "1.#inf": np.inf}
_PLAIN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]+)?$")
_GROUPED = {
    decimal: re.compile(
        rf"[+-]?[1-9][0-9]{{0,2}}(?:(?P<sign>[{group}'’\u00a0\u2009\u202f ])[0-9]{{3}})(?:(?P=sign)[0-9]{{3}})*"
        rf"(?:{re.escape(decimal)}[0-9]*)?(?:[eE][+-]?[0-9]+)?$"
    )
    for decimal, group in ((".", ","), (",", "."))
}
_CLOCK = re.compile(
    r"(?:(\d{4}-\d\d-\d\d|\d\d?\.\d\d?\.\d{4}|\d{4}/\d\d/\d\d)[T ])?(\d{1,2}):(\d\d):(\d\d)(?:[.,](\d+))?(Z|[+-]\d\d:?\d\d)?$"
)
_DAYS = ("%Y-%m-%d", "%d.%m.%Y", "%Y/%m/%d")
DAY = 86_400.0  # [s]
_QUOTES = "\"' \t\u00a0"


@lru_cache(maxsize=1 << 14)  # while it is found out how a file is written, its cells are looked at several times
def number(cell: str, decimal: str = ".") -> float | None:
    """The number a cell stands for, NaN when it is a way to write that there is none, None when it is neither.

    Args:
        cell: the text.
        decimal: the decimal sign; the other of ``.`` and ``,`` may stand between thousands.
    """
    text = cell.strip(_QUOTES)
    plain = text if decimal == "." else text.replace(",", ".") if "." not in text else "?"
    if _PLAIN.match(plain):
        return float(plain.replace("d", "e").replace("D", "e"))
    lower = text.lower()
    if lower in MISSING:
        return float("nan")
    if lower in _INFINITE:
        return _INFINITE[lower]
    if text.startswith("\u2212"):
        return number("-" + text[1:], decimal)
    if _GROUPED[decimal].match(text):
        digits = re.sub(r"[,'’\u00a0\u2009\u202f ]" if decimal == "." else r"[.'’\u00a0\u2009\u202f ]", "", text)
        return float(digits.replace(",", "."))
    return None


def clock(cell: str, midnight: float = 0.0) -> float | None:
    """A clock time [s], NaN where there is none, None for anything else.

    Args:
        cell: the text.
        midnight: since when a date counts [s since 1970]; since 1970 itself, too few digits are left for what follows the
            point.
    """
    text = cell.strip(_QUOTES)
    return float("nan") if text.lower() in MISSING else _clock(text, midnight) if ":" in text else None


def midnight_of(cells: Iterable[str]) -> float | None:
    """The midnight before the first date of clock times [s since 1970], 0 without dates; None for another column."""
    filled = [cell for cell in cells if cell.strip(_QUOTES).lower() not in MISSING]
    if not 2 * sum(map(is_clock, filled)) > len(filled):
        return None
    first = next(value for cell in filled if (value := clock(cell)) is not None)
    return first // DAY * DAY


def is_clock(cell: str) -> bool:
    """True for a clock time or a date with one."""
    return ":" in cell and _CLOCK.match(cell.strip(_QUOTES)) is not None


def _clock(text: str, midnight: float) -> float | None:
    match = _CLOCK.match(text)
    if match is None:
        return None
    day, hour, minute, second, fraction, zone = match.groups()
    if int(hour) > 24 or int(minute) > 59 or int(second) > 60:
        return None
    seconds = 3600.0 * int(hour) + 60.0 * int(minute) + int(second) + (float(f"0.{fraction}") if fraction else 0.0)
    if zone and zone != "Z":
        seconds -= (1 if zone[0] == "+" else -1) * (3600.0 * int(zone[1:3]) + 60.0 * int(zone[-2:]))
    if day is None:
        return seconds
    for form in _DAYS:
        try:
            return datetime.strptime(day, form).replace(tzinfo=timezone.utc).timestamp() - midnight + seconds
        except ValueError:
            continue
    return None


def numbers(cells: Sequence[str], decimal: str = ".", midnight: float | None = None) -> Array | None:
    """The numbers of a column, or its clock times, NaN where there is none; None when a cell is neither."""
    quick = None if midnight is not None else _quick(cells, decimal)
    if quick is not None:
        return quick
    found = np.empty(len(cells))
    for index, cell in enumerate(cells):
        value = clock(cell, midnight) if midnight is not None else number(cell, decimal)
        if value is None:
            return None
        found[index] = value
    return found


def _quick(cells: Sequence[str], decimal: str) -> Array | None:
    """All cells in one go when they are plain numbers."""
    texts = cells if decimal == "." else [cell.replace(",", ".") if "." not in cell else "?" for cell in cells]
    if not cells or not all(map(_PLAIN.match, texts)):
        return None
    try:
        return np.array(texts, dtype=np.float64)
    except ValueError:
        return None


def past_midnight(seconds: Array) -> Array:
    """Clock times without a date that go on after midnight, a day added where they go back by more than half of one."""
    step = np.diff(seconds, prepend=seconds[:1])
    return seconds + DAY * np.cumsum(np.nan_to_num(step) < -0.5 * DAY)


def first_bad(cells: Sequence[str], clocks: bool = False) -> int:
    """Index of the first cell that is neither a number, or a clock time, nor a way to write that there is none."""
    return next((index for index, cell in enumerate(cells) if (clock(cell) if clocks else number(cell)) is None), 0)


def comma_is(cells: Iterable[str]) -> str:
    """What a comma in the cells of one column is.

    ``1,234`` may be 1.234 or 1234. The comma is a decimal sign where the digits behind it aren't three or nothing but a zero
    stands before it, and where a number of four digits has none. It stands between thousands where a number has two, or a
    point behind it, and where numbers below 1000 have none at all.

    Returns:
        ``","`` for a decimal sign, ``"."`` for thousands, ``"?"`` when both would do, and nothing when there is no comma.
    """
    undecided = small = large = False
    for cell in cells:
        text = cell.strip(_QUOTES).lstrip("+-")
        if is_clock(text):
            continue
        if "," not in text:
            large |= text.isdigit() and len(text) > 3
            small |= text.isdigit() and len(text) <= 3
            continue
        before, _, after = text.partition(",")
        if "," in after or "." in after:
            return "."
        if "." in before or len(after) != 3 or before in {"0", ""} or len(before) > 3:
            return ","
        undecided = True
    if not undecided:
        return ""
    return "," if large else "." if small else "?"
