"""All recordings through one verb: found, worked on where that has not been done, and put together in one table."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa

from .job import Entry, Job
from .journal import Journal
from .pool import ALONE, Workers, worked
from .recordings import Found, content_hash, is_remote
from .table import Naming, names_of_parameters, table_of, write_table

__all__ = ["Batch", "Progress", "run_batch"]

Progress = Callable[[int, int, int], None]
"""Told how many recordings are done, of how many, and how many of these were refused."""


@dataclass(frozen=True, eq=False)
class Batch:
    """What came of a run.

    Attributes:
        table: a row per joint and recording.
        parameters: names of the model's parameters.
        worked: how many recordings were worked on now; the others had been before.
        seconds: of one core that this took [s].
        memory: largest memory of a worker [byte], of the recordings worked on now.
    """

    table: pa.Table
    parameters: tuple[str, ...]
    worked: int
    seconds: float
    memory: int

    @property
    def refused(self) -> int:
        """Number of rows that were refused."""
        return int(self.table["status"].to_pylist().count("refused"))


def run_batch(
    found: Found,
    job: Job,
    out: Path,
    *,
    naming: Naming | None = None,
    workers: Workers = ALONE,
    progress: Progress = lambda done, total, refused: None,
) -> Batch:
    """Work on every recording that has no result yet, and write ``results.parquet``.

    Args:
        found: the recordings.
        job: what is asked of each.
        out: folder of the results; what is finished is kept in its ``journal``.
        naming: of the axes; by folders when None.
        workers: who does the work.
        progress: told after every recording.

    Raises:
        InputError: the folder cannot be written, or no workers can be had.
    """
    naming = naming or Naming(found.recordings)
    done: dict[str, str] = {}  # key of the result, by path
    fresh: dict[str, Entry] = {}  # what has no key, by path
    spent, seconds, memory, refused = 0, 0.0, 0, 0
    with Journal(out / "journal" / job.digest[:12]) as journal:
        waiting: list[str] = []
        for path in found.recordings:
            key = _known(path, job, journal)
            if key:
                done[path] = key
            else:
                waiting.append(path)
        progress(len(done), len(found.recordings), 0)
        for path, entry in worked(waiting, job, workers):
            journal.add(entry)
            if entry["key"] and not entry.get("again"):
                done[path] = entry["key"]
            else:
                fresh[path] = entry
            spent, seconds, memory = spent + 1, seconds + entry["seconds"], max(memory, entry["memory"])
            refused += any(row["status"] == "refused" for row in entry["rows"])
            progress(len(done) + len(fresh), len(found.recordings), refused)
        table = table_of(_places(done, fresh, journal), job, naming)
    write_table(table, out / "results.parquet")
    return Batch(table, tuple(names_of_parameters(job)), spent, seconds, memory)


def _known(path: str, job: Job, journal: Journal) -> str:
    """Key of a result that there is already: of an unchanged file, or of the same content elsewhere; else empty."""
    if not journal.known:
        return ""
    key = journal.keys.get(job.signature(path), "")
    if key or is_remote(path):
        return key
    try:
        key = job.key(content_hash(Path(path), job.beside(Path(path))))
    except OSError:
        return ""
    return key if key in journal.known else ""


def _places(done: Mapping[str, str], fresh: Mapping[str, Entry], journal: Journal) -> Iterator[tuple[str, Entry]]:
    """Path and entry of each recording, one entry in memory at a time.

    Of entries with one key, the first that was kept: the same content at two places has one result.
    """
    places: dict[str, list[str]] = {}
    for path, key in done.items():
        places.setdefault(key, []).append(path)
    for entry in journal.entries():
        if not entry.get("again"):
            yield from ((path, entry) for path in places.pop(entry["key"], ()))
    yield from fresh.items()
