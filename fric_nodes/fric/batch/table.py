"""The results as one table: a row per joint and recording; columns of every verb, of this verb, and of the parameters."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from ..errors import InputError
from .job import Entry, Job
from .recordings import is_remote

__all__ = ["Naming", "names_of_parameters", "schema", "table_of", "write_table"]


class Naming:
    """Which axis a recording is of, and when it was made, from its path and its content.

    An axis is the text that the pattern's group ``axis`` finds in the path (or its first group, or all that it matches), a
    stroke, and the joint. Without a pattern, it is the recording's folder below the one that all have in common. The pattern's
    group ``time`` (a date, ISO 8601 or alike) goes before the time that the recording holds.
    """

    def __init__(self, recordings: Sequence[str], pattern: str = "") -> None:
        """Compile the pattern.

        Raises:
            InputError: it is no regular expression, or matches no recording.
        """
        try:
            self._pattern = re.compile(pattern) if pattern else None
        except re.error as error:
            raise InputError("--axis", f"is no regular expression ({error})", "give one such as 'machine_[0-9]+'") from None
        if self._pattern is not None and not any(self._pattern.search(path) for path in recordings):
            raise InputError("--axis", f"'{pattern}' is in no path, such as {recordings[0]}", "give one that matches paths")
        folders = [_folder(path) for path in recordings]
        alike = len({is_remote(path) for path in recordings}) == 1
        self._common = os.path.commonpath(folders) if alike else ""

    def axis(self, path: str, joint: str) -> str:
        """Name of the axis; of the machine alone where the joint is not known."""
        return "/".join(part for part in (self._machine(path), joint) if part)

    def _machine(self, path: str) -> str:
        if self._pattern is None:
            folder = os.path.relpath(_folder(path), self._common) if self._common else _folder(path)
            return "" if folder == "." else folder
        found = self._pattern.search(path)
        if found is None:
            return "?"
        groups = found.groupdict()
        plain = [text for k, text in enumerate(found.groups(), 1) if k != self._pattern.groupindex.get("time") and text]
        return str(groups.get("axis") or (plain[0] if plain else found[0]))

    def time(self, path: str, begin: int | None) -> datetime | None:
        """Time of the recording; None where neither the path nor the recording says it."""
        if self._pattern is not None and "time" in self._pattern.groupindex:
            import pandas as pd

            found = self._pattern.search(path)
            stamp = pd.to_datetime(found["time"] if found else None, utc=True, errors="coerce")
            if not pd.isna(stamp):
                told: datetime = stamp.to_pydatetime()
                return told
        if begin is None:
            return None
        return datetime.fromtimestamp(begin // 10**9, tz=timezone.utc).replace(microsecond=begin % 10**9 // 1000)


def _folder(path: str) -> str:
    return path.rstrip("/").rpartition("/")[0] if is_remote(path) else str(Path(path).absolute().parent)


def names_of_parameters(job: Job) -> list[str]:
    """Of the model, in its order; empty for a verb whose rows have none."""
    if job.parsed_model is None or not job.task.has_parameters:
        return []
    return [each.name for each in job.parsed_model.parameters()]


def schema(job: Job) -> pa.Schema:
    """The columns of the results of ``job``."""
    columns: dict[str, pa.DataType] = {
        "path": pa.string(),
        "axis": pa.string(),
        "joint": pa.string(),
        "hash": pa.string(),
        "time": pa.timestamp("us", tz="UTC"),
        "duration": pa.float64(),
        "rate": pa.float64(),
        "status": pa.string(),
        "refusal": pa.string(),
        **job.task.columns(),
    }
    for name in names_of_parameters(job):
        columns |= {name: pa.float64(), f"{name}.lower": pa.float64(), f"{name}.upper": pa.float64()}
    return pa.schema(list(columns.items()), metadata={"format": "fric-batch/1", "verb": job.verb, "model": job.model})


def table_of(places: Iterable[tuple[str, Entry]], job: Job, naming: Naming) -> pa.Table:
    """The table, in the order of the paths.

    Args:
        places: path of each recording and what came of it, in any order.
        job: what was asked.
        naming: of the axes.
    """
    form = schema(job)
    batches: list[pa.RecordBatch] = []
    rows: list[dict[str, Any]] = []
    for path, entry in places:
        rows += [_row(path, entry, row, naming) for row in entry["rows"]]
        if len(rows) >= 10_000:  # numerical: rows of Python objects take ten times the memory of columns
            batches.append(pa.RecordBatch.from_pylist(rows, schema=form))
            rows = []
    batches.append(pa.RecordBatch.from_pylist(rows, schema=form))
    table = pa.Table.from_batches(batches, schema=form)
    return table.take(pc.sort_indices(table, sort_keys=[("path", "ascending")]))  # stable: joints stay as they come


def _row(path: str, entry: Entry, row: Mapping[str, Any], naming: Naming) -> dict[str, Any]:
    found = {
        "path": path,
        "hash": entry["hash"] or None,
        "axis": naming.axis(path, row.get("joint", "")),
        "time": naming.time(path, row.get("time_ns")),
        **{name: value for name, value in row.items() if name not in {"parameters", "time_ns"}},
    }
    for name, (value, lower, upper) in row.get("parameters", {}).items():
        found |= {name: value, f"{name}.lower": lower, f"{name}.upper": upper}
    return found


def write_table(table: pa.Table, path: Path) -> None:
    """Write the table as Parquet, aside first.

    Raises:
        InputError: it cannot be written.
    """
    aside = path.with_name(f"{path.name}.tmp")
    try:
        with aside.open("wb") as file:
            pq.write_table(table, file, compression="zstd", row_group_size=100_000)
            file.flush()
            os.fsync(file.fileno())
        aside.replace(path)
    except OSError as error:
        aside.unlink(missing_ok=True)
        raise InputError(path, f"cannot be written ({error})", "choose a folder that you can write to") from None
