"""From a bag to a :class:`~fric_nodes.record.Record`.

Joint states set the time base: one sample per message, at the stamp of its header. Everything else is brought onto these
stamps: the force command, where the joint states have no effort, by holding the last one (zero order); the reference by the
cubic Hermite polynomial through its positions and velocities; further signals by linear interpolation. Topics without a header
are compared by time of reception, on both sides, because the clock of the stamps may be another one.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..record import Array, Mask, Record, Units
from .checks import Samples, Stamps, check_samples, gap_length_ns, pick_topic
from .errors import BagError, DamagedError
from .series import Messages, Series, collect, series
from .source import Source
from .topics import Raw, Topic
from .types import FLOAT64, JOINT_STATE, REFERENCE, STAMPED_FORCE

__all__ = ["BagInfo", "EffortFrom", "TimeFrom", "Topics", "bag_info", "iterate_raw", "read_record"]

TimeFrom = Literal["stamp", "log"]
EffortFrom = Literal["auto", "joint_states", "command"]
_HOLDS = ("following", "preceding", "linear")


@dataclass(frozen=True)
class Topics:
    """Names of the topics in a bag; a name that is not there also matches one single topic under a namespace.

    Attributes:
        joint_states: ``sensor_msgs/msg/JointState``.
        force_command: ``std_msgs/msg/Float64`` or ``fric_interfaces/msg/StampedForce`` [N or N m].
        reference: ``fric_interfaces/msg/Reference``.
        feedforward: as ``force_command``; not part of a record, but known to reports.
        normal_load: as ``force_command`` [N], as are all further signals of a plant.
        temperature: as ``normal_load`` [degC].
    """

    joint_states: str = "/joint_states"
    force_command: str = "/force_command"
    reference: str = "/reference"
    feedforward: str = "/feedforward_force"
    normal_load: str = "/normal_load"
    temperature: str = "/temperature"


class BagInfo(NamedTuple):
    """What a bag holds, without reading its messages.

    Attributes:
        path: the bag.
        storage: ``mcap`` or ``sqlite3``.
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
        path: bag folder, or a ``.mcap`` or ``.db3`` file.
        topics: names of the topics; None for all.

    Yields:
        Topic, message type, time of reception [ns] and CDR bytes.

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
) -> Record:
    """Read one joint of a recording.

    Args:
        path: bag folder, or a ``.mcap`` or ``.db3`` file; also a bag whose recorder was killed.
        joint: name of the joint; None when there is only one.
        topics: names of the topics; the usual ones when None.
        time: ``stamp`` for the stamps of the headers, ``log`` for the time of reception.
        repair: drop or mark what is unusable instead of refusing the recording; what was done is in the notes.
        start: first time to keep [s] from the first sample; None for the first sample.
        end: last time to keep [s] from the first sample; None for the last sample.
        effort: ``joint_states``, ``command``, or ``auto`` for the joint states where they have it and the command otherwise.
        units: units of position and force; None for those stored with the bag, or else m and N.

    Returns:
        Record with one sample per joint state.

    Raises:
        BagError: anything that makes the recording unusable, with its remedy.
    """
    names = topics or Topics()
    try:
        with Source(path) as source:
            record = _Reading(source, names, time, effort, repair).record(joint, units)
    except DamagedError as damage:
        # Something inside does not read: take what is whole, block by block. What is lost then shows as a gap.
        with Source(path, recover=True) as source:
            source.notes.insert(0, f"the bag {damage.problem}; read record by record")
            record = _Reading(source, names, time, effort, repair).record(joint, units)
    return record if start is None and end is None else record.between(start, end)


