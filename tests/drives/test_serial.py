"""The serial protocol against its emulator on a pseudo-terminal: frames survive any damage, or are dropped."""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from fric.axis import SimulatedAxis
from fric.drives import DRIVES, DriveError
from fric.drives.drive import checked_options
from fric.drives.serial import SerialDrive
from fric.drives.serial_emulator import BadLine, SerialEmulator
from fric.drives.serial_frames import Command, Splitter, Status, newer, pack, unpack
from fric.model import build_model, term
from hypothesis import given, settings
from hypothesis import strategies as st

H = 1_000_000  # [ns]


class Clock:
    now = 10**18

    def __call__(self) -> int:
        return self.now


class Pair:
    """Drive and emulator in library time."""

    def __init__(self, folder: Path, **options: object) -> None:
        self.clock = Clock()
        model = build_model("rigid", {"mass": 2.0}, [term("viscous", coefficient=35.0)])
        self.port = folder / "drive"
        self.emulator = SerialEmulator(SimulatedAxis(model), self.port, self.clock, **options)  # type: ignore[arg-type]
        self.emulator.plug()
        self.drive = SerialDrive(str(self.port), 921_600, 0.05, self.clock)

    def exchanges(self, n: int, force: float) -> None:
        for _ in range(n):
            self.exchange(force)

    def exchange(self, force: float):
        reading = self.drive.exchange(force)
        self.emulator.poll()
        self.clock.now += H
        return reading


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path


@pytest.fixture
def pair(folder: Path) -> Iterator[Pair]:
    made = Pair(folder)
    yield made
    made.drive.close()
    made.emulator.close()


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE, bit by bit."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = ((crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def test_a_command_is_laid_out_as_documented() -> None:
    assert crc16(b"123456789") == 0x29B1  # the published check value
    body = b"\x43" + struct.pack("<Id", 7, -12.5)
    whole = body + struct.pack("<HH", crc16(body), crc16(body[::-1]))
    encoded = pack(Command(7, -12.5))
    assert encoded.endswith(b"\0")
    assert 0 not in encoded[:-1]
    at, found = 0, b""
    while at < len(encoded) - 1:  # byte stuffing undone, as on a microcontroller
        n = encoded[at]
        found += encoded[at + 1 : at + n] + b"\0"
        at += n
    assert found[:-1] == whole


numbers = st.floats(allow_nan=False)
u32 = st.integers(0, 2**32 - 1)
commands = st.builds(Command, u32, numbers)
floats32 = st.floats(width=32, allow_nan=False)
statuses = st.builds(Status, u32, u32, st.integers(0, 2**64 - 1), numbers, floats32, floats32, floats32, st.integers(0, 15))


@given(st.lists(st.one_of(commands, statuses), max_size=8), st.lists(st.integers(1, 40), max_size=40))
def test_frames_come_through_whatever_the_pieces(frames: list[Command | Status], lengths: list[int]) -> None:
    data = b"".join(map(pack, frames))
    splitter, found = Splitter(), []
    for n in [*lengths, len(data)]:
        found += splitter.feed(data[:n])
        data = data[n:]
    assert found == frames
    assert splitter.damaged == 0


@settings(max_examples=500)
@given(st.one_of(commands, statuses), st.data())
def test_a_damaged_frame_is_none(frame: Command | Status, data: st.DataObject) -> None:
    encoded = bytearray(pack(frame)[:-1])
    for _ in range(data.draw(st.integers(1, 4))):
        match data.draw(st.sampled_from(["flip", "drop", "insert", "cut"])):
            case "flip":
                encoded[data.draw(st.integers(0, len(encoded) - 1))] ^= data.draw(st.integers(1, 255))
            case "drop" if len(encoded) > 1:
                del encoded[data.draw(st.integers(0, len(encoded) - 1))]
            case "insert":
                encoded.insert(data.draw(st.integers(0, len(encoded))), data.draw(st.integers(0, 255)))
            case _:
                del encoded[data.draw(st.integers(1, len(encoded))) :]
    got = unpack(bytes(encoded))
    assert got is None or got == frame


def test_both_checks_together_are_31_independent_ones() -> None:
    """The map from errors of a command's body to both checks shares nothing but the parity: one error in 2^31 passes."""
    n = 13
    zero = crc16(bytes(n))
    rows = []
    for bit in range(8 * n):
        body = (1 << bit).to_bytes(n, "little")
        rows.append((crc16(body) ^ zero) << 16 | (crc16(body[::-1]) ^ zero))
    rank = 0
    while rows:
        pivot = rows.pop()
        if pivot:
            rank += 1
            low = pivot & -pivot
            rows = [row ^ pivot if row & low else row for row in rows]
    assert rank == 31


def test_numbers_go_round() -> None:
    assert newer(0, 2**32 - 1)
    assert newer(1, 0)
    assert not newer(5, 5)
    assert not newer(4, 5)
    assert not newer(2**31, 0)


def test_a_force_moves_the_axis_and_the_readings_say_so(pair: Pair) -> None:
    pair.drive.open()
    readings = [reading for _ in range(2000) if (reading := pair.exchange(7.0)) is not None]
    assert len(readings) > 1990
    last = readings[-1]
    assert last.velocity == pytest.approx(7.0 / 35.0, rel=1e-3)
    assert last.effort == pytest.approx(7.0)
    assert math.isnan(last.temperature)
    assert abs(last.stamp - pair.clock.now) <= 3 * H
    stamps = np.diff([reading.stamp for reading in readings])
    assert stamps.min() > 0.9 * H
    assert stamps.max() < 1.1 * H


