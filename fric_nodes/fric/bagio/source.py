"""Opening a recording, whatever state it is in: one source of raw messages for all that reads bags.

ROS 2 bags in order are read through ``rosbags``. A bag that its recorder did not close, a lone storage file, a folder without
``metadata.yaml`` and a ROS 1 bag are read record by record as far as they go; what was wrong is kept in :attr:`Source.notes`.
"""

from __future__ import annotations

import shutil
import struct
import sys
from collections.abc import Collection, Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any, cast

import apsw
import numpy as np
from rosbags.rosbag2 import Reader, ReaderError
from ruamel.yaml.error import YAMLError, YAMLStreamError

from .bulk_mcap import Gathered, gathered
from .bulk_sqlite import gathered_sqlite
from .errors import BagError, DamagedError
from .passing import Passing
from .recover_mcap import McapScan, mcap_metadata
from .recover_ros1 import Ros1Scan
from .recover_sqlite import SqliteScan, has_journal, sqlite_metadata
from .rows import Rows
from .topics import Raw, Topic

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

__all__ = ["Source"]

_REMEDY = "give a rosbag2 folder, or a .mcap, .db3 or .bag file"
# What the library lets through when a file is not what it should be. Lengths come from the file: hence the last two.
_LIBRARY_ERRORS = (ReaderError, OSError, ValueError, LookupError, EOFError, AssertionError, RuntimeError, AttributeError)
_FOREIGN_ERRORS = (apsw.Error, zstd.ZstdError, YAMLError, YAMLStreamError, struct.error)
_DAMAGE = (*_LIBRARY_ERRORS, *_FOREIGN_ERRORS, TypeError, MemoryError, OverflowError)


def _storage_files(folder: Path) -> list[Path]:
    """Storage files of a folder in the order of their names (``bag_2`` before ``bag_10``)."""
    found = [path for path in folder.iterdir() if path.is_file() and _kind(path)]
    return sorted(found, key=lambda path: (len(path.name), path.name))


def _kind(path: Path) -> str | None:
    """``mcap``, ``sqlite3`` or ``ros1`` by the name, None for anything else."""
    if path.name.endswith((".bag", ".bag.active")):
        return "ros1"
    name = path.name.removesuffix(".zstd")
    return "mcap" if name.endswith(".mcap") else "sqlite3" if name.endswith(".db3") else None


