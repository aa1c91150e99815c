"""Loading a bag of 60 s at 1 kHz: 60,000 JointState and as many force commands into arrays."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from ...bagio.encode import joint_state_messages, stamped_force_messages
from ...bagio.read import read_record
from ...bagio.write import BagWriter, Storage
from ...figure import Figure
from ..benchmark import Benchmark

__all__ = ["BENCHMARK", "write_bag"]

_N_SAMPLES = 60_000
_REPEATS = 3


def write_bag(path: Path, storage: Storage, n_samples: int = _N_SAMPLES) -> None:
    """Write joint states and force commands, so many of each at 1 kHz."""
    stamp = np.arange(n_samples, dtype=np.int64) * 1_000_000
    signal = np.sin(np.arange(n_samples) * 1e-3)
    with BagWriter(path, storage=storage) as bag:
        bag.topic("/joint_states", "sensor_msgs/msg/JointState")
        bag.topic("/force_command", "fric_interfaces/msg/StampedForce")
        states = joint_state_messages(stamp, "axis", signal, np.gradient(signal), 10 * signal)
        commands = stamped_force_messages(stamp, "", 10 * signal)
        for at, state, command in zip(stamp.tolist(), states, commands, strict=True):
            bag.write("/joint_states", at, state)
            bag.write("/force_command", at, command)


def run() -> list[Figure]:
    """Best of a few loads, per storage."""
    figures = []
    storages: tuple[Storage, ...] = ("mcap", "sqlite3")
    with tempfile.TemporaryDirectory() as folder:
        for storage in storages:
            path = Path(folder) / storage
            write_bag(path, storage)
            spent = []
            for _ in range(_REPEATS):
                start = time.perf_counter()
                record = read_record(path)
                spent.append(time.perf_counter() - start)
            assert record.n_samples == _N_SAMPLES
            figures.append(Figure(f"load 60 s at 1 kHz, {storage}", min(spent), "s", "<= 0.5"))
    return figures


BENCHMARK = Benchmark("recordings", "loading a recording", run)
