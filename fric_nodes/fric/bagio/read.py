"""From a bag to a :class:`~fric.record.Record`.

Joint states set the time base: one sample per message, at the stamp of its header. Everything else is brought onto these
stamps: the force command, where the joint states have no effort, by holding the last one (zero order); the reference by the
cubic Hermite polynomial through its positions and velocities; further signals by linear interpolation. Topics without a header
are compared by time of reception, on both sides, because the clock of the stamps may be another one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from ..record import Array, Record, Units
from .alignment import clocks, hermite, reference_of, stamp_of
from .checks import Samples, check_samples, pick_topic
from .effort import EffortFrom, EffortSearch, command_topics
from .errors import BagError, DamagedError
from .selection import split_topic
from .series import Messages, Series, collect, joints_in, number_series, series
from .source import Source
from .topics import Raw, Topic, Topics
from .types import ARRAYS, FLOAT32, FLOAT64, JOINT_TYPES, REFERENCE, STAMPED_FORCE, TRAJECTORY_STATE
from .window import Window, stored_invalid, stored_notes

__all__ = [
    "BagInfo",
    "EffortFrom",
    "RecordReading",
    "TimeFrom",
    "Topics",
    "bag_info",
    "iterate_raw",
    "joint_list",
    "read_record",
]

TimeFrom = Literal["stamp", "log"]
_HOLDS = ("following", "preceding", "linear", "unknown")


class BagInfo(NamedTuple):
    """What a bag holds, without reading its messages.

    Attributes:
        path: the bag.
        storage: ``mcap``, ``sqlite3`` or ``ros1``.
        topics: with type and number of messages.
        custom: key and value pairs stored with the bag.
        notes: what is wrong with its files.
    """

    path: Path
    storage: str
    topics: tuple[Topic, ...]
    custom: dict[str, str]
    notes: tuple[str, ...]


def bag_info(path: str | Path) -> BagInfo:
    """Describe a bag.

    Raises:
        BagError: not a bag, or damaged beyond use.
    """
    with Source(path) as source:
        return BagInfo(source.path, source.storage, source.topics, source.custom, tuple(source.notes))


def iterate_raw(path: str | Path, topics: list[str] | None = None) -> Iterator[Raw]:
    """Messages of a bag as they were recorded, in the order of reception.

    Args:
        path: bag folder, or a ``.mcap``, ``.db3`` or ``.bag`` file.
        topics: names of the topics; None for all.

    Yields:
        Topic, message type, time of reception [ns] and bytes (CDR, or those of ROS 1).

    Raises:
        BagError: not a bag; a topic that is not there; damaged.
    """
    with Source(path) as source:
        known = {topic.name for topic in source.topics}
        for name in topics or ():
            if name not in known:
                listed = ", ".join(sorted(known))
                raise BagError(source.path, f"no topic {name} in the bag; it holds: {listed}", "choose among these")
        yield from source.messages(topics)


def read_record(
    path: str | Path,
    *,
    joint: str | None = None,
    topics: Topics | None = None,
    time: TimeFrom = "stamp",
    repair: bool = False,
    start: float | None = None,
    end: float | None = None,
    effort: EffortFrom = "auto",
    units: Units | None = None,
    window: tuple[float, float] | None = None,
) -> Record:
    """Read one joint of a recording.

    Args:
        path: bag folder, or a ``.mcap``, ``.db3`` or ``.bag`` file; also a bag whose recorder was killed.
        joint: name of the joint; None when there is only one.
        topics: names of the topics; the usual ones when None.
        time: ``stamp`` for the stamps of the headers, ``log`` for the time of reception.
        repair: drop or mark what is unusable instead of refusing the recording; what was done is in the notes.
        start: first time to keep [s] from the first sample; None for the first sample.
        end: last time to keep [s] from the first sample; None for the last sample.
        effort: ``joint_states``, ``command``, or ``auto`` for the joint states where they have it and the command otherwise.
        units: units of position and force; None for those stored with the bag, or else m and N.
        window: read only what was received between these times [s] from the first message; the rest stays on the disk.

    Returns:
        Record with one sample per joint state.

    Raises:
        BagError: anything that makes the recording unusable, with its remedy.
    """
    names = topics or Topics()

    def found(source: Source) -> Record:
        part = None if window is None else Window.of(source, *window)
        return RecordReading(source, names, time, effort, repair, part).record(joint, units)

    try:
        with Source(path) as source:
            record = found(source)
    except DamagedError as damage:
        # Something inside does not read: take what is whole, block by block. What is lost then shows as a gap.
        with Source(path, recover=True) as source:
            source.notes.insert(0, f"the bag {damage.problem}; read record by record")
            record = found(source)
    return record if start is None and end is None else record.between(start, end)


class RecordReading:
    """One pass over one bag or a window of it.

    Attributes:
        n_states: joint states that it has read.
    """

    def __init__(
        self, source: Source, topics: Topics, time: TimeFrom, effort: EffortFrom, repair: bool, window: Window | None = None
    ) -> None:
        self.source = source
        source.window = None if window is None else window.around
        self.window = window
        self.n_states = 0
        self.where = source.path
        self.topics = topics
        self.effort_from = effort
        self.repair = repair
        self.notes = list(source.notes)
        self.by_log = time == "log"
        self.refused: dict[str, BagError] = {}
        self.candidates: dict[str, Messages] = {}

    def record(self, joint: str | None, units: Units | None) -> Record:
        """The record, see :func:`read_record`."""
        custom = self.source.custom
        raw = self._collect()
        states = series(self.where, raw["joint_states"], joint, custom.get("fric.joint"))
        self.notes += states.notes
        if not self.by_log and not states.stamped:
            self.by_log = True
            self.notes.append("all header stamps are zero: time of reception used")
        time_ns = states.log_ns if self.by_log else stamp_of(states)
        signals = {"position": self._position(states)}
        search = EffortSearch(
            self.where, self.topics, self.effort_from, self.by_log, states, raw, self.candidates, self.refused
        )
        effort = search.find()
        signals["effort"] = effort.values
        self.notes += effort.notes
        self._optional(states, raw, signals)
        hold = "following" if effort.commanded else effort.hold or custom.get("fric.effort_hold", "unknown")
        samples = Samples(time_ns, signals, effort.valid, [], hold if hold in _HOLDS else "unknown")
        self._stored_invalid(samples, raw["joint_states"].topic)
        if effort.commanded:
            self._after_first_command(samples)
        check_samples(self.where, samples, repair=self.repair)
        kept = samples.signals
        return Record(
            time=(samples.time_ns - samples.time_ns[0]) * 1e-9,
            position=kept.pop("position"),
            effort=kept.pop("effort"),
            velocity=kept.pop("velocity", None),
            reference=kept.pop("reference", None),
            extra=kept,
            valid=None if samples.valid.all() else samples.valid,
            joint=states.joint,
            units=self._units(units),
            source=str(self.where),
            effort_hold=samples.hold,
            notes=(*stored_notes(custom), *self.notes, *samples.notes),
        )

    def _collect(self) -> dict[str, Messages]:
        """Raw messages of every topic that is needed, by its role."""
        have = self.source.topics
        if not any(topic.n_messages for topic in have):
            raise BagError(self.where, "is empty: it holds no message", "record while the topics are being published")
        roles: dict[str, Topic] = {"joint_states": self._joint_topic()}
        force = [FLOAT64, STAMPED_FORCE, FLOAT32]
        types = {"force_command": [*force, *ARRAYS], "reference": [REFERENCE, TRAJECTORY_STATE], "effort": []}
        types |= dict.fromkeys(("normal_load", "temperature", *self._extra()), force)
        named = {field.name for field in fields(Topics) if getattr(self.topics, field.name) != field.default}
        needed = named | ({"force_command"} if self.effort_from == "command" else set())
        for role, msgtypes in types.items():
            given = getattr(self.topics, role, f"/{role}")
            if not given or (role == "force_command" and self.effort_from == "joint_states"):
                continue
            # A topic that was named is taken with any type that has numbers in it.
            known = msgtypes if role == "reference" or role not in named else [topic.msgtype for topic in have]
            try:
                roles[role] = self._pick(roles["joint_states"], split_topic(given)[0], known, role)
            except BagError as error:
                if role in needed:
                    raise
                self.refused[role] = error
        others = [] if "force_command" in roles or self.topics.effort else command_topics(have)
        found = collect(self.source, [*roles.values(), *others])
        if self.window is not None:
            states = roles["joint_states"].name
            found[states] = self.window.inside(found[states])
            if not found[states].data:
                raise BagError(self.where, f"no message of {states} in this part of it", "choose another part")
        self.n_states = len(found[roles["joint_states"].name].data)
        self.candidates = {topic.name: found[topic.name] for topic in others if found[topic.name].data}
        needed |= {"joint_states"}
        return {role: found[topic.name] for role, topic in roles.items() if found[topic.name].data or role in needed}

    def _pick(self, states: Topic, name: str, msgtypes: list[str], role: str) -> Topic:
        """The topic of a role."""
        # The axis whose joint states are read has its other topics under the same namespace.
        beside = _namespace(states, self.topics) + name
        name = beside if any(topic.name == beside for topic in self.source.topics) else name
        topic, note = pick_topic(self.where, self.source.topics, name, msgtypes, role)
        self.notes += [note] if note else []
        return topic

    def _joint_topic(self) -> Topic:
        """The topic of the joint states: under its name, or the only one of another name that holds joints."""
        topic, note = joint_topic(self.where, self.source.topics, self.topics)
        self.notes += [note] if note else []
        return topic

    def _extra(self) -> list[str]:
        """Names of further signals: those that the bag's writer named, and whatever a plant of ours has measured besides."""
        names = [name for name in self.source.custom.get("fric.extra", "").split(",") if name]
        if "fric.joint" in self.source.custom:
            commands = (split_topic(self.topics.force_command)[0], "/feedforward_force")
            names += [
                topic.name.removeprefix("/")
                for topic in self.source.topics
                if topic.msgtype in (FLOAT64, STAMPED_FORCE) and not topic.name.endswith(commands)
            ]
        return list(dict.fromkeys(names))

    def _position(self, states: Series) -> Array:
        """Position of the joint, unless nothing can be made of it."""
        position = states.fields["position"]
        if position.size and not np.isfinite(position).any():
            problem = f"position of joint '{states.joint}' is not finite (NaN or inf) at any of {position.size} samples"
            raise BagError(self.where, problem, "choose another joint with --joint NAME, or record its position")
        return position

    def _stored_invalid(self, samples: Samples, topic: Topic) -> None:
        """Leave out what the writer of the bag has left out."""
        custom, n_samples, window = self.source.custom, samples.time_ns.size, self.window
        if window is None or "fric.invalid" not in custom:
            valid = stored_invalid(custom, n_samples)
        else:
            before = window.counted(self.source, topic)
            valid = None if before is None else stored_invalid(custom, n_samples, before, topic.n_messages)
            if valid is None:
                self.notes.append("which samples the writer of the recording left out is not known: their numbers are not")
        if valid is not None:
            samples.valid &= valid

    def _after_first_command(self, samples: Samples) -> None:
        """Leave out the joint states before the first command, whose effort is not known."""
        known = ~np.isnan(samples.signals["effort"])
        first = int(np.argmax(known)) if known.any() else samples.time_ns.size
        if first:
            self.notes.append(f"{first} samples before the first force command left out: their effort is not known")
            samples.keep(slice(first, None))

    def _optional(self, states: Series, raw: dict[str, Messages], signals: dict[str, Array]) -> None:
        """Signals that a record may have: velocity, reference and whatever else was recorded with it."""
        velocity = states.fields.get("velocity")
        if velocity is not None:
            if np.isfinite(velocity).all():
                signals["velocity"] = velocity
            else:
                self.notes.append("velocity left out: it is not finite (NaN or inf) in places")
        if "reference" not in raw and "reference.position" in states.fields:
            wanted = states.fields["reference.position"]  # of the trajectory controller whose state is read
            signals |= {"reference": wanted} if np.isfinite(wanted).all() else {}
        for role, messages in raw.items():
            if role in {"joint_states", "force_command", "effort"}:
                continue
            if role == "reference":
                other = reference_of(series(self.where, messages, states.joint))
            else:
                selection = split_topic(getattr(self.topics, role, ""))[1]
                other = number_series(self.where, messages, states.joint, selection, role=role, certain=True)
            at, times, order = clocks(states, other, self.by_log)
            fields = {name: values[order] for name, values in other.fields.items()}
            good = np.isfinite(np.stack(list(fields.values()))).all(axis=0)
            if not good.all():
                self.notes.append(f"{int((~good).sum())} messages of {other.topic} are not finite: dropped")
                times, fields = times[good], {name: values[good] for name, values in fields.items()}
            times, first = np.unique(times, return_index=True)
            if not times.size:
                continue
            fields = {name: values[first] for name, values in fields.items()}
            if role == "reference" and "velocity" in fields:
                signals["reference"] = hermite(at, times, fields["position"], fields["velocity"])
            else:
                values = fields["position" if role == "reference" else "value"]
                signals[role] = np.interp((at - times[0]) * 1e-9, (times - times[0]) * 1e-9, values)

    def _units(self, given: Units | None) -> Units:
        if given is not None:
            return given
        custom = self.source.custom
        if "fric.position_unit" not in custom and "fric.force_unit" not in custom:
            self.notes.append("the recording does not state its units: m and N assumed")
        default = Units()
        return replace(
            default,
            position=custom.get("fric.position_unit", default.position),
            force=custom.get("fric.force_unit", default.force),
        )