class _Reading:
    """One pass over one bag."""

    def __init__(self, source: Source, topics: Topics, time: TimeFrom, effort: EffortFrom, repair: bool) -> None:
        self.source = source
        self.where = source.path
        self.topics = topics
        self.effort_from = effort
        self.repair = repair
        self.notes = list(source.notes)
        self.by_log = time == "log"
        self.refused: dict[str, BagError] = {}

    def record(self, joint: str | None, units: Units | None) -> Record:
        custom = self.source.custom
        raw = self._collect()
        states = series(self.where, raw["joint_states"], joint, custom.get("fric.joint"))
        self.notes += states.notes
        if not self.by_log and not states.stamped:
            self.by_log = True
            self.notes.append("all header stamps are zero: time of reception used")
        time_ns = states.log_ns if self.by_log else _stamp(states)
        signals = {"position": states.fields["position"]}
        signals["effort"], from_command, valid = self._effort(states, raw)
        self._optional(states, raw, signals)
        samples = Samples(time_ns, signals, valid, [])
        own_invalid = _stored_invalid(custom, samples.time_ns.size)
        samples.valid &= own_invalid
        if from_command:
            self._after_first_command(samples)
        check_samples(self.where, samples, repair=self.repair)
        hold = custom.get("fric.effort_hold", "linear")
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
            effort_hold="following" if from_command or hold not in _HOLDS else hold,
            notes=(*_stored_notes(custom), *self.notes, *samples.notes),
        )

    def _collect(self) -> dict[str, Messages]:
        """Raw messages of every topic that is needed, by its role."""
        have, where = self.source.topics, self.where
        if not any(topic.n_messages for topic in have):
            raise BagError(where, "is empty: it holds no message", "record while the topics are being published")
        roles: dict[str, Topic] = {}
        types = {"joint_states": [JOINT_STATE], "force_command": [FLOAT64, STAMPED_FORCE], "reference": [REFERENCE]}
        optional = {name: [FLOAT64, STAMPED_FORCE] for name in ("normal_load", "temperature", *self._extra())}
        needed = {"joint_states", "force_command"} if self.effort_from == "command" else {"joint_states"}
        for role, msgtypes in {**types, **optional}.items():
            if role == "force_command" and self.effort_from == "joint_states":
                continue
            name = getattr(self.topics, role, f"/{role}")
            # The axis whose joint states are read has its other topics under the same namespace.
            beside = _namespace(roles, self.topics) + name
            name = beside if any(topic.name == beside for topic in have) else name
            try:
                roles[role], note = pick_topic(where, have, name, msgtypes, role)
            except BagError as error:
                if role in needed:
                    raise
                self.refused[role] = error
                continue
            self.notes += [note] if note else []
        found = collect(self.source, list(roles.values()))
        return {role: found[topic.name] for role, topic in roles.items() if found[topic.name].data or role in needed}

    def _extra(self) -> list[str]:
        """Names of further signals: those that the bag's writer named, and whatever a plant of ours has measured besides."""
        names = [name for name in self.source.custom.get("fric.extra", "").split(",") if name]
        if "fric.joint" in self.source.custom:
            commands = (self.topics.force_command, "/feedforward_force")
            names += [
                topic.name.removeprefix("/")
                for topic in self.source.topics
                if topic.msgtype in (FLOAT64, STAMPED_FORCE) and not topic.name.endswith(commands)
            ]
        return list(dict.fromkeys(names))

    def _effort(self, states: Series, raw: dict[str, Messages]) -> tuple[Array, bool, Mask]:
        """Effort at each joint state, whether it comes from the command, and where it can be used."""
        everywhere = np.ones(states.log_ns.size, dtype=np.bool_)
        own = states.fields.get("effort")
        if own is not None and self.effort_from != "command":
            zero = not np.any(own)
            if not zero or "force_command" not in raw:
                self.notes += ["effort is zero throughout"] if zero else []
                return own, False, everywhere
        if self.effort_from == "joint_states":
            raise BagError(
                self.where,
                f"joint '{states.joint}' has no effort in {states.topic}",
                "read the force command in its place, or record the effort",
            )
        if "force_command" not in raw:
            refusal = self.refused.get("force_command")
            if refusal is not None and not refusal.problem.startswith(f"no topic {self.topics.force_command} in the bag"):
                raise refusal  # it is there, but not as it is needed
            raise BagError(
                self.where,
                f"no effort: {states.topic} has none for joint '{states.joint}' and there is no topic "
                f"{self.topics.force_command} ({FLOAT64} or {STAMPED_FORCE})",
                "record the effort or the force command, or name its topic with --topic force_command=NAME",
            )
        command = series(self.where, raw["force_command"], states.joint)
        if own is not None and self.effort_from == "auto":
            self.notes.append(f"effort is zero throughout in {states.topic}: taken from {command.topic}")
        elif self.effort_from == "auto":
            self.notes.append(f"{states.topic} has no effort: taken from {command.topic}, each command held until the next")
        return self._held(states, command), True, self._while_commanded(states, command)

    def _clocks(self, states: Series, other: Series) -> tuple[Stamps, Stamps, NDArray[np.intp]]:
        """Times of the joint states and, sorted, of another topic, on one clock; and the order that sorts the other topic."""
        if not self.by_log and other.stamped:
            at, times = _stamp(states), _stamp(other)
        else:
            at, times = states.log_ns, other.log_ns
        order = np.argsort(times, kind="stable")
        return at, times[order], order

    def _held(self, states: Series, command: Series) -> Array:
        """The last command at or before each joint state; NaN before the first."""
        at, times, order = self._clocks(states, command)
        values = command.fields["data" if "data" in command.fields else "force"][order]
        last = np.searchsorted(times, at, side="right") - 1
        return np.where(last >= 0, values[np.maximum(last, 0)], np.nan)

    def _while_commanded(self, states: Series, command: Series) -> Mask:
        """False where commands have stopped for good while joint states go on: nobody knows what the drive then applies."""
        at, times, _ = self._clocks(states, command)
        valid = np.ones(at.size, dtype=np.bool_)
        if times.size > 10:
            valid = at <= times[-1] + gap_length_ns(times)
            if not valid.all():
                self.notes.append(
                    f"commands on {command.topic} stop before the joint states: "
                    f"the last {int((~valid).sum())} samples marked as not to be used"
                )
        return valid

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
        for role, messages in raw.items():
            if role in {"joint_states", "force_command"}:
                continue
            other = series(self.where, messages, states.joint)
            at, times, order = self._clocks(states, other)
            fields = {name: values[order] for name, values in other.fields.items()}
            good = np.isfinite(np.stack(list(fields.values()))).all(axis=0)
            if not good.all():
                self.notes.append(f"{int((~good).sum())} messages of {other.topic} are not finite: dropped")
                times, fields = times[good], {name: values[good] for name, values in fields.items()}
            times, first = np.unique(times, return_index=True)
            if not times.size:
                continue
            fields = {name: values[first] for name, values in fields.items()}
            if role == "reference":
                signals["reference"] = hermite(at, times, fields["position"], fields["velocity"])
            else:
                values = fields["data" if "data" in fields else "force"]
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