def hammered(folder: Path, n_frames: int, seed: int) -> tuple[int, int, int, int]:
    """Commands accepted, wrong forces, wrong readings, readings of ``n_frames`` exchanges over a very bad line."""
    random = np.random.default_rng(seed)
    bad = {"drop": 0.004, "flip": 0.004, "split": 0.1, "hold": 0.1, "repeat": 0.02}
    pair = Pair(folder, incoming=BadLine(random, **bad), outgoing=BadLine(random, **bad), watchdog=1.0)
    pair.drive._timeout = 10**12
    pair.drive.open()
    sent: dict[int, float] = {}
    true: dict[int, float] = {}
    wrong = wrong_readings = readings = 0

    def check(sequence: int, force: float) -> None:
        nonlocal wrong
        wrong += sent.get(sequence) != force

    pair.emulator.on_force = check
    measure = pair.emulator.axis.measure

    def measured():
        state = measure()
        true[state.position] = state.effort
        return state

    pair.emulator.axis.measure = measured  # type: ignore[method-assign]
    forces = random.normal(0.0, 5.0, n_frames).tolist()
    for k, force in enumerate(forces):
        sent[k + 1] = force
        sent.pop(k - 100, None)
        if len(true) > 2000:
            true.clear()
        reading = pair.exchange(force)
        if reading is not None:
            readings += 1
            wrong_readings += bool(true) and reading.position not in true and len(true) > 50
    pair.drive.close()
    pair.emulator.close()
    return pair.emulator.accepted, wrong, wrong_readings, readings


def test_a_bad_line_never_makes_a_wrong_force(folder: Path) -> None:
    accepted, wrong, wrong_readings, readings = hammered(folder, 20_000, 1)
    assert wrong == 0
    assert wrong_readings == 0
    assert accepted > 8_000  # and it isn't silent
    assert readings > 4_000


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_a_million_frames_over_a_bad_line(folder: Path) -> None:
    _, wrong, wrong_readings, _ = hammered(folder, 1_000_000, 2)
    assert wrong == 0
    assert wrong_readings == 0


def test_a_frame_held_up_does_not_act_late(pair: Pair) -> None:
    pair.drive.open()
    for _ in range(10):
        pair.exchange(1.0)
    late = pack(Command(5, 99.0))
    assert pair.drive._line is not None
    pair.drive._line.write(late)  # type: ignore[attr-defined]
    pair.emulator.poll()
    assert pair.emulator.force == 1.0


def test_silence_takes_the_force_away(pair: Pair) -> None:
    pair.drive.open()
    for _ in range(10):
        pair.exchange(3.0)
    pair.clock.now += 60 * H
    pair.emulator.poll()
    assert pair.emulator.force == 0.0


def test_unplugging_is_an_error_and_plugging_in_works_again(pair: Pair) -> None:
    pair.drive.open()
    for _ in range(10):
        pair.exchange(3.0)
    pair.emulator.unplug()
    with pytest.raises(DriveError, match=r"drive.* is lost .*; plug the drive in again"):
        pair.exchanges(3, 3.0)
    pair.drive.close()
    with pytest.raises(DriveError, match="can't be opened"):
        pair.drive.open()
    pair.emulator.plug()
    begin = time.monotonic()
    pair.drive.open()
    for _ in range(200):
        if pair.exchange(3.0) is not None:
            break
    else:
        pytest.fail("no reading after plugging in")
    assert time.monotonic() - begin < 1.0
    assert pair.emulator.force == 3.0


def test_a_drive_that_is_silent_or_at_fault_is_an_error(pair: Pair) -> None:
    pair.drive.open()
    poll, pair.emulator.poll = pair.emulator.poll, lambda: None  # type: ignore[method-assign]
    with pytest.raises(DriveError, match=r"no intact status for 0\.05"):
        pair.exchanges(60, 0.0)
    pair.emulator.poll = poll  # type: ignore[method-assign]
    pair.drive.open()
    pair.emulator.faulty = True
    with pytest.raises(DriveError, match="reports a fault"):
        pair.exchanges(5, 0.0)


@pytest.mark.parametrize("force", [math.nan, math.inf])
def test_no_force_that_is_not_finite_leaves_the_host(pair: Pair, force: float) -> None:
    pair.drive.open()
    with pytest.raises(DriveError, match="finite"):
        pair.drive.exchange(force)


def test_a_drive_that_does_not_read_holds_nothing_up(pair: Pair) -> None:
    pair.drive._timeout = 10**12
    pair.drive.open()
    begin = time.monotonic()
    for _ in range(2000):
        pair.drive.exchange(1.0)
    assert time.monotonic() - begin < 20.0


def test_options_are_checked_by_name() -> None:
    kind = DRIVES["serial"]
    assert checked_options(kind, {"port": "/dev/x"})["baud"] == 921_600
    with pytest.raises(DriveError, match=r"no option 'speed'; choose from port, baud, timeout"):
        checked_options(kind, {"speed": 1})
    with pytest.raises(DriveError, match="baud is 1"):
        checked_options(kind, {"baud": 1})
    with pytest.raises(DriveError, match="port is 5"):
        checked_options(kind, {"port": 5})
    with pytest.raises(DriveError, match="no port"):
        kind.make(checked_options(kind, {}), time.time_ns, None)
