"""``.mat`` up to version 7: variables, fields of structs by dots, elements of struct arrays and cells by ``[0]``, ``[1]`` ...

Simulink's "Structure With Time" is ``ScopeData.time`` and ``ScopeData.signals[0].values``; a matrix of values is
``ScopeData.signals[0].values[0]`` and so on, one per column. What MATLAB stores as objects (timetable, timeseries, table) is opaque
to every other program and is named with what to do.

A damaged file may claim sizes that no memory holds. The sizes that the file's own tags state are checked before it is read.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .errors import ImportingError, one_line
from .table import Importer, Source, Table, TextOptions

__all__ = ["IMPORTER"]

_RESAVE = "save it again in MATLAB with save(FILE, '-v7')"
_OBJECT = (
    "is a MATLAB object (timetable, timeseries, table or the like), which only MATLAB reads",
    "store its columns in a struct first, as in s.t = seconds(T.Time); s.q = T.q; save(FILE, 's', '-v7')",
)
_COMPRESSED = 15  # type of an element that is compressed
_MATRIX = 14
_HEADER = 128  # [bytes]
_MOST_UNPACKED = 1 << 33  # [bytes] a recording of a day at 10 kHz with ten signals fits
_DEEPEST = 20  # levels of structs and cells
_MOST_ELEMENTS = 2000  # of a struct array or a cell array that are listed


def read(path: Path, options: TextOptions, wanted: Sequence[Source]) -> Table:
    """Read the variables.

    Raises:
        ImportingError: not a readable file, or one of version 7.3.
    """
    from scipy.io import loadmat  # slow to import, and only this needs it

    table = Table(path)
    with path.open("rb") as file:
        head = file.read(512)
    if head.startswith(b"MATLAB 7.3") or head[512 - 8 :].startswith(b"\x89HDF") or head.startswith(b"\x89HDF"):
        what = "is a MATLAB 7.3 file (HDF5), which is not read"
        raise ImportingError(path, what, "save it in MATLAB with save(FILE, '-v7') and import that")
    try:
        _check_sizes(path, head)
        content: Mapping[str, Any] = loadmat(str(path), squeeze_me=True, struct_as_record=False)
        for name, value in content.items():
            if not name.startswith("__"):
                _add(table, name, value, 0)
    except ImportingError:
        raise
    except Exception as error:  # scipy raises many kinds, down to zlib's
        raise ImportingError(path, f"is not a readable .mat file ({one_line(error)})", _RESAVE) from error
    if "None" in content and "__function_workspace__" in content:
        table.unusable.pop("None", None)
    return table


def _add(table: Table, name: str, value: Any, depth: int) -> None:
    """Take a variable, and what it holds by its dotted names."""
    names = getattr(value, "_fieldnames", None)
    kind = type(value).__name__
    if depth > _DEEPEST:
        table.unusable[name] = ("is nested too deeply", "export the signals as arrays")
    elif names is not None:
        for inner in names:
            _add(table, f"{name}.{inner}", getattr(value, inner), depth + 1)
    elif kind in {"MatlabOpaque", "MatlabObject", "MatlabFunction"}:
        # scipy gives an object the name "None" or that of its variable.
        table.unusable[_owner(name, value)] = _OBJECT
    elif hasattr(value, "toarray"):
        table.add(name, value.toarray())
    elif isinstance(value, np.ndarray) and value.dtype.kind == "O":
        if value.size and all(np.ndim(element) == 0 and np.isreal(element) for element in value.flat) and not any(
            hasattr(element, "_fieldnames") for element in value.flat
        ):
            table.add(name, value.astype(np.float64))  # a cell array of numbers
            return
        for index in list(np.ndindex(value.shape))[:_MOST_ELEMENTS]:
            _add(table, name + "".join(f"[{k}]" for k in index), value[index], depth + 1)
    else:
        table.add(name, value)


def _owner(name: str, value: Any) -> str:
    """Name of the variable that an opaque object is."""
    try:
        found = value["s0"] if value.dtype.names else None
        text = bytes(np.ravel(found)[0]).decode() if found is not None else name
    except (IndexError, TypeError, ValueError, UnicodeDecodeError):
        text = name
    return text if text and text.isidentifier() else name


def _check_sizes(path: Path, head: bytes) -> None:
    """Refuse a file of version 5 to 7 whose elements claim more than the file holds or memory can.

    Source: MAT-File Format (MathWorks), chapter 1: an element is a tag of its type and its number of bytes, and its data.
    """
    if len(head) < _HEADER + 8 or head[126:128] not in {b"IM", b"MI"}:
        return  # version 4, which states its sizes array by array and reads no more than there is
    order = "<" if head[126:128] == b"IM" else ">"
    size = path.stat().st_size
    with path.open("rb") as file:
        at = _HEADER
        while at + 8 <= size:
            file.seek(at)
            kind, length = struct.unpack(f"{order}II", file.read(8))
            if kind not in {_COMPRESSED, _MATRIX} or length > size - at - 8:
                raise ImportingError(path, f"is damaged at byte {at}: what it holds there doesn't fit the file", _RESAVE)
            data = file.read(length)
            if kind == _COMPRESSED:
                start = _unpacked(path, data)
            else:
                start = data[:256]
            _check_dimensions(path, start, order, kind == _COMPRESSED, length)
            at += 8 + length


def _unpacked(path: Path, data: bytes) -> bytes:
    """The start of a compressed element, after its whole size was counted."""
    unpack = zlib.decompressobj()
    start, total = b"", 0
    block = data
    while block and not unpack.eof:
        part = unpack.decompress(block, 1 << 24)
        start = start or part[:256]
        total += len(part)
        if total > _MOST_UNPACKED:
            raise ImportingError(path, f"unpacks to more than {_MOST_UNPACKED >> 30} GiB", "save fewer signals")
        block = unpack.unconsumed_tail
        if not part and not block:
            break
    return start


def _check_dimensions(path: Path, start: bytes, order: str, tagged: bool, length: int) -> None:
    """The dimensions that an array states must be those of data that are there."""
    body = start[8:] if tagged else start
    if tagged and len(start) >= 8:
        length = struct.unpack(f"{order}I", start[4:8])[0]
    if len(body) < 32:
        return
    count = struct.unpack(f"{order}I", body[20:24])[0] // 4
    if count > (len(body) - 24) // 4:
        raise ImportingError(path, f"is damaged: an array has {count} dimensions", _RESAVE)
    elements = 1
    for extent in struct.unpack(f"{order}{count}i", body[24 : 24 + 4 * count]):
        elements *= max(extent, 0)
    # An element takes at least one byte where it is a number, and a tag of eight where it is a cell; sparse arrays state their
    # own number of entries.
    if elements > max(length, 8) and body[8] != 5:
        raise ImportingError(path, f"is damaged: an array of {elements} elements in {length} bytes", _RESAVE)


IMPORTER = Importer("mat", (".mat",), read)
