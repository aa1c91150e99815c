"""``fric identify --pieces``: combined parameters, what is refused, and a recording that would not fit into memory."""

from __future__ import annotations

import csv
import json
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fric.bagio import read_record, write_record
from fric.bench.long_recordings import TRUE, write_long_recording
from fric.model_file import read_model

Command = Callable[..., "subprocess.CompletedProcess[str]"]
Refusal = Callable[..., str]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """200 s; between 80 s and 120 s the axis stands."""
    folder = tmp_path_factory.mktemp("bags")
    record = read_record(write_long_recording(folder / "moving", 200.0 / 3600.0))
    stands = (record.time > 79.5) & (record.time < 120.5)
    position, effort = record.position.copy(), record.effort.copy()
    # Returned to where it goes on, too slowly to say anything.
    position[stands] = np.linspace(position[stands][0], position[stands][-1], int(stands.sum()))
    effort[stands] = 0.0
    return write_record(replace(record, position=position, effort=effort), folder / "bag")


def test_parameters_of_the_pieces_are_put_together(bag: Path, fric: Command, tmp_path: Path) -> None:
    done = fric("identify", bag, "--pieces", 40, "--json", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["pieces"]["all"] == 5
    assert found["pieces"]["used"] == 4
    (refused,) = found["pieces"]["refused"]
    assert (refused["begin"], refused["end"]) == (80.0, 120.0)
    for name, true in TRUE.items():
        entry = found["parameters"][name]
        assert entry["value"] == pytest.approx(true, rel=0.01), name
        assert entry["interval"][0] < entry["value"] < entry["interval"][1]
        assert entry["drift_interval"][0] < entry["drift_per_hour"] < entry["drift_interval"][1]
        assert entry["pieces"] == 4
    assert any(note.startswith("in 4 of 4 pieces: # s at rest") for note in found["notes"]), found["notes"]
    assert json.loads((tmp_path / "out" / "result.json").read_text()) == found
    assert read_model(tmp_path / "out" / "model.yaml").value("mass") == pytest.approx(TRUE["mass"], rel=0.01)
    rows = list(csv.DictReader((tmp_path / "out" / "pieces.csv").read_text().splitlines()))
    assert [row["status"].partition(":")[0] for row in rows] == ["used", "used", "refused", "used", "used"]
    assert float(rows[0]["mass low"]) < float(rows[0]["mass"]) < float(rows[0]["mass high"])
    assert rows[2]["mass"] == ""
    page = (tmp_path / "out" / "report.html").read_text()
    assert "coulomb.force" in page
    assert "Pieces left out" in page


def test_the_table_has_scatter_and_drift(bag: Path, fric: Command, tmp_path: Path) -> None:
    done = fric("identify", bag, "--pieces", 40, "--end", 75, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "scatter" in done.stdout
    assert "drift per hour" in done.stdout
    assert "2 of 2 pieces" in done.stdout
    again = fric("identify", bag, "--pieces", 40, "--end", 75, "--out", tmp_path / "out")
    assert again.returncode == 0, again.stderr


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--pieces", 0), "--pieces"),
        (("--pieces", 40, "--joint", "all"), "--joint all"),
        (("--pieces", 40, "--uncertainty", "sandwich"), "--uncertainty"),
        (("--pieces", 40, "--terms", "coulomb,time_drift"), "time_drift"),
        (("--pieces", 40, "--joint", "elbow"), "elbow"),
        (("--pieces", 40, "--time", "sun"), "--time"),
    ],
)
def test_what_needs_the_whole_recording_is_refused(
    bag: Path, fric: Command, refusal: Refusal, tmp_path: Path, more: tuple[object, ...], said: str
) -> None:
    assert said in refusal(fric("identify", bag, *more, "--out", tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_a_recording_that_does_not_fit_names_the_option(
    bag: Path, fric: Command, refusal: Refusal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fric.bagio.memory.available", lambda: 50_000_000)  # 200,000 samples take 128 MB
    line = refusal(fric("identify", bag, "--out", tmp_path / "out"))
    assert "--pieces" in line
    assert "0.13 GB" in line
