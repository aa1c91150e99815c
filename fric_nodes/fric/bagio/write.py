"""Writing recordings: message by message as they come, and whole records at once.

What :class:`BagWriter` has taken is on disk at most ``flush_period`` later, whether further messages come or not, so a recorder
that is killed loses no more than that. What is needed to read such a bag (units, joint) is stored at its beginning as well.
"""

from __future__ import annotations

import contextlib
import json
import shutil
import sqlite3
import struct
import tempfile
import threading
from collections.abc import Iterable, Mapping
from io import StringIO
from pathlib import Path
from types import TracebackType
from typing import Literal

import numpy as np
from rosbags.interfaces import Connection, ConnectionExtRosbag2, Qos
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer, WriterError
from rosbags.rosbag2.storage_mcap import McapWriter
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer
from ruamel.yaml import YAML

from ..record import Record
from .checks import Stamps
from .chunk_index import ChunkIndex
from .encode import float64_messages, joint_state_messages, reference_messages
from .errors import WriteError
from .types import FLOAT64, JOINT_STATE, REFERENCE, definition

__all__ = ["BagWriter", "Compression", "Storage", "record_metadata", "write_record"]

Storage = Literal["mcap", "sqlite3"]
Compression = Literal["none", "zstd"]
_VERSION: Literal[9] = 9  # of the bag format, that of ROS 2 Jazzy
_EXISTS = "choose another name, or remove it first"


class BagWriter:
    """Writes a rosbag2 bag; a context manager; may be used from several threads."""

    def __init__(
        self,
        path: str | Path,
        *,
        storage: Storage = "mcap",
        compression: Compression = "none",
        metadata: Mapping[str, str] | None = None,
        flush_period: float | None = 0.5,
    ) -> None:
        """Create the bag.

        Args:
            path: folder to create.
            storage: ``mcap`` or ``sqlite3``.
            compression: ``none``, or ``zstd`` for chunks (MCAP) or messages (SQLite).
            metadata: key and value pairs for the custom data of the bag.
            flush_period: longest time that a message may wait before it is on disk [s]; None: until the bag is closed.

        Raises:
            WriteError: there is something of this name already, or the folder cannot be created.
        """
        self.path = Path(path)
        if self.path.exists() or self.path.is_symlink():
            raise WriteError(self.path, "exists already and is not overwritten", _EXISTS)
        mode = CompressionMode.NONE
        if compression == "zstd":
            mode = CompressionMode.STORAGE if storage == "mcap" else CompressionMode.MESSAGE
        plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
        self._writer = Writer(self.path, version=_VERSION, storage_plugin=plugin)
        self._writer.set_compression(mode, CompressionFormat.ZSTD)
        custom = {str(key): str(value) for key, value in (metadata or {}).items()}
        for key, value in custom.items():
            self._writer.set_custom_data(key, value)
        try:
            self._writer.open()
        except (WriterError, OSError, sqlite3.Error) as error:
            raise WriteError(self.path, f"cannot be created ({error})", "choose a folder that can be written to") from error
        self._connections: dict[str, Connection] = {}
        self._lock = threading.Lock()
        self._pending = False
        self._failure: Exception | None = None
        self._stop = threading.Event()
        self._closed = False
        _prepare(self._writer, custom)
        self._thread: threading.Thread | None = None
        if flush_period is not None:
            self._thread = threading.Thread(target=self._flush_regularly, args=(flush_period,), name="bag-flush", daemon=True)
            self._thread.start()

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    @property
    def counts(self) -> dict[str, int]:
        """Messages taken so far, by topic."""
        return {name: self._writer.counts[connection.id] for name, connection in self._connections.items()}

    def topic(
        self, name: str, msgtype: str, msgdef: str | None = None, digest: str | None = None, offered: Iterable[Qos] = ()
    ) -> None:
        """Announce a topic; announcing it again with the same type changes nothing.

        Args:
            name: of the topic.
            msgtype: such as ``std_msgs/msg/Float64``.
            msgdef: text of the definition with everything it refers to; looked up when None.
            digest: RIHS01 hash of the type; looked up when None.
            offered: quality of service that the topic's publishers offer.

        Raises:
            WriteError: announced before with another type; or a type whose definition is not known.
        """
        with self._lock:
            known = self._connections.get(name)
            if known is not None:
                if known.msgtype != msgtype:
                    raise WriteError(name, f"has the type {known.msgtype}, not {msgtype}", "record one type per topic")
                return
            if msgdef is None or digest is None:
                found = definition(msgtype)
                msgdef, digest = msgdef or found[0], digest or found[1]
            self._connections[name] = self._writer.add_connection(
                name, msgtype, msgdef=msgdef, rihs01=digest, offered_qos_profiles=list(offered)
            )

    def offer(self, topic: str, offered: Iterable[Qos]) -> None:
        """Note what a further publisher of ``topic`` offers, for the metadata that the bag gets in the end.

        Raises:
            WriteError: topic not announced.
        """
        connection = self._announced(topic)
        with self._lock:
            ext = connection.ext
            if isinstance(ext, ConnectionExtRosbag2):
                ext.offered_qos_profiles.extend(qos for qos in offered if qos not in ext.offered_qos_profiles)

    def _announced(self, topic: str) -> Connection:
        connection = self._connections.get(topic)
        if connection is None:
            raise WriteError(topic, "is not announced", "announce a topic with its type before writing to it")
        return connection

    def write(self, topic: str, log_time_ns: int, data: bytes | memoryview) -> None:
        """Take one message.

        Args:
            topic: announced by :meth:`topic`.
            log_time_ns: time of reception [ns].
            data: CDR bytes.

        Raises:
            WriteError: topic not announced, bag closed, or the disk refused an earlier message.
        """
        connection = self._announced(topic)
        with self._lock:
            if self._closed:
                raise WriteError(self.path, "is closed", "open a new bag")
            if self._failure is not None:
                raise WriteError(self.path, f"cannot be written ({self._failure})", "free space on the disk") from self._failure
            try:
                self._writer.write(connection, log_time_ns, data)
            except (OSError, sqlite3.Error) as error:
                self._failure = error
                raise WriteError(self.path, f"cannot be written ({error})", "free space on the disk") from error
            self._pending = True

    def flush(self) -> None:
        """Put everything taken so far on disk."""
        with self._lock:
            if self._pending and not self._closed:
                _make_durable(self._writer)
                self._pending = False

    def close(self) -> None:
        """Write index and metadata; closing again does nothing.

        Raises:
            WriteError: the disk refuses.
        """
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        with self._lock:
            if self._closed:
                return
            self._closed = True
            try:
                if not any(self._writer.counts.values()):
                    self._writer.min_timestamp = 0  # otherwise the start of an empty bag is the largest integer
                self._writer.close()
            except (OSError, sqlite3.Error) as error:
                with contextlib.suppress(Exception):
                    self._writer.abort()
                raise WriteError(self.path, f"cannot be closed ({error})", "free space on the disk") from error

    def _flush_regularly(self, period: float) -> None:
        while not self._stop.wait(period):
            try:
                self.flush()
            except (OSError, sqlite3.Error) as error:
                self._failure = error  # the next write reports it
                return


