"""The parts of a recording that a static map is made of: settled motion, and what leads to it.

A part is settled where the velocity, averaged over a window, keeps its sign and its value (to a tenth, or to what its own
scatter allows) and where the force has left its transient behind: beyond half as far again as where friction has turned round
(:func:`knee`; a thirtieth is then left of an exponential approach), or four times as far where the way is long. Where the
recording begins within a motion only what stands out of the scatter is a transient; a force that still rises in what is left
hasn't settled. The load, where it is recorded, must hold too. Alternating sticking and slipping has a mean velocity too, but
its mean force belongs to no velocity: where the speed is below half its mean for more than a tenth of the time, the part is
named and left out.

The standard error of a part's mean force is that of a long-run variance, for its residuals (ripple of the screw, control)
are correlated in time.

Source: Armstrong-Helouvry, Dupont, Canudas de Wit 1994 (friction at constant velocities); long-run variance as in
:mod:`.statistics`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ...record import Array, Mask, Record
from ..statistics import bartlett_lag, long_run

__all__ = ["Motion", "Part", "condensed", "find_parts", "knee", "mean_and_error", "motion_of", "runs", "turning_point"]

_WINDOW = 0.1  # [s] over which the velocity is averaged
_WINDOW_SAMPLES = 10
_STEADY = 0.1  # relative change of the mean velocity within a window
_REST = 0.005  # of the fast end of the speeds: slower is rest
_SLOW_SHARE = 0.1
_SHORTEST = 20  # samples of a part
_FALLEN = 0.1  # of the steepest slope: friction has turned round
_BEYOND = 1.5  # break-away distances from a turning point to settled friction; physical
_FAR_BEYOND = 4.0  # the same where the strokes are long enough; physical: bristles have settled to e^-4
_LOAD_CHANGE = 0.2  # within a part, of its mean
_STILL_RISING = 0.1  # of the transient, left over in what follows it
_STANDS_OUT = 6.0  # standard deviations of the settled force: a transient where the recording begins
_CLIPPED = 0.3  # share of a part's samples at the extreme of the recording's force


@dataclass(frozen=True, eq=False)
class Motion:
    """How a joint moves: arrays of shape ``(n,)``.

    Attributes:
        velocity: as recorded, or from the position over the shortest window that is quiet enough [x/s].
        mean: over a window [x/s].
        window: its length [samples].
        rest: slower than this is rest [x/s].
    """

    velocity: Array
    mean: Array
    window: int
    rest: float

    @property
    def direction(self) -> Array:
        """Sign of the mean velocity, 0 at rest, shape ``(n,)``."""
        return np.where(np.abs(self.mean) > self.rest, np.sign(self.mean), 0.0)


@dataclass(frozen=True)
class Part:
    """A settled part.

    Attributes:
        first: its first sample.
        last: one beyond its last sample.
        start: sample at which its velocity became steady, before the force had settled.
        velocity: mean [x/s].
        force: mean [F].
        error: standard error of that mean, residual correlation taken into account [F].
        load: mean of the load signal, NaN where there is none.
    """

    first: int
    last: int
    start: int
    velocity: float
    force: float
    error: float
    load: float

    @property
    def direction(self) -> float:
        """1 forward, -1 backward."""
        return float(np.sign(self.velocity))


def runs(mask: Mask) -> Iterator[tuple[int, int]]:
    """First sample, and one beyond the last, of every run of True."""
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    yield from zip(bounds[::2].tolist(), bounds[1::2].tolist(), strict=True)


def _moving_mean(signal: Array, width: int) -> Array:
    """Centred mean over ``width`` samples, fewer at the ends."""
    total = np.concatenate([[0.0], np.cumsum(signal)])
    index = np.arange(signal.shape[0])
    low = np.maximum(index - width // 2, 0)
    high = np.minimum(index + (width + 1) // 2, signal.shape[0])
    return np.asarray((total[high] - total[low]) / (high - low), dtype=np.float64)


def _differentiated(record: Record) -> Array:
    """Velocity as the slope over the shortest window over which the position's steps and noise don't show."""
    time, position = record.time, record.position
    n = record.n_samples
    for length in (0.03, 0.06, 0.12, 0.25, 0.5, 1.0):
        half = max(round(0.5 * length / record.sample_time), 1)
        low = np.maximum(np.arange(n) - half, 0)
        high = np.minimum(np.arange(n) + half, n - 1)
        velocity = np.asarray((position[high] - position[low]) / (time[high] - time[low]), dtype=np.float64)
        # Two windows that don't overlap differ by the noise of both where the motion is steady, which much of it is.
        apart = velocity[2 * half :] - velocity[: -2 * half] if n > 4 * half else velocity[1:] - velocity[:-1]
        noise = 1.4826 * float(np.median(np.abs(apart))) / np.sqrt(2.0)
        if noise <= 0.02 * float(np.quantile(np.abs(velocity), 0.9)) or n < 8 * half:
            break
    return velocity


def motion_of(record: Record, rest_velocity: float | None = None) -> Motion:
    """How the joint of ``record`` moves."""
    velocity = record.velocity if record.velocity is not None else _differentiated(record)
    window = max(round(_WINDOW / record.sample_time), _WINDOW_SAMPLES)
    window = min(window, max(record.n_samples // 10, 3))
    fast = float(np.quantile(np.abs(velocity), 0.98))
    return Motion(velocity, _moving_mean(velocity, window), window, rest_velocity or _REST * fast)


def mean_and_error(values: Array) -> tuple[float, float]:
    """Mean of a signal and the standard error of that mean, correlation in time taken into account; ``values`` is ``(n,)``."""
    n = values.shape[0]
    mean = float(np.mean(values))
    residual = values - mean
    variance = float(long_run(residual[:, None], bartlett_lag(residual), np.zeros(0, dtype=np.int64))[0, 0]) / n**2
    # White noise of the same size is the least there can be: a ripple over few periods can cancel by chance.
    least = float(residual @ residual) / n**2
    return mean, float(np.sqrt(max(variance, least) * n / max(n - 1, 1)))


def turning_point(record: Record, motion: Motion, first: int, direction: float) -> int:
    """The sample from which the joint moves in ``direction`` up to sample ``first``."""
    other = np.flatnonzero(motion.direction[:first] != direction)
    start = int(other[-1]) if other.size else 0
    # The mean velocity changes its sign up to a window away from where the position turns.
    low = max(start - 2 * motion.window, 0)
    position = direction * record.position[low : max(first, low + 1)]
    return int(low + position.shape[0] - 1 - int(np.argmin(position[::-1])))


def knee(way: Array, force: Array) -> tuple[float, float]:
    """Way [x] and change of force [F] at which friction has turned round after a turning point; NaN where it hasn't.

    That is where the slope, once it has been steepest, has fallen to a tenth of that: at 90 % of the change of an exponential
    approach (Dahl, LuGre), at the corner of a straight one; what friction does further on, by place or slowly, isn't counted.

    Args:
        way: from the turning point on [x], shape ``(n,)``.
        force: in the direction of motion [F], shape ``(n,)``.
    """
    nothing = (float("nan"), float("nan"))
    x, first = np.unique(np.maximum.accumulate(way), return_index=True)
    y = np.maximum.accumulate(force - force[0])[first]
    if x.shape[0] < 4 or y[-1] <= 0.0:
        return nothing
    half = float(np.interp(0.5 * y[-1], y + 1e-12 * y[-1] * np.arange(y.shape[0]), x))
    near = np.flatnonzero(x <= 4.0 * half + x[2])
    width = max(0.5 * half, 2.0 * float(np.median(np.diff(x[near]))) if near.shape[0] > 1 else 0.0)
    if width <= 0.0 or x[-1] <= width:
        return nothing
    at = np.concatenate([x[x <= x[-1] - width], np.arange(0.0, x[-1] - width, 0.2 * width)[:2000]])
    at = np.unique(at)
    slope = (np.interp(at + width, x, y) - np.interp(at, x, y)) / width
    steepest = int(np.argmax(slope))
    fallen = np.flatnonzero(slope[steepest:] <= _FALLEN * slope[steepest])
    if not fallen.size:
        return nothing
    k = steepest + int(fallen[0])
    # Between the last place where it hasn't fallen and the first where it has.
    limit = _FALLEN * slope[steepest]
    share = (slope[k - 1] - limit) / max(slope[k - 1] - slope[k], 1e-300)
    distance = float(at[k - 1] + share * (at[k] - at[k - 1]))
    return distance, float(np.interp(distance, x, y))


def _settled_from(way: Array, force: Array) -> int:
    """Number of samples from a turning point on before which the force has its transient; all of them when it never settles.

    Args:
        way: travelled from the turning point [x], shape ``(n,)``.
        force: in the direction of motion [F], shape ``(n,)``.
    """
    n = int(force.shape[0])
    smooth = _moving_mean(force, max(min(5, n // 20), 1))
    distance, change = knee(way, smooth)
    if not np.isfinite(distance) or change <= 0.0:
        return n
    # Where the way is long, further: what is left of the transient weighs on the mean.
    beyond = max(_BEYOND * distance, min(_FAR_BEYOND * distance, 0.5 * float(np.max(way))))
    first = int(np.searchsorted(np.maximum.accumulate(way), beyond))
    if n - first < 4:
        return n
    rise = float(np.polyfit(np.linspace(0.0, 1.0, n - first), smooth[first:], 1)[0])
    return n if rise > _STILL_RISING * change and way[-1] < 3.0 * distance else first


def _begun_unsettled(way: Array, force: Array) -> int:
    """Samples to leave out of a motion that the recording begins with, which may have begun just then: 0 where it had settled.

    Unlike after a reversal there may be no transient, and what looks like one must stand out of the scatter of what follows.
    """
    first = _settled_from(way, force)
    rest = force[first:]
    if 2 * first > force.shape[0] or rest.shape[0] < _SHORTEST:
        return 0
    rise = float(np.mean(rest)) - float(np.mean(force[: max(min(5, first // 4), 1)]))
    return first if rise > _STANDS_OUT * float(np.std(rest)) else 0


def _steady(motion: Motion) -> Mask:
    """True where the mean velocity changes little over a window."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    mean, width = motion.mean, motion.window
    change = maximum_filter1d(mean, width) - minimum_filter1d(mean, width)
    scatter = np.sqrt(_moving_mean((motion.velocity - mean) ** 2, 5 * width))
    tolerance = _STEADY * np.abs(mean) + np.minimum(4.0 * scatter / np.sqrt(width), 0.5 * np.abs(mean))
    result: Mask = change <= tolerance
    return result


