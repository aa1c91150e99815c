"""What makes a recording unusable, checked before anything else is done with it.

Each finding is one line with file, cause and remedy. With ``repair`` the samples concerned are dropped or marked instead, and
each thing done is said in the notes: what, how many, where, why. Nothing happens in silence.

Terms: a *gap* is a step longer than ten median steps and than 50 ms; a shorter irregularity is jitter and is left alone. A
*jump* is a step of more than 10 s forward, or a clock that starts again at an earlier time and goes on from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..record import Array, Mask
from .errors import BagError
from .topics import Topic

__all__ = ["MIN_SAMPLES", "Samples", "Stamps", "check_samples", "gap_length_ns", "pick_joint", "pick_topic"]

Stamps = NDArray[np.int64]

MIN_SAMPLES = 10
_JUMP_NS = 10_000_000_000
_GAP_FLOOR_NS = 50_000_000
_GAP_MEDIANS = 10
_STRAY = 10  # a run of stamps shorter than this that fits nowhere is stray, not a part of the recording


@dataclass
class Samples:
    """Signals on their way to a record; arrays of shape ``(n_samples,)``.

    Attributes:
        time_ns: stamps [ns], in the order of reception.
        signals: by name, ``position`` and ``effort`` among them.
        valid: False where a sample must not be used.
        notes: what was done.
    """

    time_ns: Stamps
    signals: dict[str, Array]
    valid: Mask
    notes: list[str] = field(default_factory=list)

    def keep(self, chosen: Mask | slice) -> None:
        """Leave out all but the chosen samples."""
        self.time_ns = self.time_ns[chosen]
        self.signals = {name: signal[chosen] for name, signal in self.signals.items()}
        self.valid = self.valid[chosen]

    def seconds(self, index: int | np.intp) -> float:
        """Time of a sample from the first one [s]."""
        return float(self.time_ns[index] - self.time_ns[0]) * 1e-9


def pick_topic(
    where: object, topics: Sequence[Topic], name: str, msgtypes: Sequence[str], key: str
) -> tuple[Topic, str | None]:
    """The topic of a bag that a name stands for.

    A name that is not there also matches a single topic of one of these types under a namespace.

    Args:
        where: the bag, for messages.
        topics: what the bag holds.
        name: name that is asked for.
        msgtypes: types that can be used.
        key: name of the field of ``Topics`` with which the user can give another name.

    Returns:
        The topic, and a note when it is not the one literally asked for.

    Raises:
        BagError: not there, of another type, several of that name under namespaces, or without messages.
    """
    named = [topic for topic in topics if topic.name == name]
    fitting = [topic for topic in named if topic.msgtype in msgtypes]
    note = None
    if not named:
        tail = "/" + name.strip("/").rsplit("/", 1)[-1]
        fitting = [topic for topic in topics if topic.name.endswith(tail) and topic.msgtype in msgtypes]
        if len(fitting) > 1:
            listed = ", ".join(topic.name for topic in fitting)
            problem = f"no topic {name}, but several that end like it: {listed}"
            raise BagError(where, problem, f"choose one with --topic {key}=NAME")
        if fitting:
            note = f"topic {name} is not in the bag; {fitting[0].name} was read in its place"
    if not fitting:
        if named:
            raise BagError(
                where,
                f"topic {name} has the type {named[0].msgtype}, expected {' or '.join(msgtypes)}",
                f"choose another topic with --topic {key}=NAME",
            )
        listed = ", ".join(f"{topic.name} ({topic.msgtype})" for topic in topics) or "none"
        raise BagError(where, f"no topic {name} in the bag; it holds: {listed}", f"name the topic with --topic {key}=NAME")
    if fitting[0].n_messages == 0:
        raise BagError(where, f"topic {fitting[0].name} holds no message", "record while the topic is being published")
    return fitting[0], note


def pick_joint(where: object, joints: Sequence[str], wanted: str | None, usual: str | None = None) -> str:
    """The joint that is meant: the one asked for, the usual one of this bag, or the only one.

    Raises:
        BagError: not among ``joints``, or several and none chosen.
    """
    listed = ", ".join(joints)
    if wanted is not None:
        if wanted not in joints:
            raise BagError(where, f"no joint '{wanted}'; joints there: {listed}", "choose one of them with --joint NAME")
        return wanted
    if usual is not None and usual in joints:
        return usual
    if len(joints) > 1:
        raise BagError(where, f"several joints: {listed}", "choose one with --joint NAME")
    return joints[0]


def gap_length_ns(time_ns: Stamps) -> float:
    """Step above which two samples have a gap between them [ns]."""
    step = np.diff(time_ns)
    step = step[step > 0]
    return max(_GAP_MEDIANS * float(np.median(step)), _GAP_FLOOR_NS) if step.size else _GAP_FLOOR_NS


def check_samples(where: object, samples: Samples, *, repair: bool, received: bool = True) -> None:
    """Check samples, or repair them in place.

    Args:
        where: they come from.
        samples: to be checked.
        repair: what can be.
        received: True when they have a time of reception besides, as those of a bag have.

    Raises:
        BagError: too short; or, without ``repair``, values that are not finite, stamps that go back, repeat or jump, gaps.
    """
    _enough(where, samples)
    _finite(where, samples, repair)
    otherwise = ", or read by time of reception with --time log" if received else ""
    _jumps(where, samples, repair, otherwise)
    _order(where, samples, repair, otherwise)
    _gaps(where, samples, repair)
    _enough(where, samples)


def _enough(where: object, samples: Samples) -> None:
    count = samples.time_ns.size
    if count < MIN_SAMPLES:
        left = " left" if samples.notes else ""
        raise BagError(where, f"too short: only {count} samples{left}, at least {MIN_SAMPLES} are needed", "record for longer")


def _finite(where: object, samples: Samples, repair: bool) -> None:
    good = np.ones(samples.time_ns.size, dtype=np.bool_)
    for name, signal in samples.signals.items():
        finite = np.isfinite(signal)
        if finite.all():
            continue
        bad = np.flatnonzero(~finite)
        first = samples.seconds(bad[0])
        what = f"{name} is not finite (NaN or inf) at {bad.size} of {signal.size} samples, first at {first:.3f} s"
        if not repair:
            raise BagError(where, what, "drop these samples with --repair, or record again")
        samples.notes.append(f"{what}: dropped")
        good &= finite
    if not good.all():
        samples.keep(good)
        _enough(where, samples)


def _jumps(where: object, samples: Samples, repair: bool, otherwise: str) -> None:
    step = np.diff(samples.time_ns)
    far = (step > _JUMP_NS) | (step < -gap_length_ns(samples.time_ns))
    if not far.any():
        return
    at = int(np.flatnonzero(far)[0])
    size = float(step[at]) * 1e-9
    what = f"time jumps by {size:+.3f} s after sample {at} (at {samples.seconds(at):.3f} s), {int(far.sum())} jump(s) in all"
    if not repair:
        raise BagError(where, what, f"keep the longest part in one piece with --repair{otherwise}")
    edges = [0, *(np.flatnonzero(far) + 1).tolist(), samples.time_ns.size]
    chosen, left_out = _longest_part(samples.time_ns, edges)
    samples.keep(chosen)
    part = f"{samples.time_ns.size} samples, {samples.seconds(-1):.3f} s"
    samples.notes.append(f"{what}: kept the longest part in one piece ({part}), left out {left_out} samples")


def _longest_part(time_ns: Stamps, edges: list[int]) -> tuple[Mask, int]:
    """The longest run of parts that belong together, stray stamps between them taken out; and how many samples are left out."""
    runs: list[list[tuple[int, int]]] = []
    for start, stop in pairwise(edges):
        if stop - start < _STRAY:
            continue
        if runs and 0 < time_ns[start] - time_ns[runs[-1][-1][1] - 1] <= _JUMP_NS:
            runs[-1].append((start, stop))
        else:
            runs.append([(start, stop)])
    if not runs:
        widest = max(range(len(edges) - 1), key=lambda part: edges[part + 1] - edges[part])
        runs = [[(edges[widest], edges[widest + 1])]]
    best = max(runs, key=lambda run: sum(stop - start for start, stop in run))
    chosen = np.zeros(time_ns.size, dtype=np.bool_)
    for start, stop in best:
        chosen[start:stop] = True
    return chosen, int(time_ns.size - chosen.sum())


def _order(where: object, samples: Samples, repair: bool, otherwise: str) -> None:
    time_ns = samples.time_ns
    newest = np.maximum.accumulate(time_ns)
    back = np.zeros(time_ns.size, dtype=np.bool_)
    again = np.zeros(time_ns.size, dtype=np.bool_)
    back[1:] = time_ns[1:] < newest[:-1]
    again[1:] = time_ns[1:] == newest[:-1]
    for bad, verb in ((back, "go back"), (again, "repeat an earlier one")):
        if not bad.any():
            continue
        first = int(np.argmax(bad))
        what = f"{int(bad.sum())} of {time_ns.size} stamps {verb}, first at sample {first} ({samples.seconds(first):.3f} s)"
        if not repair:
            raise BagError(where, what, f"drop these samples with --repair{otherwise}")
        samples.notes.append(f"{what}: dropped")
    samples.keep(~(back | again))


def _gaps(where: object, samples: Samples, repair: bool) -> None:
    if samples.time_ns.size < MIN_SAMPLES:
        return
    step = np.diff(samples.time_ns)
    # A gap between samples that are marked already, as in a repaired recording that was written again, is known.
    known = ~samples.valid[:-1] & ~samples.valid[1:]
    gaps = np.flatnonzero((step > gap_length_ns(samples.time_ns)) & ~known)
    if not gaps.size:
        return
    longest = int(gaps[np.argmax(step[gaps])])
    what = (
        f"{gaps.size} gap(s) in the samples, the longest {float(step[longest]) * 1e-9:.3f} s "
        f"at {samples.seconds(longest):.3f} s (median step {float(np.median(step)) * 1e-6:.3f} ms)"
    )
    if not repair:
        remedy = "keep them, with the samples beside marked as not to be used, with --repair, or record again"
        raise BagError(where, what, remedy)
    samples.valid = samples.valid.copy()
    samples.valid[gaps] = False
    samples.valid[gaps + 1] = False
    samples.notes.append(f"{what}: kept, the sample on either side marked as not to be used")
