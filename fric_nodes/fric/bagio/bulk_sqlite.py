"""All messages of some topics of an SQLite file of ROS 2 at once: one question to the database for each topic."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import apsw
import numpy as np

from .bulk_mcap import Gathered
from .rows import Rows

__all__ = ["gathered_sqlite"]

_MESSAGES = (
    "SELECT timestamp, data FROM messages WHERE topic_id = ? AND timestamp >= ? AND timestamp < ? ORDER BY timestamp, id"
)
_ALL = (0, (1 << 63) - 1)  # [ns] since 1970


def gathered_sqlite(path: Path, topics: Collection[str], window: tuple[int, int] | None) -> dict[str, Gathered] | None:
    """The messages of ``topics`` by their name; None where the database doesn't give them.

    Args:
        path: of the file.
        topics: their names.
        window: times of reception [ns] from which, and before which, messages are taken; None: all.
    """
    try:
        connection = apsw.Connection(str(path), flags=apsw.SQLITE_OPEN_READONLY)
    except apsw.Error:
        return None
    try:
        named: dict[str, list[int]] = {}
        for number, name in connection.execute("SELECT id, name FROM topics"):
            named.setdefault(name, []).append(number)
        found = {}
        for topic in topics:
            numbers = named.get(topic, [])
            if len(numbers) > 1:
                return None
            rows: list[Any] = connection.execute(_MESSAGES, (numbers[0], *(window or _ALL))).fetchall() if numbers else []
            if any(type(time) is not int or type(data) is not bytes for time, data in rows):
                return None
            times = np.fromiter((time for time, _ in rows), dtype=np.int64, count=len(rows))
            found[topic] = Gathered(times, Rows.of([data for _, data in rows]))
    except apsw.Error:
        return None
    finally:
        connection.close()
    return found
