"""Erasing the padding of CDR messages, so that equal messages are equal bytes.

Fields are aligned to their own size, and the bytes skipped for that are whatever happened to be in the sender's buffer: the
same joint state, published twice, may give different bytes. They mean nothing, but whoever compares two recordings, or looks
for retransmissions, would see differences. Here they become zero.
"""

from __future__ import annotations

import numpy as np
from rosbags.interfaces.typing import Typesdict

from .decode import DecodeError, layout_of

__all__ = ["PaddingEraser"]

_HEADER = 4  # bytes of encapsulation, left as they are
_LAYOUTS_KEPT = 16  # per message type; most topics have one, texts that change have as many as messages


class PaddingEraser:
    """Erases the padding of messages of one type.

    Args:
        msgtype: such as ``sensor_msgs/msg/JointState``.
        types: fields of that type and of those it refers to, see :func:`fric.bagio.types.type_fields`.
    """

    def __init__(self, msgtype: str, types: Typesdict) -> None:
        self._msgtype = msgtype
        self._types = types
        # Whether a message has a known layout is one comparison when its bytes are taken as one large number: the bytes that
        # decide about offsets, masked, are those of the layout. Erasing is then one masking more, 0.5 us in all.
        self._masks: dict[tuple[int, int, int], int] = {}

    def __call__(self, message: bytes) -> bytes:
        """The message with zeros for its padding; as it is when it does not fit its type."""
        number = int.from_bytes(message, "little")
        size = len(message)
        for (length, deciding, decided), kept in self._masks.items():
            if length == size and number & deciding == decided:
                return (number & kept).to_bytes(size, "little")
        try:
            deciding, kept = self._derive(message)
        except DecodeError:
            return message
        if len(self._masks) >= _LAYOUTS_KEPT:
            self._masks.pop(next(iter(self._masks)))
        self._masks[size, deciding, number & deciding] = kept
        return (number & kept).to_bytes(size, "little")

    def _derive(self, message: bytes) -> tuple[int, int]:
        """Masks of the bytes that decide about the layout, and of those that are not padding."""
        layout = layout_of(message, self._msgtype, self._types)
        deciding = np.zeros(len(message), dtype=np.uint8)
        kept = np.zeros(len(message), dtype=np.uint8)
        kept[:_HEADER] = 0xFF
        for start, stop in layout.fixed:
            deciding[start:stop] = kept[start:stop] = 0xFF
        for offset, count, dtype in layout.columns.values():
            kept[offset : offset + np.dtype(dtype).itemsize * (1 if count is None else count)] = 0xFF
        return int.from_bytes(deciding.tobytes(), "little"), int.from_bytes(kept.tobytes(), "little")
