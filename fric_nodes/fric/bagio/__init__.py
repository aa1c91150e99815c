"""Recordings in and out, without ROS: rosbag2 bags (MCAP, SQLite3) and files of other programs.

:func:`read_record` and :func:`write_record` convert between a bag and a :class:`~fric.record.Record`; :func:`pieces` reads a
bag that doesn't fit into memory;
:func:`read_series` and :func:`iterate_raw` give single topics and raw messages; :class:`BagWriter` records;
:func:`import_recording` reads ``.mat``, ``.csv``, ``.npz`` and ``.parquet`` by a mapping.
"""

from __future__ import annotations

from .errors import BagError, ImportingError, WriteError
from .importing import import_recording
from .mapping import ImportMap, load_mapping
from .pieces import Piece, pieces
from .read import BagInfo, Topics, bag_info, iterate_raw, read_record
from .series import Series, read_series
from .topics import Raw, Topic
from .write import BagWriter, record_metadata, write_record

__all__ = [
    "BagError",
    "BagInfo",
    "BagWriter",
    "ImportMap",
    "ImportingError",
    "Piece",
    "Raw",
    "Series",
    "Topic",
    "Topics",
    "WriteError",
    "bag_info",
    "import_recording",
    "iterate_raw",
    "load_mapping",
    "pieces",
    "read_record",
    "read_series",
    "record_metadata",
    "write_record",
]
