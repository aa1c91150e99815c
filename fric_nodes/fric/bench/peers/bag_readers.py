"""Loading a bag into arrays beside readers that go message by message: ``rosbags`` and ``mcap-ros2-support``.

All three end with the same four arrays of the joint states and the one of the force commands: time, position, velocity, effort
and commanded force.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...bagio.read import read_record
from ...record import Array
from ..benchmarks.recordings import write_bag
from ..peer import Pair, Peer

__all__ = ["PEER", "by_mcap_ros2", "by_rosbags"]

_N_SAMPLES = 20_000
_TURNS = 7


class _Columns:
    """Arrays that grow message by message."""

    def __init__(self) -> None:
        self._states: list[tuple[float, float, float, float]] = []
        self._forces: list[float] = []

    def add(self, topic: str, message: Any) -> None:
        if topic == "/joint_states":
            stamp = message.header.stamp
            at = stamp.sec + 1e-9 * stamp.nanosec
            self._states.append((at, message.position[0], message.velocity[0], message.effort[0]))
        else:
            self._forces.append(message.force)

    def arrays(self) -> tuple[Array, Array]:
        return np.array(self._states), np.array(self._forces)


def by_rosbags(path: Path) -> tuple[Array, Array]:
    """Joint states, shape ``(n, 4)``, and forces, shape ``(n,)``."""
    from rosbags.highlevel import AnyReader

    columns = _Columns()
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            columns.add(connection.topic, reader.deserialize(raw, connection.msgtype))
    return columns.arrays()


def by_mcap_ros2(path: Path) -> tuple[Array, Array]:
    """The same from the ``.mcap`` file in ``path``."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    columns = _Columns()
    (file,) = path.glob("*.mcap")
    with file.open("rb") as stream:
        for _, channel, _, message in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            columns.add(channel.topic, message)
    return columns.arrays()


def prepare(folder: Path) -> Sequence[Pair]:
    """Against both, from one MCAP file; and against rosbags from SQLite3."""
    bags = {storage: folder / f"bag_{storage}" for storage in ("mcap", "sqlite3")}
    write_bag(bags["mcap"], "mcap", _N_SAMPLES)
    write_bag(bags["sqlite3"], "sqlite3", _N_SAMPLES)
    pairs = []
    for storage, name, read, needs in (
        ("mcap", "rosbags", by_rosbags, ""),
        ("sqlite3", "rosbags", by_rosbags, ""),
        ("mcap", "mcap-ros2-support", by_mcap_ros2, "mcap_ros2"),
    ):
        path = bags[storage]

        def mine(path: Path = path) -> float:
            begun = time.perf_counter()
            record = read_record(path)
            spent = time.perf_counter() - begun
            assert record.n_samples == _N_SAMPLES
            return spent

        def theirs(path: Path = path, read: Any = read) -> float:
            begun = time.perf_counter()
            states, forces = read(path)
            spent = time.perf_counter() - begun
            assert states.shape == (_N_SAMPLES, 4)
            assert forces.shape == (_N_SAMPLES,)
            return spent

        title = f"loading {2 * _N_SAMPLES:,} messages ({storage}), against {name}"
        pairs.append(Pair(title, mine, theirs, ">= 10", _TURNS, needs, even=True))
    return pairs


PEER = Peer("bag-readers", prepare)
