"""Many recordings through ``fric batch identify``: 20 s at 1 kHz each, one in a hundred broken.

One worker, then two; then two once more in a process that is killed five times on its way, and started again each time. The
recordings are made here, of ten axes with friction of their own, each with its own noise. The time holds everything: workers
that start, hashes, reading, fits and the table.
"""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from itertools import count
from pathlib import Path

import numpy as np

from ...bagio.write import write_record
from ...batch.fleet.look import fleet_of
from ...batch.fleet.page import fleet_page
from ...batch.job import Entry, Job
from ...batch.journal import Journal
from ...batch.pool import Workers
from ...batch.recordings import find
from ...batch.run import Batch, run_batch
from ...batch.table import Naming, names_of_parameters, table_of, write_table
from ...facade.structure import model_from
from ...figure import Figure
from ...model import build_model, term
from ...model_file import model_to_text
from ...record import Record
from ...simulation import simulate
from ..benchmark import Benchmark
from ..broken import BREAKS

__all__ = ["BENCHMARK"]

_RECORDINGS = 200
_DURATION, _RATE = 20.0, 1000.0  # [s], [Hz]
_AXES = 10
_DAY = 86_400 * 10**9  # [ns]
_FIRST = 1_772_323_200 * 10**9  # [ns since 1970]
_BROKEN = 100  # one in so many
_KILLS = 5
_RESULTS = 20_000  # made up, to be put together
_CODE = (
    "import sys; from pathlib import Path; from fric.bench.benchmarks.batch import worked; "
    "worked(Path(sys.argv[1]), Path(sys.argv[2]), 2)"
)


def _recording(axis: int, generator: np.random.Generator) -> Record:
    t = np.arange(int(_DURATION * _RATE)) / _RATE
    force = sum(
        20.0 * np.sin(2.0 * np.pi * f * t + p) for f, p in zip((0.2, 0.7, 1.9), generator.uniform(0, 6, 3), strict=True)
    )
    terms = [term("coulomb", force=12.0 + 0.2 * axis), term("viscous", coefficient=30.0), term("bias", force=1.0)]
    effort = np.asarray(force, dtype=np.float64) + 0.1 * generator.standard_normal(t.size)
    motion = simulate(build_model("rigid", {"mass": 5.0}, terms), effort, 1.0 / _RATE, hold="following")
    position = np.round(motion.position, 6)
    return Record(t, position, effort, joint="slide", effort_hold="following", source="benchmark")


