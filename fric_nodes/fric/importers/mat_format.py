"""The values of a MATLAB file of version 4 to 7, read so that a damaged file can't do harm.

Source: MAT-File Format (MathWorks, R2022b), "Level 5 MAT-File Format" and "Level 4 MAT-File Format". A file of level 5 is a
    header of
128 bytes and elements, each a tag of type and length and its data, padded to eight bytes; an array is an element that holds
others: flags, dimensions, name, and then numbers, cells, or the fields of structs. A file of level 4 is a sequence of
matrices, each with a header of five integers.

Every length is held against what is there before anything is read or reserved; nothing is trusted that the file says of itself.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Cells", "MatError", "Opaque", "Structs", "Text", "values_of"]

_HEADER = 128  # [bytes]
_MOST_UNPACKED = 1 << 33  # [bytes] a recording of a day at 10 kHz with ten signals
_BLOCK = 1 << 24  # [bytes] that are unpacked at a time
_DEEPEST = 20  # levels of structs and cells
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT, _CHARACTERS, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_NUMERIC = range(6, 16)  # classes of numbers
_COMPLEX = 0x0800


class MatError(Exception):
    """A file that isn't as the format says."""


@dataclass(frozen=True)
class Text:
    """Characters; no signal."""


@dataclass(frozen=True)
class Opaque:
    """An object that only MATLAB reads, of this class."""

    kind: str


@dataclass(frozen=True)
class Cells:
    """A cell array: its dimensions and its values, in MATLAB's order (first index fastest)."""

    shape: tuple[int, ...]
    values: list[Any]


@dataclass(frozen=True)
class Structs:
    """A struct, or an array of them: dimensions and the fields of each, in MATLAB's order."""

    shape: tuple[int, ...]
    values: list[dict[str, Any]]


def values_of(content: bytes) -> Iterator[tuple[str, Any]]:
    """Names and values of the variables: arrays of numbers, or one of the classes above.

    Raises:
        MatError: damaged, or no such file.
    """
    if len(content) < 8:
        raise MatError("it is too short")
    if 0 in content[:4] or len(content) < _HEADER:
        yield from _level_4(content)
        return
    mark = content[126:128]
    if mark not in {b"IM", b"MI"}:
        raise MatError("its header is none of a MATLAB file")
    reader = _Level5("<" if mark == b"IM" else ">")
    rest = memoryview(content)[_HEADER:]
    while len(rest) >= 8:
        kind, data, rest = reader.element(rest)
        if kind == _COMPRESSED:
            kind, data, _ = reader.element(memoryview(reader.unpacked(data)))
        if kind != _MATRIX:
            raise MatError(f"an element of type {kind} stands where a variable belongs")
        name, value = reader.matrix(data, 0)
        if name:  # what MATLAB keeps for its objects has no name
            yield name, value
    if bytes(rest).strip(b"\0"):
        raise MatError("it ends in the middle of a variable")


