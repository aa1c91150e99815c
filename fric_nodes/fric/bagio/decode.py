"""Bulk decoding of CDR messages into arrays.

A recording holds tens of thousands of messages of one type whose variable parts (names, frame ids, lengths of lists) almost
never change. So messages of equal length are joined into one table of bytes, one row per message; the offsets of all fields
are found once, on the first row; and a column of the table is then a field. That the offsets hold for every row is verified,
not assumed: all bytes that decide about offsets (list lengths, string lengths) and all strings must be equal over the rows.
Rows where they differ are decoded with a layout of their own.

CDR here is the plain encoding of ROS 2 (OMG DDSI-RTPS, XCDR version 1): four bytes of encapsulation header, whose second byte
says little (1) or big endian (0), then the fields in order, each aligned to its own size counted from the end of the header.
Messages of ROS 1 have neither header nor alignment, are little endian, and their strings do not end in a zero.

Lengths come from the file: a list can't have more members than its message has bytes, whatever it says, and types that contain
themselves are refused.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Typesdict

from .rows import Rows

__all__ = ["Block", "DecodeError", "decode", "layout_of"]

_MANY_LAYOUTS = 64  # above this many layouts of one length, messages are decoded one by one
_HEADER = 4  # bytes of encapsulation before the payload
_DEEPEST = 32  # levels of types within types; those of ROS have four or five
_MOST_FIELDS = 100_000  # of a message: above it the table of its fields outgrows the message by far
_SCALARS = {
    "bool": "u1",
    "byte": "u1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}


class DecodeError(Exception):
    """A message that is not a valid encoding of its type; ``row`` is its index among the messages given."""

    def __init__(self, problem: str, row: int = 0) -> None:
        self.row = row
        super().__init__(problem)


class _Column(NamedTuple):
    """Where a numeric field lies in a message: first byte, number of values (None: a scalar), numpy type."""

    offset: int
    size: int | None
    dtype: str


@dataclass
class _Layout:
    """Offsets of the fields of one message; ``fixed`` are the byte ranges that must not change for the offsets to hold."""

    columns: dict[str, _Column] = field(default_factory=dict)
    strings: dict[str, Any] = field(default_factory=dict)
    fixed: list[tuple[int, int]] = field(default_factory=list)
    end: int = 0


class Block(NamedTuple):
    """Messages that share one layout.

    Attributes:
        rows: index of each message among those given, shape ``(n_rows,)``.
        numbers: numeric fields by dotted name (``header.stamp.sec``), shape ``(n_rows,)``, or ``(n_rows, n_values)`` for lists.
        strings: strings and lists of strings by dotted name, the same for every row.
    """

    rows: NDArray[np.intp]
    numbers: dict[str, NDArray[Any]]
    strings: dict[str, Any]


class _Walker:
    """Finds the offsets of all fields of one message."""

    def __init__(self, message: bytes, types: Typesdict, ros1: bool) -> None:
        self.message = message
        self.types = types
        self.aligned = not ros1
        self.order = "<"
        self.layout = _Layout()
        self.depth = 0
        if ros1:
            return
        if len(message) < _HEADER or message[0] != 0 or message[1] not in {0, 1}:
            raise DecodeError(f"not plain CDR (it starts with {bytes(message[:4]).hex() or 'nothing'})")
        self.order = "<" if message[1] else ">"
        self.layout.fixed.append((0, 2))
        self.layout.end = _HEADER

    def take(self, size: int, alignment: int) -> int:
        """Advance over ``size`` bytes aligned to ``alignment``; their offset."""
        at = self.layout.end + ((_HEADER - self.layout.end) % alignment if self.aligned else 0)
        if at + size > len(self.message):
            raise DecodeError(f"it ends after {len(self.message)} bytes, before all its fields")
        self.layout.end = at + size
        return at

    def length(self) -> int:
        """Read a list or string length."""
        at = self.take(4, 4)
        self.layout.fixed.append((at, at + 4))
        count = int(struct.unpack_from(self.order + "I", self.message, at)[0])
        if count > len(self.message):
            raise DecodeError(f"it ends after {len(self.message)} bytes, before all {count} members of a list")
        return count

    def string(self) -> str:
        size = self.length()
        at = self.take(size, 1)
        self.layout.fixed.append((at, at + size))
        return self.message[at : at + size].rstrip(b"\0").decode("utf-8", errors="replace")

    def values(self, name: str, base: str, count: int | None) -> None:
        """A scalar or a list of scalars (or strings)."""
        if base == "string":
            self.layout.strings[name] = self.string() if count is None else [self.string() for _ in range(count)]
            return
        if base not in _SCALARS:
            raise DecodeError(f"field '{name}' has the type {base}, which cannot be decoded")
        dtype = np.dtype(_SCALARS[base])
        at = self.take(dtype.itemsize * (1 if count is None else count), dtype.itemsize) if count != 0 else self.layout.end
        self.layout.columns[name] = _Column(at, count, self.order + _SCALARS[base])

    def structure(self, msgtype: str, prefix: str) -> None:
        if msgtype not in self.types:
            raise DecodeError(f"message type {msgtype} is not defined")
        if self.depth >= _DEEPEST or len(self.layout.columns) > _MOST_FIELDS:
            raise DecodeError(f"message type {msgtype} contains itself, or too many others")
        self.depth += 1
        for name, description in self.types[msgtype][1]:
            self.one(prefix + name, description)
        self.depth -= 1

    def one(self, name: str, description: Any) -> None:
        """A field as rosbags describes it."""
        kind, rest = description
        if kind == Nodetype.BASE:
            self.values(name, rest[0], None)
        elif kind == Nodetype.NAME:
            self.structure(rest, name + ".")
        else:
            (inner, base), count = rest
            count = self.length() if kind == Nodetype.SEQUENCE else count
            if inner == Nodetype.BASE:
                self.values(name, base[0], count)
            else:
                if count > len(self.message):
                    raise DecodeError(f"it ends after {len(self.message)} bytes, before all {count} members of '{name}'")
                for index in range(count):
                    self.structure(base, f"{name}.{index}.")


def layout_of(message: bytes, msgtype: str, types: Typesdict, encoding: str = "cdr") -> _Layout:
    """Where the fields of ``message`` lie.

    Args:
        message: as recorded.
        msgtype: its type.
        types: fields of that type and of those it refers to.
        encoding: ``cdr`` or ``ros1``.

    Raises:
        DecodeError: the message doesn't fit its type.
    """
    walker = _Walker(message, types, encoding == "ros1")
    walker.structure(msgtype, "")
    # Up to three bytes of padding may follow in CDR; more means that the type is not the one that was written.
    if len(message) - walker.layout.end > (3 if walker.aligned else 0):
        raise DecodeError(f"it has {len(message) - walker.layout.end} bytes more than its fields")
    return walker.layout


def _columns(table: NDArray[np.uint8], layout: _Layout) -> dict[str, NDArray[Any]]:
    numbers: dict[str, NDArray[Any]] = {}
    for name, (offset, count, dtype) in layout.columns.items():
        size = np.dtype(dtype).itemsize * (1 if count is None else count)
        values = np.ascontiguousarray(table[:, offset : offset + size]).view(dtype) if size else np.empty((len(table), 0))
        values = values.astype(values.dtype.newbyteorder("="), copy=False)
        numbers[name] = values[:, 0] if count is None else values
    return numbers


def decode(messages: Sequence[bytes], msgtype: str, types: Typesdict, encoding: str = "cdr") -> list[Block]:
    """Decode messages of one type.

    Args:
        messages: as recorded.
        msgtype: their type, such as ``sensor_msgs/msg/JointState``.
        types: fields of that type and of those it refers to, see :func:`fric.bagio.types.type_fields`.
        encoding: ``cdr`` or ``ros1``.

    Returns:
        Blocks that together hold every message once, rows ascending within each block.

    Raises:
        DecodeError: a message does not fit its type.
    """
    held = Rows.of(messages)
    blocks: list[Block] = []
    for length in np.unique(held.lengths):
        rows = np.flatnonzero(held.lengths == length)
        blocks += _split(rows, held.table(rows), msgtype, types, encoding)
    return blocks


def _split(rows: NDArray[np.intp], table: NDArray[np.uint8], msgtype: str, types: Typesdict, encoding: str) -> list[Block]:
    """Blocks of messages of one length, ``table`` holding one message per row."""
    blocks: list[Block] = []
    while rows.size:
        try:
            layout = layout_of(table[0].tobytes(), msgtype, types, encoding)
        except DecodeError as error:
            raise DecodeError(str(error), int(rows[0])) from None
        if len(blocks) < _MANY_LAYOUTS:
            fixed = np.concatenate([np.arange(start, stop) for start, stop in ((0, 0), *layout.fixed)])
            alike = (table[:, fixed] == table[0, fixed]).all(axis=1)
        else:
            # Strings that change from message to message: comparing all the rest each time would cost its square.
            blocks.append(Block(rows[:1], _columns(table[:1], layout), layout.strings))
            rows, table = rows[1:], table[1:]
            continue
        blocks.append(Block(rows[alike], _columns(table[alike], layout), layout.strings))
        rows, table = rows[~alike], table[~alike]
    return blocks
