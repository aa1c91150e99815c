"""A process killed while it records leaves a bag that reads up to the last half second."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from fric.bagio import read_record, read_series
from fric.record import Units

RECORDER = """
import sys, time
import numpy as np
from fric.bagio import BagWriter
from fric.bagio.encode import joint_state_messages

metadata = {"fric.position_unit": "rad", "fric.force_unit": "N m", "fric.effort_hold": "preceding"}
with BagWriter(sys.argv[1], storage=sys.argv[2], compression=sys.argv[3], metadata=metadata) as bag:
    bag.topic("/joint_states", "sensor_msgs/msg/JointState")
    for k in range(100000):
        now = time.time_ns()
        one = joint_state_messages(np.array([now]), "axis", np.array([float(k)]), None, np.array([-float(k)]))
        bag.write("/joint_states", now, one[0])
        if k == 0:
            print("recording", flush=True)
        time.sleep(0.001)
"""


@pytest.mark.parametrize(
    ("storage", "compression"), [("mcap", "none"), ("mcap", "zstd"), ("sqlite3", "none"), ("sqlite3", "zstd")]
)
def test_killed_recorder(tmp_path: Path, storage: str, compression: str) -> None:
    path = tmp_path / "bag"
    command = [sys.executable, "-c", RECORDER, str(path), storage, compression]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as recorder:
        assert recorder.stdout is not None
        assert recorder.stdout.readline() == "recording\n"
        time.sleep(1.6)
        recorder.kill()
        killed_ns = time.time_ns()
    files = {file.name: file.read_bytes() for file in path.iterdir()}
    assert "metadata.yaml" not in files

    record = read_record(path, time="log", repair=True)  # a busy machine may leave gaps
    np.testing.assert_array_equal(record.position, np.arange(record.n_samples))
    np.testing.assert_array_equal(record.effort, -np.arange(record.n_samples))
    assert (record.units, record.effort_hold) == (Units("rad", "N m"), "preceding")
    assert any("metadata.yaml is missing" in note for note in record.notes)
    lost = (killed_ns - int(read_series(path, "/joint_states").log_ns[-1])) * 1e-9
    print(f"{storage} {compression}: {record.n_samples} samples, {lost:.3f} s lost")
    assert lost < 1.0

    # The user's files are as they were.
    assert {file.name: file.read_bytes() for file in path.iterdir()} == files
