"""Reading an SQLite bag that its recorder did not close, up to the last complete record and without changing it.

SQLite repairs an interrupted database when it is opened for writing, from the journal that lies beside it. The repair is done
on a copy in a temporary folder; the user's files stay as they are.
"""

from __future__ import annotations

import shutil
import sqlite3
import struct
from collections.abc import Collection, Iterator
from contextlib import closing, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError, YAMLStreamError

from .blocks import UNPACK_ERRORS, unpacked
from .errors import BagError
from .topics import Raw, Topic

__all__ = ["SqliteScan", "has_journal", "sqlite_metadata"]

_JOURNALS = ("-journal", "-wal", "-shm")
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
# A damaged database may give texts and numbers that Python does not take, even in its own error messages.
_ERRORS = (sqlite3.Error, ValueError, OverflowError, MemoryError)
_FORMATS = {"ros2msg": MessageDefinitionFormat.MSG, "ros2idl": MessageDefinitionFormat.IDL}


def has_journal(path: Path) -> bool:
    """True when a journal with content lies beside the database: its recorder did not close it, or is still at work."""
    for suffix in ("-journal", "-wal"):
        # A recorder at work may take its journal away at any time.
        with suppress(FileNotFoundError):
            if path.with_name(path.name + suffix).stat().st_size:
                return True
    return False


class SqliteScan:
    """Messages of an SQLite bag, as far as the database can be read.

    Attributes:
        topics: what the readable rows hold.
        damage: what is not readable, in plain words.
        custom: key and value pairs that fric's own recorder stored at the beginning.
    """

    def __init__(self, path: Path) -> None:
        """Copy, repair the copy and count what is there.

        Raises:
            BagError: empty, not a database, or without a single readable topic.
        """
        self.path = path
        self.damage: list[str] = []
        if path.stat().st_size == 0:
            raise BagError(path, "is empty (0 bytes)", "record again")
        self._folder = TemporaryDirectory(prefix="fric-bag-")
        try:
            copy = Path(self._folder.name) / "bag.db3"
            shutil.copyfile(path, copy)
            for suffix in _JOURNALS:
                with suppress(FileNotFoundError):
                    shutil.copyfile(path.with_name(path.name + suffix), copy.with_name(copy.name + suffix))
            if not has_journal(path):
                _fit_header(copy)
            self._size = copy.stat().st_size
            self._connection = sqlite3.connect(copy)
            # What a damaged schema may name (functions, virtual tables) is not to be run.
            self._connection.execute("PRAGMA trusted_schema=OFF")
            self._names = self._read_topics()
        except BaseException as error:
            self.close()
            if isinstance(error, _ERRORS):
                raise BagError(
                    path, f"cannot be read as an SQLite bag ({error})", "it is truncated or damaged beyond use: record again"
                ) from error
            raise
        counts: dict[int, int] = dict.fromkeys(self._names, 0)
        for number, _, _ in self._rows(self.damage):
            counts[number] = counts.get(number, 0) + 1
        definitions = self._read_definitions()
        none = MessageDefinition(MessageDefinitionFormat.NONE, "")
        self.topics = tuple(
            Topic(name, msgtype, counts[number], definitions.get(msgtype, none))
            for number, (name, msgtype) in self._names.items()
        )

    def close(self) -> None:
        """Remove the copy."""
        with suppress(AttributeError):
            self._connection.close()
        self._folder.cleanup()

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Raw]:
        """Messages in the order they were written; of all topics when ``topics`` is None."""
        for number, log_time, data in self._rows([]):
            name, msgtype = self._names.get(number, ("", ""))
            if name and (topics is None or name in topics):
                # A lone file does not say that its messages are compressed; the first bytes do.
                try:
                    plain = unpacked(data, "zstd") if data[:4] == _ZSTD_MAGIC else data
                except UNPACK_ERRORS:
                    plain = data  # whoever decodes it refuses it
                yield Raw(name, msgtype, log_time, plain)

    def _read_topics(self) -> dict[int, tuple[str, str]]:
        rows = self._connection.execute("SELECT id, name, type FROM topics ORDER BY id")
        return {number: (str(name), str(msgtype)) for number, name, msgtype in rows if isinstance(number, int)}

    def _read_definitions(self) -> dict[str, MessageDefinition]:
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        try:
            return {
                str(name): MessageDefinition(_FORMATS.get(encoding, MessageDefinitionFormat.NONE), str(text))
                for name, encoding, text in self._connection.execute(query)
            }
        except _ERRORS:
            return {}  # bags older than schema version 4 have no such table

    def _rows(self, damage: list[str]) -> Iterator[tuple[int, int, bytes]]:
        taken = odd = 0
        try:
            # In the order of the row number: the index on the time may be damaged where the table is not.
            rows = self._connection.execute("SELECT topic_id, timestamp, data FROM messages NOT INDEXED ORDER BY id")
            for number, log_time, data in rows:
                if not (isinstance(number, int) and isinstance(log_time, int) and isinstance(data, bytes)):
                    odd += 1
                    continue
                taken += len(data) + 1
                if taken > self._size:
                    # Pages that are referred to more than once: each row would come again and again.
                    damage.append("read up to the row where there are more of them than the file has room for")
                    break
                yield number, log_time, data
        except _ERRORS as error:
            damage.append(f"read up to its last readable row ({error})")
        if odd:
            damage.append(f"{odd} rows left out: they hold no message")


def _fit_header(copy: Path) -> None:
    """Make the number of pages in the header of a copy that of the file, since SQLite opens no file that is shorter.

    File format of SQLite, section 1.3: bytes 16 and 17 hold the page size (1 means 65536), bytes 28 to 31 the number of pages.
    """
    with copy.open("r+b") as file:
        header = file.read(100)
        if len(header) < 100 or not header.startswith(b"SQLite format 3\0"):
            return
        (page_size,), (pages,) = struct.unpack_from(">H", header, 16), struct.unpack_from(">I", header, 28)
        page_size = 65536 if page_size == 1 else page_size
        there = copy.stat().st_size // page_size if page_size else 0
        if there < pages:
            file.truncate(there * page_size)
            file.seek(28)
            file.write(struct.pack(">I", there))


def sqlite_metadata(path: Path) -> dict[str, str]:
    """``custom_data`` of the newest metadata row of an SQLite bag; empty without one."""
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?immutable=1", uri=True)) as connection:
            row = connection.execute("SELECT metadata FROM metadata ORDER BY id DESC LIMIT 1").fetchone()
        content = YAML(typ="safe").load(row[0]) if row else None
    except (*_ERRORS, YAMLError, YAMLStreamError, LookupError, TypeError, AttributeError, RecursionError):
        return {}
    custom = content.get("custom_data") if isinstance(content, dict) else None
    return {str(key): str(value) for key, value in custom.items()} if isinstance(custom, dict) else {}
