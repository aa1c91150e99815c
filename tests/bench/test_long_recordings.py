"""Recordings of hours: what is written, and the figures of short ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fric.bagio import read_record
from fric.bench.benchmarks import long_recordings
from fric.bench.long_recordings import DRIFT, TRUE, true_values, write_long_recording


def test_what_is_written_is_the_motion_under_that_force(tmp_path: Path) -> None:
    record = read_record(write_long_recording(tmp_path / "bag", 70.0 / 3600.0))
    assert record.n_samples == 70_000
    assert np.allclose(np.diff(record.time), 1e-3)
    # Speed and acceleration by differences over 20 ms, apart from reversals.
    wide, h = 20, 2e-2
    q = record.position
    v, a = (q[2 * wide :] - q[: -2 * wide]) / (2 * h), (q[2 * wide :] - 2 * q[wide:-wide] + q[: -2 * wide]) / h**2
    force = record.effort[wide:-wide]
    moves = np.abs(v) > 0.01
    columns = np.column_stack([a, np.sign(v), v, np.ones_like(v)])[moves]
    found = np.linalg.lstsq(columns, force[moves], rcond=None)[0]
    assert found == pytest.approx(list(TRUE.values()), rel=0.02)
    assert true_values(4.0)["viscous.coefficient"] == TRUE["viscous.coefficient"] + 2.0 * DRIFT


@pytest.mark.parametrize("power", [1.0, 1.7])
def test_the_power_with_which_time_grows_is_found(power: float) -> None:
    hours = [0.5, 1.0, 2.0, 4.0]
    slope, half = long_recordings._growth(hours, [3.0 * each**power * (1.0 + 0.01 * (-1) ** k) for k, each in enumerate(hours)])
    assert abs(slope - power) < half < 0.1


@pytest.mark.long
@pytest.mark.timeout(900)
def test_figures_of_short_recordings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_recordings, "_PIECE", 60.0)
    found = {each.name: each for each in long_recordings.figures((0.1,), tmp_path)}
    assert all(each.reached is not False for each in found.values()), found
    assert 100.0 < found["a sample identified as a whole"].value < 2000.0
    assert not list(tmp_path.rglob("*.mcap"))