def _namespace(roles: dict[str, Topic], topics: Topics) -> str:
    """What stands before the usual name of the joint states in the name they were found under."""
    states = roles.get("joint_states")
    return states.name.removesuffix(topics.joint_states) if states and states.name.endswith(topics.joint_states) else ""


def _stamp(of: Series) -> Stamps:
    assert of.stamp_ns is not None
    return of.stamp_ns


def hermite(at: Stamps, times: Stamps, position: Array, velocity: Array) -> Array:
    """Position between samples of position and velocity, by the cubic through both at either end.

    Before the first sample, after the last and inside a gap the sample before is held (the first one, before it): a reference
    that is not being published does not move.

    Args:
        at: where it is wanted [ns], shape ``(n,)``.
        times: of the samples, increasing [ns], shape ``(m,)``.
        position: at these times [m or rad], shape ``(m,)``.
        velocity: at these times [m/s or rad/s], shape ``(m,)``.
    """
    if times.size < 2:
        return np.full(at.size, position[0])
    left = np.clip(np.searchsorted(times, at, side="right") - 1, 0, times.size - 2)
    step = times[left + 1] - times[left]
    inside = (at >= times[0]) & (at <= times[-1]) & (step <= gap_length_ns(times))
    h = step * 1e-9
    s = np.clip((at - times[left]) / step, 0.0, 1.0)
    p0, p1, v0, v1 = position[left], position[left + 1], velocity[left] * h, velocity[left + 1] * h
    # Hermite basis in nested form: p0 + s v0 + s^2 (3 d - 2 v0 - v1) + s^3 (v0 + v1 - 2 d), d = p1 - p0.
    d = p1 - p0
    curve = p0 + s * (v0 + s * (3 * d - 2 * v0 - v1 + s * (v0 + v1 - 2 * d)))
    held = np.where(at < times[0], position[0], np.where(at >= times[left + 1], p1, p0))
    return np.where(inside, curve, held)


def _stored_invalid(custom: dict[str, str], n_samples: int) -> Mask:
    """Which samples the writer of the bag left usable; all, when it does not say or the number of samples differs."""
    valid = np.ones(n_samples, dtype=np.bool_)
    try:
        stored = json.loads(custom.get("fric.invalid", "{}"))
        if stored and stored["samples"] == n_samples:
            for first, last in stored["ranges"]:
                valid[first : last + 1] = False
    except (ValueError, KeyError, TypeError):
        pass  # written by somebody else: only an offer
    return valid


def _stored_notes(custom: dict[str, str]) -> tuple[str, ...]:
    try:
        stored = json.loads(custom.get("fric.notes", "[]"))
    except ValueError:
        return ()
    return tuple(str(note) for note in stored) if isinstance(stored, list) else ()
