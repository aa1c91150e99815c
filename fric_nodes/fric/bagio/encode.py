"""Bulk encoding of the messages that fric writes itself: tables of bytes, one row per message (see :mod:`.decode`)."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from ..record import Array
from .checks import Stamps

__all__ = ["float64_messages", "joint_state_messages", "reference_messages", "stamped_force_messages"]

_ENCAPSULATION = b"\x00\x01\x00\x00"  # plain CDR, little endian


class _Table:
    """Messages of one layout that grow field by field, little endian, each field aligned to its size."""

    def __init__(self, n_messages: int) -> None:
        self.n_messages = n_messages
        self.parts: list[NDArray[np.uint8]] = []
        self.size = 0  # without encapsulation

    def raw(self, content: bytes, alignment: int = 1) -> None:
        """The same bytes in every message."""
        content = bytes(-self.size % alignment) + content
        row = np.frombuffer(content, dtype=np.uint8)
        self.parts.append(np.broadcast_to(row, (self.n_messages, row.size)))
        self.size += row.size

    def length(self, count: int) -> None:
        self.raw(struct.pack("<I", count), 4)

    def string(self, text: str) -> None:
        encoded = text.encode() + b"\0"
        self.length(len(encoded))
        self.raw(encoded)

    def numbers(self, values: NDArray[np.float64] | NDArray[np.int32] | NDArray[np.uint32]) -> None:
        """One number per message."""
        self.raw(b"", values.dtype.itemsize)
        column = np.ascontiguousarray(values.astype(values.dtype.newbyteorder("<"))).view(np.uint8)
        self.parts.append(column.reshape(self.n_messages, values.dtype.itemsize))
        self.size += values.dtype.itemsize

    def header(self, stamp_ns: Stamps, frame_id: str = "") -> None:
        self.numbers((stamp_ns // 1_000_000_000).astype(np.int32))
        self.numbers((stamp_ns % 1_000_000_000).astype(np.uint32))
        self.string(frame_id)

    def messages(self) -> list[bytes]:
        head = np.broadcast_to(np.frombuffer(_ENCAPSULATION, dtype=np.uint8), (self.n_messages, 4))
        table = np.concatenate([head, *self.parts], axis=1)
        data, width = table.tobytes(), table.shape[1]
        return [data[at : at + width] for at in range(0, len(data), width)]


def joint_state_messages(
    stamp_ns: Stamps, joint: str, position: Array, velocity: Array | None, effort: Array | None
) -> list[bytes]:
    """``sensor_msgs/msg/JointState`` of one joint; all arrays of shape ``(n_messages,)``."""
    table = _Table(stamp_ns.size)
    table.header(stamp_ns)
    table.length(1)
    table.string(joint)
    for values in (position, velocity, effort):
        table.length(0 if values is None else 1)
        if values is not None:
            table.numbers(values)
    return table.messages()


def reference_messages(stamp_ns: Stamps, joint: str, position: Array, velocity: Array, acceleration: Array) -> list[bytes]:
    """``fric_interfaces/msg/Reference``; all arrays of shape ``(n_messages,)``."""
    table = _Table(stamp_ns.size)
    table.header(stamp_ns, joint)
    for values in (position, velocity, acceleration):
        table.numbers(values)
    return table.messages()


def stamped_force_messages(stamp_ns: Stamps, joint: str, force: Array) -> list[bytes]:
    """``fric_interfaces/msg/StampedForce``; all arrays of shape ``(n_messages,)``."""
    table = _Table(stamp_ns.size)
    table.header(stamp_ns, joint)
    table.numbers(force)
    return table.messages()


def float64_messages(values: Array) -> list[bytes]:
    """``std_msgs/msg/Float64`` from values of shape ``(n_messages,)``."""
    table = _Table(values.size)
    table.numbers(values)
    return table.messages()
