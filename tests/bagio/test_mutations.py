"""Damaged bags: one line, or a record with a word on what is lost; never a traceback, a hang, or memory that they only declare.

Small recordings in every format, and random damage to them: what disks, networks and careless copying do to a file. Ten
thousand in every run; ``--long`` tries a hundred times as many. What a flipped bit makes of a single number in a message that
has no checksum can't be known, so that values are not compared; that samples are missing can, and has to be said.
"""

from __future__ import annotations

import resource
import struct
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from fric.bagio import Topics, read_record
from fric.errors import InputError
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

START_NS = 1_700_000_000_000_000_000
FORMATS = {"mcap": 2200, "mcap-zstd": 1600, "sqlite3": 1700, "ros1": 2000, "ros1-bz2": 1200, "ros1-lz4": 1300}
"""How many damaged bags of each format; ten thousand together."""
TOPICS = Topics(force_command="/effort_controller/commands:a,b")
_N_SAMPLES = 40
# Numbers that lengths and offsets must not be believed to have.
_EXTREMES = (0, 1, 0x7F, 0xFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 40, (1 << 63) - 1, (1 << 64) - 1)


def _rows(ros1: bool) -> Iterator[tuple[str, str, int, bytes]]:
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_JAZZY)
    types = store.types
    js, array, f64 = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64MultiArray", "std_msgs/msg/Float64"

    def pack(name: str, message: object) -> bytes:
        return bytes(store.serialize_ros1(message, name) if ros1 else store.serialize_cdr(message, name))

    for k in range(_N_SAMPLES):
        now = START_NS + k * 5_000_000
        stamp = types["builtin_interfaces/msg/Time"](sec=now // 10**9, nanosec=now % 10**9)
        numbered = {"seq": k} if ros1 else {}
        header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="", **numbered)
        value = [np.sin(0.2 * k), np.cos(0.3 * k)]
        state = types[js](header=header, name=["a", "b"], position=np.array(value), velocity=np.zeros(0), effort=np.zeros(0))
        layout = types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
        yield "/joint_states", js, now, pack(js, state)
        yield "/effort_controller/commands", array, now, pack(array, types[array](layout=layout, data=np.array(value)))
        yield "/temperature", f64, now, pack(f64, types[f64](data=20.0 + k))


