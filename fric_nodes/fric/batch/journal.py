"""What is finished, kept so that a process that is killed at any moment loses no more than what it was working on.

Each finished recording is one line of JSON, with a checksum in front, at the end of ``journal.jsonl``, handed to the operating
system at once and to the disk every second. After so many lines, they become a file ``part-NNNNNN.parquet``, written aside and
renamed, and the journal begins anew. A line that was cut off is dropped when the journal is opened; a line that is in a part
already (killed between the two) counts once. After a loss of power, at most the lines of the last second are missing.
"""

from __future__ import annotations

import fcntl
import json
import os
import time
import zlib
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import IO

import pyarrow as pa
import pyarrow.parquet as pq

from ..errors import InputError
from .job import Entry

__all__ = ["Journal"]

_ENTRIES_OF_A_PART = 10_000  # numerical: a part of some MB, a hundred of them for 10^6 recordings
_SYNC = 1.0  # [s], physical: the most that a loss of power costs
_FIELDS = ("signature", "key", "again")


class Journal:
    """The finished recordings of one job in one folder; a context manager. One process at a time writes it."""

    def __init__(self, folder: Path, part_size: int = _ENTRIES_OF_A_PART) -> None:
        """Open, and make the folder when it is missing.

        Raises:
            InputError: it cannot be written, or another process is at it.
        """
        self.folder = folder
        self._size = part_size
        self._synced = 0.0
        self._lines = 0
        self.keys: dict[str, str] = {}
        """Key of the result by signature of the recording; those that are to be tried again are not among them."""
        self.known: set[str] = set()
        """Keys of all results."""
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._lock = _locked(folder)
            for part in self._parts():
                table = pq.read_table(part, columns=list(_FIELDS))
                for signature, key, again in zip(*(table[name].to_pylist() for name in _FIELDS), strict=True):
                    self._note(signature, key, again)
            self._file = self._opened()
        except (OSError, pa.ArrowInvalid) as error:
            raise InputError(folder, f"cannot be used ({error})", "choose another --out") from None

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Put everything on the disk."""
        self._sync()
        self._file.close()
        self._lock.close()

    def add(self, entry: Entry) -> None:
        """Keep what came of a recording.

        Raises:
            InputError: the disk refuses.
        """
        text = json.dumps(entry, separators=(",", ":"), ensure_ascii=False).encode()
        try:
            self._file.write(b"%08x %s\n" % (zlib.crc32(text), text))
            self._file.flush()
            if time.monotonic() - self._synced > _SYNC:
                self._sync()
            self._note(entry["signature"], entry["key"], entry.get("again", False))
            self._lines += 1
            if self._lines >= self._size:
                self._seal()
        except OSError as error:
            raise InputError(self.folder, f"cannot be written ({error})", "free space, and start again: it goes on") from None

    def entries(self) -> Iterator[Entry]:
        """Every entry, the latest of a recording last."""
        for part in self._parts():
            for batch in pq.ParquetFile(part).iter_batches(batch_size=1000, columns=["entry"]):
                yield from (json.loads(each) for each in batch.column(0).to_pylist())
        yield from self._whole_lines()

    def _note(self, signature: str, key: str, again: bool) -> None:
        if key and not again:
            self.known.add(key)
            if signature:
                self.keys[signature] = key

    def _parts(self) -> list[Path]:
        return sorted(self.folder.glob("part-*.parquet"))

    @property
    def _path(self) -> Path:
        return self.folder / "journal.jsonl"

    def _whole_lines(self) -> Iterator[Entry]:
        if not self._path.exists():
            return
        with self._path.open("rb") as file:
            for line in file:
                entry = _entry(line)
                if entry is None:
                    return
                yield entry

    def _opened(self) -> IO[bytes]:
        """The journal, behind its last whole line."""
        whole = 0
        if self._path.exists():
            with self._path.open("rb") as file:
                for line in file:
                    entry = _entry(line)
                    if entry is None:
                        break
                    whole += len(line)
                    self._lines += 1
                    self._note(entry["signature"], entry["key"], entry.get("again", False))
        journal = self._path.open("ab")
        journal.truncate(whole)
        return journal

    def _sync(self) -> None:
        self._file.flush()
        os.fsync(self._file.fileno())
        self._synced = time.monotonic()

    def _seal(self) -> None:
        """Make a part of the journal, and begin anew."""
        entries = list(self._whole_lines())
        columns: dict[str, list[object]] = {name: [each.get(name) for each in entries] for name in ("signature", "key")}
        columns["again"] = [bool(each.get("again")) for each in entries]
        columns["entry"] = [json.dumps(each) for each in entries]
        numbers = [int(part.stem.removeprefix("part-")) for part in self._parts()]
        part = self.folder / f"part-{max(numbers, default=0) + 1:06d}.parquet"
        aside = part.with_suffix(".tmp")
        with aside.open("wb") as file:
            pq.write_table(pa.table(columns), file, compression="zstd")
            file.flush()
            os.fsync(file.fileno())
        aside.replace(part)
        self._file.truncate(0)
        self._sync()
        self._lines = 0


def _entry(line: bytes) -> Entry | None:
    """What a line holds; None for one that is not whole."""
    check, _, text = line.partition(b" ")
    if not line.endswith(b"\n"):
        return None
    try:
        if int(check, 16) != zlib.crc32(text[:-1]):
            return None
        entry: Entry = json.loads(text)
    except ValueError:
        return None
    return entry


def _locked(folder: Path) -> IO[str]:
    """Keep others out; the lock goes with the process, however that ends."""
    file = (folder / "lock").open("w")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        file.close()
        raise InputError(folder, "is in use by another run", "wait for it, or choose another --out") from None
    return file
