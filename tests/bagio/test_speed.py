"""Loading time of a long recording: 60 s at 1 kHz, joint states and commands."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from fric_nodes.bagio import BagWriter, read_record
from fric_nodes.bagio.encode import float64_messages, joint_state_messages, stamped_force_messages

N = 60_000
LIMIT = 1.5  # [s]; on an idle machine a third of a second, and CI machines are slower


@pytest.mark.parametrize("command", ["Float64", "StampedForce"])
@pytest.mark.parametrize(("storage", "compression"), [("mcap", "none"), ("mcap", "zstd"), ("sqlite3", "none")])
def test_loads_fast(tmp_path: Any, storage: Any, compression: Any, command: str) -> None:
    stamps = 1_700_000_000_000_000_000 + np.arange(N, dtype=np.int64) * 1_000_000
    position = np.sin(np.arange(N) * 1e-3)
    effort = np.cos(np.arange(N) * 1e-3)
    states = joint_state_messages(stamps, "axis", position, None, None)
    stamped = command == "StampedForce"
    forces = stamped_force_messages(stamps, "axis", effort) if stamped else float64_messages(effort)
    with BagWriter(tmp_path / "bag", storage=storage, compression=compression, flush_period=None) as bag:
        bag.topic("/joint_states", "sensor_msgs/msg/JointState")
        bag.topic("/force_command", "fric_interfaces/msg/StampedForce" if stamped else "std_msgs/msg/Float64")
        for k, stamp in enumerate(stamps.tolist()):
            bag.write("/joint_states", stamp, states[k])
            bag.write("/force_command", stamp, forces[k])
    start = time.perf_counter()
    record = read_record(tmp_path / "bag")
    elapsed = time.perf_counter() - start
    print(f"{storage} {compression} {command}: {elapsed:.3f} s for 2 x {N} messages")
    np.testing.assert_array_equal(record.position, position)
    np.testing.assert_array_equal(record.effort, effort)
    assert elapsed < LIMIT
