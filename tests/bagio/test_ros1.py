"""ROS 1 bags: compressed or not, closed or not, whole or not; all written with plain rosbags."""

from __future__ import annotations

import bz2
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fric.bagio import BagError, Topics, bag_info, read_record, read_series
from fric.bagio.blocks import unpacked
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

START = 1_600_000_000_000_000_000
MS = 1_000_000
JS, F64, ARRAY = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64", "std_msgs/msg/Float64MultiArray"
STORE = get_typestore(Stores.ROS1_NOETIC)


def joint_state(stamp: int, number: int, names: list[str], position: list[float], effort: list[float]) -> bytes:
    types = STORE.types
    time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    # Texts of odd lengths: nothing is aligned in ROS 1.
    header = types["std_msgs/msg/Header"](seq=number, stamp=time, frame_id="odd")
    message = types[JS](
        header=header, name=names, position=np.array(position), velocity=np.zeros(0), effort=np.array(effort, dtype=np.float64)
    )
    return bytes(STORE.serialize_ros1(message, JS))


def write(path: Path, rows: list[tuple[str, str, int, bytes]], compression: str = "") -> Path:
    writer = Writer(path)
    if compression:
        writer.set_compression(Writer.CompressionFormat[compression])
    with writer:
        known: dict[str, Any] = {}
        for topic, msgtype, now, data in rows:
            if topic not in known:
                known[topic] = writer.add_connection(topic, msgtype, typestore=STORE)
            writer.write(known[topic], now, data)
    return path


def states(n_samples: int = 200, effort: bool = True) -> list[tuple[str, str, int, bytes]]:
    rows = []
    for k in range(n_samples):
        now = START + k * MS
        made = joint_state(now - 300_000, k, ["a", "joint_b"], [k * 1e-3, -k * 1e-3], [2.0 * k, 3.0 * k] if effort else [])
        rows.append(("/joint_states", JS, now, made))
    return rows


@pytest.mark.parametrize("compression", ["", "BZ2", "LZ4"])
def test_every_compression(tmp_path: Path, compression: str) -> None:
    bag = write(tmp_path / "run.bag", states(), compression)
    record = read_record(bag, joint="joint_b")
    np.testing.assert_allclose(record.time, np.arange(200) * 1e-3, atol=1e-12)
    np.testing.assert_array_equal(record.position, -np.arange(200) * 1e-3)
    np.testing.assert_array_equal(record.effort, 3.0 * np.arange(200))
    assert record.notes == ("the recording does not state its units: m and N assumed",)
    assert read_record(tmp_path, joint="a").effort[-1] == 398.0  # the folder that holds nothing else
    info = bag_info(bag)
    assert info.storage == "ros1"
    assert info.topics[0][:3] == ("/joint_states", JS, 200)
    series = read_series(bag, "/joint_states", "a")
    assert series.stamp_ns is not None
    assert series.stamp_ns[0] == START - 300_000


def test_commands_of_a_controller(tmp_path: Path) -> None:
    rows = states(effort=False)
    for k in range(0, 200, 4):
        message = STORE.types[F64](data=float(k))
        rows.append(("/joint_b_effort_controller/command", F64, START + k * MS, bytes(STORE.serialize_ros1(message, F64))))
    bag = write(tmp_path / "run.bag", sorted(rows, key=lambda row: row[2]))
    topic = "/joint_b_effort_controller/command"
    for topics in (Topics(), Topics(force_command=topic)):
        with pytest.raises(BagError, match=f"give --topic force_command=NAME with one of {topic}:joint_b"):
            read_record(bag, joint="joint_b", topics=topics)  # of two joints, nothing but its name says whose it is
    with pytest.raises(BagError, match="is of joint 'joint_b', as was said, and not of joint 'a'"):
        read_record(bag, joint="a", topics=Topics(force_command=f"{topic}:joint_b"))
    record = read_record(bag, joint="joint_b", topics=Topics(force_command=f"{topic}:joint_b"))
    np.testing.assert_array_equal(record.effort, np.arange(200) // 4 * 4.0)
    assert record.effort_hold == "following"


def test_several_bags_in_a_folder_are_several_recordings(tmp_path: Path) -> None:
    write(tmp_path / "one.bag", states())
    write(tmp_path / "two.bag", states())
    with pytest.raises(BagError, match=r"several ROS 1 bags: one.bag, two.bag; give one"):
        read_record(tmp_path)


def test_killed_recorder(tmp_path: Path) -> None:
    content = write(tmp_path / "run.bag", states(3000)).read_bytes()
    for share in (0.5, 0.8):
        cut = tmp_path / "run.bag.active"
        cut.write_bytes(content[: int(len(content) * share)])
        with pytest.raises(BagError, match="holds no complete message"):
            read_record(cut, joint="a")  # all in one block of rosbags' writer, which is cut off
    whole = content.replace(b"index_pos=" + content[content.index(b"index_pos=") + 10 :][:8], b"index_pos=" + bytes(8), 1)
    cut.write_bytes(whole[:-20])
    record = read_record(cut, joint="a")
    assert record.n_samples == 3000
    assert any("not closed by its recorder" in note for note in record.notes)


def test_a_block_that_declares_too_much_is_left_out(tmp_path: Path) -> None:
    content = bytearray(write(tmp_path / "run.bag", states(), "BZ2").read_bytes())
    at = content.index(b"size=") + 5
    struct.pack_into("<I", content, at, 0xFFFFFFF0)
    (tmp_path / "large.bag").write_bytes(content)
    with pytest.raises(BagError, match="holds no complete message"):
        read_record(tmp_path / "large.bag", joint="a")
    # A block that unpacks to a thousand times of what it declares is not unpacked further than that.
    assert len(unpacked(bz2.compress(bytes(10_000_000)), "bz2", 1000)) == 1001


def test_messages_of_ros1_in_an_mcap_file(tmp_path: Path) -> None:
    def text(value: str) -> bytes:
        return struct.pack("<I", len(value)) + value.encode()

    def record(operation: int, content: bytes) -> bytes:
        return struct.pack("<BQ", operation, len(content)) + content

    definition, _ = STORE.generate_msgdef(JS, ros_version=1)
    content = b"\x89MCAP0\r\n" + record(1, text("ros1") + text("a converter"))
    content += record(3, struct.pack("<H", 1) + text("sensor_msgs/JointState") + text("ros1msg") + text(definition))
    content += record(4, struct.pack("<HH", 7, 1) + text("/joint_states") + text("ros1") + struct.pack("<I", 0))
    for _, _, now, data in states():
        content += record(5, struct.pack("<HIQQ", 7, 0, now, now) + data)
    content += record(15, bytes(4)) + record(2, bytes(20)) + b"\x89MCAP0\r\n"
    (tmp_path / "run.mcap").write_bytes(content)
    np.testing.assert_array_equal(read_record(tmp_path / "run.mcap", joint="joint_b").effort, 3.0 * np.arange(200))


def test_another_version_and_another_file(tmp_path: Path) -> None:
    (tmp_path / "old.bag").write_bytes(b"#ROSBAG V1.2\n" + bytes(100))
    with pytest.raises(BagError, match=r"version 1.2; convert it"):
        read_record(tmp_path / "old.bag")
    (tmp_path / "not.bag").write_bytes(b"not a bag at all" * 10)
    with pytest.raises(BagError, match="not a ROS 1 bag"):
        read_record(tmp_path / "not.bag")
    (tmp_path / "none.bag").write_bytes(b"")
    with pytest.raises(BagError, match="is empty"):
        read_record(tmp_path / "none.bag")
