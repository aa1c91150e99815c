"""The lines of a text file: its encoding, samples of them, and how a line falls into cells."""

from __future__ import annotations

import codecs
import csv
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from .errors import ImportingError

__all__ = ["Line", "encoding_of", "is_comment", "last_lines", "lines_of", "sample_lines", "split", "uncommented"]

_COMMENTS = ("#", "%", "//", "!", ";")
_BLOCK = 1 << 18  # [bytes] that are looked at in the middle and at the end of a file, to find out how it is written
_TAIL = 1 << 14  # [bytes]
_JOINED = 20  # lines that a quoted text may run over
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


class Line(NamedTuple):
    """A line of a file and its number from 1."""

    at: int
    text: str


def encoding_of(path: Path) -> str:
    """UTF-8, or UTF-16 or 32 by their marks or by every other byte being 0, or else the one byte a letter of Windows."""
    with path.open("rb") as file:
        head = file.read(_BLOCK)
        file.seek(max(path.stat().st_size - _BLOCK, 0))
        tail = file.read(_BLOCK)
    for mark, name in _BYTE_ORDER_MARKS:
        if head.startswith(mark):
            return name
    if head and head.count(0) > 0.3 * len(head):
        return "utf-16-le" if head[1::2].count(0) >= head[::2].count(0) else "utf-16-be"
    for block, edges in ((head, (0, 3)), (tail, (3, 0))):
        # A letter of several bytes may be cut at the edge of a block.
        try:
            block[edges[0] if len(tail) == _BLOCK else 0 : len(block) - (edges[1] if len(head) == _BLOCK else 0)].decode(
                "utf-8"
            )
        except UnicodeDecodeError:
            return "cp1252"
    return "utf-8"


def lines_of(path: Path, encoding: str, delimiter: str | None = None, after: int = 0) -> Iterator[Line]:
    """The lines after the first ``after`` ones; a quoted text that runs over several lines is one.

    Raises:
        ImportingError: the file cannot be read.
    """
    try:
        with path.open(encoding=encoding, errors="replace") as file:
            numbered = (Line(at, text) for at, text in enumerate(file, 1) if at > after)
            if delimiter is None:
                yield from (Line(at, text.strip()) for at, text in numbered)
                return
            for at, text in numbered:
                if '"' not in text or text.count('"') % 2 == 0:
                    yield Line(at, text.rstrip("\r\n"))
                    continue
                yield from _joined(Line(at, text), numbered)
    except (OSError, UnicodeError) as error:
        raise ImportingError(path, f"cannot be read as {encoding} text ({error})", "export it again, as UTF-8") from error


def _joined(first: Line, following: Iterator[Line]) -> Iterator[Line]:
    """A line with an open quotation mark together with those up to its end; as they are when there is none."""
    taken = [first]
    for line in following:
        taken.append(line)
        if line.text.count('"') % 2:
            yield Line(first.at, " ".join(part.text.rstrip("\r\n") for part in taken))
            return
        if len(taken) >= _JOINED:
            break
    for line in taken:
        yield Line(line.at, line.text.rstrip("\r\n"))


def sample_lines(path: Path, encoding: str, skip: int, count: int) -> tuple[list[Line], list[str]]:
    """Lines that are not blank: the first ones with their numbers, and some from the middle and the end of the file."""
    first: list[Line] = []
    for line in lines_of(path, encoding, "", skip):
        if line.text.strip():
            first.append(Line(line.at, line.text.rstrip("\r\n")))
        if len(first) >= 10 * count:
            break
    size = path.stat().st_size
    if size <= 2 * _BLOCK:
        whole = [line.text for line in first] if len(first) < 10 * count else []
        whole = whole or [line.text.rstrip("\r\n") for line in lines_of(path, encoding, "", skip) if line.text.strip()]
        return first, whole if len(whole) <= 2 * count else [*whole[len(whole) // 2 :][:count], *whole[:: len(whole) // count]]
    later: list[str] = []
    wide = 4 if "32" in encoding else 2 if "16" in encoding else 1
    plain = encoding.replace("-sig", "") if wide == 1 else encoding
    with path.open("rb") as file:
        if plain in {"utf-16", "utf-32"}:
            mark = file.read(wide)
            plain += "-le" if mark[:1] == b"\xff" else "-be"
        for start in (size // 2, size - _BLOCK):
            file.seek(start - start % wide)
            text = file.read(_BLOCK).decode(plain, errors="replace")
            cut = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")[1:]
            later += [line for line in cut[: None if start > size // 2 else -1] if line.strip()][:count]
    return first, later


def last_lines(path: Path, encoding: str) -> list[str]:
    """The last lines of a file that aren't blank, 50 at most; none of a text in UTF-16 or 32."""
    if not encoding.startswith(("utf-8", "cp1252")):
        return []
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - _TAIL, 0))
        text = file.read().decode(encoding.replace("-sig", ""), errors="replace")
    return [line for line in text.replace("\r\n", "\n").replace("\r", "\n").split("\n")[1:] if line.strip()][-50:]


def is_comment(text: str, delimiter: str | None) -> bool:
    """True for a line that begins with a sign of a comment."""
    start = text.lstrip()
    return start.startswith(_COMMENTS) and not (delimiter and start.startswith(delimiter))


def uncommented(text: str) -> str:
    """A line without the sign of a comment at its start."""
    return text.lstrip().lstrip("#%/!;").strip()


def split(text: str, delimiter: str | None) -> list[str]:
    """The cells of a line; None for any run of blanks between them."""
    if '"' in text and (delimiter is None or len(delimiter) == 1):
        try:
            cells = next(csv.reader([text], delimiter=delimiter or " ", skipinitialspace=True), [])
        except csv.Error:
            cells = text.split(delimiter)
        return [cell for cell in cells if cell] if delimiter is None else [cell.strip() for cell in cells]
    return text.split() if delimiter is None else [cell.strip() for cell in text.split(delimiter)]
