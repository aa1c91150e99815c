"""All messages at once are the messages that come one after the other."""

from __future__ import annotations

import shutil
import struct
from pathlib import Path

import numpy as np
import pytest
from fric.bagio.bulk_mcap import gathered
from fric.bagio.encode import joint_state_messages, stamped_force_messages
from fric.bagio.recover_mcap import MAGIC
from fric.bagio.rows import Rows
from fric.bagio.series import collect
from fric.bagio.source import Source
from fric.bagio.write import BagWriter, Storage

N = 3000
TOPICS = {"/joint_states", "/force_command"}


def written(path: Path, storage: Storage) -> Path:
    """A bag of several blocks, with messages of two lengths on one topic."""
    rng = np.random.default_rng(5)
    times = np.arange(N) * 1_000_000
    stamps = times.tolist()
    values = rng.standard_normal((3, N))
    states = joint_state_messages(times, "axis", *values)
    others = joint_state_messages(times, "another", *values)
    forces = stamped_force_messages(times, "axis", values[0])
    with BagWriter(path, storage=storage) as bag:
        bag.topic("/joint_states", "sensor_msgs/msg/JointState")
        bag.topic("/force_command", "fric_interfaces/msg/StampedForce")
        bag.topic("/else", "fric_interfaces/msg/StampedForce")
        for k in range(N):
            bag.write("/joint_states", stamps[k], (others if k % 7 == 3 else states)[k])
            bag.write("/force_command" if k % 3 else "/else", stamps[k], forces[k])
    return path


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("window", [None, (2_000_000_000, 2_500_000_000), (1 << 60, 1 << 61)])
def test_they_are_the_same(tmp_path: Path, storage: Storage, window: tuple[int, int] | None) -> None:
    with Source(written(tmp_path / "bag", storage)) as source:
        source.window = window
        found = source.gathered(TOPICS)
        assert found is not None
        for topic in TOPICS:
            expected = [(message.log_time_ns, message.data) for message in source.messages({topic})]
            assert list(zip(found[topic].log_ns.tolist(), found[topic].data, strict=True)) == expected
            assert len(expected) == (0 if window == (1 << 60, 1 << 61) else len(expected))
        if window is None:
            assert len(found["/joint_states"].data) == N


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("bulk") / "bag", "mcap")


def copied(bag: Path, folder: Path) -> Path:
    """The storage file of a copy of ``bag``."""
    shutil.copytree(bag, folder / "bag")
    (file,) = (folder / "bag").glob("*.mcap")
    return file


def test_what_the_index_says_is_verified(stored: Path, tmp_path: Path) -> None:
    file = copied(stored, tmp_path)
    content = bytearray(file.read_bytes())
    assert gathered(file, TOPICS, None) is not None
    # The index of the messages of one topic in one block: its first record is moved by a byte.
    at = len(MAGIC)
    while content[at] != 0x07:
        at += 9 + struct.unpack_from("<Q", content, at + 1)[0]
    content[at + 9 + 6 + 8] ^= 1
    file.write_bytes(content)
    assert gathered(file, TOPICS, None) is None
    with Source(tmp_path / "bag") as source:  # by the other reader, or refused in one line by it
        assert source.gathered(TOPICS) is None


@pytest.mark.parametrize("seed", range(40))
def test_bytes_that_changed_give_the_same_messages_or_none(stored: Path, tmp_path: Path, seed: int) -> None:
    """Compressed blocks carry a checksum; the rest is the index."""
    file = copied(stored, tmp_path)
    content = bytearray(file.read_bytes())
    expected = gathered(file, TOPICS, None)
    assert expected is not None
    rng = np.random.default_rng(seed)
    index = len(content) - 8 - 29  # the footer, from which on a summary was written
    (summary,) = struct.unpack_from("<Q", content, index + 9)
    for _ in range(3):
        content[int(rng.integers(summary, len(content)))] = int(rng.integers(256))
    file.write_bytes(content)
    found = gathered(file, TOPICS, None)
    if found is not None and all(len(found[topic].data) == len(expected[topic].data) for topic in TOPICS):
        for topic in TOPICS:
            assert list(found[topic].data)[::97] == list(expected[topic].data)[::97]


def test_rows_are_a_sequence() -> None:
    messages = [b"ab", b"cdef", b"", b"gh"]
    rows = Rows.of(messages)
    assert list(rows) == messages
    assert [rows[k] for k in range(4)] == messages
    assert list(rows[1:3]) == messages[1:3]
    assert list(rows.taken(np.array([3, 0]))) == [b"gh", b"ab"]
    assert list(Rows.joined([rows, Rows.of([]), rows[2:]])) == [*messages, b"", b"gh"]
    np.testing.assert_array_equal(rows.table(np.array([0, 3])), [[97, 98], [103, 104]])


def test_collecting_takes_them_all_at_once(stored: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Source(stored) as source:
        monkeypatch.setattr(source, "messages", lambda topics: pytest.fail("one after the other"))
        topics = [topic for topic in source.topics if topic.name in TOPICS]
        assert {name: len(held.data) for name, held in collect(source, topics).items()} == {
            "/joint_states": N,
            "/force_command": N - len(range(0, N, 3)),
        }