class Source:
    """An open recording; a context manager.

    Attributes:
        path: what the user gave.
        topics: topics with their types and numbers of messages.
        storage: ``mcap``, ``sqlite3`` or ``ros1``.
        custom: the key and value pairs that the recorder stored with the bag.
        notes: what was wrong with the files and how they were read all the same.
        window: times of reception [ns] from which, and before which, :meth:`messages` gives; None: all.
    """

    def __init__(self, path: str | Path, *, recover: bool = False) -> None:
        """Open a recording.

        Args:
            path: bag folder, or a ``.mcap``, ``.db3`` or ``.bag`` file.
            recover: read record by record even if the bag looks in order.

        Raises:
            BagError: not there, not a bag, or damaged beyond use.
        """
        self.path = Path(path)
        self.notes: list[str] = []
        self.custom: dict[str, str] = {}
        self.storage = ""
        self.topics: tuple[Topic, ...] = ()
        self.window: tuple[int, int] | None = None
        self._stack = ExitStack()
        self._reader: Reader | None = None
        self._scans: list[McapScan | SqliteScan | Ros1Scan] = []
        self._passing = Passing(self._scans)
        self._bulk: list[Path] = []  # storage files whose messages are stored as they are
        self._refusal = ""  # why the library does not read it
        files = self._find()
        try:
            if recover or not self._open_library(files):
                self._open_scans(files)
        except BaseException:
            self._stack.close()
            raise

    def __enter__(self) -> Source:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close all files."""
        self._stack.close()

    @property
    def recovered(self) -> bool:
        """True when the bag is read record by record."""
        return self._reader is None

    @property
    def late(self) -> int:
        """Messages that a scan met too late to be in their window."""
        return self._passing.late

    @property
    def start_ns(self) -> int | None:
        """Time of reception of the first message [ns]; None when there is none."""
        if self._reader is not None:
            return int(self._reader.start_time) if self._reader.message_count else None
        return next((message.log_time_ns for scan in self._scans for message in scan.messages()), None)

    @property
    def end_ns(self) -> int | None:
        """Time of reception of the last message [ns], for which a scan passes through the file; None when there is none."""
        if self._reader is not None:
            return int(self._reader.end_time) - 1 if self._reader.message_count else None
        return max((message.log_time_ns for scan in self._scans for message in scan.messages()), default=None)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Raw]:
        """Messages of the window in the order of reception; of all topics when ``topics`` is None.

        A window is found by the index of the storage. A scan has none: windows that move forward share one pass over the file.

        Raises:
            DamagedError: the storage turns out to be damaged on the way.
        """
        first, stop = self.window or (None, None)
        if self._reader is None:
            if first is not None and stop is not None:
                yield from self._passing.messages(topics, first, stop)
                return
            for scan in self._scans:
                yield from scan.messages(topics)
            return
        chosen = [x for x in self._reader.connections if topics is None or x.topic in topics]
        if not chosen:
            return
        try:
            for connection, log_time, data in self._reader.messages(chosen, first, stop):
                if not 0 <= log_time < 1 << 63:
                    raise ValueError(f"a time of reception of {log_time} ns")
                yield Raw(connection.topic, connection.msgtype, log_time, data)
        except _DAMAGE as error:
            raise DamagedError(self.path, f"is damaged ({error})", "record again, or restore it from a copy") from error

    def gathered(self, topics: Collection[str]) -> dict[str, Gathered] | None:
        """The messages of ``topics`` in the window, by their name, all at once; None where they come one after the other."""
        several = len({topic.name for topic in self.topics}) < len(self.topics)  # types of one topic
        if self._reader is None or not self._bulk or several:
            return None
        of_file = gathered if self.storage == "mcap" else gathered_sqlite
        files = [of_file(file, topics, self.window) for file in self._bulk]
        if any(file is None for file in files):
            return None
        parts = {topic: [file[topic] for file in files if file is not None] for topic in topics}
        return {
            topic: Gathered(np.concatenate([part.log_ns for part in of]), Rows.joined(part.data for part in of))
            for topic, of in parts.items()
        }

    def _find(self) -> list[Path]:
        path = self.path
        if not path.exists():
            raise BagError(path, "is not there", "check the path")
        if path.is_file():
            if _kind(path) is None:
                raise BagError(path, "is not a recording (neither .mcap nor .db3 nor .bag)", _REMEDY)
            return [path]
        found = _storage_files(path)
        files = [file for file in found if _kind(file) != "ros1"]
        ros1 = [file for file in found if _kind(file) == "ros1"]
        if not files and len(ros1) > 1:
            listed = ", ".join(file.name for file in ros1)
            raise BagError(path, f"holds several ROS 1 bags: {listed}", "give one of them, or each as a recording of its own")
        if not found:
            raise BagError(path, "is not a bag: there is no .mcap or .db3 file in it, and no .bag file", _REMEDY)
        return files or ros1

    def _open_library(self, files: list[Path]) -> bool:
        """Open through rosbags; False, with a note, when that does not work."""
        if _kind(files[0]) == "ros1":
            return False
        in_order = self.path.is_dir() and (self.path / "metadata.yaml").is_file()
        if self.path.is_dir() and not in_order:
            self.notes.append("metadata.yaml is missing: the recorder was not stopped properly")
            if len(files) > 1:
                return False
        target = self.path if in_order else files[0]
        if target.name.endswith(".zstd"):
            return False
        if any(_kind(file) == "sqlite3" and has_journal(file) for file in files):
            self.notes.append("a journal lies beside the database: its recorder did not close it")
            return False
        try:
            reader = Reader(target)
            reader.open()
        except _DAMAGE as error:
            self._refusal = str(error).rstrip(".")
            return False
        self._stack.callback(reader.close)
        if not in_order and _kind(target) == "sqlite3":
            # Only metadata.yaml says whether single messages are compressed; the scan looks at each.
            return False
        self._reader = reader
        merged: dict[tuple[str, str], Topic] = {}
        for x in reader.connections:
            before = merged[x.topic, x.msgtype].n_messages if (x.topic, x.msgtype) in merged else 0
            merged[x.topic, x.msgtype] = Topic(x.topic, x.msgtype, before + x.msgcount, x.msgdef)
        self.topics = tuple(merged.values())
        self.storage = _kind(files[0]) or ""
        storage = cast(Any, reader.storage)
        if not (in_order and storage.metadata.compression_mode):
            self._bulk = [Path(each.path) for each in (storage.storages if in_order else [storage])]
        # rosbags has no public access to the custom data of a folder.
        custom = reader.storage.metadata.custom if in_order else None
        self.custom = dict(custom) if custom else self._stored_custom(files[0])
        return True

    def _open_scans(self, files: list[Path]) -> None:
        merged: dict[tuple[str, str], Topic] = {}
        for file in files:
            plain = self._unpacked(file) if file.name.endswith(".zstd") else file
            kind = _kind(file)
            scans: dict[str, type[McapScan | SqliteScan | Ros1Scan]] = {
                "mcap": McapScan,
                "sqlite3": SqliteScan,
                "ros1": Ros1Scan,
            }
            try:
                scan: McapScan | SqliteScan | Ros1Scan = scans[kind or ""](plain)
            except BagError as error:
                raise BagError(file, error.problem, error.remedy) from error
            self._stack.callback(scan.close)
            self._scans.append(scan)
            self.notes += [f"{file.name}: {problem}" for problem in scan.damage]
            for topic in scan.topics:
                before = merged.get((topic.name, topic.msgtype))
                count = topic.n_messages + (before.n_messages if before else 0)
                merged[topic.name, topic.msgtype] = topic._replace(n_messages=count)
            self.storage = kind or ""
            self.custom = self.custom or self._stored_custom(plain)
        if self._refusal and not any(scan.damage for scan in self._scans):
            self.notes.append(f"read record by record, because its index is not usable ({self._refusal})")
        self.topics = tuple(merged.values())
        if not any(topic.n_messages for topic in self.topics):
            raise BagError(self.path, "holds no complete message", "it is truncated beyond use or empty: record again")

    def _stored_custom(self, file: Path) -> dict[str, str]:
        if _kind(file) == "ros1":
            return {}
        return mcap_metadata(file, "fric") if _kind(file) == "mcap" else sqlite_metadata(file)

    def _unpacked(self, file: Path) -> Path:
        """A file that is compressed as a whole, decompressed as far as it goes, in a temporary folder."""
        folder = self._stack.enter_context(TemporaryDirectory(prefix="fric-bag-"))
        plain = Path(folder) / file.name.removesuffix(".zstd")
        with plain.open("wb") as target, zstd.open(file, "rb") as packed:
            try:
                shutil.copyfileobj(packed, target)
            except (EOFError, zstd.ZstdError):
                self.notes.append(f"{file.name}: compressed file is cut off; read as far as it goes")
        return plain
