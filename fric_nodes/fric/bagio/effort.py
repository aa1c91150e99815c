"""Where the force of a record comes from: a topic that was named, the joint states, or the command.

The effort of the joint states counts as missing where it is not there, where it never changes (controllers without an effort
interface publish zero), and where it is mostly not finite (ros2_control publishes NaN then). The command takes its place, each
one held until the next. Which topic the command is on is known where it has its usual name, where it was named, and where the
bag holds a single topic that says by its name that it commands an effort, for a single joint; otherwise the refusal says what
to give. A list of commands holds one value per joint in an order that no bag tells: see :mod:`.selection`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from ..record import Array, Mask
from .alignment import clocks, held, stamp_of
from .checks import MIN_SAMPLES, Stamps, gap_length_ns
from .errors import BagError
from .selection import split_topic
from .series import Messages, Series, number_series
from .topics import Topic, Topics
from .types import ARRAYS, FLOAT64, NUMBERS, STAMPED_FORCE

__all__ = ["Effort", "EffortFrom", "EffortSearch", "command_topics"]

EffortFrom = Literal["auto", "joint_states", "command"]
_ROLE = "force_command"
_OTHER_QUANTITY = re.compile(r"position|velocity|speed|pose|twist|cmd_vel", re.IGNORECASE)
_EFFORT_NAME = re.compile(r"effort|torque|force|current", re.IGNORECASE)


class Effort(NamedTuple):
    """The force at each joint state.

    Attributes:
        values: [N or N m], shape ``(n,)``; NaN before the first command.
        commanded: True when it is the command, held from one to the next.
        valid: False where it must not be used, shape ``(n,)``.
        notes: where it comes from, and why from there.
        hold: how it acts between two samples, where the source tells; empty otherwise.
    """

    values: Array
    commanded: bool
    valid: Mask
    notes: tuple[str, ...] = ()
    hold: str = ""


def command_topics(topics: Sequence[Topic]) -> list[Topic]:
    """Topics that may command an effort: numbers, or lists of numbers, under the name that controllers of ROS give them."""
    return [
        topic
        for topic in topics
        if topic.n_messages
        and topic.msgtype in (*NUMBERS, *ARRAYS, STAMPED_FORCE)
        and topic.name.rsplit("/", 1)[-1] in {"command", "commands"}
        and not _OTHER_QUANTITY.search(topic.name)
    ]


@dataclass(frozen=True)
class EffortSearch:
    """The search for the force of one joint in one bag.

    Attributes:
        where: the bag, for messages.
        topics: names of the topics, as asked for.
        source: ``joint_states``, ``command``, or ``auto``.
        by_log: True when the joint states are taken at their time of reception.
        states: the joint states.
        raw: messages by role: ``effort`` and ``force_command`` where there are such topics.
        candidates: messages of topics that may command an effort, by name, where there is no ``force_command``.
        refused: why a role has no topic.
    """

    where: object
    topics: Topics
    source: EffortFrom
    by_log: bool
    states: Series
    raw: Mapping[str, Messages]
    candidates: Mapping[str, Messages]
    refused: Mapping[str, BagError]

    def find(self) -> Effort:
        """The force.

        Raises:
            BagError: there is none, or it is not clear which it is.
        """
        if self.topics.effort:
            return self._measured()
        own, everywhere = self.states.fields.get("effort"), np.ones(self.states.log_ns.size, dtype=np.bool_)
        why = self._missing(own)
        if own is not None and not why and self.source != "command":
            return Effort(own, False, everywhere, self._unused())
        # What does not change may be right all the same: no force acts in a free oscillation.
        usable = own is not None and bool(np.isfinite(own).all()) and self.source != "command"
        if self.source == "joint_states":
            if own is not None and usable:
                return Effort(own, False, everywhere, (why.removesuffix(f" in {self.states.topic}"),))
            problem = why if own is not None else f"joint '{self.states.joint}' has no effort in {self.states.topic}"
            raise BagError(self.where, problem, "read the force command in its place, or record the effort")
        try:
            return self._commanded(why)
        except BagError as error:
            if own is None or not usable or self._named:
                raise
            hint = f"no command was taken in its place: {error.problem}; {error.remedy}"
            known = bool(self.candidates or _ROLE in self.raw)
            said = why.removesuffix(f" in {self.states.topic}")
            return Effort(own, False, everywhere, (said, hint) if known else (said,))

    @property
    def _named(self) -> bool:
        """True when the user named the topic of the command."""
        return self.topics.force_command != Topics.force_command

    def _missing(self, own: Array | None) -> str:
        """Why the effort of the joint states can't be used; empty when it can."""
        topic = self.states.topic
        if own is None:
            return f"{topic} has no effort"
        finite = np.isfinite(own)
        if 2 * int(finite.sum()) < own.size and self._leaves_gaps(finite):
            return f"effort is not finite (NaN or inf) at {int((~finite).sum())} of {own.size} samples in {topic}"
        some = own[finite]
        if own.size >= MIN_SAMPLES and some.size and float(np.ptp(some)) == 0.0:
            return f"effort is {'zero' if some[0] == 0.0 else f'{some[0]:.6g}'} throughout in {topic}"
        return ""

    def _leaves_gaps(self, finite: Mask) -> bool:
        """False when the finite values are spread over the recording without gaps: a sensor that is read less often."""
        times = self.states.log_ns if self.by_log else stamp_of(self.states)
        if int(finite.sum()) < MIN_SAMPLES:
            return True
        edges = np.concatenate((times[:1], times[finite], times[-1:]))
        return bool(np.max(np.abs(np.diff(edges))) > gap_length_ns(times))

    def _unused(self) -> tuple[str, ...]:
        """A note when the user named a command but the joint states have an effort."""
        if not self._named or _ROLE not in self.raw:
            return ()
        return (f"effort is that of {self.states.topic}; {self.raw[_ROLE].topic.name} is not used, since that is there",)

    def _measured(self) -> Effort:
        """A force that was measured on a topic of its own, between its messages on the straight line."""
        _, selection = split_topic(self.topics.effort)
        single = len(self.states.joints) <= 1
        other = number_series(self.where, self.raw["effort"], self.states.joint, selection, role="effort", certain=single)
        at, times, order = clocks(self.states, other, self.by_log)
        values = other.fields["value"][order]
        times, first = np.unique(times, return_index=True)
        values = values[first]
        if times.size < MIN_SAMPLES:
            problem = f"topic {other.topic} holds only {times.size} message(s) with a time of their own"
            raise BagError(self.where, problem, "record it for as long as the joint states")
        found = np.interp((at - times[0]) * 1e-9, (times - times[0]) * 1e-9, values)
        right = np.clip(np.searchsorted(times, at, side="left"), 1, times.size - 1)
        valid = (at >= times[0]) & (at <= times[-1]) & (times[right] - times[right - 1] <= gap_length_ns(times))
        notes = [f"effort taken from {self.topics.effort}"]
        if not valid.all():
            notes.append(f"{int((~valid).sum())} samples without a message of {other.topic} marked as not to be used")
        return Effort(found, False, valid, tuple(notes), "linear")

    def _commanded(self, why: str) -> Effort:
        command, note = self._command()
        said = why if self.source == "auto" else ""
        if said:
            ending = ", each command held until the next" if "effort" not in self.states.fields else ""
            note = f"{said}: taken from {command.topic}{ending}{f' ({note})' if note else ''}"
        at, times, order = clocks(self.states, command, self.by_log)
        values = held(at, times, command.fields["value"][order])
        valid, notes = self._while_commanded(at, times, command.topic)
        return Effort(values, True, valid, (note, *notes) if note else notes)

    def _command(self) -> tuple[Series, str]:
        """The commands, and a note where that is not the topic asked for."""
        joint = self.states.joint
        single = len(self.states.joints) <= 1
        if _ROLE in self.raw:
            _, selection = split_topic(self.topics.force_command)
            return number_series(self.where, self.raw[_ROLE], joint, selection, role=_ROLE, certain=single), ""
        absent = f"no topic {split_topic(self.topics.force_command)[0]} in the bag"
        refusal = self.refused.get(_ROLE)
        if refusal is not None and not refusal.problem.startswith(absent):
            raise refusal  # it is there, but not as it is needed
        output = self.states.fields.get("output.effort")
        if output is not None and np.isfinite(output).all():
            held_output = self.states._replace(fields={"value": output})
            return held_output, "the output of the controller"
        without = f"no usable effort: {self._missing(self.states.fields.get('effort')) or 'the command is asked for'}"
        if len(self.candidates) != 1:
            raise self._no_command(without)
        ((name, messages),) = self.candidates.items()
        found = number_series(self.where, messages, joint, "", role=_ROLE, certain=single)
        if _EFFORT_NAME.search(name):
            return found, f"there is no topic {self.topics.force_command}, and no other effort command in the bag"
        unsure = f"{name} may command joint '{joint}', but its name does not say that it commands an effort"
        raise BagError(self.where, f"{without}; {unsure}", f"if it does, say so: --topic {_ROLE}={name}")

    def _no_command(self, without: str) -> BagError:
        if self.candidates:
            problem = f"{without}; the command may be on one of {', '.join(self.candidates)}"
            return BagError(self.where, problem, f"name its topic: --topic {_ROLE}={next(iter(self.candidates))}, or another")
        own = self.states.fields.get("effort")
        why = f"{self.states.topic} has none for joint '{self.states.joint}'" if own is None else self._missing(own)
        return BagError(
            self.where,
            f"no effort: {why or 'the command is asked for'} and there is no topic "
            f"{self.topics.force_command} ({FLOAT64} or {STAMPED_FORCE})",
            "record the effort or the force command, or name its topic with --topic force_command=NAME",
        )

    def _while_commanded(self, at: Stamps, times: Stamps, topic: str) -> tuple[Mask, tuple[str, ...]]:
        """False where commands have stopped for good while joint states go on: nobody knows what the drive then applies."""
        valid = np.ones(at.size, dtype=np.bool_)
        if times.size > 10:
            valid = at <= times[-1] + gap_length_ns(times)
            if not valid.all():
                stopped = f"commands on {topic} stop before the joint states"
                return valid, (f"{stopped}: the last {int((~valid).sum())} samples marked as not to be used",)
        return valid, ()
