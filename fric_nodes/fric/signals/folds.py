"""Positions that fold: an angle kept within one turn, a counter that starts again at 2^n counts.

A signal that folds lies in an interval of the length C of the fold. Where it leaves it, it jumps by C against the motion, and
goes on with the same velocity: q_k - q_{k-1} = v dt -+ C. With |v dt| < C / 2 such a jump is longer than half of the range of
the whole recording, which no other step of it is. So a step is looked at that is longer than half the range; from it the local
motion, the median velocity of the steps around, is subtracted, and what is left, r, is the fold:

- of a size that is known (one turn of a joint in rad, 2^n steps of the encoder, n >= 8), within what the steps around differ
  among themselves;
- or of any size, where at least two such r agree within that, the motion crosses the end of the range at each of them, and all
  of the recording lies within C.

The same steps in a stick-slip, an impact, a play or a slow log go along with the motion, or begin and end at rest, and stay.

With the size known, every step is taken as the nearer way round. With more than 0.4 C between two samples that is no longer
known to be the true one, and the recording is refused; likewise a position that jumps, by what is no fold, while the motion
before and behind is the same (an encoder set to zero meanwhile). Where the joint rests on both sides of a jump that is far
longer than every other step of the recording, it may have been set to zero or have slipped: the two samples are marked as bad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..record import Array, Index, Mask, Record, RecordError
from .resolution import step_of

__all__ = ["Fold", "fold_of", "unfolded"]

_AROUND = 4  # steps on either side whose median is the local motion
_NULL = 12  # steps on either side whose spread about it tells what a step differs by without a fold
_CROSSING = 20  # samples on either side between which the motion must have crossed the end
_OFF = 3.0  # times that spread: two jumps that differ by less are equal
_CLEAR = 4.0  # times that spread, a jump at least
_AMBIGUOUS = 0.4  # of a fold: a motion that gets faster passes here before the nearer way round, 0.5, is the wrong one
_FILLED = 0.8  # of a fold: a range that makes sense as one
_THERE_AND_BACK = 3  # samples: a spike, at most
_LEAST_BITS = 8  # of a counter
_EQUAL = 1e-5  # relative: digits that a text file keeps
_SUDDEN = 20.0  # times the local motion: a step that no motion makes which has the same velocity before and after
_PRECISE = 0.1  # of a fold, to which a jump has to be known to count as equal to others
_COARSE = 0.5  # of one turn, which need not be found from the jumps
_STEADY = 0.25  # by which these velocities may differ
_TURNS = {
    2.0 * math.pi: "one turn",
    360.0: "one turn in degrees (the recording says rad: state the unit where it is imported)",
}


@dataclass(frozen=True)
class Fold:
    """How a position folds: by ``size`` [x], and what that is taken as."""

    size: float
    name: str

    def turns(self, position: Array) -> Array:
        """Number of folds to add from each sample to the next, shape ``(n_samples - 1,)``."""
        return np.asarray(-np.round(np.diff(position) / self.size))


@dataclass(frozen=True, eq=False)
class _Jumps:
    """Steps that might be folds; arrays of shape ``(n_jumps,)``.

    Attributes:
        steps: their numbers.
        motion: what the local motion makes of each [x].
        left: the step less that [x].
        spread: by how much the steps around differ from the local motion [x].
        crossing: net way of the motion around the jump, the jump left out [x].
    """

    steps: Index
    motion: Array
    left: Array
    spread: Array
    crossing: Array

    def __getitem__(self, which: Mask) -> _Jumps:
        return _Jumps(self.steps[which], self.motion[which], self.left[which], self.spread[which], self.crossing[which])

    @property
    def against(self) -> Mask:
        """True where the motion goes across the jump in the other direction."""
        return (self.crossing * self.left < 0.0) & (np.abs(self.crossing) > self.spread)

    @property
    def along(self) -> Mask:
        """True where the motion goes the way of the jump, as it does in a slip."""
        return (self.crossing * self.left > 0.0) & (np.abs(self.crossing) > self.spread)


def _range(signal: Array) -> float:
    """From the lowest to the highest value, single samples left out."""
    if signal.size < 3:
        return float(np.ptp(signal))
    middle = np.median(np.lib.stride_tricks.sliding_window_view(signal, 3), axis=1)
    return float(np.ptp(middle))


def _jumps(time: Array, signal: Array, which: Index) -> _Jumps:
    """What the steps ``which`` of ``signal`` are beside the motion around them."""
    step, dt = np.diff(signal), np.diff(time)
    rate = step / dt
    usual = np.ones(step.size, dtype=np.bool_)
    usual[which] = False
    n = which.size
    motion, spread, crossing = np.zeros(n), np.zeros(n), np.zeros(n)
    for number, k in enumerate(which.tolist()):
        low, high = max(k - _NULL, 0), min(k + _NULL + 1, step.size)
        # As far out as there are enough steps that aren't jumps themselves.
        near = np.flatnonzero(usual[low:high]) + low
        close = near[np.argsort(np.abs(near - k), kind="stable")[: 2 * _AROUND]]
        velocity = float(np.median(rate[close])) if close.size else 0.0
        motion[number] = velocity * dt[k]
        others = step[close] - velocity * dt[close]
        spread[number] = float(np.max(np.abs(others), initial=0.0))
        low, high = max(k - _CROSSING, 0), min(k + _CROSSING + 1, step.size)
        crossing[number] = float(np.sum(step[low:high][usual[low:high]]))
    return _Jumps(which, motion, step[which] - motion, spread, crossing)


def _single(jumps: _Jumps) -> Mask:
    """True where no other jump of about the same size leads back at once: that would be a spike."""
    alone = np.ones(jumps.steps.size, dtype=np.bool_)
    for i in range(jumps.steps.size - 1):
        both = jumps.left[i] + jumps.left[i + 1]
        near = jumps.steps[i + 1] - jumps.steps[i] <= _THERE_AND_BACK
        if alone[i] and near and abs(both) < 0.25 * min(abs(jumps.left[i]), abs(jumps.left[i + 1])):
            alone[i] = alone[i + 1] = False
    return alone


def _margin(jumps: _Jumps, size: float, step: float) -> Array:
    """By how much a jump may differ from ``size``, shape ``(n_jumps,)``."""
    return _OFF * jumps.spread + 2.0 * step + _EQUAL * size


def _known(record: Record, size: float, step: float, margin: float) -> tuple[float, str]:
    """The known fold that is as large as ``size``, and its name; 0 where there is none."""
    if record.units.position == "rad":
        for turn, name in _TURNS.items():
            if abs(size - turn) <= min(margin, 0.1 * turn):
                return turn, name
    if step > 0.0:
        bits = round(math.log2(max(size / step, 1.0)))
        if bits >= _LEAST_BITS and abs(size - 2.0**bits * step) <= margin:
            return 2.0**bits * step, f"2^{bits} steps of the encoder"
    return 0.0, ""


def fold_of(record: Record) -> Fold | None:
    """How the position of ``record`` folds; None when it doesn't.

    Raises:
        RecordError: it folds, and moves too fast for the way round to be known.
    """
    position = record.position
    step, extent = np.diff(position), _range(position)
    which = np.flatnonzero(np.abs(step) > 0.5 * extent)
    if extent == 0.0 or not which.size or which.size > 0.5 * step.size:
        _refuse_fast(record, extent, np.zeros(0, dtype=np.int64))
        return None
    jumps = _jumps(record.time, position, which)
    _refuse_fast(record, extent, which[~_single(jumps)])
    jumps = jumps[np.abs(jumps.left) > _CLEAR * jumps.spread]
    for known in (True, False):
        # A spike isn't a fold; yet noise at the end of the range goes there and back by exactly one.
        among = jumps if known else jumps[_single(jumps)]
        found = _fold_among(record, among, extent, known)
        if found is not None:
            _refuse_fast(record, extent, which[~_single(_jumps(record.time, position, which))], found.size)
            return found
    return None


def _fold_among(record: Record, jumps: _Jumps, extent: float, known: bool) -> Fold | None:
    """The fold whose size most of ``jumps`` have; only of a known size, or of any."""
    if not jumps.steps.size:
        return None
    grain = step_of(record.position)
    sizes = np.abs(jumps.left)
    size, name = float(np.median(sizes)), ""
    margin = _margin(jumps, size, grain)
    if known:
        # Whichever jump it is that has a known size: the others may be spikes.
        sizes_known = [_known(record, float(s), grain, float(m)) for s, m in zip(sizes, margin, strict=True)]
        size, name = max(sizes_known, key=lambda one: sum(other[0] == one[0] for other in sizes_known if other[0] > 0.0))
        if size == 0.0:
            return None
    precise = margin <= (_COARSE if size in _TURNS else _PRECISE) * size
    equal = (np.abs(sizes - size) <= margin) & precise
    folds = jumps[equal]
    within = extent <= size + float(np.max(folds.spread, initial=0.0)) * _OFF + 2.0 * grain
    crossed, slipped = int(np.sum(folds.against)), int(np.sum(folds.along))
    others = jumps[~equal]
    odd = int(np.sum(_single(others))) if others.steps.size else 0
    if not within or odd > (0.5 * folds.steps.size if known else 0):
        return None
    if known:
        # Noise at the end of the range goes there and back at rest as well, but one turn is no length to slip by.
        return Fold(size, name) if crossed > (0 if size in _TURNS else slipped) else None
    if crossed < max(2.0, 0.5 * folds.steps.size) or _known(record, size, grain, float(np.max(folds.spread)) * _OFF)[0] > 0.0:
        return None
    return Fold(size, f"a fold of {size:.6g} {record.units.position}")


def _refuse_fast(record: Record, extent: float, spikes: Index, size: float = 0.0) -> None:
    """Refuse a motion whose way round isn't known; without a size, that of an angle that fills one turn."""
    if size == 0.0:
        size = 2.0 * math.pi
        if record.units.position != "rad" or not _FILLED * size < extent <= size * (1.0 + _EQUAL):
            return
    step = np.diff(record.position)
    step -= size * np.round(step / size)
    step[spikes] = 0.0
    fast = np.abs(step) > _AMBIGUOUS * size
    if np.any(fast):
        most, at = float(np.max(np.abs(step))), float(record.time[int(np.argmax(fast))])
        raise RecordError(
            record.source,
            f"position folds every {size:.4g} {record.units.position} and moves by {most:.3g} {record.units.position} from "
            f"one sample to the next, first at {at:.3f} s: the direction can't be determined",
            f"record at {2.5 / record.sample_time:.4g} Hz or more, move more slowly, or record an angle that doesn't fold",
        )