def recording(folder: Path, kind: str) -> Path:
    """A small recording of two joints and their commands as a lone file."""
    ros1 = kind.startswith("ros1")
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_JAZZY)
    writer: Ros1Writer | Ros2Writer
    if ros1:
        path = file = folder / f"{kind}.bag"
        writer = Ros1Writer(path)
        if kind != "ros1":
            writer.set_compression(Ros1Writer.CompressionFormat[kind.removeprefix("ros1-").upper()])
    else:
        path = folder / kind
        plugin = StoragePlugin.SQLITE3 if kind == "sqlite3" else StoragePlugin.MCAP
        writer = Ros2Writer(path, version=9, storage_plugin=plugin)
        file = path / f"{kind}.{'db3' if kind == 'sqlite3' else 'mcap'}"
        if kind.endswith("zstd"):
            writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        known = {}
        for topic, msgtype, now, data in _rows(ros1):
            if topic not in known:
                known[topic] = writer.add_connection(topic, msgtype, typestore=store)
            writer.write(known[topic], now, data)
    return file


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """``content`` with one to three faults of random kind, place and size."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 4))):
        if not data:
            break
        size = len(data)
        at = int(rng.integers(size))
        length = int(min(size - at, 2 ** rng.uniform(0, 10)))
        other = int(rng.integers(size - length + 1))
        kind = rng.integers(8)
        if kind <= 1:  # bits flipped
            for place in rng.integers(size, size=int(rng.integers(1, 9))):
                data[int(place)] ^= 1 << int(rng.integers(8))
        elif kind == 2:  # cut off
            del data[at:]
        elif kind == 3:  # a part twice
            data[other:other] = data[at : at + length]
        elif kind == 4:  # two parts exchanged
            first, second = data[at : at + length], data[other : other + length]
            data[at : at + length], data[other : other + length] = second, first
        elif kind == 5:  # a length or an offset that is not to be believed
            extreme = _EXTREMES[int(rng.integers(len(_EXTREMES)))]
            packed = struct.pack("<Q", extreme)[: 4 if rng.integers(2) and extreme < 1 << 32 else 8]
            data[at : at + len(packed)] = packed if rng.integers(2) else packed[::-1]
        elif kind == 6:  # a part that was never written
            data[at : at + length] = bytes(length)
        else:  # a part lost
            del data[at : at + length]
    return bytes(data)


@dataclass
class Tally:
    """What became of damaged recordings."""

    refused: int = 0
    read: int = 0
    unclear: int = 0
    """Refusals without a problem or a remedy."""
    silent: int = 0
    """Records that lack samples and do not say why."""
    longest: float = 0.0
    """The longest that one of them took [s]."""


def try_all(folder: Path, kind: str, n_mutations: int, seed: int) -> Tally:
    """Read damaged recordings of one format; anything but a record or a refusal is an error."""
    file = recording(folder, kind)
    content = file.read_bytes()
    whole = read_record(file, joint="a", topics=TOPICS)
    rng = np.random.default_rng([seed, list(FORMATS).index(kind)])
    target = folder / f"damaged{file.suffix}"
    tally = Tally()
    for number in range(n_mutations):
        target.write_bytes(damaged(content, rng))
        begun = time.perf_counter()
        try:
            record = read_record(target, joint="a", topics=TOPICS, repair=bool(rng.integers(2)))
        except InputError as error:
            tally.refused += 1
            tally.unclear += not (error.problem and error.remedy)
        except BaseException as error:
            kept = folder / f"found_{kind}_{number}{file.suffix}"
            kept.write_bytes(target.read_bytes())
            raise AssertionError(f"{kind}, seed {seed}, mutation {number}, kept as {kept}: {error!r}") from error
        else:
            tally.read += 1
            tally.silent += record.n_samples < whole.n_samples and not set(record.notes) - set(whole.notes)
        tally.longest = max(tally.longest, time.perf_counter() - begun)
    return tally


def judge(tally: Tally, n_mutations: int, peak_before: int) -> None:
    assert tally.read + tally.refused == n_mutations
    assert tally.read > n_mutations // 20  # the damage is not so large that nothing is left to be read
    assert tally.refused > n_mutations // 20
    assert tally.unclear == 0
    # The name of a joint in a single message, damaged, is that of another joint, whose messages another publisher may send.
    assert tally.silent <= n_mutations // 200
    assert tally.longest < 5.0
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak_before) * 1024
    assert grown < 256 << 20, f"{grown / 2**20:.0f} MiB for files of some kilobytes"


@pytest.mark.parametrize("kind", FORMATS)
def test_damaged_bags(tmp_path: Path, kind: str) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    judge(try_all(tmp_path, kind, FORMATS[kind], 0), FORMATS[kind], before)


@pytest.mark.long
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("kind", FORMATS)
def test_a_million_damaged_bags(tmp_path: Path, kind: str) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    judge(try_all(tmp_path, kind, 100 * FORMATS[kind], 1), 100 * FORMATS[kind], before)


def test_damaged_metadata(tmp_path: Path) -> None:
    """The text beside the messages: whatever it says, the messages are read."""
    file = recording(tmp_path, "mcap")
    text = (file.parent / "metadata.yaml").read_bytes()
    rng = np.random.default_rng(3)
    for _ in range(60):
        (file.parent / "metadata.yaml").write_bytes(damaged(text, rng))
        assert read_record(file.parent, joint="a", topics=TOPICS).n_samples == _N_SAMPLES