# rosbags keeps data in memory until a chunk is full (MCAP) or the bag is closed (SQLite), and offers no way to change that. The
# two functions below are the only place that reaches into its storage objects.
def _prepare(writer: Writer, custom: Mapping[str, str]) -> None:
    """Store the custom data at the beginning of the file, and let the flushing thread use the storage."""
    storage = writer.storage
    if isinstance(storage, McapWriter):
        pairs = b"".join(_text(key) + _text(value) for key, value in custom.items())
        content = _text("fric") + struct.pack("<I", len(pairs)) + pairs
        storage.bio.write(struct.pack("<BQ", 0x0C, len(content)) + content)
        storage.bio.flush()
        storage.chunks = ChunkIndex(storage.path.parent)
    elif isinstance(storage, Sqlite3Writer):
        storage.conn.close()
        storage.conn = sqlite3.connect(storage.path, check_same_thread=False)  # every use is under the writer's lock
        storage.cursor = storage.conn.cursor()
        text = StringIO()
        YAML(typ="safe").dump(_unfinished(custom), text)
        storage.cursor.execute("INSERT INTO metadata(metadata_version, metadata) VALUES(?, ?)", (_VERSION, text.getvalue()))
        storage.conn.commit()


def _make_durable(writer: Writer) -> None:
    """Hand all data to the operating system, in records that are complete."""
    storage = writer.storage
    if isinstance(storage, McapWriter):
        if storage.chunk.msgs:
            storage.close_chunk()
        storage.bio.flush()
    elif isinstance(storage, Sqlite3Writer):
        storage.conn.commit()