def _without_jumps(record: Record) -> Record:
    """``record`` with a jump marked that begins and ends at rest; one in the middle of a motion is refused."""
    step, unit = np.diff(record.position), record.units.position
    size = np.abs(step)
    if step.size < 4 * _AROUND:
        return record
    beside = np.maximum(np.concatenate([size[1:], size[-1:]]), np.concatenate([size[:1], size[:-1]]))
    which = np.flatnonzero(size > _SUDDEN * beside)
    if not which.size or which.size > 0.01 * step.size:
        return record
    rate = step / np.diff(record.time)
    jumps = _jumps(record.time, record.position, which)
    found = jumps[_single(jumps)]
    usual = np.delete(size, found.steps)
    bad = np.zeros(record.n_samples, dtype=np.bool_)
    notes = []
    for k, motion, left, spread in zip(found.steps.tolist(), found.motion, found.left, found.spread, strict=True):
        before, after = rate[max(k - _AROUND, 0) : k], rate[k + 1 : k + 1 + _AROUND]
        if min(before.size, after.size) < _AROUND or abs(left) < _SUDDEN * (abs(motion) + spread):
            continue
        first, last = float(np.median(before)), float(np.median(after))
        at = float(record.time[k + 1])
        if abs(motion) > _OFF * spread and abs(first - last) <= _STEADY * min(abs(first), abs(last)):
            raise RecordError(
                record.source,
                f"position jumps by {left:+.4g} {unit} at {at:.3f} s while the motion goes on as before: no joint moves so, "
                "and no fold of a known size does",
                f"read one side of the jump (--end {record.time[k]:.6g} or --start {at:.6g}), or record again",
            )
        if abs(motion) <= _OFF * spread and abs(left) > _SUDDEN * float(np.max(usual, initial=0.0)):
            bad[k : k + 2] = True
            notes.append(
                f"position jumps by {left:+.4g} {unit} at {at:.3f} s, from rest to rest and by {_SUDDEN:g} times more than in "
                "any other step: taken for a sensor that was set anew, and left out"
            )
    return replace(record, valid=record.mask & ~bad, notes=(*record.notes, *notes)) if notes else record


