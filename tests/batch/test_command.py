"""The command: its status, its one line for what it refuses, its progress, and what it leaves in a folder."""

from __future__ import annotations

import contextlib
import io
import json
import sys
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from fric_nodes.cli.batch import Progress
from fric_nodes.cli.main import main


def fric(*arguments: object, monkeypatch: pytest.MonkeyPatch) -> tuple[int, str, str]:
    """Status, standard output and standard error of the command, called in this process."""
    monkeypatch.setattr(sys, "argv", ["fric", "batch", *map(str, arguments)])
    out, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error), pytest.raises(SystemExit) as end:
        main()
    return int(end.value.code or 0), out.getvalue(), error.getvalue()


Command = Callable[..., tuple[int, str, str]]
_WITHOUT_FRICTION = """format: fric-model/1
joint: axis
units: {position: m, force: N}
plant: {type: rigid, mass: 5.0}
terms: [{effect: viscous, coefficient: 30.0}]
"""


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch) -> Command:
    return lambda *arguments: fric(*arguments, monkeypatch=monkeypatch)


def test_identify_ends_with_0_and_with_1_when_a_recording_is_refused(logs: Path, tmp_path: Path, command: Command) -> None:
    run = (
        "identify",
        logs,
        "--terms",
        "coulomb,viscous",
        "--workers",
        0,
        "--axis",
        "machine_[0-9]+",
        "--out",
        tmp_path / "out",
    )
    status, out, error = command(*run)
    assert status == 0, error
    assert "5 results of 2 axes" in out
    assert "5 of 5 recordings, 0 refused" in error
    (logs / "machine_1" / "bad.mcap").write_bytes(b"none")
    status, out, _ = command(*run, "--json")
    assert status == 1
    found = json.loads(out)
    assert (found["rows"], found["refused"], found["axes"], found["axis_days"]) == (6, 1, 2, 5)
    assert json.loads((tmp_path / "out" / "batch.json").read_text()) == found
    assert "is not an MCAP file" in (tmp_path / "out" / "fleet.html").read_text()


def test_doctor_and_a_mapping(tmp_path: Path, command: Command) -> None:
    import numpy as np

    from .conftest import recording

    record = recording(3)
    table = np.column_stack([record.time, record.position, record.effort])
    np.savetxt(tmp_path / "run.csv", table, delimiter=",", header="t,q,u", comments="")
    (tmp_path / "map.yaml").write_text(
        "joint: z\ntime: {from: t, unit: s}\nposition: {from: q, unit: m}\neffort: {from: u, unit: N}\n"
    )
    status, out, error = command(
        "doctor", tmp_path / "run.csv", "--map", tmp_path / "map.yaml", "--workers", 0, "--out", tmp_path / "o"
    )
    assert status == 0, out + error
    (row,) = pq.read_table(tmp_path / "o" / "results.parquet").to_pylist()
    assert (row["joint"], row["axis"], row["time"], row["status"]) == ("z", "z", None, "ok")
    assert {each["check"] for each in row["checks"]} > {"stamps"}


def test_a_search_that_is_ended_is_told_and_another_bound_is_another_job(good: Path, tmp_path: Path, command: Command) -> None:
    (tmp_path / "model.yaml").write_text(_WITHOUT_FRICTION)
    run = ("diagnose", good / "machine_2" / "day_0", "--model", tmp_path / "model.yaml", "--workers", 0, "--reports", 0)
    out = ("--out", tmp_path / "out", "--at-most")
    for seconds, worked in ((1e-3, "1 worked on now"), (1e-3, "none to work on"), (2e-3, "1 worked on now")):
        status, printed, error = command(*run, *out, seconds)
        assert status == 0, error
        assert worked in printed
        (row,) = pq.read_table(tmp_path / "out" / "results.parquet").to_pylist()
        assert any("the search was ended after the time that was asked for" in note for note in row["notes"])
        assert row["mismatch"]
    status, _, error = command(*run, *out, 0)
    assert status == 2
    assert "--at-most: 0 s is no time" in error


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nowhere/*.mcap"], "matches nothing"),
        (["LOGS", "--axis", "("], "no regular expression"),
        (["LOGS", "--workers", "-1"], "give 0 or more"),
        (["LOGS", "--time", "noon"], "use stamp or log"),
        (["LOGS", "--terms", "glue"], "glue"),
        (["LOGS", "--workers", "1", "--memory", "much"], "which is no size"),
        (["nostore://bucket/x"], "cannot be opened"),
    ],
)
def test_bad_input_is_one_line_and_status_2(
    arguments: list[str], says: str, good: Path, tmp_path: Path, command: Command
) -> None:
    given = [str(good) if each == "LOGS" else each for each in arguments]
    status, _, error = command("identify", *given, "--out", tmp_path / "out")
    assert status == 2, error
    (line,) = [each for each in error.splitlines() if each.startswith("fric: ")]
    assert says in line
    assert "Traceback" not in error


def test_without_dask_the_remedy_is_named(
    good: Path, tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    status, _, error = command("identify", good, "--workers", 2, "--out", tmp_path / "out")
    assert status == 2
    assert "pip install 'fric[batch]'" in error


def test_what_others_wrote_is_not_replaced(good: Path, tmp_path: Path, command: Command) -> None:
    (tmp_path / "fleet.html").write_text("mine")
    status, _, error = command("identify", good, "--workers", 0, "--out", tmp_path)
    assert status == 2
    assert "fleet.html was not written by this command" in error
    assert (tmp_path / "fleet.html").read_text() == "mine"


def test_progress_is_a_line_now_and_then_in_a_pipe_and_one_that_changes_on_a_terminal() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    for stream, lines in ((io.StringIO(), 4), (Terminal(), 1)):
        now = [0.0]
        with contextlib.redirect_stderr(stream):
            shown = Progress(lambda held=now: held[0])
            for done in range(31):
                shown(done, 30, 1)
                now[0] += 1.0
            shown.end()
        text = stream.getvalue()
        assert text.count("\n") == lines, text
        assert "30 of 30 recordings, 1 refused" in text
        assert "1 per s, about 19 s left" in text or lines == 4
