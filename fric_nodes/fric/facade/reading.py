"""Recordings from anywhere."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, overload

from ..bagio.importing import import_recording
from ..bagio.read import read_record
from ..bagio.topics import Topics
from ..errors import InputError
from ..importers import suffixes
from ..record import Record

if TYPE_CHECKING:
    import pandas as pd

    Source: TypeAlias = str | Path | Record | pd.DataFrame

__all__ = ["read", "records_of"]


@overload
def read(
    source: Source,
    *,
    joint: str | None = ...,
    mapping: Mapping[str, Any] | str | Path | None = ...,
    topics: Mapping[str, str] | None = ...,
    time: Literal["stamp", "log"] = ...,
    repair: bool = ...,
    start: float | None = ...,
    end: float | None = ...,
) -> Record: ...


@overload
def read(
    source: Sequence[Source],
    *,
    joint: str | None = ...,
    mapping: Mapping[str, Any] | str | Path | None = ...,
    topics: Mapping[str, str] | None = ...,
    time: Literal["stamp", "log"] = ...,
    repair: bool = ...,
    start: float | None = ...,
    end: float | None = ...,
) -> list[Record]: ...


def read(
    source: Source | Sequence[Source],
    *,
    joint: str | None = None,
    mapping: Mapping[str, Any] | str | Path | None = None,
    topics: Mapping[str, str] | None = None,
    time: Literal["stamp", "log"] = "stamp",
    repair: bool = False,
    start: float | None = None,
    end: float | None = None,
) -> Record | list[Record]:
    """One joint's recording, from a bag, from a file of another program, or from a table.

    Args:
        source: a rosbag2 folder or a ``.mcap``, ``.db3`` or ``.bag`` file; a file that ``mapping`` says how to read
            (``.csv``, ``.mat``, ``.npz``, ``.parquet``, ``.json``, ...); a pandas table with the columns ``time`` [s],
            ``position`` and ``effort``; or several of these, which gives a list.
        joint: name of the joint; None where there is one only.
        mapping: where each signal of such a file comes from and its unit, as a dictionary or a YAML file.
        topics: names of topics by role (``joint_states``, ``force_command``, ``reference``, ...), where they aren't the usual.
        time: ``stamp`` for the stamps of the messages, ``log`` for the time of reception.
        repair: drop or fill what can't be used instead of refusing the recording; the record's notes say what was done.
        start: first time to keep [s] from the first sample.
        end: last time to keep [s] from the first sample.

    Returns:
        The record; a list of them where ``source`` is a list.

    Raises:
        InputError: the recording can't be used; the message says what to do.

    Example:
        >>> import numpy as np, pandas as pd
        >>> t = np.arange(0.0, 1.0, 1e-3)
        >>> table = pd.DataFrame({"time": t, "position": 0.01 * np.sin(9.0 * t), "effort": np.cos(9.0 * t)})
        >>> read(table).n_samples
        1000
    """
    if isinstance(source, (list, tuple)):
        return [
            read(each, joint=joint, mapping=mapping, topics=topics, time=time, repair=repair, start=start, end=end)
            for each in source
        ]
    if isinstance(source, Record):
        return _cut(source, start, end)
    if hasattr(source, "columns"):
        return _cut(_from_table(source, joint), start, end)
    path = Path(str(source))
    if mapping is not None:
        return _cut(import_recording(path, mapping, repair=repair), start, end)
    if path.is_file() and path.suffix.lower() in suffixes():
        raise InputError(
            path,
            "is no bag, and nothing says which column is which",
            "give a mapping, such as mapping={'time': {'from': 't', 'unit': 's'}, 'position': ..., 'effort': ...}",
        )
    names = None if topics is None else Topics(**topics)
    return read_record(path, joint=joint, topics=names, time=time, repair=repair, start=start, end=end)


def records_of(source: Source | Iterable[Source]) -> list[Record]:
    """A list of records from one source or several, see :func:`read`."""
    if isinstance(source, (str, Path, Record)) or hasattr(source, "columns"):
        return [read(source)]
    return [read(each) for each in source]


def _cut(record: Record, start: float | None, end: float | None) -> Record:
    return record if start is None and end is None else record.between(start, end)


def _from_table(table: pd.DataFrame, joint: str | None) -> Record:
    missing = [name for name in ("time", "position", "effort") if name not in table.columns]
    if missing:
        raise InputError(
            "table",
            f"has no column {', '.join(missing)}",
            "name the columns time [s], position and effort; others may be",
        )
    columns = {str(name): table[name].to_numpy() for name in table.columns}
    return Record.from_arrays(**columns, joint=joint or "axis", source="table")