class _Level5:
    """Reads elements in one order of bytes."""

    def __init__(self, order: str) -> None:
        self.order = order
        self.total = 0

    def element(self, data: memoryview) -> tuple[int, memoryview, memoryview]:
        """Type and data of the first element, and what follows."""
        if len(data) < 8:
            raise MatError("it ends in the middle of an element")
        kind, size = struct.unpack(f"{self.order}II", data[:8])
        if kind >> 16:  # four bytes or less stand within the tag
            kind, size = kind & 0xFFFF, kind >> 16
            if size > 4:
                raise MatError("a short element is longer than four bytes")
            return kind, data[4 : 4 + size], data[8:]
        if size > len(data) - 8:
            raise MatError(f"an element of {size} bytes has only {len(data) - 8}")
        end = 8 + size if kind == _COMPRESSED else 8 + size + -size % 8
        return kind, data[8 : 8 + size], data[end:]

    def unpacked(self, data: memoryview) -> bytes:
        """The element that a compressed one holds."""
        unpack = zlib.decompressobj()
        parts: list[bytes] = []
        block: bytes | memoryview = data
        try:
            while not unpack.eof:
                part = unpack.decompress(block, _BLOCK)
                block = unpack.unconsumed_tail
                if not part and not block:
                    break
                parts.append(part)
                self.total += len(part)
                if self.total > _MOST_UNPACKED:
                    raise MatError(f"it unpacks to more than {_MOST_UNPACKED >> 30} GiB")
        except zlib.error as error:
            raise MatError(f"a compressed variable doesn't unpack: {error}") from error
        if not unpack.eof:
            raise MatError("a compressed variable ends too early")
        return b"".join(parts)

    def numbers(self, data: memoryview) -> tuple[NDArray[Any], memoryview]:
        """The numbers of the first element, and what follows."""
        kind, body, rest = self.element(data)
        if kind not in _NUMBERS:
            raise MatError(f"an element of type {kind} stands where numbers belong")
        dtype = np.dtype(self.order + _NUMBERS[kind])
        if len(body) % dtype.itemsize:
            raise MatError("an element ends in the middle of a number")
        return np.frombuffer(body, dtype=dtype), rest

    def text(self, data: memoryview) -> tuple[str, memoryview]:
        """The characters of the first element, and what follows."""
        _, body, rest = self.element(data)
        return bytes(body).rstrip(b"\0").decode("utf-8", errors="replace"), rest

    def matrix(self, data: memoryview, depth: int) -> tuple[str, Any]:
        """Name and value of an array."""
        if depth > _DEEPEST:
            raise MatError(f"it nests more than {_DEEPEST} structs or cells")
        if not len(data):
            return "", np.empty(0)  # how an empty cell or field is written
        flags, rest = self.numbers(data)
        if flags.size < 1:
            raise MatError("an array has no flags")
        kind = int(flags[0]) & 0xFF
        if kind == _OPAQUE:
            name, rest = self.text(rest)
            _, rest = self.text(rest)
            return name, Opaque(self.text(rest)[0])
        extents, rest = self.numbers(rest)
        shape = tuple(int(extent) for extent in extents)
        if len(shape) < 2 or min(shape) < 0:
            raise MatError(f"an array has the dimensions {list(shape)[:9]}")
        name, rest = self.text(rest)
        if kind in _NUMERIC:
            return name, self._numeric(rest, shape, bool(int(flags[0]) & _COMPLEX))
        if kind == _CHARACTERS:
            return name, Text()
        if kind == _SPARSE:
            return name, Opaque("sparse")
        if kind == _FUNCTION:
            return name, Opaque("function")
        if kind == _CELL:
            return name, self._cells(rest, shape, depth)
        if kind in {_STRUCT, _OBJECT}:
            return name, self._structs(rest, shape, kind == _OBJECT, depth)
        raise MatError(f"an array of the unknown class {kind}")

    def _numeric(self, data: memoryview, shape: tuple[int, ...], pair: bool) -> NDArray[Any]:
        values, rest = self.numbers(data)
        if values.size != _count(shape):
            raise MatError(f"an array of {_count(shape)} numbers holds {values.size}")
        if pair:
            imaginary, _ = self.numbers(rest)
            if imaginary.size != values.size:
                raise MatError("an array has more real parts than imaginary ones, or fewer")
            values = values + 1j * imaginary
        return values.reshape(shape, order="F")

    def _inner(self, data: memoryview, count: int, depth: int) -> Iterator[Any]:
        """The values of this many arrays one after the other."""
        if 8 * count > len(data):
            raise MatError(f"{count} values in {len(data)} bytes")
        rest = data
        for _ in range(count):
            kind, body, rest = self.element(rest)
            if kind != _MATRIX:
                raise MatError(f"an element of type {kind} stands where an array belongs")
            yield self.matrix(body, depth + 1)[1]

    def _cells(self, data: memoryview, shape: tuple[int, ...], depth: int) -> Cells:
        return Cells(shape, list(self._inner(data, _count(shape), depth)))

    def _structs(self, data: memoryview, shape: tuple[int, ...], named: bool, depth: int) -> Structs | Opaque:
        if named:
            return Opaque(self.text(data)[0])
        lengths, rest = self.numbers(data)
        _, body, rest = self.element(rest)
        width = int(lengths[0]) if lengths.size else 0
        if not 0 < width <= max(len(body), 1):
            raise MatError("a struct has no names of fields")
        names = [
            bytes(body[at : at + width]).split(b"\0")[0].decode("utf-8", errors="replace") for at in range(0, len(body), width)
        ]
        count = _count(shape)
        if not names:
            return Structs(shape, [])
        values = self._inner(rest, count * len(names), depth)
        return Structs(shape, [{name: next(values) for name in names} for _ in range(count)])


def _count(shape: tuple[int, ...]) -> int:
    count = 1
    for extent in shape:
        count *= extent
    return count


_LEVEL_4 = ("f8", "f4", "i4", "i2", "u2", "u1")


def _level_4(content: bytes) -> Iterator[tuple[str, Any]]:
    at = 0
    while at + 20 <= len(content):
        order = "<" if struct.unpack_from("<i", content, at)[0] in range(5000) else ">"
        kind, rows, columns, imaginary, length = struct.unpack_from(f"{order}5i", content, at)
        precision, form = kind // 10 % 10, kind % 10
        if not 0 <= kind < 5000 or precision >= len(_LEVEL_4) or form > 2 or min(rows, columns) < 0 or length < 1:
            raise MatError("its header is none of a MATLAB file")
        dtype = np.dtype(order + _LEVEL_4[precision])
        size = rows * columns * dtype.itemsize
        start = at + 20 + length
        end = start + size * (2 if imaginary else 1)
        if end > len(content):
            raise MatError(f"a matrix of {rows} x {columns} numbers ends too early")
        name = content[at + 20 : start].split(b"\0")[0].decode("latin-1")
        values = np.frombuffer(content, dtype, rows * columns, start).reshape((rows, columns), order="F")
        yield name, Text() if form == 1 else Opaque("sparse") if form == 2 else values.astype(complex) if imaginary else values
        at = end
    if at == 0 or content[at:].strip(b"\0"):
        raise MatError("it ends in the middle of a matrix")