def made(folder: Path, number: int) -> int:
    """Make so many recordings, and return how many of them are broken."""
    generator = np.random.default_rng(11)
    broken = 0
    ways = count()
    for k in range(number):
        bag = folder / f"machine_{k % _AXES}" / f"day_{k // _AXES:04d}" / "run"
        write_record(_recording(k % _AXES, generator), bag, compression="zstd", start_time_ns=_FIRST + k // _AXES * _DAY)
        if k % _BROKEN == _BROKEN // 2:
            BREAKS[next(ways) % len(BREAKS)][1](bag, generator)
            broken += 1
    return broken


def worked(folder: Path, out: Path, workers: int) -> Batch:
    """All recordings of a folder through ``identify``."""
    return run_batch(find([str(folder)], mapped=False), _job(), out, workers=Workers(workers))


def _timed(folder: Path, out: Path, workers: int) -> tuple[Batch, float]:
    start = time.perf_counter()
    found = worked(folder, out, workers)
    return found, time.perf_counter() - start


def _killed(folder: Path, out: Path, number: int) -> int:
    """How often the process was killed before it came to its end."""
    kills = 0
    while True:
        enough = (kills + 1) * number // (_KILLS + 1)
        process = subprocess.Popen([sys.executable, "-c", _CODE, str(folder), str(out)])
        while process.poll() is None:
            if kills < _KILLS and _lines(out) >= enough:
                process.send_signal(signal.SIGKILL)
                process.wait()
                kills += 1
                break
            time.sleep(0.02)
        if process.returncode != -signal.SIGKILL:
            if process.returncode != 0:
                raise RuntimeError(f"the batch ended with status {process.returncode}")
            return kills


def _lines(out: Path) -> int:
    return sum(path.read_bytes().count(b"\n") for path in out.glob("journal/*/journal.jsonl"))


def _entry(k: int, names: Sequence[str], generator: np.random.Generator) -> Entry:
    """A finished recording, made up: one of a hundred days of an axis."""
    axes = _RESULTS // 100
    values = (10.0 + generator.standard_normal(len(names))).tolist()
    row = {
        "joint": "slide",
        "time_ns": _FIRST + k // axes * _DAY,
        "status": "ok",
        "duration": _DURATION,
        "rate": _RATE,
        "parameters": {name: [value, value - 0.1, value + 0.1] for name, value in zip(names, values, strict=True)},
        "verdict": "converged; every fitted parameter is determined",
    }
    key = f"{k:032x}"
    return {"signature": key, "hash": key, "key": key, "rows": [row], "seconds": 0.3, "memory": 0}


def _put_together(folder: Path) -> tuple[float, float]:
    """Time to make table and page of finished results, per 1,000 of them [s], and what the results take on the disk [byte]."""
    job, generator = _job(), np.random.default_rng(12)
    names = names_of_parameters(job)
    with Journal(folder) as journal:
        for k in range(_RESULTS):
            journal.add(_entry(k, names, generator))
        start = time.perf_counter()
        places = ((f"machine_{k % (_RESULTS // 100)}/{entry['key']}", entry) for k, entry in enumerate(journal.entries()))
        table = table_of(places, job, Naming(["machine_0/0", "machine_1/0"]))
        write_table(table, folder / "results.parquet")
        page = fleet_page(fleet_of(table, names), table, job.verb)
        spent = time.perf_counter() - start
    if "machine_" not in page:
        raise RuntimeError("the page shows no axis")
    size = sum(path.stat().st_size for path in folder.iterdir())
    return 1e3 * spent / _RESULTS, size / _RESULTS


def _job() -> Job:
    return Job("identify", model_to_text(model_from("coulomb,viscous,bias")))


def run(number: int = _RECORDINGS) -> list[Figure]:
    """Throughput with one worker and with two, and what kills cost."""
    root = Path(tempfile.mkdtemp(prefix="fric-batch-"))
    try:
        broken = made(root / "logs", number)
        size = sum(path.stat().st_size for path in (root / "logs").rglob("*.mcap"))
        one, alone = _timed(root / "logs", root / "one", 1)
        two, both = _timed(root / "logs", root / "two", 2)
        start = time.perf_counter()
        kills = _killed(root / "logs", root / "killed", number)
        killed = time.perf_counter() - start
        texts = [(root / name / "results.parquet").read_bytes() for name in ("one", "two", "killed")]
        again = _timed(root / "logs", root / "one", 1)[1]
        per_thousand, size_of_result = _put_together(root / "results")
    finally:
        shutil.rmtree(root, ignore_errors=True)
    paths = two.table["path"].to_pylist()
    return [
        Figure(f"{number} recordings of 20 s at 1 kHz, {size / number / 1e6:.2g} MB each: one worker", number / alone, "1/s"),
        Figure("two workers", number / both, "1/s"),
        Figure("how many times faster with two", alone / both, "1", ">= 1.8"),
        Figure("time of a core for one recording", 1e3 * one.seconds / number, "ms"),
        Figure("largest memory of a worker", max(one.memory, two.memory) / 1e6, "MB", "<= 2000"),
        Figure("recordings with a row", float(len(set(paths))), "1", f"== {number}"),
        Figure(f"refused, of {broken} that were broken", float(two.refused), "1", f"<= {broken}"),
        Figure(f"two workers, killed {kills} times on the way", number / killed, "1/s"),
        Figure("runs with the same results, to the last byte", float(texts.count(texts[0])), "1", "== 3"),
        Figure("a run with nothing left to do", again, "s"),
        Figure(f"table and page, per 1,000 results ({_RESULTS:,} of them)", per_thousand, "s"),
        Figure("a result on the disk, in journal and table", size_of_result, "byte"),
    ]


BENCHMARK = Benchmark("batch", "many recordings by workers", run, long=True, sized=run)
