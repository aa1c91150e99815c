"""Every recording that cannot be used is refused with one line of file, cause and remedy, or repaired with a note."""

from __future__ import annotations

import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fric.bagio import BagError, read_record
from fric.errors import InputError
from fric.record import Record

START = 1_700_000_000_000_000_000
MS = 1_000_000
JS, F64 = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64"


def refused(path: Path, match: str, **options: Any) -> None:
    with pytest.raises(BagError, match=match) as caught:
        read_record(path, **options)
    text = str(caught.value)
    assert isinstance(caught.value, InputError)
    assert "\n" not in text
    assert path.name in text
    assert caught.value.remedy


def stamps_with(change: Any, n_samples: int = 100) -> list[int]:
    stamps = [START + k * MS for k in range(n_samples)]
    change(stamps)
    return stamps


# What is not a recording at all


def test_not_there(tmp_path: Path) -> None:
    refused(tmp_path / "none", "is not there; check the path")


def test_no_bag_in_folder(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    refused(tmp_path, "is not a bag: there is no .mcap or .db3 file in it")


@pytest.mark.parametrize("name", ["a.mcap", "a.db3"])
@pytest.mark.parametrize("content", [b"", b"this is not a recording at all, but it is long enough to look at" * 20])
def test_file_of_another_kind(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    refused(tmp_path / name, "is empty" if not content else "not an MCAP|cannot be read as an SQLite bag")


def test_file_with_another_ending(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("1,2")
    refused(tmp_path / "a.csv", "is not a recording")


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_empty_bag(write_bag: Any, storage: str) -> None:
    refused(write_bag([], topics=[("/joint_states", JS)], storage=storage), "is empty|holds no complete message")


# Truncated and damaged files


def test_mcap_truncated_anywhere_gives_what_is_whole(write_bag: Any, joint_rows: Any, tmp_path: Path) -> None:
    content = (write_bag(joint_rows(2000)) / "bag.mcap").read_bytes()
    whole = read_record(tmp_path / "bag")
    for share in (0.3, 0.6, 0.95, 0.999):
        cut = tmp_path / f"cut_{share}.mcap"
        cut.write_bytes(content[: int(len(content) * share)])
        record = read_record(cut)
        assert record.n_samples > 2000 * min(share, 0.8) * 0.8
        np.testing.assert_array_equal(record.position, whole.position[: record.n_samples])
        # Without its very end the file lacks nothing but its index.
        said = ("read up to its last complete record", "index is not usable")[: 1 + (record.n_samples == 2000)]
        assert any(words in note for note in record.notes for words in said)
        assert cut.read_bytes() == content[: int(len(content) * share)]


def test_mcap_truncated_beyond_use(write_bag: Any, joint_rows: Any, tmp_path: Path) -> None:
    content = (write_bag(joint_rows(2000)) / "bag.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[:300])
    refused(tmp_path / "cut.mcap", "holds no complete message; it is truncated beyond use")


def test_compressed_mcap_truncated(write_bag: Any, joint_rows: Any, tmp_path: Path) -> None:
    content = (write_bag(joint_rows(60_000), compression="storage") / "bag.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: len(content) * 2 // 3])
    record = read_record(tmp_path / "cut.mcap")
    assert 25_000 < record.n_samples < 60_000
    np.testing.assert_array_equal(record.position, np.arange(record.n_samples) * 1e-3)


def test_sqlite_truncated(write_bag: Any, joint_rows: Any, tmp_path: Path) -> None:
    content = (write_bag(joint_rows(5000), storage="sqlite3") / "bag.db3").read_bytes()
    (tmp_path / "cut.db3").write_bytes(content[: len(content) // 2])
    record = read_record(tmp_path / "cut.db3")
    assert record.n_samples > 1000
    np.testing.assert_array_equal(record.position, np.arange(record.n_samples) * 1e-3)
    assert any("last readable row" in note for note in record.notes)
    (tmp_path / "stub.db3").write_bytes(content[:5000])
    refused(tmp_path / "stub.db3", "cannot be read as an SQLite bag|holds no complete message")


def test_damaged_block_inside_shows_as_a_gap(write_bag: Any, joint_rows: Any, tmp_path: Path) -> None:
    stamps = [START + k * MS // 5 for k in range(60_000)]  # a block of 1 MiB then lasts about 2 s
    bag = write_bag(joint_rows(60_000, stamps=stamps), compression="storage")
    content = bytearray((bag / "bag.mcap").read_bytes())
    middle = content.index(b"zstd", len(content) // 2) + 40
    content[middle : middle + 64] = bytes(64)
    (bag / "bag.mcap").write_bytes(content)
    refused(bag, "gap")
    record = read_record(bag, repair=True)
    notes = " | ".join(record.notes)
    assert "left out" in notes
    assert "1 gap(s)" in notes
    assert record.valid is not None
    assert np.count_nonzero(~record.valid) == 2


def test_checksum_of_a_block_counts(write_bag: Any, joint_rows: Any) -> None:
    stamps = [START + k * MS // 5 for k in range(30_000)]
    bag = write_bag(joint_rows(30_000, stamps=stamps))
    file = bag / "bag.mcap"
    content = bytearray(file.read_bytes())
    # rosbags writes no checksums: put in that of the second block (opcode 6), as other recorders do.
    at, blocks = 8, []
    while len(blocks) < 2:
        opcode, size = struct.unpack_from("<BQ", content, at)
        blocks += [at + 9] if opcode == 6 else []
        at += 9 + size
    start = blocks[1]
    (length,) = struct.unpack_from("<Q", content, start + 32)
    data = slice(start + 40, start + 40 + length)
    struct.pack_into("<I", content, start + 24, zlib.crc32(content[data]))
    file.write_bytes(content)
    assert read_record(bag).n_samples == 30_000
    content[start + 40 + length - 3] ^= 0x10  # in the last effort of the block
    file.write_bytes(content)
    record = read_record(bag, repair=True)
    assert 10_000 < record.n_samples < 25_000
    assert any("checksum" in note for note in record.notes)


def test_broken_metadata_file_does_not_matter(write_bag: Any, joint_rows: Any) -> None:
    bag = write_bag(joint_rows())
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    record = read_record(bag)
    assert record.n_samples == 100
    assert any("index is not usable" in note for note in record.notes)


def test_message_that_is_not_what_its_type_says(write_bag: Any, joint_rows: Any) -> None:
    rows = joint_rows()
    rows[7] = (*rows[7][:3], b"\x00\x01\x00\x00\x05\x00")
    refused(write_bag(rows), "message 7 of topic /joint_states is not a valid sensor_msgs/msg/JointState")


# Topics, joints, effort


def test_topic_missing(write_bag: Any, ros: Any) -> None:
    bag = write_bag([("/data", F64, START, ros.float64(1.0))])
    refused(bag, r"no topic /joint_states in the bag; it holds: /data \(std_msgs/msg/Float64\)")


def test_wrong_type(write_bag: Any, ros: Any) -> None:
    bag = write_bag([("/joint_states", F64, START, ros.float64(1.0))])
    refused(bag, "topic /joint_states has the type std_msgs/msg/Float64, expected sensor_msgs/msg/JointState")


def test_topic_without_messages(write_bag: Any, ros: Any) -> None:
    bag = write_bag([("/data", F64, START, ros.float64(1.0))], topics=[("/joint_states", JS)])
    refused(bag, "topic /joint_states holds no message")


def test_effort_missing(write_bag: Any, joint_rows: Any) -> None:
    bag = write_bag(joint_rows(effort=None))
    refused(bag, "no effort: /joint_states has none for joint 'axis' and there is no topic /force_command")
    refused(bag, "has no effort in /joint_states; read the force command", effort="joint_states")
    refused(bag, "no topic /force_command", effort="command")


def test_effort_missing_in_some(write_bag: Any, joint_rows: Any) -> None:
    rows = joint_rows()
    rows[5:8] = joint_rows(effort=None)[5:8]
    refused(write_bag(rows), "effort is missing in 3 of 100 messages")


def test_effort_of_another_length(write_bag: Any, ros: Any, joint_rows: Any) -> None:
    rows = joint_rows()
    rows[50] = ("/joint_states", JS, rows[50][2], ros.joint_state(rows[50][2], ["axis"], [0.0], [], [1.0, 2.0]))
    refused(write_bag(rows), r"effort has 2 values for 1 joints in 1 messages of /joint_states, first at 0\.050 s")


def test_too_short(write_bag: Any, joint_rows: Any) -> None:
    refused(write_bag(joint_rows(9)), "too short: only 9 samples, at least 10 are needed")


# Values and stamps: refused, and repaired on request


def repaired(path: Path, match: str) -> Record:
    refused(path, match)
    record = read_record(path, repair=True)
    assert any(re.search(match, note) for note in record.notes)
    return record


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
@pytest.mark.parametrize("signal", ["position", "effort"])
def test_not_finite(write_bag: Any, joint_rows: Any, value: float, signal: str) -> None:
    bad = {20, 21, 40}
    options: dict[str, Any] = {signal: lambda k: value if k in bad else float(k)}
    record = repaired(
        write_bag(joint_rows(**options)), rf"{signal} is not finite \(NaN or inf\) at 3 of 100 samples, first at 0\.020 s"
    )
    assert record.n_samples == 100
    expected = np.arange(100) * (1e-3 if signal == "position" else 1.0)
    if signal == "effort":
        np.testing.assert_allclose(record.effort, expected)


def test_stamp_goes_back_a_little(write_bag: Any, joint_rows: Any) -> None:
    def change(stamps: list[int]) -> None:
        stamps[30] = stamps[28] + MS // 2

    record = repaired(write_bag(joint_rows(stamps=stamps_with(change))), r"1 of 100 stamps go back, first at sample 30")
    np.testing.assert_allclose(record.position, np.delete(np.arange(100), 30) * 1e-3)


def test_stamp_repeats(write_bag: Any, joint_rows: Any) -> None:
    def change(stamps: list[int]) -> None:
        stamps[30] = stamps[29]
        stamps[60] = stamps[59]

    record = repaired(
        write_bag(joint_rows(stamps=stamps_with(change))), r"2 of 100 stamps repeat an earlier one, first at sample 30"
    )
    np.testing.assert_allclose(record.position, np.delete(np.arange(100), [30, 60]) * 1e-3)


def test_stamps_jump_forward(write_bag: Any, joint_rows: Any) -> None:
    def change(stamps: list[int]) -> None:
        stamps[40:] = [stamp + 3600 * 10**9 for stamp in stamps[40:]]

    record = repaired(
        write_bag(joint_rows(stamps=stamps_with(change))), r"time jumps by \+3600\.001 s after sample 39 \(at 0\.039 s\)"
    )
    np.testing.assert_allclose(record.position, np.arange(40, 100) * 1e-3)
    assert record.time[0] == 0.0


def test_clock_starts_again(write_bag: Any, joint_rows: Any) -> None:
    def change(stamps: list[int]) -> None:
        stamps[70:] = [stamp - 65 * MS for stamp in stamps[70:]]

    record = repaired(write_bag(joint_rows(stamps=stamps_with(change))), r"time jumps by -0\.064 s after sample 69")
    np.testing.assert_allclose(record.position, np.arange(70) * 1e-3)


def test_one_stray_stamp_costs_one_sample(write_bag: Any, joint_rows: Any) -> None:
    def change(stamps: list[int]) -> None:
        stamps[50] = 17

    record = repaired(write_bag(joint_rows(stamps=stamps_with(change))), "time jumps by -1700000000")
    np.testing.assert_allclose(record.position, np.delete(np.arange(100), 50) * 1e-3)


def test_gap_is_marked_and_kept(write_bag: Any, joint_rows: Any) -> None:
    def change(stamps: list[int]) -> None:
        stamps[40:] = [stamp + 200 * MS for stamp in stamps[40:]]

    record = repaired(
        write_bag(joint_rows(stamps=stamps_with(change))), r"1 gap\(s\) in the samples, the longest 0\.201 s at 0\.039 s"
    )
    assert record.n_samples == 100
    assert record.valid is not None
    np.testing.assert_array_equal(np.flatnonzero(~record.valid), [39, 40])


def test_jitter_is_fine(write_bag: Any, joint_rows: Any) -> None:
    def change(stamps: list[int]) -> None:
        stamps[40:] = [stamp + 45 * MS for stamp in stamps[40:]]
        stamps[10] += MS // 3

    assert read_record(write_bag(joint_rows(stamps=stamps_with(change)))).valid is None


def test_slow_recordings_have_longer_gaps(write_bag: Any, joint_rows: Any) -> None:
    # At 10 Hz a step of 0.9 s is below ten medians, one of 1.1 s above.
    slow = [START + k * 100 * MS for k in range(100)]
    fine = [*slow[:50], *(stamp + 800 * MS for stamp in slow[50:])]
    bad = [*slow[:50], *(stamp + 1000 * MS for stamp in slow[50:])]
    assert read_record(write_bag(joint_rows(stamps=fine), name="fine")).n_samples == 100
    refused(write_bag(joint_rows(stamps=bad), name="bad"), "1 gap")


def test_nothing_left_after_repair(write_bag: Any, joint_rows: Any) -> None:
    bag = write_bag(joint_rows(position=lambda k: float("nan") if k > 4 else 0.0))
    with pytest.raises(BagError, match=r"95 of 100 samples.*too many to repair"):
        read_record(bag, repair=True)


def test_chunk_of_unknown_compression_is_named(write_bag: Any, joint_rows: Any, tmp_path: Path) -> None:
    content = bytearray((write_bag(joint_rows(), compression="storage") / "bag.mcap").read_bytes())
    # Both the chunk and the index name the compression.
    renamed = bytes(content).replace(struct.pack("<I", 4) + b"zstd", struct.pack("<I", 4) + b"none")
    (tmp_path / "odd.mcap").write_bytes(renamed)
    refused(tmp_path / "odd.mcap", "holds no complete message")
