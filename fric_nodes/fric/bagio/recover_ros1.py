"""Reading a ROS 1 bag record by record, up to the last one that is complete.

A recorder that was killed leaves a bag without index (``.bag.active``); how a file is passed over without one: :mod:`.scan`.
Layout of the file, bag format version 2.0: the line ``#ROSBAG V2.0``, then
records of header and data, each with its length before it (four bytes, little endian); a header is a list of fields
``name=value``, again with their lengths. Chunks hold further records, compressed by bz2 or lz4 or not at all.
"""

from __future__ import annotations

import mmap
import re
import struct
from collections.abc import Iterator

from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat

from .blocks import UNPACK_ERRORS, unpacked
from .errors import BagError
from .scan import Channel, Scan
from .topics import ros2_name

__all__ = ["Ros1Scan"]

_MESSAGE, _BAG_HEADER, _CHUNK, _CONNECTION = 2, 3, 5, 7
_INDEX = {bytes([4]), bytes([6])}  # operations of records that only say where others are
_TIME = struct.Struct("<II")
_LENGTH = struct.Struct("<I")


def _fields(header: bytes) -> dict[bytes, bytes]:
    """Fields of a record's header, by name.

    Raises:
        ValueError: a field reaches over the end, or has no name.
    """
    fields: dict[bytes, bytes] = {}
    at, end = 0, len(header)
    while at + 4 <= end:
        (size,) = _LENGTH.unpack_from(header, at)
        at += 4
        name, found, value = header[at : at + size].partition(b"=")
        if not found or at + size > end:
            raise ValueError("field without a name, or too long")
        fields[name] = value
        at += size
    return fields


def _records(content: bytes | mmap.mmap, at: int) -> Iterator[tuple[bytes, int, int, bool]]:
    """Header, first byte of the data, the byte after them, and whether they are complete, of each record from ``at`` on."""
    total = len(content)
    while at + 8 <= total:
        (head,) = _LENGTH.unpack_from(content, at)
        start = at + 4 + head + 4
        if start > total:
            yield b"", at, total, False
            return
        (size,) = _LENGTH.unpack_from(content, start - 4)
        stop = start + size
        yield content[at + 4 : at + 4 + head], start, min(stop, total), stop <= total
        at = stop


class Ros1Scan(Scan):
    """Messages of a ROS 1 bag; one of another version, or an encrypted one, is refused."""

    def _first_record(self) -> int:
        found = re.match(rb"#ROSBAG V(\d+\.\d+)\n", self._content[:32])
        if found is None:
            raise BagError(self.path, "is not a ROS 1 bag (its first line is not that of one)", "give a recorded bag")
        if found[1] != b"2.0":
            version = found[1].decode()
            raise BagError(self.path, f"is a ROS 1 bag of version {version}", "convert it to version 2.0 with 'rosbag fix'")
        return found.end()

    def _messages(self, damage: list[str]) -> Iterator[tuple[int, int, bytes]]:
        end = self._start
        for header, start, stop, complete in _records(self._content, self._start):
            end = stop
            fields = self._header(header, start, damage)
            if not complete:
                damage.append("not closed by its recorder (a record is cut off); read up to its last complete record")
                return
            if fields is None:
                continue
            operation = fields.get(b"op")
            if operation == bytes([_BAG_HEADER]):
                self._bag_header(fields, damage)
            elif operation == bytes([_CHUNK]):
                yield from self._chunk(fields, self._content[start:stop], start, damage)
            else:
                yield from self._record(fields, operation, self._content, start, stop)
        if end < len(self._content):
            damage.append("not closed by its recorder (a record is cut off); read up to its last complete record")

    def _header(self, header: bytes, at: int, damage: list[str]) -> dict[bytes, bytes] | None:
        try:
            return _fields(header)
        except ValueError:
            damage.append(f"record at byte {at} is not readable and left out")
            return None

    def _bag_header(self, fields: dict[bytes, bytes], damage: list[str]) -> None:
        if fields.get(b"encryptor"):
            raise BagError(self.path, "is encrypted", "decrypt it with the plugin that it was recorded with")
        if fields.get(b"index_pos") == bytes(8):
            damage.append("not closed by its recorder (it has no index)")

    def _chunk(self, fields: dict[bytes, bytes], data: bytes, at: int, damage: list[str]) -> Iterator[tuple[int, int, bytes]]:
        try:
            (size,) = _LENGTH.unpack(fields.get(b"size", b""))
            content = unpacked(data, fields.get(b"compression", b"").decode("ascii", errors="replace"), size)
        except (struct.error, *UNPACK_ERRORS):
            damage.append(f"block at byte {at} is not readable and left out")
            return
        if len(content) != size:
            damage.append(f"block at byte {at} is damaged (size) and left out")
            return
        end = 0
        for header, start, stop, whole in _records(content, 0):
            if not whole:
                break
            end = stop
            inner = self._header(header, at, damage)
            if inner is not None:
                yield from self._record(inner, inner.get(b"op"), content, start, stop)
        if end < len(content):
            damage.append(f"block at byte {at} is damaged: the rest of it from byte {end} on is left out")

    def _record(
        self, fields: dict[bytes, bytes], operation: bytes | None, content: bytes | mmap.mmap, start: int, stop: int
    ) -> Iterator[tuple[int, int, bytes]]:
        try:
            if operation == bytes([_MESSAGE]):
                (number,) = _LENGTH.unpack(fields.get(b"conn", b""))
                seconds, nanoseconds = _TIME.unpack(fields.get(b"time", b""))
                yield number, seconds * 1_000_000_000 + nanoseconds, content[start:stop]
            elif operation == bytes([_CONNECTION]):
                (number,) = _LENGTH.unpack(fields.get(b"conn", b""))
                inner = _fields(content[start:stop])
                texts = [inner.get(name, b"").decode("utf-8", errors="replace") for name in (b"type", b"message_definition")]
                topic = fields.get(b"topic", b"").decode("utf-8", errors="replace")
                definition = MessageDefinition(MessageDefinitionFormat.MSG, texts[1])
                self._channels[number] = Channel("/" + topic.strip("/"), ros2_name(texts[0]), definition, "ros1")
            elif operation not in _INDEX:
                self._odd += 1
        except (struct.error, ValueError):
            self._odd += 1