def _text(text: str) -> bytes:
    encoded = text.encode()
    return struct.pack("<I", len(encoded)) + encoded


def _unfinished(custom: Mapping[str, str]) -> dict[str, object]:
    """Metadata of a bag that is being written; the same fields as those of a finished one."""
    return {
        "version": _VERSION,
        "storage_identifier": "sqlite3",
        "relative_file_paths": [],
        "duration": {"nanoseconds": 0},
        "starting_time": {"nanoseconds_since_epoch": 0},
        "message_count": 0,
        "topics_with_message_count": [],
        "compression_format": "",
        "compression_mode": "",
        "files": [],
        "custom_data": dict(custom),
        "ros_distro": "rosbags",
    }


def record_metadata(record: Record) -> dict[str, str]:
    """Custom data that a bag of this record carries: what messages cannot say."""
    custom = {
        "fric.joint": record.joint,
        "fric.position_unit": record.units.position,
        "fric.force_unit": record.units.force,
        "fric.effort_hold": record.effort_hold,
        "fric.source": Path(record.source).name,
    }
    if record.extra:
        custom["fric.extra"] = ",".join(record.extra)
    if record.notes:
        custom["fric.notes"] = json.dumps(list(record.notes))
    if record.valid is not None and not record.valid.all():
        edges = np.flatnonzero(np.diff(np.concatenate(([False], ~record.valid, [False])).astype(np.int8)))
        ranges = [[int(first), int(stop) - 1] for first, stop in edges.reshape(-1, 2)]
        custom["fric.invalid"] = json.dumps({"samples": record.n_samples, "ranges": ranges})
    return custom


def write_record(
    record: Record,
    path: str | Path,
    *,
    storage: Storage = "mcap",
    compression: Compression = "none",
    start_time_ns: int = 0,
    metadata: Mapping[str, str] | None = None,
) -> Path:
    """Write a record as a bag: joint states, and the reference and further signals where there are any.

    The bag appears under its name when it is complete, or not at all. Stamps and times of reception are the record's time on
    top of ``start_time_ns``, so the same record gives the same bag.

    Args:
        record: what to write.
        path: folder to create.
        storage: ``mcap`` or ``sqlite3``.
        compression: ``none`` or ``zstd``.
        start_time_ns: stamp of the first sample [ns]; when 0, one second, since a zero stamp means "not stamped" in ROS.
        metadata: further custom data.

    Returns:
        The folder.

    Raises:
        WriteError: there is something of this name already, or it cannot be written.
    """
    path = Path(path)
    if path.exists() or path.is_symlink():
        raise WriteError(path, "exists already and is not overwritten", _EXISTS)
    stamps = np.rint(record.time * 1e9).astype(np.int64) + (start_time_ns or 1_000_000_000)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    except OSError as error:
        raise WriteError(path, f"cannot be created ({error})", "choose a folder that can be written to") from error
    try:
        # rosbags names the file inside after its folder, so the folder has its final name from the start, one level down.
        custom = {**record_metadata(record), **(metadata or {})}
        with BagWriter(work / path.name, storage=storage, compression=compression, metadata=custom, flush_period=None) as bag:
            _write_messages(bag, record, stamps)
        (work / path.name).rename(path)
    except WriteError as error:  # under its own name, not that of the temporary folder
        raise WriteError(path, error.problem, error.remedy) from error
    except OSError as error:
        raise WriteError(path, f"cannot be created ({error})", "choose a folder that can be written to") from error
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return path


def _write_messages(bag: BagWriter, record: Record, stamps: Stamps) -> None:
    columns = {
        "/joint_states": (
            JOINT_STATE,
            joint_state_messages(stamps, record.joint, record.position, record.velocity, record.effort),
        )
    }
    if record.reference is not None:
        velocity = np.gradient(record.reference, record.time)
        acceleration = np.gradient(velocity, record.time)
        columns["/reference"] = (REFERENCE, reference_messages(stamps, record.joint, record.reference, velocity, acceleration))
    for name, signal in record.extra.items():
        columns[f"/{name}"] = (FLOAT64, float64_messages(signal))
    for topic, (msgtype, _) in columns.items():
        bag.topic(topic, msgtype)
    messages = [(topic, data) for topic, (_, data) in columns.items()]
    for index, log_time in enumerate(stamps.tolist()):
        for topic, data in messages:
            bag.write(topic, log_time, data[index])
