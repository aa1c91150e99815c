"""Parts of a recording: the same samples as of the whole, read without the rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fric.bagio import BagError, BagWriter, Piece, pieces, read_record, write_record
from fric.bagio.encode import float64_messages, joint_state_messages
from fric.bagio.passing import Passing
from fric.bagio.pieces import edges_of
from fric.bagio.topics import Raw
from fric.bagio.write import Compression, Storage
from fric.errors import InputError
from fric.record import Record
from rosbags.rosbag2.storage_mcap import McapReader

N = 60_000  # several chunks of 1 MiB, 11 s each; the third one is from 22 s to 33 s


@pytest.fixture(scope="module")
def record() -> Record:
    t = 1e-3 * np.arange(N)
    valid = np.ones(N, dtype=np.bool_)
    for first, last in ((0, 10), (9_990, 10_010), (52_000, 53_000)):
        valid[first:last] = False
    return Record(
        t, np.sin(t), np.cos(3.0 * t), valid=valid, extra={"normal_load": np.sin(0.1 * t)}, joint="axis", effort_hold="linear"
    )


@pytest.fixture(scope="module")
def bag(record: Record, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_record(record, tmp_path_factory.mktemp("bags") / "mcap")


@pytest.fixture
def copy(record: Record, tmp_path: Path) -> Path:
    """One to be damaged, with every sample usable."""
    return write_record(replace(record, valid=None), tmp_path / "copy", compression="zstd")


def storage_file(bag: Path) -> Path:
    return next(bag.glob("*.mcap"))


def spoil(bag: Path, time: float) -> None:
    """Make the chunk undecodable that holds what was received at this time [s]."""
    reader = McapReader(storage_file(bag))
    reader.open()
    at = reader.metadata.start_time + round(1e9 * time)
    (chunk,) = (each for each in reader.chunks if each.message_start_time <= at <= each.message_end_time)
    data = chunk.chunk_start_offset + 9 + 40 + len("zstd")  # behind opcode, length and the fields of the record
    reader.close()
    content = bytearray(storage_file(bag).read_bytes())
    content[data : data + 500] = b"\xff" * 500
    storage_file(bag).write_bytes(bytes(content))


def test_a_short_rest_belongs_to_the_piece_before() -> None:
    assert edges_of(0.0, 30.0, 10.0) == [0.0, 10.0, 20.0, 30.0]
    assert edges_of(0.0, 34.9, 10.0) == [0.0, 10.0, 20.0, 34.9]
    assert edges_of(5.0, 32.0, 10.0) == [5.0, 15.0, 25.0, 32.0]
    assert edges_of(0.0, 3.0, 10.0) == [0.0, 3.0]


@pytest.mark.parametrize(("storage", "compression"), [("mcap", "none"), ("mcap", "zstd"), ("sqlite3", "none")])
def test_pieces_are_the_whole(record: Record, tmp_path: Path, storage: Storage, compression: Compression) -> None:
    path = write_record(record, tmp_path / "bag", storage=storage, compression=compression)
    whole = read_record(path)
    found = list(pieces(path, 16.0))
    assert [piece.refused for piece in found] == [""] * 4
    assert all(before.end == after.begin for before, after in pairwise(found))
    parts = [piece.record for piece in found if piece.record is not None]
    assert [part.n_samples for part in parts] == [16_000, 16_000, 16_000, 12_000]
    for name in ("position", "effort", "mask"):
        assert np.array_equal(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name)), name
    # Interpolated between neighbours that lie in another piece.
    assert np.array_equal(np.concatenate([part.extra["normal_load"] for part in parts]), whole.extra["normal_load"])


def test_a_window_knows_which_samples_its_writer_left_out(bag: Path, record: Record) -> None:
    part = read_record(bag, window=(9.5, 10.5))
    assert part.n_samples == 1000
    assert np.array_equal(part.mask, record.mask[9500:10500])
    assert not part.mask.all()


def test_pieces_between_two_times(bag: Path, record: Record) -> None:
    found = list(pieces(bag, 8.0, start=9.0, end=20.0))
    assert [(piece.begin, piece.end) for piece in found] == [(9.0, 20.0)]
    assert found[0].record is not None
    assert np.array_equal(found[0].record.mask, record.mask[9000:20000])


def test_only_the_chunks_of_a_window_are_read(copy: Path, record: Record) -> None:
    spoil(copy, 28.0)
    part = read_record(copy, window=(36.0, 59.0))  # would say so if it met the damage
    assert np.array_equal(part.position, record.position[36_000:59_000])
    assert not any("damaged" in note for note in part.notes)
    assert any("damaged" in note for note in read_record(copy, repair=True).notes)


def test_a_damaged_chunk_spoils_its_own_piece_only(copy: Path) -> None:
    spoil(copy, 28.0)
    first, second = (piece.record for piece in pieces(copy, 36.0, repair=True))
    assert first is not None
    assert second is not None
    assert first.n_samples < 36_000
    assert second.n_samples == 24_000
    assert [any("record by record" in note for note in each.notes) for each in (first, second)] == [True, False]


def test_where_nothing_can_be_recovered_the_other_pieces_are_read(copy: Path) -> None:
    spoil(copy, 0.1)  # where the topics are described
    assert [piece.record is None for piece in pieces(copy, 20.0)] == [True, False, False]


def test_samples_that_were_left_out_behind_damage_are_not_guessed(record: Record, tmp_path: Path) -> None:
    damaged = write_record(record, tmp_path / "damaged", compression="zstd")
    spoil(damaged, 28.0)
    part = read_record(damaged, window=(50.0, 55.0))
    assert part.valid is None
    assert any("not known" in note for note in part.notes)


def test_a_recording_without_an_index(copy: Path, record: Record) -> None:
    (copy / "metadata.yaml").unlink()
    file = storage_file(copy)
    file.write_bytes(file.read_bytes()[: int(0.7 * file.stat().st_size)])
    found = list(pieces(copy, 10.0))
    records = [piece.record for piece in found if piece.record is not None]
    assert len(records) == len(found) > 2
    assert all(any("no index" in note for note in each.notes) for each in records)
    position = np.concatenate([each.position for each in records])
    assert np.array_equal(position, record.position[: position.size])
    assert position.size > 0.3 * N


def _raw(time: float) -> Raw:
    return Raw("/joint_states", "", round(time * 1e9), b"")


def test_windows_of_a_file_without_an_index_share_one_pass() -> None:
    # Received at 0, 1, ... s; a few are written a little late, one far too late.
    times = [*range(40), 39.5, *range(40, 70), 20.5, *range(70, 100)]
    passes = []

    def messages(topics: object = None) -> Iterator[Raw]:
        passes.append(topics)
        return map(_raw, times)

    passing = Passing([SimpleNamespace(messages=messages)])
    for first, stop in ((0.0, 32.0), (28.0, 62.0), (58.0, 101.0)):
        found = [
            message.log_time_ns * 1e-9 for message in passing.messages({"/joint_states"}, int(first * 1e9), int(stop * 1e9))
        ]
        assert sorted(found) == pytest.approx(sorted(each for each in times if first <= each < stop and each != 20.5))
    assert len(passes) == 1
    assert passing.late == 1
    again = list(passing.messages({"/joint_states"}, 20 * 10**9, 22 * 10**9))
    assert [message.log_time_ns for message in again] == [20 * 10**9, 21 * 10**9]
    assert len(passes) == 2


def test_a_command_before_a_piece_acts_in_it(tmp_path: Path) -> None:
    stamps = 10**9 + 1_000_000 * np.arange(6000, dtype=np.int64)
    t = 1e-3 * np.arange(6000)
    with BagWriter(tmp_path / "bag", flush_period=None) as writer:
        writer.topic("/joint_states", "sensor_msgs/msg/JointState")
        writer.topic("/force_command", "std_msgs/msg/Float64")
        states = joint_state_messages(stamps, "axis", np.sin(t), None, None)
        commands = float64_messages(np.floor(t / 0.3))
        for k, (at, state) in enumerate(zip(stamps.tolist(), states, strict=True)):
            if k % 300 == 0:
                writer.write("/force_command", at, commands[k])
            writer.write("/joint_states", at, state)
    records = [piece.record for piece in pieces(tmp_path / "bag", 2.0)]
    assert [None if each is None else each.n_samples for each in records] == [2000, 2000, 2000]
    effort = np.concatenate([each.effort for each in records if each is not None])
    assert np.array_equal(effort, np.floor(t / 0.3))


def test_a_piece_without_samples_keeps_the_others(tmp_path: Path, record: Record) -> None:
    with BagWriter(tmp_path / "bag", flush_period=None) as writer:
        writer.topic("/joint_states", "sensor_msgs/msg/JointState")
        stamps = 10**9 + 1_000_000 * np.arange(N, dtype=np.int64)
        states = joint_state_messages(stamps, "axis", record.position, None, record.effort)
        for k in (*range(10_000), *range(20_000, 30_000)):
            writer.write("/joint_states", int(stamps[k]), states[k])
    found = list(pieces(tmp_path / "bag", 10.0))
    assert [piece.record is None for piece in found] == [False, True, False]
    assert "no message of /joint_states" in found[1].refused


@pytest.mark.parametrize(
    "read",
    [
        lambda bag: list(pieces(bag, 0.0)),
        lambda bag: list(pieces(bag, float("nan"))),
        lambda bag: list(pieces(bag, 1.0, start=61.0)),
        lambda bag: list(pieces(bag, 1.0, start=5.0, end=4.0)),
        lambda bag: read_record(bag, window=(70.0, 80.0)),
    ],
)
def test_times_that_are_not_there_are_refused(bag: Path, read: Callable[[Path], list[Piece]]) -> None:
    with pytest.raises(InputError):
        read(bag)


def test_a_window_beyond_the_end_says_how_long_it_is(bag: Path) -> None:
    with pytest.raises(BagError, match=r"lasts 59\.999 s"):
        read_record(bag, window=(70.0, 80.0))