def find_parts(record: Record, motion: Motion, load: Array | None) -> tuple[list[Part], list[str]]:
    """The settled parts of ``record``, and sentences on what looked like one and is none."""
    parts: list[Part] = []
    notes: list[str] = []
    unit, force_unit = record.units.position, record.units.force
    direction = motion.direction
    extremes = (float(np.min(record.effort)), float(np.max(record.effort)))
    for sign in (1.0, -1.0):
        for first, last in runs(_steady(motion) & (direction == sign) & record.mask):
            # By chance the mean of an unsteady velocity holds for a window.
            if last - first < max(_SHORTEST, 2 * motion.window):
                continue
            where = f"{record.source}: from {record.time[first]:.2f} s to {record.time[last - 1]:.2f} s"
            velocity = motion.velocity[first:last]
            speed = abs(float(np.mean(velocity)))
            slow = float(np.mean(sign * velocity < 0.5 * speed))
            if slow > _SLOW_SHARE:
                notes.append(
                    f"{where} the joint sticks and slips at {sign * speed:.3g} {unit}/s on average"
                    f" ({100 * slow:.0f} % of the time slower than half of that): no settled part"
                )
                continue
            skip = 0
            if np.any(direction[:first] != sign):
                turn = turning_point(record, motion, first, sign)
                way = sign * (record.position[turn:last] - record.position[turn])
                skip = max(turn + _settled_from(way, sign * record.effort[turn:last]) - first, 0)
            elif record.mask[:first].all():
                way = sign * (record.position[:last] - record.position[0])
                skip = max(_begun_unsettled(way, sign * record.effort[:last]) - first, 0)
            if last - first - skip < _SHORTEST:
                notes.append(f"{where} the force doesn't settle before the motion at {sign * speed:.3g} {unit}/s ends")
                continue
            force = record.effort[first + skip : last]
            clipped = max(float(np.mean(force == extreme)) for extreme in extremes)
            if clipped > _CLIPPED and force.shape[0] > _SHORTEST and np.ptp(record.effort) > 0:
                level = float(np.median(force))
                notes.append(f"{where} the force is saturated at {level:.4g} {force_unit}: no settled part")
                continue
            held = np.ones(1) if load is None else _moving_mean(load[first + skip : last], motion.window)
            if np.ptp(held) > _LOAD_CHANGE * abs(float(np.mean(held))):
                notes.append(f"{where} the load changes from {held[0]:.3g} to {held[-1]:.3g}: no settled part")
                continue
            mean, error = mean_and_error(force)
            velocity = motion.velocity[first + skip : last]
            own_load = float("nan") if load is None else float(np.mean(load[first + skip : last]))
            parts.append(Part(first + skip, last, first, float(np.mean(velocity)), mean, error, own_load))
    return sorted(parts, key=lambda part: part.first), condensed(notes)


def condensed(notes: Iterable[str]) -> list[str]:
    """Of notes that differ in their numbers only, the first with the count of the others."""
    alike: dict[str, list[str]] = {}
    for note in notes:
        alike.setdefault(re.sub(r"[-+0-9.e]+", "", note), []).append(note)
    return [
        f"{same[0]} (and {len(same) - 1} more like it)" if len(same) > 1 and " more like it)" not in same[0] else same[0]
        for same in alike.values()
    ]
