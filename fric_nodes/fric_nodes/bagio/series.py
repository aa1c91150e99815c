"""Topics of a recording as arrays: the bulk-decoded table that reports and :func:`fric_nodes.bagio.read_record` use."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..record import Array
from .checks import Stamps, pick_joint, pick_topic
from .decode import Block, DecodeError, decode
from .errors import BagError, DamagedError
from .source import Source
from .topics import Topic
from .types import FLOAT64, JOINT_STATE, REFERENCE, STAMPED_FORCE, type_fields

__all__ = ["Messages", "Series", "collect", "read_series", "series"]

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
        notes: what was left out, and why.
    """

    topic: str
    msgtype: str
    stamp_ns: Stamps | None
    log_ns: Stamps
    fields: dict[str, Array]
    joint: str = ""
    notes: tuple[str, ...] = ()

    @property
    def stamped(self) -> bool:
        """True when the messages carry stamps that are not all zero."""
        return self.stamp_ns is not None and bool(np.any(self.stamp_ns))


class Messages(NamedTuple):
    """Raw messages of one topic: what the topic is, times of reception [ns], CDR bytes."""

    topic: Topic
    log_ns: Stamps
    data: list[bytes]


def collect(source: Source, topics: Collection[Topic]) -> dict[str, Messages]:
    """Raw messages of topics, by name, in one pass over the bag, each in the order of reception."""
    times: dict[str, list[int]] = {topic.name: [] for topic in topics}
    data: dict[str, list[bytes]] = {topic.name: [] for topic in topics}
    types = {topic.name: topic.msgtype for topic in topics}
    for name, msgtype, log_time, raw in source.messages(set(times)):
        if types[name] == msgtype:
            times[name].append(log_time)
            data[name].append(raw)
    found: dict[str, Messages] = {}
    for topic in topics:
        log_ns = np.array(times[topic.name], dtype=np.int64)
        messages = data[topic.name]
        if np.any(np.diff(log_ns) < 0):  # several recorder threads, or files out of order
            order = np.argsort(log_ns, kind="stable")
            log_ns, messages = log_ns[order], [messages[index] for index in order]
        found[topic.name] = Messages(topic, log_ns, messages)
    return found


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
    try:
        blocks = decode(messages.data, topic.msgtype, type_fields(topic.msgtype, topic.definition))
    except KeyError as error:
        raise BagError(
            where,
            f"the bag does not define the type {topic.msgtype} of topic {topic.name}",
            "record it with a recorder that does",
        ) from error
    except DecodeError as error:
        raise BagError(
            where, f"message {error.row} of topic {topic.name} is not a valid {topic.msgtype}: {error}", "record again"
        ) from error
    if topic.msgtype == JOINT_STATE:
        return _joint_series(where, messages, blocks, joint, usual)
    wanted = _FIELDS.get(topic.msgtype) or _scalar_fields(blocks)
    if any(key not in block.numbers for key in wanted.values() for block in blocks):
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


def read_series(path: str | Path, topic: str, joint: str | None = None) -> Series:
    """Read one topic of a recording into arrays.

    Args:
        path: bag folder, or a ``.mcap`` or ``.db3`` file.
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
        if "header.stamp.sec" not in block.numbers:
            return None
        seconds = block.numbers["header.stamp.sec"].astype(np.int64)
        stamp_ns[block.rows] = seconds * 1_000_000_000 + block.numbers["header.stamp.nanosec"]
    return stamp_ns


def _scalar_fields(blocks: Sequence[Block]) -> dict[str, str]:
    """All single numbers of a type that fric does not know, by their dotted names, the header left out."""
    names = [name for name, values in blocks[0].numbers.items() if values.ndim == 1] if blocks else []
    common = [name for name in names if all(name in block.numbers for block in blocks)]
    return {name: name for name in common if not name.startswith("header.")}


def _names(block: Block) -> list[str]:
    """Joints of joint states; numbered when they have no names."""
    return list(block.strings["name"]) or [str(index) for index in range(block.numbers["position"].shape[1])]


def _joint_series(where: object, messages: Messages, blocks: Sequence[Block], joint: str | None, usual: str | None) -> Series:
    topic, n_messages = messages.topic, messages.log_ns.size
    joints = sorted({name for block in blocks for name in _names(block)})
    if not joints:
        raise BagError(
            where, f"joint states on {topic.name} hold no joint", "choose another topic with --topic joint_states=NAME"
        )
    chosen = pick_joint(where, joints, joint, usual)
    stamp_ns = _stamps(blocks, n_messages)
    assert stamp_ns is not None  # joint states have a header
    has = np.zeros(n_messages, dtype=np.bool_)
    columns = {name: np.full(n_messages, np.nan) for name in _JOINT_FIELDS}
    absent = dict.fromkeys(_JOINT_FIELDS, 0)
    for block in blocks:
        names = _names(block)
        if chosen not in names:
            continue  # another publisher's joints
        has[block.rows] = True
        for name in _JOINT_FIELDS:
            values = block.numbers[name]
            if values.shape[1] == len(names):
                columns[name][block.rows] = values[:, names.index(chosen)]
            elif values.shape[1] == 0:
                absent[name] += block.rows.size
            else:
                at = (messages.log_ns[block.rows[0]] - messages.log_ns[0]) * 1e-9
                where_in = f"in {block.rows.size} messages of {topic.name}, first at {at:.3f} s"
                raise BagError(
                    where,
                    f"{name} has {values.shape[1]} values for {len(names)} joints {where_in}",
                    "record with a publisher that gives one value per joint",
                )
    total = int(has.sum())
    fields: dict[str, Array] = {}
    notes: list[str] = []
    for name in _JOINT_FIELDS:
        if 0 < absent[name] < total:
            if name == "velocity":
                notes.append(f"velocity left out: it is missing in {absent[name]} of {total} messages of {topic.name}")
                continue
            raise BagError(
                where,
                f"{name} is missing in {absent[name]} of {total} messages of {topic.name}",
                "record with one publisher only",
            )
        if not absent[name]:
            fields[name] = columns[name][has]
    if "position" not in fields:
        raise BagError(where, f"joint '{chosen}' has no position on {topic.name}", "record a publisher that gives positions")
    return Series(topic.name, topic.msgtype, stamp_ns[has], messages.log_ns[has], fields, chosen, tuple(notes))