def unfolded(record: Record) -> Record:
    """``record`` with a position that runs on where it folded, and a note that says so; ``record`` itself when it doesn't.

    The reference follows: each of its samples is taken as the turn that is nearest to the position, where it folds too. A
    recorded velocity that was made from the folded position is replaced by the unfolded one's at the jumps.

    Raises:
        RecordError: the way round can't be told, or the position jumps as no motion and no known fold does.
    """
    fold = fold_of(record)
    if fold is None:
        return _without_jumps(record)
    turns = fold.turns(record.position)
    position = record.position + fold.size * np.concatenate([[0.0], np.cumsum(turns)])
    at = np.flatnonzero(turns)
    times = f"{at.size} time{'s' if at.size > 1 else ''}"
    note = f"position jumps by {fold.size:.4g} {record.units.position} {times}: taken as {fold.name}"
    found = replace(
        record,
        position=position,
        reference=_beside(record.reference, position, fold.size),
        velocity=_velocity(record, position, at, fold.size),
        notes=(*record.notes, note),
    )
    return _without_jumps(found)


def _beside(reference: Array | None, position: Array, size: float) -> Array | None:
    """``reference`` in the turn of ``position``: sample by sample where it folds as well, else as a whole."""
    if reference is None:
        return None
    turns = (position - reference) / size
    folds = _range(reference) <= size * (1.0 + _EQUAL)
    return np.asarray(reference + size * (np.round(turns) if folds else np.round(np.median(turns))))


def _velocity(record: Record, position: Array, steps: Index, size: float) -> Array | None:
    """The recorded velocity, without what a difference of the folded position has left in it."""
    if record.velocity is None:
        return None
    velocity = record.velocity.copy()
    true = np.gradient(position, record.time)
    # A one-sided difference jumps by C / h, a central one by half of that at two samples: a quarter is far from either end.
    limit = 0.25 * size / record.sample_time
    for shift in (-1, 0, 1, 2):
        at = np.clip(steps + shift, 0, record.n_samples - 1)
        wrong = at[np.abs(velocity[at] - true[at]) > limit]
        velocity[wrong] = true[wrong]
    return velocity
