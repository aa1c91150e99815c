"""Compressed blocks of recordings, unpacked up to the size that they declare and no further.

A size comes from the file. What is damaged, or made to do harm, may declare more than there is memory, or unpack to more than
it declares; neither is followed.
"""

from __future__ import annotations

import sys
from bz2 import BZ2Decompressor

from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

__all__ = ["LARGEST", "UNPACK_ERRORS", "unpacked"]

# Bytes of one block or message, unpacked. ROS 1 and 2 make blocks of about 1 MiB, and a block is kept in memory as a whole.
LARGEST = 1 << 30
UNPACK_ERRORS = (ValueError, RuntimeError, EOFError, OSError, MemoryError, zstd.ZstdError)


def unpacked(data: bytes, compression: str, size: int = LARGEST) -> bytes:
    """Content of a block, or as much of it as its first bytes give; one byte more than ``size`` where it holds more than that.

    Args:
        data: of the block.
        compression: ``zstd``, ``lz4``, ``bz2``, or ``none``, which may be empty.
        size: of the content, as declared [byte].

    Raises:
        ValueError: a compression that is not known, or a size that no recorder writes.
        RuntimeError, EOFError, OSError, MemoryError, ZstdError: the data are not what the compression makes; all of them, and
            nothing else, are in ``UNPACK_ERRORS``.
    """
    if size > LARGEST:
        raise ValueError(f"a block of {size} bytes")
    if compression in {"", "none"}:
        return data
    if compression == "zstd":
        return bytes(zstd.ZstdDecompressor().decompress(data, max_length=size + 1))
    if compression == "lz4":
        return bytes(LZ4FrameDecompressor().decompress(data, max_length=size + 1))
    if compression == "bz2":
        return BZ2Decompressor().decompress(data, max_length=size + 1)
    raise ValueError(f"compression {compression!r} is not known")
