"""Periods of the loop in wall time: reckoned right, and measured on a real graph."""

from __future__ import annotations

import numpy as np
import pytest
from fric_nodes.benchmarks.wall_time import figures, sent


def test_late_messages_are_counted() -> None:
    stamps = 0.001 * np.arange(20_000, dtype=np.float64)
    stamps[10_000:] += 0.004  # one period of 5 ms
    stamps[15_000] += 0.0004  # 1.4 ms and 0.6 ms: no miss
    found = {each.name.partition(": ")[2]: each.value for each in figures(1000.0, "joint_states", stamps)}
    assert found["longest period"] == pytest.approx(5.0)
    assert found["periods longer than 1.5 nominal ones"] == 1.0
    assert found["period, 99 %"] == pytest.approx(1.0)
    assert found["period, 99.9 %"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.long
def test_four_processes_keep_a_moving_axis_at_its_rate() -> None:
    found = sent(100.0, 8.0)
    for stamps in found.values():
        assert stamps.shape[0] > 50  # how long the processes take to start is the machine's affair
        assert np.median(np.diff(np.sort(stamps))) == pytest.approx(0.01, rel=0.1)
