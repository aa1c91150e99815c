"""Frames of the serial protocol ``fric-serial/1``: what goes over the line, byte by byte.

A frame is a body, followed by two checks, all of it encoded by consistent overhead byte stuffing (COBS) and ended by one zero
byte. COBS takes every zero out of the frame, so a receiver finds the next frame after any damage: it is what follows the next
zero. All numbers are little-endian; floats are IEEE 754.

    command, host to drive: kind u8 = 0x43 | sequence u32 | force f64                                              13 bytes
    status,  drive to host: kind u8 = 0x53 | sequence u32 | echo u32 | time u64 [us] | position f64 | velocity f32
                            | effort f32 | temperature f32 | flags u8                                              38 bytes
    checks:                 CRC-16/CCITT-FALSE of the body u16 | the same of the body in reverse order of bytes u16

Kinds have one length each, and another length is no frame. One CRC-16 passes one garbled frame in 65,536; over the bytes in
reverse order it is another function of the error but for the parity, and both together pass one in 2 * 10^9.

Sequence numbers grow by one per frame, and begin anew with the connection's first frame. A receiver takes a command only when
its number is newer than the last one's, modulo 2^32, so that a frame that was held up somewhere doesn't act late; a number that
is far off (more than 2^16 ahead or behind) begins a new sequence only after the drive has been without command for its watchdog
time, and has taken the force away.

A drive gives the force of the newest command; without one for the watchdog time it gives none (flag 2). It gives no more than
its own limit (flag 4). ``echo`` is the number of the command whose force acts. It answers each command with a status. NaN: not
measured. Flags: 1 the drive is ready, 2 watchdog, 4 force limited, 8 fault of the drive.
Source: Cheshire and Baker 1999, Consistent Overhead Byte Stuffing, IEEE/ACM Trans. Networking 7(2); CRC as in ITU-T V.41 with
the preset 0xFFFF.
"""

from __future__ import annotations

import binascii
import struct
from typing import NamedTuple

__all__ = ["FAULT", "LIMITED", "READY", "WATCHDOG", "Command", "Splitter", "Status", "newer", "pack", "unpack"]

READY, WATCHDOG, LIMITED, FAULT = 1, 2, 4, 8
_COMMAND, _STATUS = 0x43, 0x53
_COMMAND_BODY, _STATUS_BODY, _CHECKS = struct.Struct("<BId"), struct.Struct("<BIIQdfffB"), struct.Struct("<HH")
_PRESET = 0xFFFF
_LONGEST = 64  # numerical: no encoded frame is as long; what is longer is discarded up to the next zero
_WINDOW = 1 << 16  # numerical: a sequence number further ahead than this is none of the same sequence


class Command(NamedTuple):
    """A force [F] for the drive, and its number."""

    sequence: int
    force: float


class Status(NamedTuple):
    """State of the drive: number, number of the command that acts, time [us] of its clock, and what it measures in SI units."""

    sequence: int
    echo: int
    time: int
    position: float
    velocity: float
    effort: float
    temperature: float
    flags: int


def newer(sequence: int, last: int) -> bool:
    """True when ``sequence`` follows ``last`` within the window, modulo 2^32."""
    return 0 < (sequence - last) & 0xFFFFFFFF <= _WINDOW


def pack(frame: Command | Status) -> bytes:
    """The bytes of ``frame``, with the zero at their end."""
    is_command = isinstance(frame, Command)
    body = _COMMAND_BODY.pack(_COMMAND, *frame) if is_command else _STATUS_BODY.pack(_STATUS, *frame)
    return _stuffed(body + _checks(body)) + b"\0"


def unpack(encoded: bytes) -> Command | Status | None:
    """The frame in ``encoded``, which is without the zero; None when it is damaged."""
    whole = _unstuffed(encoded)
    if whole is None or len(whole) < 1 + _CHECKS.size:
        return None
    body = whole[: -_CHECKS.size]
    if whole[-_CHECKS.size :] != _checks(body):
        return None
    if body[0] == _COMMAND and len(body) == _COMMAND_BODY.size:
        return Command(*_COMMAND_BODY.unpack(body)[1:])
    if body[0] == _STATUS and len(body) == _STATUS_BODY.size:
        return Status(*_STATUS_BODY.unpack(body)[1:])
    return None


def _checks(body: bytes) -> bytes:
    return _CHECKS.pack(binascii.crc_hqx(body, _PRESET), binascii.crc_hqx(body[::-1], _PRESET))


def _stuffed(data: bytes) -> bytes:
    """COBS of ``data``, which is shorter than 254 bytes."""
    return b"".join(bytes((len(piece) + 1,)) + piece for piece in data.split(b"\0"))


def _unstuffed(encoded: bytes) -> bytes | None:
    pieces, at, end = [], 0, len(encoded)
    while at < end:
        after = at + encoded[at]
        if encoded[at] == 0 or after > end:
            return None
        pieces.append(encoded[at + 1 : after])
        at = after
    return b"\0".join(pieces)


class Splitter:
    """Finds frames in a stream of bytes that comes in pieces of any length.

    Attributes:
        damaged: pieces between two zeros that were no frame.
    """

    def __init__(self) -> None:
        self.damaged = 0
        self._rest = b""
        self._skipping = False

    def feed(self, data: bytes) -> list[Command | Status]:
        """The frames that are complete with ``data``, in order."""
        found: list[Command | Status] = []
        *complete, rest = (self._rest + data).split(b"\0")
        for encoded in complete:
            if self._skipping:
                self._skipping = False
                self.damaged += 1
                continue
            frame = unpack(encoded) if encoded else None
            if frame is not None:
                found.append(frame)
            elif encoded:
                self.damaged += 1
        if len(rest) > _LONGEST:
            rest, self._skipping = b"", True
        self._rest = rest
        return found
