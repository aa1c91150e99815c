"""What makes a recording unusable, checked before anything else is done with it.

Each finding is one line with file, cause and remedy. With ``repair`` missing values are filled where the motion says what they
were, and samples are marked or dropped where it doesn't; each thing done is said in the notes: what, how many, where, why.
Nothing happens in silence, and a recording of which more than half would be lost is refused.

Missing values: a signal that has one in every n-th row only was sampled at a rate of its own and is brought onto the others',
see :mod:`.clocks`. In any other, up to three in a row are bridged: by the cubic through the samples around for a motion, by
the line for a force. A fit uses frequencies up to about a tenth of the rate, and over four steps such a motion is a cubic to
within a per mille. Longer stretches are marked as not to be used; those at the ends are left out.

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
from ..signals.stamps import rounded_grid, unwrapped_stamps
from .clocks import SMOOTH, is_seldom, place
from .errors import BagError
from .topics import Topic

__all__ = ["MIN_SAMPLES", "Samples", "Stamps", "check_samples", "gap_length_ns", "pick_joint", "pick_topic"]

Stamps = NDArray[np.int64]

MIN_SAMPLES = 10
HELD = ("following", "preceding")
"""Holds that a stamp begins or ends."""
_JUMP_NS = 10_000_000_000
_GAP_FLOOR_NS = 50_000_000
_GAP_MEDIANS = 10
_BRIDGED = 3  # missing values in a row that are filled, see above
_LOST = 0.5  # of a recording: with more than this gone, what is left is another recording
_HOLD_BROKEN = 0.1  # of the samples dropped: a force held over one step would then too often act over several
_STRAY = 10  # a run of stamps shorter than this that fits nowhere is stray, not a part of the recording


@dataclass
class Samples:
    """Signals on their way to a record; arrays of shape ``(n_samples,)``.

    Attributes:
        time_ns: stamps [ns], in the order of reception.
        signals: by name, ``position`` and ``effort`` among them.
        valid: False where a sample must not be used.
        notes: what was done.
        hold: of the effort, see :attr:`fric.record.Record.effort_hold`; ``unknown`` when a repair broke it.
    """

    time_ns: Stamps
    signals: dict[str, Array]
    valid: Mask
    notes: list[str] = field(default_factory=list)
    hold: str = "unknown"

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
    otherwise = ", or read by time of reception with --time log" if received else ""
    _recognised(samples)
    _jumps(where, samples, repair, otherwise)
    _order(where, samples, repair, otherwise)
    _finite(where, samples, repair)
    _gaps(where, samples, repair)
    _enough(where, samples)


def _recognised(samples: Samples) -> None:
    """Stamps that a counter has wrapped, or that are an even grid rounded, are what they stand for."""
    seconds = (samples.time_ns - samples.time_ns[0]) * 1e-9
    unwrapped = unwrapped_stamps(seconds)
    if unwrapped is not None:
        seconds, wrap, times = unwrapped
        samples.notes.append(f"the stamps start again {times} time(s), as a counter does after {wrap:.6g} s: they run on")
    # Single precision rounds the stamps themselves, not what they are from the first on.
    rounded = rounded_grid(seconds)
    if rounded is not None:
        seconds, step = rounded
        rate = 1.0 / float(seconds[1] - seconds[0])
        samples.notes.append(f"the stamps are rounded to {1e3 * step:.3g} ms: taken as even at {rate:.5g} Hz")
    if unwrapped is not None or rounded is not None:
        samples.time_ns = samples.time_ns[0] + np.rint((seconds - seconds[0]) * 1e9).astype(np.int64)


def _enough(where: object, samples: Samples) -> None:
    count = samples.time_ns.size
    if count < MIN_SAMPLES:
        left = " left" if samples.notes else ""
        raise BagError(where, f"too short: only {count} samples{left}, at least {MIN_SAMPLES} are needed", "record for longer")


def _finite(where: object, samples: Samples, repair: bool) -> None:
    _enough(where, samples)
    ends = np.ones(samples.time_ns.size, dtype=np.bool_)
    marked = np.zeros(samples.time_ns.size, dtype=np.bool_)
    # The motion first: by it, a force is judged.
    for name in sorted(samples.signals, key=lambda name: name != "position"):
        signal = samples.signals[name]
        finite = np.isfinite(signal)
        if finite.all():
            continue
        bad = np.flatnonzero(~finite)
        first = f"first at {samples.seconds(bad[0]):.3f} s"
        what = f"{name} is not finite (NaN or inf) at {bad.size} of {signal.size} samples, {first}"
        seldom = is_seldom(signal)
        if not repair:
            way = (
                f"bring {name}, which has a value in some rows only, onto the others' times"
                if seldom
                else "fill or mark these samples"
            )
            raise BagError(where, what, f"{way} with --repair, or record again")
        lost = 0 if seldom else int(bad.size)
        if finite.sum() < MIN_SAMPLES or lost > _LOST * signal.size:
            if name in {"position", "effort"}:
                raise BagError(where, f"{what}: too many to repair", "record again, or map another column")
            del samples.signals[name]
            samples.notes.append(f"{what}: {name} left out")
            continue
        done, gap = _filled(name, samples, finite, seldom)
        samples.notes.append(f"{what}: {done}")
        marked |= gap
        rows = np.flatnonzero(np.isfinite(samples.signals[name]))
        ends[: rows[0]] = ends[rows[-1] + 1 :] = False
    lost = int(np.count_nonzero(marked | ~ends))
    if lost > _LOST * ends.size:
        problem = f"{lost} of {ends.size} samples lack a value that could be told from those around"
        raise BagError(where, problem, "record again, or map other columns")
    samples.valid = samples.valid & ~marked
    if not ends.all():
        samples.notes.append(f"{int((~ends).sum())} samples at the ends, where a signal has no value yet or any more, left out")
        samples.keep(ends)
    _enough(where, samples)


def _filled(name: str, samples: Samples, finite: Mask, seldom: bool) -> tuple[str, Mask]:
    """Fill the missing values of a signal; what was done, and which samples must not be used."""
    time = (samples.time_ns - samples.time_ns[0]) * 1e-9
    signal = samples.signals[name]
    if seldom:
        placed = place(name, time, time[finite], signal[finite], samples.hold, samples.signals.get("position"))
        samples.signals[name] = placed.values
        every = float(np.median(np.diff(np.flatnonzero(finite))))
        held = name == "effort" and samples.hold in HELD
        step = f"; from here on it counts as held over one step of {np.median(np.diff(time)) * 1e3:.4g} ms" if held else ""
        return f"a value every {every:g} rows, filled {placed.how}{step}", placed.bridged
    rows = np.flatnonzero(finite)
    inside = ~finite
    inside[: rows[0]] = inside[rows[-1] + 1 :] = False
    run = np.diff(rows)[np.clip(np.searchsorted(rows, np.arange(signal.size)) - 1, 0, rows.size - 2)] - 1
    short, long = inside & (run <= _BRIDGED), inside & (run > _BRIDGED)
    values = np.where(inside, np.interp(time, time[finite], np.where(finite, signal, 0.0)[finite]), signal)
    if name in SMOOTH and rows.size > 3 and short.any():
        from scipy.interpolate import CubicSpline  # slow to import

        values[short] = CubicSpline(time[finite], signal[finite])(time[short])
    samples.signals[name] = values
    parts = [
        f"{short.sum()} filled from those around" if short.any() else "",
        f"{long.sum()} in longer gaps marked as not to be used" if long.any() else "",
        f"{signal.size - finite.sum() - inside.sum()} at the ends left out" if inside.sum() < (~finite).sum() else "",
    ]
    return ", ".join(filter(None, parts)), long


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
    share = float(np.mean(back | again))
    if share > _LOST:
        remedy = "give the time as a period in the mapping, or export it with more digits" if not otherwise else "record again"
        raise BagError(where, f"{100 * share:.0f} % of the stamps go back or repeat an earlier one: too many to drop", remedy)
    if share > _HOLD_BROKEN and samples.hold in HELD:
        samples.notes.append(f"the effort was held from stamp to stamp ({samples.hold}); with so many dropped it no longer is")
        samples.hold = "unknown"
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
