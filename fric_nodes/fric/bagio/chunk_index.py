"""The index of an MCAP file that is being written, on disk instead of in memory until the file is closed.

An MCAP file ends with an entry for each of its chunks. A recorder that closes a chunk every half second would hold more of them
with every hour; the library keeps them as objects of about a kilobyte each.
"""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

__all__ = ["ChunkIndex"]

_LENGTH = struct.Struct("<I")


class ChunkIndex(list[BytesIO]):
    """Takes the place of the library's list of entries: appended to, counted, and gone through once in order.

    Args:
        folder: of the bag; the file in it has no name, and is gone with the process.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 (lives as long as the bag is written)
        self._count = 0

    def append(self, entry: BytesIO, /) -> None:
        """Put one entry on disk."""
        content = entry.getvalue()
        self._file.write(_LENGTH.pack(len(content)) + content)
        self._count += 1

    def __del__(self) -> None:
        self._file.close()  # the library's writer has no other end of its list

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[BytesIO]:
        self._file.seek(0)
        for _ in range(self._count):
            (length,) = _LENGTH.unpack(self._file.read(_LENGTH.size))
            entry = BytesIO()
            entry.write(self._file.read(length))
            yield entry
        self._file.seek(0, 2)
