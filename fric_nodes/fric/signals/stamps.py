"""Stamps: the even grid that they stand for, and whether the motion follows the grid or the stamps.

**The grid from the stamps alone.** Sample k is taken at t_0 + P n_k, with whole numbers n_k that grow by one but where samples
were lost. The period P is the duration over the sum of the steps, each rounded to whole usual ones. Where a step
is longer than one and a half periods, the median lateness after it, less that before, tells how many samples were lost:
a stamp that is late leaves what follows where it was. The line through (n_k, t_k) is the grid.

**Rounded stamps** (single precision, a counter in milliseconds at 400 Hz, too few digits) are the even grid, rounded: each is
then within one step of the rounding of it. They may repeat, and are recognised before anything asks that time grows; so are
those of a counter that starts again, after 2^n of its units or once an hour or a day.

**Whose the jitter is.** From sample k to k + m the motion goes on by the same share of its way from k - m to k + 2 m as time
does, but for its curvature. That share is r by the stamps and g by the grid. With Q the way from k - m to k + 2 m,
q_{k+m} - q_k - Q g = beta Q (r - g) + e_k,
where beta is 0 if the position was read evenly and only its stamp is late, and 1 if it was read when the stamp was taken; e has
none of the noise of q_k and q_{k+m} in common with Q, so that noise favours neither. Least squares gives beta, for the lag m at
which it is known best. Where that is surely nearer to one, the stamps are right and stay; where it is surely not, the grid is
taken. Where the motion doesn't decide, the stamps do: one that is late is followed by a shorter step, so that neighbouring
steps are correlated by -1/2. Steps that don't make up for each other are those of samples that were read unevenly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter

from ..record import Array, Record
from .resolution import step_of

__all__ = ["Grid", "Jitter", "evened", "grid_of", "is_jitter", "jitter_of", "rounded_grid", "unwrapped_stamps"]

_BASE = 64  # samples over which a slope tells the period
_LOST = 1.5  # periods: a longer step may have lost a sample
_BESIDE = (7, 25, 25)  # samples on either side that tell where the stamps go on: few while losses near by are not known yet
_LAGS = (1, 2, 4, 8)  # samples: a clock that wanders shows over several
_FEWEST = 40  # comparisons that tell anything
_EVEN = 1e-3  # of a period: stamps that are evener are left as they are
_SURE = 1.645  # standard errors: 90 % two-sided
_HALF = 0.5
_NOTE = "stamps jitter"  # how the note begins that says what was made of them
_WANDER = 4.0  # times: by how much a grid that wanders has to follow the stamps better than a straight one does
_SLOW = 501  # samples over which a clock may wander
_ROUNDED = 1.5  # steps of the rounding that stamps may lie apart about a line: one, and what the line itself is off
_REGULAR = 2.0  # samples by which the distances of the rarer steps of rounded stamps may differ: one, and the clock's own error
_EXACT = 1e-6  # of a counter's range, to which a wrap is known
_MOST_LEVELS = 0.02  # of a period: rounding by less does nothing


_WRAPS = (
    *(2.0**bits * unit for bits in (16, 24, 31, 32) for unit in (1e-3, 1e-6, 1e-9) if 2.0**bits * unit > 1.0),
    *(60.0, 3600.0, 43200.0, 86400.0),
)
"""After how long counters of milli-, micro- and nanoseconds start again, and clocks [s]; within a second none is meant to."""


@dataclass(frozen=True, eq=False)
class Grid:
    """The even grid that stamps stand for.

    Attributes:
        number: of each sample on the grid, shape ``(n,)``; grows by one but where samples are missing.
        period: [s].
        time: of each sample on the grid [s], shape ``(n,)``.
        off: stamp less grid [s], shape ``(n,)``.
    """

    number: Array
    period: float
    time: Array
    off: Array

    @property
    def n_lost(self) -> int:
        """Samples that are missing."""
        return int(self.number[-1] - self.number[0] + 1) - int(self.number.shape[0])

    @property
    def spread(self) -> float:
        """Standard deviation of the stamps about the grid [s]."""
        return float(np.std(self.off))


@dataclass(frozen=True)
class Jitter:
    """Whether the motion follows stamps that jitter.

    Attributes:
        share: of the jitter that the motion follows: 0 if the position was read evenly, 1 if at its stamp; NaN: can't be told.
        error: standard error of it; infinite where it can't be told.
    """

    share: float
    error: float

    @property
    def follows(self) -> bool:
        """True where the position was surely read when its stamp was taken."""
        return self.share - _SURE * self.error > _HALF

    @property
    def is_even(self) -> bool:
        """True where the position was surely read evenly."""
        return self.share + _SURE * self.error < _HALF


def _period(time: Array) -> float:
    """Time between samples [s], lost ones counted: jitter makes as many steps longer as shorter, so that roundings cancel."""
    step = np.diff(time)
    usual = float(np.median(step))
    if usual > 0.0:
        return float(time[-1] - time[0]) / max(float(np.sum(np.round(step / usual))), 1.0)
    base = min(_BASE, max(step.shape[0] // 2, 1))
    return float(np.median(time[base:] - time[:-base]) / base)


def grid_of(time: Array) -> Grid:
    """The even grid of ``time`` [s], shape ``(n,)``, with n at least 2."""
    n = time.shape[0]
    period = _period(time)
    skip = np.ones(n - 1)
    if period > 0.0:
        candidates = np.flatnonzero(np.diff(time) > _LOST * period).tolist()
        for beside in _BESIDE:
            for k in candidates:
                first, last = max(k + 1 - beside, 0), min(k + 1 + beside, n)
                # With what is known of the losses near by, one after the other.
                number = np.concatenate([[0.0], np.cumsum(skip[first : last - 1])])
                late = time[first:last] - period * number
                jump = float(np.median(late[k + 1 - first :])) - float(np.median(late[: k + 1 - first]))
                skip[k] = max(skip[k] + round(jump / period), 1)
    number = np.concatenate([[0.0], np.cumsum(skip)])
    slope, start = np.polyfit(number, time, 1)
    line = slope * number + start
    off = time - line
    # A clock that is set right as it goes, or a rate that changes, wanders about any line.
    slow = median_filter(off, min(_SLOW, 2 * ((n - 1) // 4) + 1), mode="nearest")
    if float(np.std(off)) > _WANDER * float(np.std(off - slow)) and float(np.ptp(slow)) > _HALF * slope:
        line, off = line + slow, off - slow
    return Grid(number, float(slope), line, off)


def unwrapped_stamps(time: Array) -> tuple[Array, float, int] | None:
    """Stamps of a counter that has started again [s], after how long it does so [s], and how often; None where it hasn't.

    Args:
        time: as recorded [s], shape ``(n,)``.
    """
    step = np.diff(time)
    back = np.flatnonzero(step < 0.0)
    if not back.size or time.shape[0] < 2 * _BESIDE[0] or back.size > step.shape[0] // _BESIDE[0]:
        return None
    usual = float(np.median(step))
    fitting = [wrap for wrap in _WRAPS if np.all(np.abs(step[back] + wrap - usual) < max(2.0 * usual, _EXACT * wrap))]
    if usual <= 0.0 or len(fitting) != 1:
        return None
    turns = np.zeros(time.shape[0])
    turns[back + 1] = fitting[0]
    return time + np.cumsum(turns), fitting[0], int(back.size)


def rounded_grid(time: Array) -> tuple[Array, float] | None:
    """Even stamps [s], and the step by which the given ones were rounded [s]; None where rounding doesn't explain them.

    Args:
        time: as recorded [s], shape ``(n,)``; may repeat.
    """
    if time.shape[0] < 2 * _BESIDE[0] or not np.all(np.isfinite(time)):
        return None
    step = np.diff(time)
    if np.any(step < 0.0) or not np.any(step > 0.0):
        return None
    # Of the steps, not of the stamps: these may be several roundings apart throughout.
    fuzz = 8.0 * float(np.finfo(np.float64).eps * np.max(np.abs(time)))
    quantum = step_of(fuzz * np.round(step / fuzz))
    every = np.arange(time.shape[0], dtype=np.float64)
    period, start = (float(value) for value in np.polyfit(every, time, 1))
    if period <= 0.0 or quantum < _MOST_LEVELS * period or float(np.max(np.abs(step - period))) < _EVEN * period:
        return None
    # Rounding gives steps of two sizes only, and spreads the rarer one as evenly as whole numbers allow.
    counts = np.round(step / quantum)
    longer = counts > np.floor(period / quantum)
    rare = np.flatnonzero(longer if np.mean(longer) < _HALF else ~longer)
    if float(np.ptp(counts)) > 1.0 or rare.size < _BESIDE[0] or float(np.ptp(np.diff(rare))) > _REGULAR:
        return None
    if float(np.ptp(time - start - period * every)) > _ROUNDED * quantum:
        return None
    return start + period * every, quantum


def jitter_of(record: Record, grid: Grid) -> Jitter:
    """Whether the motion of ``record`` follows its stamps or the grid."""
    if grid.period <= 0.0:
        return Jitter(float("nan"), float("inf"))
    return min((_followed(record, grid, lag) for lag in _LAGS), key=lambda each: each.error)


def _followed(record: Record, grid: Grid, lag: int) -> Jitter:
    """The same by the motion over ``lag`` samples, where none is lost or invalid in the samples beside these."""
    nothing, n = Jitter(float("nan"), float("inf")), record.n_samples
    if n < 3 * lag + _FEWEST:
        return nothing
    first = np.arange(n - 3 * lag)
    invalid = np.concatenate([[0], np.cumsum(~record.mask)])
    whole = (grid.number[first + 3 * lag] - grid.number[first] == 3 * lag) & (invalid[first + 3 * lag + 1] == invalid[first])
    a, b, c, d = (first[whole] + k * lag for k in range(4))
    if a.shape[0] < _FEWEST:
        return nothing
    q = record.position
    way = q[d] - q[a]
    by_stamp, by_grid = ((time[c] - time[b]) / (time[d] - time[a]) for time in (record.time, grid.time))
    moved = way * (by_stamp - by_grid)
    rest = q[c] - q[b] - way * by_grid
    power = float(moved @ moved)
    if power == 0.0:
        return nothing
    share = float(moved @ rest) / power
    # Neighbours share samples: what is left out in turn are blocks, so that a few that decide alone decide little.
    blocks = np.arange(0, moved.shape[0], 8 * 3 * lag)
    products, powers = (np.add.reduceat(each, blocks) for each in (moved * rest, moved**2))
    without = (np.sum(products) - products) / np.maximum(power - powers, 1e-300)
    n = blocks.shape[0]
    if n < 2 or float(np.min(power - powers)) <= 0.0:
        return nothing  # one block has all that there is to see
    return Jitter(share, float(np.sqrt((n - 1) / n * np.sum((without - np.mean(without)) ** 2))))


def is_jitter(grid: Grid) -> bool:
    """True where steps make up for each other, as those of an even clock do that is read late."""
    step = np.diff(grid.off)
    step = step - np.mean(step)
    # Halfway between the correlation of -1/2 and none.
    return float(step[1:] @ step[:-1]) < -_HALF * _HALF * float(step @ step)


def evened(record: Record) -> Record:
    """``record`` with even stamps and a note of it, unless its motion follows the recorded ones, or that was done before."""
    if any(note.startswith(_NOTE) for note in record.notes):
        return record
    grid = grid_of(record.time)
    if grid.period <= 0.0 or float(np.max(np.abs(grid.off))) < _EVEN * grid.period or not np.all(np.diff(grid.time) > 0.0):
        return record
    found = jitter_of(record, grid)
    if found.follows or not (found.is_even or is_jitter(grid)):
        return record
    about = f"{_NOTE} by {1e3 * grid.spread:.3g} ms ({100.0 * grid.spread / grid.period:.2g} % of a sample)"
    why = "the motion doesn't" if found.is_even else "the motion doesn't decide it"
    note = f"{about}, {why}: taken as even at {1.0 / grid.period:.5g} Hz; stamp where the sensor is read"
    return replace(record, time=grid.time - grid.time[0], notes=(*record.notes, note))
