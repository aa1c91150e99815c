"""Spikes: one to three samples of position or effort that are off by far, with what was before going on behind them.

A block of samples is a candidate when all of it lies to one side of the line between the samples around it, and the signal
goes on behind as before: the line's slope is that of the steps on either side. With J the least distance from that line, what
the recording does otherwise is the null:

    J >= 4 max |x'' h^2 / 2| over all samples of the position beside the candidates (an impact, a slip, the encoder's steps),
    J >= 4 max |x' h| over all steps of the effort beside the candidates (a reversal, a relay, a bang-bang drive).

The candidates are sorted, and the most of them are taken for which this holds with all of them left out. Noise with a power-law
tail of exponent 3 passes by chance in 4^-3 = 1.6 % of the recordings, one with lighter tails never. An effort with large steps
of its own shows a spike only by leaving the range of all other samples: then half of J must lie outside it, a quarter of that
range at least, and no other sample may go there and back by a quarter of J. A blow that was measured does the same, yet the
velocity changes with it: an effort after which the velocity has changed in that direction, by more than it does otherwise, is
no spike.

A spike is filled by the line. Samples marked as bad would cut the recording there, and a filter needs some time on
either side of a cut.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..record import Array, Index, Mask, Record
from .resolution import step_of

__all__ = ["Spike", "spikes_of", "without_spikes"]

_LONGEST = 3  # samples; physical: a fault of a conversion or a telegram, and no motion
_APART = 4.0  # times the largest that the rest of the recording does; statistical: no extreme of the same distribution
_AGREE = 0.25  # of a spike, by which what is before and behind may differ; physical: it comes back to where it left
_OUTSIDE = 0.5  # of a spike, outside of the range of the other samples; physical: most of it is beyond what was measured
_BEYOND = 0.25  # of the range of the other samples, outside of it; physical, likewise
_MOST = 0.01  # of the samples; statistical: what is more frequent is no exception
_ANSWER = (1, 2, 5, 15)  # samples on either side over which the velocity is taken; numerical: noise falls as motion blurs
_SURE = 5.0  # standard deviations of that; statistical: one spike among 10^6 samples
_TOGETHER = 3.0  # standard deviations of the sum over all of them; statistical: 99.9 %
_NINETY = 1.645  # standard deviations that hold 90 % of a normal distribution; statistical
_FLOAT = 1e-9  # of the top speed; numerical: what differences of floating point leave
_ROUNDED = math.sqrt(0.5)  # of a step: four rounded values, less half of eight others, of a variance of 1/12 each
_NAMED = 5  # spikes named one by one


@dataclass(frozen=True)
class Spike:
    """Samples ``first`` to ``last`` (exclusive), off by ``height`` at least, with its sign."""

    first: int
    last: int
    height: float


@dataclass(frozen=True, eq=False)
class _Candidates:
    """Blocks that may be spikes, the highest first; arrays of shape ``(n_candidates,)``."""

    first: Index
    length: Index
    height: Array

    def covered(self, n: int) -> Index:
        """Rank of the highest candidate that covers each sample, the number of candidates where none does, shape ``(n,)``."""
        rank = np.full(n, self.first.size, dtype=np.int64)
        for offset in range(_LONGEST):
            inside = np.flatnonzero(self.length > offset)
            np.minimum.at(rank, self.first[inside] + offset, inside)
        return rank


def _candidates(time: Array, signal: Array, slopes: bool) -> _Candidates:
    """All blocks that stick out; with ``slopes`` the signal must go on with the same slope, else with the same value."""
    n = signal.size
    rate = np.diff(signal) / np.diff(time)
    firsts, lengths, heights = [], [], []
    for m in range(1, _LONGEST + 1):
        first = np.arange(2, n - m - 1)
        before, behind = first - 1, first + m
        slope = (signal[behind] - signal[before]) / (time[behind] - time[before])
        off = np.array([signal[first + j] - signal[before] - slope * (time[first + j] - time[before]) for j in range(m)])
        least = np.min(np.abs(off), axis=0)
        same = np.all(off > 0.0, axis=0) | np.all(off < 0.0, axis=0)
        if slopes:
            # A bend has the same value on both sides of it, but not the same slope.
            wide = time[behind] - time[before]
            gap = np.maximum(np.abs(rate[before - 1] - slope), np.abs(rate[behind] - slope)) * wide
        else:
            gap = np.abs(signal[behind] - signal[before])
        good = np.flatnonzero(same & (gap <= _AGREE * least) & (least > 0.0))
        firsts.append(first[good])
        lengths.append(np.full(good.size, m, dtype=np.int64))
        heights.append(np.sign(off[0, good]) * least[good])
    first, length, height = np.concatenate(firsts), np.concatenate(lengths), np.concatenate(heights)
    order = np.argsort(-np.abs(height), kind="stable")[: max(int(_LONGEST * _MOST * n), 8)]
    return _Candidates(first[order], length[order], height[order])


def _beside(found: _Candidates, size: Array, reach: int) -> Array:
    """The largest of ``size`` beside the first ``j`` candidates, for each ``j``, shape ``(n_candidates + 1,)``.

    ``size[i]`` is of sample ``i`` with ``reach`` samples on either side.
    """
    covered = found.covered(size.size)
    rank = covered.copy()
    for shift in range(1, reach + 1):
        rank[shift:] = np.minimum(rank[shift:], covered[:-shift])
        rank[:-shift] = np.minimum(rank[:-shift], covered[shift:])
    # What lies beside a candidate's line is bent by it for as long as the next samples reach.
    largest = np.zeros(found.first.size + 1)
    np.maximum.at(largest, rank, size)
    return np.asarray(np.maximum.accumulate(largest[::-1])[::-1])


def _taken(found: _Candidates, null: Array, n: int) -> int:
    """How many of the candidates stand out from all that is beside them."""
    number = np.arange(1, found.first.size + 1)
    apart = np.flatnonzero((np.abs(found.height) >= _APART * null[1:]) & (number <= _LONGEST * _MOST * n))
    return int(apart[-1]) + 1 if apart.size else 0


def _merged(found: _Candidates, count: int) -> list[Spike]:
    """The first ``count`` candidates, of those that overlap the highest."""
    taken: list[Spike] = []
    used: set[int] = set()
    for first, length, height in zip(found.first[:count], found.length[:count], found.height[:count], strict=True):
        block = range(int(first), int(first + length))
        if used.isdisjoint(block):
            used.update(block)
            taken.append(Spike(block.start, block.stop, float(height)))
    return sorted(taken, key=lambda spike: spike.first)


def _bend(time: Array, signal: Array) -> Array:
    """Distance of each sample from the line through its neighbours, shape ``(n,)``; 0 at the ends."""
    bend = np.zeros(signal.size)
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    bend[1:-1] = np.abs(signal[1:-1] - signal[:-2] - share * (signal[2:] - signal[:-2]))
    return bend


def _step(signal: Array) -> Array:
    """The larger step beside each sample, shape ``(n,)``."""
    step = np.abs(np.diff(signal))
    return np.asarray(np.maximum(np.concatenate([step, [0.0]]), np.concatenate([[0.0], step])), dtype=np.float64)


def spikes_of(record: Record, name: str) -> list[Spike]:
    """The spikes of a signal of ``record``, ``"position"`` or ``"effort"``, in the order of time."""
    signal, n = record.signals()[name], record.n_samples
    if n < 20 * _LONGEST or float(np.ptp(signal)) == 0.0:
        return []
    if name == "position":
        found = _candidates(record.time, signal, True)
        return _merged(found, _taken(found, _beside(found, _bend(record.time, signal), 1), n))
    found = _candidates(record.time, signal, False)
    taken = _taken(found, _beside(found, _step(signal), 1), n)
    spikes = _merged(found, max(taken, _outside(signal, found)))
    answered = _answered(record, spikes)
    return [spike for spike, real in zip(spikes, answered, strict=True) if not real]


def _outside(signal: Array, found: _Candidates) -> int:
    """How many candidates leave the range of all other samples by far."""
    top = np.min(signal) + _beside(found, signal - np.min(signal), 0)[1:]
    bottom = np.max(signal) - _beside(found, np.max(signal) - signal, 0)[1:]
    value, half = signal[found.first], _OUTSIDE * np.abs(found.height)
    up, margin = found.height > 0.0, _BEYOND * (top - bottom)
    nearest = np.minimum.accumulate(np.where(up, value, np.inf)), np.maximum.accumulate(np.where(up, -np.inf, value))
    lowest = np.minimum(np.minimum.accumulate(np.where(up, value - half, np.inf)), nearest[0] - margin)
    highest = np.maximum(np.maximum.accumulate(np.where(up, -np.inf, value + half)), nearest[1] + margin)
    apart = np.abs(found.height) >= _APART * _returns(signal, found)
    number = np.arange(1, value.size + 1)
    all_out = np.flatnonzero(apart & (top <= lowest) & (bottom >= highest) & (number <= _LONGEST * _MOST * signal.size))
    return int(all_out[-1]) + 1 if all_out.size else 0


def _returns(signal: Array, found: _Candidates) -> Array:
    """The highest candidate beside the first ``j`` and what overlaps with them, shape ``(n_candidates,)``."""
    covered = found.covered(signal.size)
    own = np.array([int(np.min(covered[f : f + m])) for f, m in zip(found.first, found.length, strict=True)], dtype=np.int64)
    largest = np.zeros(found.first.size + 1)
    np.maximum.at(largest, own, np.abs(found.height))
    return np.asarray(np.maximum.accumulate(largest[::-1])[::-1][1:])


def _answered(record: Record, spikes: list[Spike]) -> Mask:
    """True where the velocity changes with a spike of the effort, shape ``(n_spikes,)``."""
    if record.n_samples < 20 * max(_ANSWER) or not spikes:
        return np.zeros(len(spikes), dtype=np.bool_)
    # Many blows that are each lost in noise are seen together; faults of a sensor that happen to agree with the motion are few.
    answer = np.array([_answer(record, spikes, w) for w in _ANSWER])
    together = np.max(np.sum(np.clip(answer, -_SURE, _SURE), axis=1)) > _TOGETHER * np.sqrt(len(spikes))
    return np.asarray(np.max(answer, axis=0) > _SURE) | bool(together)


def _answer(record: Record, spikes: list[Spike], w: int) -> Array:
    """Change of the velocity over ``w`` samples with each spike, in its direction, in standard deviations, ``(n_spikes,)``."""
    position, time, n = record.position, record.time, record.n_samples
    # From the samples before to those behind, a sample that may be the spike between them.
    speed = (position[w:] - position[:-w]) / (time[w:] - time[:-w])
    change = np.zeros(n)
    change[w : n - w - 1] = speed[w + 1 :] - speed[: n - 2 * w - 1]
    # Less what it is on either side, since a force goes on for longer as well.
    blow = np.zeros(n)
    blow[2 * w : n - 2 * w] = change[2 * w : n - 2 * w] - 0.5 * (change[4 * w :] + change[: n - 4 * w])
    # By the rarer ones: a machine that rests most of the time changes its velocity seldom, and then by much.
    spread = float(np.quantile(np.abs(blow), 0.9)) / _NINETY + _FLOAT * float(np.max(np.abs(speed)))
    spread = max(spread, _ROUNDED * step_of(position) / (w * record.sample_time))
    # A force acts on the samples behind it, or on those before it, as it is held.
    means: list[float] = [np.sign(spike.height) * float(np.mean(blow[spike.first - 1 : spike.last + 1])) for spike in spikes]
    return np.asarray(np.array(means) / spread, dtype=np.float64)


def without_spikes(record: Record) -> Record:
    """``record`` with spikes of position and effort filled by the line between the samples around, each named in a note."""
    notes: list[str] = []
    filled: dict[str, Array] = {}
    for name, unit in (("position", record.units.position), ("effort", record.units.force)):
        spikes = spikes_of(record, name)
        if not spikes:
            continue
        bad = np.zeros(record.n_samples, dtype=np.bool_)
        for spike in spikes:
            bad[spike.first : spike.last] = True
        filled[name] = record.signals()[name].copy()
        filled[name][bad] = np.interp(record.time[bad], record.time[~bad], filled[name][~bad])
        notes.append(_note(record, name, unit, spikes))
    if not notes:
        return record
    position, effort = filled.get("position", record.position), filled.get("effort", record.effort)
    return replace(record, position=position, effort=effort, notes=(*record.notes, *notes))


def _note(record: Record, name: str, unit: str, spikes: list[Spike]) -> str:
    """What was left out, and where."""
    named = [f"{record.time[spike.first]:.3f} s ({spike.height:+.3g} {unit})" for spike in spikes[:_NAMED]]
    more = f" and {len(spikes) - _NAMED} more" if len(spikes) > _NAMED else ""
    samples = sum(spike.last - spike.first for spike in spikes)
    what = "spike" if len(spikes) == 1 else f"spikes ({len(spikes)})"
    return (
        f"{what} of the {name} at {', '.join(named)}{more}: left out, {samples} sample{'s' if samples > 1 else ''} "
        "filled from the ones around"
    )
