"""A batch from recordings to its table: every recording has its row, nothing is done twice, nothing is lost by a kill."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
import zlib
from dataclasses import replace
from pathlib import Path

import fric
import numpy as np
import pyarrow.parquet as pq
import pytest
from fric.batch.fleet.look import Item, fleet_of
from fric.batch.fleet.page import fleet_page
from fric.batch.job import Job
from fric.batch.journal import Journal
from fric.batch.notable import reports_of
from fric.batch.pool import ALONE, Workers, client_of
from fric.batch.recordings import find
from fric.batch.run import Batch, run_batch
from fric.batch.table import Naming

from .conftest import BROKEN

_COMMAND = "from fric_nodes.cli.main import main; main()"


def run(folder: Path, job: Job, out: Path, workers: Workers = ALONE, axis: str = "") -> Batch:
    found = find([str(folder)], bool(job.mapping))
    return run_batch(found, job, out, naming=Naming(found.recordings, axis), workers=workers)


def test_the_rows_are_what_the_facade_finds(good: Path, job: Job, tmp_path: Path) -> None:
    run(good, job, tmp_path, axis="machine_[0-9]+")
    table = pq.read_table(tmp_path / "results.parquet")
    assert table["axis"].to_pylist() == ["machine_1/axis"] * 3 + ["machine_2/axis"] * 2
    assert [str(stamp.date()) for stamp in table["time"].to_pylist()[:3]] == ["2026-03-01", "2026-03-02", "2026-03-03"]
    row = table.to_pylist()[3]
    alone = fric.identify(row["path"], job.parsed_model)
    assert row["coulomb.force"] == alone["coulomb.force"]
    error = alone.model.standard_errors["coulomb.force"]
    assert row["coulomb.force.upper"] - row["coulomb.force.lower"] == pytest.approx(2 * 1.96 * error, rel=1e-3)
    assert row["coulomb.force.lower"] < 12.0 < row["coulomb.force.upper"] or abs(row["coulomb.force"] - 12.0) < 0.2
    assert (row["rate"], row["status"], row["refusal"]) == (pytest.approx(500.0), "ok", None)
    assert row["noe"] == alone.result.train.noe


def test_what_is_finished_is_not_done_again(logs: Path, job: Job, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(logs, job, out).worked == 5
    first = (out / "results.parquet").read_bytes()
    assert run(logs, job, out).worked == 0
    assert (out / "results.parquet").read_bytes() == first
    (logs / "machine_1" / "day_0").rename(logs / "machine_1" / "day_9")  # the same content elsewhere
    moved = run(logs, job, out)
    assert moved.worked == 0
    assert "day_9" in moved.table["path"].to_pylist()[2]
    other = Job("identify", job.model, {"cutoff": 40.0})
    assert run(logs, other, out).worked == 5
    assert run(logs, job, out).worked == 0


def test_every_broken_recording_is_reported_and_stops_none(logs: Path, job: Job, tmp_path: Path) -> None:
    source = logs / "machine_2" / "day_0" / "run"
    for name, breaks in BROKEN.items():
        bag = logs / "broken" / name.replace(" ", "_")
        shutil.copytree(source, bag)
        breaks(bag)
    (logs / "broken" / "text.mcap").write_text("no recording")
    found = run(logs, job, tmp_path / "out")
    rows = {Path(row["path"]).name: row for row in found.table.to_pylist() if "/broken/" in row["path"]}
    assert len(rows) == len(BROKEN) + 1
    good = [row for row in found.table.to_pylist() if "/broken/" not in row["path"]]
    assert [row["status"] for row in good] == ["ok"] * 5
    refused = {name: row["refusal"] for name, row in rows.items() if row["status"] == "refused"}
    # Overwritten bytes may leave enough of a recording to be read record by record.
    assert set(rows) - set(refused) <= {"bytes_overwritten"}
    assert all(line and "\n" not in line and "Traceback" not in line and str(logs) not in line for line in refused.values())
    assert not any("error of fric" in line for line in refused.values()), refused


def test_a_worker_keeps_the_memory_of_one_recording_for_the_next() -> None:
    def pages_taken() -> int:
        """New pages of a hundred arrays, as long as those of a recording, of which each is freed before the next."""
        import resource

        def taken() -> int:
            return resource.getrusage(resource.RUSAGE_SELF).ru_minflt

        for _ in range(3):
            np.ones(20_000)
        before = taken()
        for _ in range(100):
            np.ones(20_000)
        return taken() - before

    with client_of(Workers(1)) as client:
        assert client.submit(pages_taken).result(timeout=60) < 400  # 40 pages each, where none is kept
        # Dask's profile of its own work would grow by 8 MB a minute.
        assert not any(client.run(lambda dask_worker: "profile" in dask_worker.periodic_callbacks).values())


@pytest.mark.long
def test_workers_that_die_cost_their_recording_only(logs: Path, job: Job, tmp_path: Path) -> None:
    mapping = "time: {from: t, unit: s}\nposition: {from: q, unit: m}\neffort: {from: u, unit: N}\n"
    nothing = np.zeros(80_000_000)  # 640 MB that take 0.6 MB on the disk
    np.savez_compressed(logs / "bomb.npz", t=nothing, q=nothing[:1], u=nothing[:1])
    mapped = Job(job.verb, job.model, mapping=mapping)
    found = run(logs, mapped, tmp_path / "out", Workers(2, "700MB"))
    refused = [row for row in found.table.to_pylist() if row["status"] == "refused"]
    assert [Path(row["path"]).name for row in refused] == ["bomb.npz"]
    assert "died twice" in refused[0]["refusal"]
    assert found.memory < 0.7e9
    alone = run(logs / "machine_1", mapped, tmp_path / "alone")
    assert alone.table["noe"].to_pylist() == found.table.slice(1, 3)["noe"].to_pylist()
    # That was for want of memory, and is tried again.
    again = run(logs, Job(job.verb, job.model, mapping=mapping), tmp_path / "out")
    assert again.worked == 1
    assert "died" not in again.table["refusal"].to_pylist()[0]


@pytest.mark.long
def test_kills_lose_nothing_and_change_nothing(good: Path, job: Job, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ["batch", "identify", str(good), "--terms", "coulomb,viscous", "--workers", "0", "--out"]
    command = [sys.executable, "-c", _COMMAND, *arguments]
    held: list[int] = []
    for enough in (1, 3):
        process = subprocess.Popen([*command, str(out)], stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 100.0
        while process.poll() is None and time.monotonic() < deadline:
            if len(_lines(out)) >= enough:
                process.send_signal(signal.SIGKILL)
            time.sleep(0.002)
        process.wait()
        held.append(len(_lines(out)))
    assert held[0] >= 1
    assert held[1] >= 3
    done = subprocess.run([*command, str(out), "--json"], capture_output=True, text=True, check=False, timeout=110)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["rows"] == 5
    assert len({json.loads(line.partition(b" ")[2])["key"] for line in _lines(out)}) == len(_lines(out)) == 5
    run(good, job, tmp_path / "whole")
    assert (out / "results.parquet").read_bytes() == (tmp_path / "whole" / "results.parquet").read_bytes()


def _lines(out: Path) -> list[bytes]:
    held = [path.read_bytes() for path in out.glob("journal/*/journal.jsonl")]
    return [line for text in held for line in text.splitlines(keepends=True) if line.endswith(b"\n")]


def test_what_comes_first_has_its_report(good: Path, job: Job, tmp_path: Path) -> None:
    found = run(good, job, tmp_path, axis="machine_[0-9]+")
    fleet = fleet_of(found.table, found.parameters)
    items = tuple(Item(axis, "mass", "steps", "2026-03-02", 9.0) for axis in ("machine_2/axis", "nowhere", "machine_2/axis"))
    pages, names, failed = reports_of(replace(fleet, items=items), job, 3)
    assert (list(pages), names, failed) == (["01_machine_2_axis.html"], {"machine_2/axis": "01_machine_2_axis.html"}, [])
    assert "coulomb.force" in pages["01_machine_2_axis.html"]
    page = fleet_page(fleet, found.table, "identify", {"machine_2/axis": "reports/a b.html"})
    assert '<a href="reports/a%20b.html">machine_2/axis</a>' in page


# The journal


def _entry(k: int) -> dict[str, object]:
    return {"signature": f"s{k}", "hash": f"h{k}", "key": f"k{k}", "rows": [{"joint": "ä", "noe": 0.1 * k}], "memory": 1}


def test_a_journal_cut_anywhere_holds_what_was_whole(tmp_path: Path) -> None:
    with Journal(tmp_path / "a") as journal:
        for k in range(6):
            journal.add(_entry(k))
    data = (tmp_path / "a" / "journal.jsonl").read_bytes()
    for at in np.random.default_rng(3).integers(0, len(data), 40).tolist():
        (tmp_path / "b").mkdir(exist_ok=True)
        (tmp_path / "b" / "journal.jsonl").write_bytes(data[:at] + bytes(at % 3))  # zeros, as a loss of power leaves them
        with Journal(tmp_path / "b") as journal:
            whole = data[:at].count(b"\n")
            assert [each["key"] for each in journal.entries()] == [f"k{k}" for k in range(whole)]
            journal.add(_entry(9))
            assert [each["key"] for each in journal.entries()][-1] == "k9"


def test_parts_hold_what_the_journal_held(tmp_path: Path) -> None:
    with Journal(tmp_path, part_size=4) as journal:
        for k in range(10):
            journal.add(_entry(k))
    assert sorted(path.name for path in tmp_path.glob("part-*")) == ["part-000001.parquet", "part-000002.parquet"]
    # Killed between a part and the new journal: the lines are in both.
    part, line = tmp_path / "part-000002.parquet", (tmp_path / "journal.jsonl").read_bytes()
    doubled = pq.read_table(part)["entry"].to_pylist()[-1].encode()
    (tmp_path / "journal.jsonl").write_bytes(b"%08x %s\n" % (zlib.crc32(doubled), doubled) + line)
    with Journal(tmp_path, part_size=4) as journal:
        assert [each["rows"] for each in journal.entries()] == [_entry(k)["rows"] for k in (*range(8), 7, 8, 9)]
        assert len(journal.known) == 10
        with pytest.raises(fric.InputError, match="in use by another run"):
            Journal(tmp_path)
    assert line.count(b"\n") == 2


# Finding


def test_patterns_stand_for_bags_files_and_folders(good: Path, tmp_path: Path) -> None:
    bags = find([str(good)], mapped=False).recordings
    assert len(bags) == 5
    assert all(Path(path).name == "run" for path in bags)
    assert find([f"{good}/machine_1/**/*.mcap", str(good / "machine_1")], mapped=False).recordings == bags[:3]
    loose = tmp_path / "loose"
    loose.mkdir()
    for k, bag in enumerate(bags[:2]):
        shutil.copy(next(Path(bag).glob("*.mcap")), loose / f"log{k}.mcap")
    (loose / "notes.txt").write_text("x")
    assert [Path(path).name for path in find([str(loose)], mapped=False).recordings] == ["log0.mcap", "log1.mcap"]
    assert find([f"{loose}/*"], mapped=False).left_out == (str(loose / "notes.txt"),)
    with pytest.raises(fric.InputError, match="matches nothing"):
        find([f"{loose}/*.bag"], mapped=False)
    with pytest.raises(fric.InputError, match="holds no recording"):
        find([str(loose / "notes.txt")], mapped=False)


def test_a_store_behind_a_url_gives_the_same_rows(good: Path, job: Job, tmp_path: Path) -> None:
    import fsspec

    store = fsspec.filesystem("memory")
    store.put(f"{good}/machine_2/", "/logs/machine_2/", recursive=True)
    try:
        found = find(["memory://logs"], mapped=False)
        assert len(found.recordings) == 2
        distant = run_batch(found, job, tmp_path / "distant")
        near = run(good / "machine_2", job, tmp_path / "near")
        for name in ("hash", "coulomb.force", "time", "status"):
            assert distant.table[name].to_pylist() == near.table[name].to_pylist()
    finally:
        store.rm("/logs", recursive=True)


def test_axes_and_times_come_from_the_path() -> None:
    paths = ["/data/m1/2026-05-01T07/a", "/data/m2/2026-05-02T07/b", "/data/c"]
    naming = Naming(paths, r"/(?P<axis>m\d)/(?P<time>[0-9T-]+)/")
    assert [naming.axis(path, "j") for path in paths] == ["m1/j", "m2/j", "?/j"]
    assert str(naming.time(paths[0], None)) == "2026-05-01 07:00:00+00:00"
    assert naming.time(paths[2], None) is None
    assert Naming(paths).axis(paths[0], "j") == "m1/2026-05-01T07/j"
    beside = ["m1/a", "m2/a"]
    assert [Naming(beside).axis(path, "j") for path in beside] == ["m1/j", "m2/j"]
    stored = ["s3://store/logs/m1/a", "s3://store/logs/m2/a"]
    assert [Naming(stored).axis(path, "j") for path in stored] == ["m1/j", "m2/j"]
    assert Naming(["m1/a", f"{Path.cwd()}/m2/a"]).axis("m1/a", "j") == "m1/j"
    assert Naming(beside[:1]).axis("m1/a", "") == ""
    with pytest.raises(fric.InputError, match="no regular expression"):
        Naming(paths, "(")
    with pytest.raises(fric.InputError, match="is in no path"):
        Naming(paths, "nowhere")
    assert os.sep == "/"
