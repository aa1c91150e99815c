"""Bags written with plain rosbags, independent of fric's own writer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START_NS = 1_700_000_000_000_000_000


class Ros:
    """Messages made and serialised by rosbags."""

    def __init__(self) -> None:
        self.store = get_typestore(Stores.ROS2_JAZZY)
        header = "std_msgs/Header header\n"
        reference = header + "float64 position\nfloat64 velocity\nfloat64 acceleration\n"
        self.store.register(get_types_from_msg(header + "float64 force\n", "fric_interfaces/msg/StampedForce"))
        self.store.register(get_types_from_msg(reference, "fric_interfaces/msg/Reference"))

    def header(self, stamp_ns: int, frame_id: str = "") -> Any:
        time = self.store.types["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
        return self.store.types["std_msgs/msg/Header"](stamp=time, frame_id=frame_id)

    def pack(self, msgtype: str, *, little_endian: bool = True, **fields: Any) -> bytes:
        message = self.store.types[msgtype](**fields)
        return bytes(self.store.serialize_cdr(message, msgtype, little_endian=little_endian))

    def joint_state(
        self,
        stamp_ns: int,
        names: Sequence[str],
        position: Sequence[float],
        velocity: Sequence[float] = (),
        effort: Sequence[float] = (),
        *,
        frame_id: str = "",
        little_endian: bool = True,
    ) -> bytes:
        return self.pack(
            "sensor_msgs/msg/JointState",
            little_endian=little_endian,
            header=self.header(stamp_ns, frame_id),
            name=list(names),
            position=np.array(position, dtype=np.float64),
            velocity=np.array(velocity, dtype=np.float64),
            effort=np.array(effort, dtype=np.float64),
        )

    def float64(self, value: float) -> bytes:
        return self.pack("std_msgs/msg/Float64", data=value)

    def force(self, stamp_ns: int, value: float, frame_id: str = "") -> bytes:
        return self.pack("fric_interfaces/msg/StampedForce", header=self.header(stamp_ns, frame_id), force=value)

    def reference(self, stamp_ns: int, position: float, velocity: float, acceleration: float = 0.0) -> bytes:
        return self.pack(
            "fric_interfaces/msg/Reference",
            header=self.header(stamp_ns),
            position=position,
            velocity=velocity,
            acceleration=acceleration,
        )


Rows = Sequence[tuple[str, str, int, bytes]]
WriteBag = Callable[..., Path]


@pytest.fixture(scope="session")
def ros() -> Ros:
    return Ros()


@pytest.fixture
def write_bag(ros: Ros, tmp_path: Path) -> WriteBag:
    """Writes rows of (topic, type, time of reception, bytes) with plain rosbags."""

    def write(
        rows: Rows,
        name: str = "bag",
        storage: str = "mcap",
        compression: str = "none",
        custom: dict[str, str] | None = None,
        topics: Sequence[tuple[str, str]] = (),
    ) -> Path:
        path = tmp_path / name
        plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
        writer = Writer(path, version=9, storage_plugin=plugin)
        writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
        for key, value in (custom or {}).items():
            writer.set_custom_data(key, value)
        with writer:
            known = {
                key: writer.add_connection(*key, typestore=ros.store)
                for key in dict.fromkeys([*topics, *((topic, msgtype) for topic, msgtype, _, _ in rows)])
            }
            for topic, msgtype, log_ns, data in rows:
                writer.write(known[topic, msgtype], log_ns, data)
        return path

    return write


@pytest.fixture
def joint_rows(ros: Ros) -> Callable[..., list[tuple[str, str, int, bytes]]]:
    """Rows of one joint: position k/1000, effort 2k, one sample per millisecond, with stamps that may be given."""

    def rows(
        n_samples: int = 100,
        stamps: Sequence[int] | None = None,
        position: Callable[[int], float] = lambda k: k * 1e-3,
        effort: Callable[[int], float] | None = lambda k: 2.0 * k,
        topic: str = "/joint_states",
        names: Sequence[str] = ("axis",),
    ) -> list[tuple[str, str, int, bytes]]:
        made = []
        for k in range(n_samples):
            log = START_NS + k * 1_000_000
            stamp = log if stamps is None else stamps[k]
            efforts = () if effort is None else [effort(k)] * len(names)
            data = ros.joint_state(stamp, names, [position(k)] * len(names), (), efforts)
            made.append((topic, "sensor_msgs/msg/JointState", log, data))
        return made

    return rows
