"""Topics of a recording as arrays: the bulk-decoded table that reports and :func:`fric.bagio.read_record` use."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..record import Array
from .bulk_mcap import Gathered
from .checks import Stamps, pick_joint, pick_topic
from .decode import Block, DecodeError, decode
from .errors import BagError, DamagedError
from .joints import UnequalError, joint_fields, joint_names
from .rows import Rows
from .selection import SelectionError, select
from .source import Source
from .topics import Topic
from .types import FLOAT64, JOINT_TYPES, REFERENCE, STAMPED_FORCE, type_versions

__all__ = ["Messages", "Series", "collect", "joints_in", "number_series", "read_series", "series"]

_JOINT_FIELDS = ("position", "velocity", "effort")
_FIELDS = {
    FLOAT64: {"data": "data"},
    STAMPED_FORCE: {"force": "force"},
    REFERENCE: {"position": "position", "velocity": "velocity", "acceleration": "acceleration"},
}


class Series(NamedTuple):
    """One topic as arrays of shape ``(n_messages,)``, in the order of reception.

    Attributes:
        topic: name of the topic.
        msgtype: its message type.
        stamp_ns: stamp of the header [ns]; None for a type without header.
        log_ns: time of reception [ns].
        fields: values by the name of the message's field.
        joint: name of the joint, for joint states.
        joints: names of all joints of the topic, for joint states.
        notes: what was left out, and why.
    """

    topic: str
    msgtype: str
    stamp_ns: Stamps | None
    log_ns: Stamps
    fields: dict[str, Array]
    joint: str = ""
    notes: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()

    @property
    def stamped(self) -> bool:
        """True when the messages carry stamps that are not all zero."""
        return self.stamp_ns is not None and bool(np.any(self.stamp_ns))


class Messages(NamedTuple):
    """Raw messages of one topic: what the topic is, times of reception [ns], bytes."""

    topic: Topic
    log_ns: Stamps
    data: Rows


def collect(source: Source, topics: Collection[Topic]) -> dict[str, Messages]:
    """Raw messages of topics, by name, in one pass over the bag or its window, each in the order of reception."""
    whole = source.gathered({topic.name for topic in topics})
    if whole is None:
        whole = _one_by_one(source, topics)
    found: dict[str, Messages] = {}
    for topic in topics:
        log_ns, messages = whole[topic.name]
        if len(messages) != topic.n_messages and not source.recovered and source.window is None:
            problem = f"is damaged ({len(messages)} of {topic.n_messages} messages of {topic.name} are where its index says)"
            raise DamagedError(source.path, problem, "record again, or restore it from a copy")
        if np.any(np.diff(log_ns) < 0):  # several recorder threads, or files out of order
            order = np.argsort(log_ns, kind="stable")
            log_ns, messages = log_ns[order], messages.taken(order)
        found[topic.name] = Messages(topic, log_ns, messages)
    return found


def _one_by_one(source: Source, topics: Collection[Topic]) -> dict[str, Gathered]:
    """As :meth:`.source.Source.gathered`, from one message after the other."""
    times: dict[str, list[int]] = {topic.name: [] for topic in topics}
    data: dict[str, list[bytes]] = {topic.name: [] for topic in topics}
    types = {topic.name: topic.msgtype for topic in topics}
    for name, msgtype, log_time, raw in source.messages(set(times)):
        if types[name] == msgtype:
            times[name].append(log_time)
            data[name].append(raw)
    return {name: Gathered(np.array(times[name], dtype=np.int64), Rows.of(data[name])) for name in times}


def series(where: object, messages: Messages, joint: str | None = None, usual: str | None = None) -> Series:
    """Decode one topic.

    Args:
        where: the bag, for messages.
        messages: raw messages of the topic.
        joint: which joint of joint states; None for the only one. Of the stamped types, messages whose ``frame_id`` names this
            joint are taken, where there are such.
        usual: which joint to take when there are several and none is asked for.

    Raises:
        BagError: a message that does not fit its type; joint not there, or several; lists of unequal length.
    """
    topic = messages.topic
    blocks = _decoded(where, messages)
    if topic.msgtype in JOINT_TYPES:
        return _joint_series(where, messages, blocks, joint, usual)
    wanted = _FIELDS.get(topic.msgtype) or _scalar_fields(blocks)
    if any(key not in block.numbers or block.numbers[key].ndim != 1 for key in wanted.values() for block in blocks):
        raise BagError(where, f"{topic.msgtype} in the bag lacks one of the fields {', '.join(wanted)}", "record it anew")
    named = [block for block in blocks if joint is not None and block.strings.get("header.frame_id") == joint]
    blocks = named or blocks
    fields = {name: np.full(messages.log_ns.size, np.nan) for name in wanted}
    for block in blocks:
        for name, key in wanted.items():
            fields[name][block.rows] = block.numbers[key]
    stamp_ns, log_ns = _stamps(blocks, messages.log_ns.size), messages.log_ns
    if named:
        rows = np.sort(np.concatenate([block.rows for block in named]))
        fields = {name: values[rows] for name, values in fields.items()}
        stamp_ns, log_ns = None if stamp_ns is None else stamp_ns[rows], log_ns[rows]
    return Series(topic.name, topic.msgtype, stamp_ns, log_ns, fields)


def number_series(where: object, messages: Messages, joint: str, selection: str, *, role: str, certain: bool) -> Series:
    """Decode one number of each message of a topic; the only field of the result is ``value``.

    Args:
        where: the bag, for messages.
        messages: raw messages of the topic.
        joint: name of the joint.
        selection: which number, see :mod:`.selection`; empty: the only one there is.
        role: of the topic, as it is named on the command line.
        certain: True when a single value can only be about this joint; a force whose ``frame_id`` names it is so in any case.

    Raises:
        BagError: a message that does not fit its type; no such number; nothing says which.
    """
    topic = messages.topic
    blocks = _decoded(where, messages)
    named = [block for block in blocks if block.strings.get("header.frame_id") == joint]
    if named and topic.msgtype == STAMPED_FORCE:
        blocks, certain = named, True
    values = np.full(messages.log_ns.size, np.nan)
    has = np.zeros(messages.log_ns.size, dtype=np.bool_)
    for block in blocks:
        try:
            found = select(block, selection, joint, certain)
        except SelectionError as error:
            given = ", ".join(f"{topic.name}:{choice}" for choice in error.choices)
            remedy = f"give --topic {role}=NAME with one of {given}" if given else f"give another topic, --topic {role}=NAME"
            raise BagError(where, f"topic {topic.name} ({topic.msgtype}) {error}", remedy) from error
        except UnequalError as error:
            raise _unequal(where, messages, block, error) from error
        if found is not None:
            values[block.rows], has[block.rows] = found, True
    if not has.any():
        remedy = f"give another topic, --topic {role}=NAME"
        raise BagError(where, f"topic {topic.name} ({topic.msgtype}) has nothing of joint '{joint}'", remedy)
    stamp_ns = _stamps(blocks, messages.log_ns.size)
    stamp_ns = None if stamp_ns is None else stamp_ns[has]
    return Series(topic.name, topic.msgtype, stamp_ns, messages.log_ns[has], {"value": values[has]})


def _decoded(where: object, messages: Messages) -> list[Block]:
    """Decoded messages of a topic.

    Raises:
        BagError: the type is not known, or a message does not fit it.
    """
    topic = messages.topic
    try:
        versions = type_versions(topic.msgtype, topic.definition, topic.encoding)
    except KeyError as error:
        raise BagError(
            where,
            f"the bag does not define the type {topic.msgtype} of topic {topic.name}",
            "record it with a recorder that does",
        ) from error
    for number, types in enumerate(versions, start=1):
        try:
            return decode(messages.data, topic.msgtype, types, topic.encoding)
        except DecodeError as error:
            if number == len(versions):
                problem = f"message {error.row} of topic {topic.name} is not a valid {topic.msgtype}: {error}"
                raise BagError(where, problem, "record again") from error
    raise AssertionError("a type has at least one version")


def joints_in(where: object, messages: Messages) -> list[str]:
    """Names of the joints of a topic, in the order in which they come.

    Raises:
        BagError: a message that does not fit its type.
    """
    blocks = sorted(_decoded(where, messages), key=lambda block: int(block.rows[0]))
    return list(dict.fromkeys(name for block in blocks for name in joint_names(block) or ()))


def _unequal(where: object, messages: Messages, block: Block, error: UnequalError) -> BagError:
    at = (messages.log_ns[block.rows[0]] - messages.log_ns[0]) * 1e-9
    where_in = f"in {block.rows.size} messages of {messages.topic.name}, first at {at:.3f} s"
    return BagError(where, f"{error} {where_in}", "record with a publisher that gives one value per joint")


def read_series(path: str | Path, topic: str, joint: str | None = None) -> Series:
    """Read one topic of a recording into arrays.

    Args:
        path: bag folder, or a ``.mcap``, ``.db3`` or ``.bag`` file.
        topic: name of the topic; a topic under a namespace that ends like it is taken too.
        joint: which joint, for joint states.

    Raises:
        BagError: the bag, the topic or the joint cannot be used.
    """
    try:
        return _read_series(Source(path), topic, joint)
    except DamagedError:
        return _read_series(Source(path, recover=True), topic, joint)


def _read_series(source: Source, topic: str, joint: str | None) -> Series:
    with source:
        msgtypes = sorted({entry.msgtype for entry in source.topics})
        entry, _ = pick_topic(source.path, source.topics, topic, msgtypes, "NAME")
        return series(source.path, collect(source, [entry])[entry.name], joint, source.custom.get("fric.joint"))


def _stamps(blocks: Sequence[Block], n_messages: int) -> Stamps | None:
    stamp_ns = np.zeros(n_messages, dtype=np.int64)
    for block in blocks:
        seconds, parts = (block.numbers.get(f"header.stamp.{name}") for name in ("sec", "nanosec"))
        if seconds is None or parts is None or seconds.ndim != 1 or parts.ndim != 1:
            return None
        stamp_ns[block.rows] = seconds.astype(np.int64) * 1_000_000_000 + parts.astype(np.int64)
    return stamp_ns


def _scalar_fields(blocks: Sequence[Block]) -> dict[str, str]:
    """All single numbers of a type that fric does not know, by their dotted names, the header left out."""
    names = [name for name, values in blocks[0].numbers.items() if values.ndim == 1] if blocks else []
    common = [name for name in names if all(name in block.numbers for block in blocks)]
    return {name: name for name in common if not name.startswith("header.")}


def _joint_series(where: object, messages: Messages, blocks: Sequence[Block], joint: str | None, usual: str | None) -> Series:
    topic, n_messages = messages.topic, messages.log_ns.size
    joints = sorted({name for block in blocks for name in joint_names(block) or ()})
    if not joints:
        raise BagError(
            where, f"joint states on {topic.name} hold no joint", "choose another topic with --topic joint_states=NAME"
        )
    chosen = pick_joint(where, joints, joint, usual)
    stamp_ns = _stamps(blocks, n_messages)
    has = np.zeros(n_messages, dtype=np.bool_)
    columns: dict[str, Array] = {name: np.full(n_messages, np.nan) for name in _JOINT_FIELDS}
    present = dict.fromkeys(_JOINT_FIELDS, 0)
    for block in blocks:
        names = joint_names(block) or []
        if chosen not in names:
            continue  # another publisher's joints
        has[block.rows] = True
        try:
            found = joint_fields(block, names, chosen)
        except UnequalError as error:
            raise _unequal(where, messages, block, error) from error
        for name, values in found.items():
            columns.setdefault(name, np.full(n_messages, np.nan))[block.rows] = values
            present[name] = present.get(name, 0) + block.rows.size
    total = int(has.sum())
    fields: dict[str, Array] = {}
    notes: list[str] = []
    for name, there in present.items():
        if 0 < there < total and name in _JOINT_FIELDS:
            absent = total - there
            if name == "velocity":
                notes.append(f"velocity left out: it is missing in {absent} of {total} messages of {topic.name}")
                continue
            raise BagError(
                where,
                f"{name} is missing in {absent} of {total} messages of {topic.name}",
                "record with one publisher only",
            )
        if there == total:
            fields[name] = columns[name][has]
    if "position" not in fields:
        raise BagError(where, f"joint '{chosen}' has no position on {topic.name}", "record a publisher that gives positions")
    stamp_ns = None if stamp_ns is None else stamp_ns[has]
    return Series(topic.name, topic.msgtype, stamp_ns, messages.log_ns[has], fields, chosen, tuple(notes), tuple(joints))
