"""Writing bags: round trips through both storages, what is refused, and what is left when something fails."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fric.bagio import BagError, BagWriter, WriteError, bag_info, iterate_raw, read_record, read_series, write_record
from fric.bagio import write as write_module
from fric.record import Record, Units
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

JS, F64 = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64"
STORAGES = [("mcap", "none"), ("mcap", "zstd"), ("sqlite3", "none"), ("sqlite3", "zstd")]


@pytest.fixture
def record() -> Record:
    time = np.arange(400) * 2e-3
    return Record(
        time=time,
        position=np.sin(3 * time),
        effort=np.cos(5 * time),
        velocity=3 * np.cos(3 * time),
        reference=np.sin(3 * time + 0.01),
        extra={"normal_load": 5.0 + time, "chamber_pressure": time**2},
        joint="slide",
        units=Units("rad", "N m"),
        effort_hold="linear",
        notes=("imported with a word about it",),
    )


@pytest.mark.parametrize(("storage", "compression"), STORAGES)
def test_round_trip(record: Record, tmp_path: Path, storage: Any, compression: Any) -> None:
    path = write_record(record, tmp_path / "out", storage=storage, compression=compression)
    again = read_record(path)
    assert set(again.signals()) == set(record.signals())
    for name, signal in record.signals().items():
        np.testing.assert_allclose(again.signals()[name], signal, rtol=1e-12, atol=1e-12, err_msg=name)
    assert (again.joint, again.units, again.effort_hold) == ("slide", Units("rad", "N m"), "linear")
    assert again.notes == record.notes
    assert [entry.name for entry in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(("storage", "compression"), STORAGES)
def test_rosbags_reads_it(record: Record, tmp_path: Path, storage: Any, compression: Any) -> None:
    path = write_record(record, tmp_path / "out", storage=storage, compression=compression)
    with AnyReader([path]) as reader:
        (states,) = [entry for entry in reader.connections if entry.topic == "/joint_states"]
        messages: list[Any] = [reader.deserialize(raw, JS) for _, _, raw in reader.messages([states])]
    assert len(messages) == 400
    assert messages[3].name == ["slide"]
    assert messages[3].effort[0] == record.effort[3]
    assert messages[3].header.stamp.sec * 10**9 + messages[3].header.stamp.nanosec == 1_006_000_000


def test_same_record_gives_the_same_messages(record: Record, tmp_path: Path) -> None:
    first = list(iterate_raw(write_record(record, tmp_path / "a")))
    assert first == list(iterate_raw(write_record(record, tmp_path / "b")))


def test_valid_samples_survive_with_their_gap(record: Record, tmp_path: Path) -> None:
    time = record.time.copy()
    time[200:] += 0.5
    valid = np.ones(400, dtype=np.bool_)
    valid[[10, 11, 199, 200]] = False
    gappy = replace(record, time=time, valid=valid)
    again = read_record(write_record(gappy, tmp_path / "out"))
    np.testing.assert_array_equal(again.mask, valid)
    with pytest.raises(BagError, match=r"1 gap\(s\)"):
        read_record(write_record(replace(gappy, valid=None), tmp_path / "unmarked"))


@pytest.mark.parametrize("kind", ["folder", "file"])
def test_existing_output_is_refused(record: Record, tmp_path: Path, kind: str) -> None:
    path = tmp_path / "out"
    if kind == "file":
        path.write_text("mine")
    else:
        path.mkdir()
        (path / "mine").write_text("mine")
    with pytest.raises(WriteError, match="out: exists already and is not overwritten; choose another name"):
        write_record(record, path)
    with pytest.raises(WriteError, match="exists already"):
        BagWriter(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["out"]


def test_nothing_is_left_when_writing_fails(record: Record, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(write_module, "_write_messages", fail)
    with pytest.raises(WriteError, match=r"out: cannot be created .*No space left"):
        write_record(record, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_folder_that_cannot_be_made(record: Record, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(WriteError, match="cannot be created"):
        write_record(record, tmp_path / "file" / "out")
    with pytest.raises(WriteError, match="cannot be created"):
        BagWriter(tmp_path / "file" / "out")


@pytest.mark.parametrize(("storage", "compression"), STORAGES)
def test_writer_takes_raw_messages(ros: Any, tmp_path: Path, storage: Any, compression: Any) -> None:
    with BagWriter(tmp_path / "out", storage=storage, compression=compression, metadata={"a": "b"}) as bag:
        bag.topic("/f", F64)
        bag.topic("/f", F64)
        with pytest.raises(WriteError, match="has the type"):
            bag.topic("/f", JS)
        with pytest.raises(WriteError, match="is not announced"):
            bag.write("/g", 1, b"")
        for k in range(20):
            bag.write("/f", 10 + k, ros.float64(k))
        assert bag.counts == {"/f": 20}
    bag.close()
    with pytest.raises(WriteError, match="is closed"):
        bag.write("/f", 99, ros.float64(1))
    assert bag_info(tmp_path / "out").custom == {"a": "b"}
    np.testing.assert_array_equal(read_series(tmp_path / "out", "/f").fields["data"], np.arange(20))
    with Reader(tmp_path / "out") as reader:
        assert (reader.message_count, reader.start_time) == (20, 10)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_bag_without_messages_closes(tmp_path: Path, storage: Any) -> None:
    with BagWriter(tmp_path / "out", storage=storage) as bag:
        bag.topic("/f", F64)
    with pytest.raises(BagError, match="is empty"):
        read_record(tmp_path / "out")


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_messages_reach_the_disk_without_further_ones(ros: Any, tmp_path: Path, storage: Any) -> None:
    with BagWriter(tmp_path / "out", storage=storage, flush_period=0.05) as bag:
        bag.topic("/f", F64)
        bag.write("/f", 1, ros.float64(1.0))
        until = time.monotonic() + 10
        found = 0
        while not found and time.monotonic() < until:
            time.sleep(0.02)
            try:
                found = bag_info(tmp_path / "out").topics[0].n_messages
            except BagError:
                found = 0
    assert found == 1


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_several_threads_write(ros: Any, tmp_path: Path, storage: Any) -> None:
    def work(topic: str) -> None:
        bag.topic(topic, F64)
        for k in range(500):
            bag.write(topic, k, ros.float64(k))

    with BagWriter(tmp_path / "out", storage=storage, flush_period=0.01) as bag:
        threads = [threading.Thread(target=work, args=(f"/t{index}",)) for index in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    for index in range(4):
        np.testing.assert_array_equal(read_series(tmp_path / "out", f"/t{index}").fields["data"], np.arange(500))