def joint_topic(where: object, have: Sequence[Topic], topics: Topics) -> tuple[Topic, str | None]:
    """The topic of the joint states, and a note when it is not the one literally asked for.

    Raises:
        BagError: there is none, or several.
    """
    name = topics.joint_states
    try:
        return pick_topic(where, have, name, JOINT_TYPES, "joint_states")
    except BagError:
        # Under its usual name only: whoever gave another one meant that. A command is no state, whatever its type.
        others = [topic for topic in have if topic.msgtype in JOINT_TYPES and topic.n_messages and "command" not in topic.name]
        tail = "/" + name.rsplit("/", 1)[-1]
        if name != Topics.joint_states or not others or any(topic.name.endswith(tail) for topic in have):
            raise
    if len(others) > 1:
        listed = ", ".join(f"{topic.name} ({topic.msgtype})" for topic in others)
        problem = f"no topic {name}, but several that hold joints: {listed}"
        raise BagError(where, problem, "choose one with --topic joint_states=NAME")
    return others[0], f"topic {name} is not in the bag; {others[0].name} ({others[0].msgtype}) was read in its place"


def joint_list(path: str | Path, topics: Topics | None = None) -> list[str]:
    """Names of the joints in a recording, in the order in which they come.

    Args:
        path: bag folder, or a ``.mcap``, ``.db3`` or ``.bag`` file.
        topics: names of the topics; the usual ones when None.

    Raises:
        BagError: it is not a bag, or holds no joints.
    """
    try:
        return _joint_list(Source(path), topics or Topics())
    except DamagedError:
        return _joint_list(Source(path, recover=True), topics or Topics())


def _joint_list(source: Source, topics: Topics) -> list[str]:
    with source:
        entry, _ = joint_topic(source.path, source.topics, topics)
        return joints_in(source.path, collect(source, [entry])[entry.name])


def _namespace(states: Topic, topics: Topics) -> str:
    """What stands before the usual name of the joint states in the name they were found under."""
    return states.name.removesuffix(topics.joint_states) if states.name.endswith(topics.joint_states) else ""
