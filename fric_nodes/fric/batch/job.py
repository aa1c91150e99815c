"""What is asked of every recording, and the work on one of them.

The key of a result is a hash of the recording's content, the verb, the model, the settings and the version of the results: what
has one key has one result, wherever the recording lies and whenever it is worked on.
"""

from __future__ import annotations

import hashlib
import json
import resource
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from .. import __version__
from ..bagio.mapping import SignalMap, load_mapping
from ..bagio.read import joint_list
from ..bagio.source import Source
from ..bagio.topics import Topics
from ..errors import InputError
from ..facade.reading import read
from ..model import Model
from ..model_file import model_from_text
from ..record import Record
from .recordings import content_hash, here, is_storage, signature
from .task import Task, task_of

__all__ = ["Entry", "Job", "lost", "read_joint", "work"]

_VERSION = f"{__version__}/2"
"""Results of another version are worked out anew; the number after the stroke counts changes of the rows."""

Entry = dict[str, Any]
"""What is known of one recording: ``signature``, ``hash``, ``key``, ``rows``, ``seconds`` of a core, ``memory`` [byte], and
``again`` where the next run tries once more."""


@dataclass(frozen=True)
class Job:
    """What is asked of every recording.

    Attributes:
        verb: ``identify``, ``diagnose`` or ``doctor``.
        model: text of the model; its values are the start, or what is tested. Empty for none.
        settings: of the verb, such as ``method`` or ``blocks``; plain data.
        mapping: text of a mapping for files of other programs; empty for bags.
        joint: name of the joint; None for every one of the recording.
        topics: names of topics by role.
        time: ``stamp`` or ``log``.
        repair: as for :func:`fric.read`.
        start: [s] left out before; None: nothing.
        end: [s] left out after; None: nothing.
    """

    verb: str
    model: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    mapping: str = ""
    joint: str | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
    time: str = "stamp"
    repair: bool = False
    start: float | None = None
    end: float | None = None

    @property
    def digest(self) -> str:
        """Hash of all that the result depends on besides the recording."""
        plain = {name: value for name, value in vars(self).items() if name in self.__dataclass_fields__}
        text = json.dumps([_VERSION, plain], sort_keys=True, default=dict)
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()

    def key(self, content: str) -> str:
        """Of the result for a recording with this content hash."""
        return hashlib.blake2b(f"{self.digest}{content}".encode(), digest_size=16).hexdigest()

    @cached_property
    def parsed_model(self) -> Model | None:
        """The model."""
        return model_from_text(self.model, "model") if self.model else None

    @property
    def task(self) -> Task:
        """The work of the verb."""
        return task_of(self.verb)

    def beside(self, path: Path) -> tuple[Path, ...]:
        """Further files that the mapping takes signals from."""
        names = _files_of(self.mapping) if self.mapping else ()
        return tuple(file for file in (path.parent / name for name in names) if file.is_file())

    def signature(self, path: str) -> str:
        """:func:`.recordings.signature`, further files included."""
        return signature(path, self.beside(Path(path)) if self.mapping else ())


@cache
def _mapping(text: str) -> dict[str, Any]:
    """The mapping as plain data."""
    from ruamel.yaml import YAML

    found: dict[str, Any] = YAML(typ="safe").load(text)
    return found


@cache
def _files_of(mapping: str) -> tuple[str, ...]:
    """Names of further files in a mapping."""
    found: dict[str, None] = {}

    def look(entry: object) -> None:
        if isinstance(entry, SignalMap):
            found.update({entry.file: None} if entry.file else {})
            look(entry.minus)
            look(entry.time)

    chosen = load_mapping(_mapping(mapping))
    for value in (*vars(chosen).values(), *chosen.extra.values()):
        look(value)
    return tuple(found)


def work(path: str, job: Job) -> Entry:
    """What comes of one recording; whatever goes wrong becomes a row that says so.

    Args:
        path: path or URL of the recording.
        job: what is asked.
    """
    begun = time.process_time()
    entry: Entry = {"signature": job.signature(path), "hash": "", "key": "", "rows": []}
    try:
        with here(path) as place:
            entry["hash"] = content_hash(place, job.beside(place))
            entry["key"] = job.key(entry["hash"])
            entry["rows"] = _rows(place, job)
    except InputError as error:
        entry["rows"] = [_refused(_line(error, path))]
    except OSError as error:
        entry["rows"] = [_refused(f"cannot be read ({error.strerror or error}); check the path and its permissions")]
    except MemoryError:
        entry["rows"], entry["key"] = [_refused("needs more memory than there is; give more, or cut it with --end")], ""
    # What could not even be read may be readable next time.
    if not entry["key"]:
        entry["again"] = True
    entry["seconds"] = time.process_time() - begun
    entry["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return entry


def lost(path: str, job: Job, why: str) -> Entry:
    """The entry of a recording on which a worker came to nothing; the next run tries again."""
    rows = [_refused(why)]
    return {"signature": job.signature(path), "hash": "", "key": "", "rows": rows, "again": True, "seconds": 0.0, "memory": 0}


def _rows(place: Path, job: Job) -> list[dict[str, Any]]:
    begin = _start_of(place) if _is_bag(place) else None
    rows = []
    for joint in _joints(place, job):
        row: dict[str, Any] = {"joint": joint or "", "time_ns": begin, "status": "ok"}
        try:
            record = read_joint(place, job, joint)
            row |= {
                "joint": record.joint,
                "duration": float(record.time[-1]),
                "rate": 1.0 / record.sample_time,
                **job.task.run(record, job.parsed_model, job.settings),
            }
        except InputError as error:
            row |= _refused(_line(error, str(place)), joint or "")
        except MemoryError:
            raise
        except Exception as error:  # one recording must not stop the others, whatever it does
            row |= _refused(f"ended in an error of fric ({type(error).__name__}: {error}); report it with the recording", joint)
        rows.append(row)
    return rows


def _joints(place: Path, job: Job) -> list[str | None]:
    """The joint asked for, or each of the recording."""
    if job.joint is not None or not _is_bag(place):
        return [job.joint]
    found = joint_list(place, Topics(**job.topics))
    return [*dict.fromkeys(found)] or [None]


def read_joint(place: Path, job: Job, joint: str | None) -> Record:
    """One joint of a recording, as the job says.

    Raises:
        InputError: it cannot be used.
    """
    return read(
        place,
        joint=joint,
        mapping=_mapping(job.mapping) if job.mapping and not _is_bag(place) else None,
        topics=dict(job.topics),
        time="log" if job.time == "log" else "stamp",
        repair=job.repair,
        start=job.start,
        end=job.end,
    )


def _is_bag(place: Path) -> bool:
    return place.is_dir() or is_storage(place)


def _start_of(place: Path) -> int | None:
    """Time of reception of the first message [ns since 1970]; None where none can be had."""
    try:
        with Source(place) as source:
            return source.start_ns
    except InputError:
        return None


def _line(error: InputError, path: str) -> str:
    """A refusal in one line that does not name the path: the same content elsewhere is refused in the same words."""
    text = f"{error.problem}; {error.remedy}"
    if error.where and not error.where.startswith(path):
        text = f"{error.where}: {text}"
    name = path.rstrip("/").rsplit("/", 1)[-1]
    return " ".join(text.replace(path, name).split())


def _refused(why: str, joint: str | None = None) -> dict[str, Any]:
    return {"status": "refused", "refusal": " ".join(why.split()), **({} if joint is None else {"joint": joint})}
