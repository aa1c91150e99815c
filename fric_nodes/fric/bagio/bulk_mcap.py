"""All messages of some topics of an MCAP file at once, by its index.

The index at the end of the file says which blocks hold which topics, and behind each block stands where in it the messages of
each topic begin: tables of numbers, which are taken as they are. Block by block the messages are then gathered without looking
at each. Layout of the records: MCAP version 0 specification.

What the index says is verified, not believed: the block's checksum, and at each place a message of that topic and time that
ends within its block. A file in which anything differs is left to the reader that takes one message after the other, and says
what is wrong.
"""

from __future__ import annotations

import mmap
import struct
from binascii import crc32
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .blocks import UNPACK_ERRORS, unpacked
from .recover_mcap import MAGIC
from .rows import Rows

__all__ = ["Gathered", "gathered"]

_FOOTER, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _CHUNK_INDEX = 0x02, 0x04, 0x05, 0x06, 0x07, 0x08
_HEAD = 9  # bytes of a record before its content: opcode and length
_FIXED = 22  # bytes of a message before its data: channel, number, times of reception and of sending
_FOOTER_SIZE = 20
_LATEST = 1 << 63  # [ns] since 1970; times are signed numbers everywhere else


class Gathered(NamedTuple):
    """Messages of one topic: times of reception [ns], shape ``(n,)``, and the messages, block by block."""

    log_ns: NDArray[np.int64]
    data: Rows


class _Block(NamedTuple):
    """Where a block is, when it was written [ns], and where the index of its messages is, by the number of their channel."""

    start: int
    length: int
    first_ns: int
    last_ns: int
    indexes: dict[int, int]


class _Odd(Exception):
    """The file isn't as its index says."""


def gathered(path: Path, topics: Collection[str], window: tuple[int, int] | None) -> dict[str, Gathered] | None:
    """The messages of ``topics`` by their name; None where the file has no index that holds.

    Args:
        path: of the file.
        topics: their names.
        window: times of reception [ns] from which, and before which, messages are taken; None: all.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        try:
            channels, blocks = _index(content)
            wanted = {number: topic for number, topic in channels.items() if topic in topics}
            found: dict[str, list[Gathered]] = {topic: [] for topic in topics}
            for block in blocks:
                there = wanted.keys() & block.indexes.keys()
                if there and (window is None or (block.first_ns < window[1] and block.last_ns >= window[0])):
                    for number, part in _of_block(content, block, there, window):
                        found[wanted[number]].append(part)
        except (_Odd, struct.error, IndexError, OverflowError, *UNPACK_ERRORS):
            return None
    none = np.zeros(0, dtype=np.int64)
    return {
        topic: Gathered(np.concatenate([none, *(part.log_ns for part in parts)]), Rows.joined(part.data for part in parts))
        for topic, parts in found.items()
    }


def _index(content: mmap.mmap) -> tuple[dict[int, str], list[_Block]]:
    """Topics by the number of their channel, and all blocks in the order of the file."""
    end = len(content) - len(MAGIC)
    at = end - _HEAD - _FOOTER_SIZE
    if at < len(MAGIC) or content[end:] != MAGIC or content[at] != _FOOTER:
        raise _Odd
    (summary,) = struct.unpack_from("<Q", content, at + _HEAD)
    if not len(MAGIC) <= summary < at:
        raise _Odd
    channels: dict[int, str] = {}
    blocks = []
    place = summary
    while place + _HEAD <= at:
        opcode, size = struct.unpack_from("<BQ", content, place)
        record = content[place + _HEAD : place + _HEAD + size]
        if opcode == _CHANNEL:
            (number,), (length,) = struct.unpack_from("<H", record), struct.unpack_from("<I", record, 4)
            channels[number] = record[8 : 8 + length].decode("utf-8", errors="replace")
        elif opcode == _CHUNK_INDEX:
            first_ns, last_ns, start, length, held = struct.unpack_from("<QQQQI", record)
            pairs = np.frombuffer(record, dtype=[("channel", "<u2"), ("at", "<u8")], count=held // 10, offset=36)
            indexes = dict(zip(pairs["channel"].tolist(), pairs["at"].tolist(), strict=True))
            blocks.append(_Block(start, length, first_ns, last_ns, indexes))
        place += _HEAD + size
    if not blocks or len(set(channels.values())) < len(channels):
        raise _Odd  # messages outside of blocks, or two channels of one topic: their order is the other reader's
    return channels, sorted(blocks, key=lambda block: block.start)


def _of_block(
    content: mmap.mmap, block: _Block, numbers: Collection[int], window: tuple[int, int] | None
) -> Iterator[tuple[int, Gathered]]:
    """The messages of the channels ``numbers`` in one block."""
    opcode, size = struct.unpack_from("<BQ", content, block.start)
    if opcode != _CHUNK or size + _HEAD != block.length:
        raise _Odd
    record = content[block.start + _HEAD : block.start + block.length]
    full, crc, name = struct.unpack_from("<QII", record, 16)
    packed = record[32 + name + 8 :]
    data = unpacked(packed, record[32 : 32 + name].decode(), full)
    if len(data) != full or (crc and crc32(data) != crc):
        raise _Odd
    bytes_of = np.frombuffer(data, dtype=np.uint8)
    for number in numbers:
        times, starts = _message_index(content, block.indexes[number], number)
        if window is not None:
            inside = (times >= window[0]) & (times < window[1])
            times, starts = times[inside], starts[inside]
        yield number, Gathered(times, _verified(bytes_of, number, times, starts))


def _message_index(content: mmap.mmap, at: int, number: int) -> tuple[NDArray[np.int64], NDArray[np.intp]]:
    """Times of reception [ns] and places of the messages of a channel in its block."""
    opcode, _, channel, size = struct.unpack_from("<BQHI", content, at)
    if opcode != _MESSAGE_INDEX or channel != number:
        raise _Odd
    pairs = np.frombuffer(content[at + _HEAD + 6 : at + _HEAD + 6 + size], dtype="<u8").reshape(-1, 2)
    if pairs.shape[0] * 16 != size or np.any(pairs >= _LATEST):
        raise _Odd
    return pairs[:, 0].astype(np.int64), pairs[:, 1].astype(np.intp)


def _verified(data: NDArray[np.uint8], number: int, times: NDArray[np.int64], starts: NDArray[np.intp]) -> Rows:
    """The messages that begin at ``starts``, each of the channel ``number`` and of its time."""
    if starts.size == 0:
        return Rows(data[:0], starts, starts)
    if int(np.max(starts)) + _HEAD + _FIXED > data.shape[0]:
        raise _Odd
    heads = data[starts[:, None] + np.arange(_HEAD + _FIXED)]
    sizes = np.ascontiguousarray(heads[:, 1:9]).view("<u8")[:, 0]
    channels = np.ascontiguousarray(heads[:, 9:11]).view("<u2")[:, 0]
    received = np.ascontiguousarray(heads[:, 15:23]).view("<u8")[:, 0]
    if np.any(sizes > data.shape[0]) or np.any(sizes < _FIXED):
        raise _Odd
    lengths = sizes.astype(np.intp) - _FIXED
    begin = starts + _HEAD + _FIXED
    if np.any(heads[:, 0] != _MESSAGE) or np.any(channels != number) or np.any(received != times.astype(np.uint64)):
        raise _Odd
    if np.any(begin + lengths > data.shape[0]):
        raise _Odd
    return Rows(data, begin, lengths)
