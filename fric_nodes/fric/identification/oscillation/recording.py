"""From a recording to its free oscillation: the part in which no force acts but a known feedback, and its reversals.

Reversals are found with a threshold: a turn counts when the position has come back by more than the noise, so that neither
steps of an encoder nor noise at a slow peak make one. Where the peak is exactly is for :mod:`.peaks` to find.

What can't be analysed is named here: it does not oscillate, sticks at once, is clipped, is sampled too slowly, or a force
still acts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from ...record import Array, Index, Record
from ..oscillation_effort import at_stamps
from ..result import IdentificationError
from .feedback import Feedback, acting

__all__ = ["Oscillation", "find_oscillation", "turning_points"]

_FEWEST = 5  # reversals: two damping ratios, two offsets and one peak to start from
_FEWEST_SAMPLES = 10  # in a half cycle


@dataclass(frozen=True, eq=False)
class Oscillation:
    """A free oscillation cut out of a recording.

    Attributes:
        time: [s] from the start of the recording, shape ``(n,)``.
        position: [x], shape ``(n,)``.
        sample_time: [s].
        noise: standard deviation of the position signal, steps of the encoder included [x].
        turns: samples at which the motion reverses, without the start and without the last stop.
        direction: of the motion after the first of them, 1 or -1.
        stops: True when the recording shows the body at rest after the last of them.
        feedback: the force that acts meanwhile.
        source: the recording's file.
        notes: what was left out.
    """

    time: Array
    position: Array
    sample_time: float
    noise: float
    turns: Index
    direction: int
    stops: bool
    feedback: Feedback
    source: str
    notes: tuple[str, ...] = ()

    @property
    def half_period(self) -> float:
        """Median time between reversals [s]."""
        return float(np.median(np.diff(self.turns))) * self.sample_time


def turning_points(position: Array, threshold: float) -> Index:
    """Samples of the turns of ``position`` that it comes back from, and had come to, by more than ``threshold``."""
    turns: list[int] = []
    high = low = 0
    rising = 0  # unknown
    for k, value in enumerate(position.tolist()):
        if value > position[high]:
            high = k
        if value < position[low]:
            low = k
        if rising >= 0 and value < position[high] - threshold:
            if rising:
                turns.append(high)
            rising, low = -1, k
        elif rising <= 0 and value > position[low] + threshold:
            if rising:
                turns.append(low)
            rising, high = 1, k
    return np.array(turns, dtype=np.int64)


def _noise(position: Array) -> tuple[float, float]:
    """Standard deviation of the position signal and step of its encoder (0 when there is none) [x]."""
    bend = np.abs(np.diff(position, 2))
    random = 1.4826 * float(np.median(bend)) / np.sqrt(6.0)
    steps = np.abs(np.diff(position))
    steps = steps[steps > 1e-12 * max(float(np.ptp(position)), 1e-300)]
    step = float(np.min(steps)) if steps.size else 0.0
    whole = steps / step if step else steps
    stepped = steps.size > 0 and float(np.mean(np.abs(whole - np.round(whole)) < 0.02)) > 0.95
    resolution = step if stepped else 0.0
    return float(np.hypot(random, resolution / np.sqrt(12.0))), resolution


def _mid_plateaus(position: Array, turns: Index, slack: float) -> Index:
    """The turns moved to the middle of the time that the position spends within ``slack`` of them."""
    moved = []
    for turn in turns:
        near = np.abs(position - position[turn]) <= slack
        first = turn - int(np.argmin(near[turn::-1])) + 1 if not near[: turn + 1].all() else 0
        last = turn + int(np.argmin(near[turn:])) if not near[turn:].all() else position.shape[0]
        moved.append((first + last - 1) // 2)
    return np.array(moved, dtype=np.int64)


def _longest_valid(record: Record) -> tuple[int, int]:
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], record.mask, [False]]).astype(np.int8)))
    parts = list(zip(bounds[::2].tolist(), bounds[1::2].tolist(), strict=True))
    if not parts:
        raise IdentificationError(record.source, "no sample is marked valid", "record again")
    return max(parts, key=lambda part: part[1] - part[0])


def find_oscillation(record: Record, gains: tuple[float, float] | None = None, mass: float | None = None) -> Oscillation:
    """The free oscillation in ``record``.

    Args:
        record: with position, and the force that acts (zero, or that of a feedback).
        gains: P [F/x] and D [F s/x] of the feedback where they are known; None: found from the recorded force.
        mass: to tell a force that matters from noise [F s^2/x]; None: it is not judged.

    Raises:
        IdentificationError: there is none, or it can't be analysed; says what to record instead.
    """
    notes = [*record.notes]
    even = at_stamps(record).uniform()
    first, last = _longest_valid(even)
    if last - first < even.n_samples:
        notes.append(f"{(even.n_samples - last + first) * even.sample_time:.2f} s outside the longest valid part left out")
    time, position = even.time[first:last], even.position[first:last]
    noise, resolution = _noise(position)
    travel = float(np.ptp(position))
    if travel <= 12.0 * noise or travel == 0.0:
        raise IdentificationError(
            record.source, "the joint does not move", "release it from a deflection well above its friction offset"
        )
    threshold = max(6.0 * noise, 2.5 * resolution, 0.005 * travel)
    turns = turning_points(position, threshold)
    _refuse_still(record.source, time, position, turns, threshold)
    turns = _mid_plateaus(position, turns, max(noise, 0.6 * resolution))
    step = even.sample_time
    half = float(np.median(np.diff(turns)))
    if half < _FEWEST_SAMPLES:
        raise IdentificationError(
            record.source,
            f"sampled too slowly: {half:.3g} samples in a half cycle",
            f"record at {20.0 / (half * step):.3g} Hz or faster",
        )
    # At a reversal nothing is known of a force that depends on the velocity's sign: smooth over an eighth of it.
    window = max(int(half / 8) | 1, 5)
    velocity = np.asarray(signal.savgol_filter(position, window, 2, deriv=1, delta=step))
    feedback, start = acting(record.source, even.effort[first:last], position, velocity, turns, gains, mass, step)
    if start > 0:
        notes.append(f"{start * step:.2f} s left out, until the driving force has ended")
    turns = turns[turns > start + 0.5 * half]
    _refuse_few(record.source, turns)
    # A deflection held before the release, and the rest after the last stop, stay where they are, and rightly so.
    swinging = slice(max(int(turns[0] - 0.5 * half), start), int(turns[-1] + 0.5 * half))
    _refuse_clipped(record.source, position[swinging], resolution, noise, half)
    end = min(int(turns[-1] + half), position.shape[0])
    rest = position[end:]
    stops = bool(rest.shape[0] > 0.5 * half and float(np.ptp(rest)) < 3.0 * threshold)
    kept = slice(start, min(end, position.shape[0]))
    turns = turns - start
    direction = 1 if position[start + turns[1]] > position[start + turns[0]] else -1
    return Oscillation(time[kept], position[kept], step, noise, turns, direction, stops, feedback, record.source, tuple(notes))


def _refuse_still(source: str, time: Array, position: Array, turns: Index, threshold: float) -> None:
    """Raise when it doesn't swing often enough to have a period: overdamped, or stuck."""
    if turns.shape[0] >= 3:
        return
    moving = np.flatnonzero(np.abs(position - position[-1]) > threshold)
    if turns.shape[0] <= 1 and moving.size:
        # An overdamped body creeps to its end: it needs long for the last tenth of its way; a stuck one stops short.
        way = np.abs(position - position[-1])
        top = float(np.max(way[moving[0] :]))
        begun = int(np.argmax(way < 0.95 * top)) if way[0] >= 0.95 * top else moving[0]
        most = int(np.flatnonzero(way > 0.5 * top)[-1]) - begun
        tail = moving[-1] - int(np.flatnonzero(way > 0.1 * top)[-1])
        if turns.shape[0] == 0 and tail > 0.8 * max(most, 1):
            raise IdentificationError(
                source,
                "overdamped: it creeps back without a reversal",
                "make it oscillate by a proportional feedback, and give its gain (parametric oscillation)",
            )
    raise IdentificationError(
        source,
        f"sticks at once: {turns.shape[0]} reversal(s) before it rests",
        "release it from a larger deflection, or stiffen it by a proportional feedback (parametric oscillation)",
    )


def _refuse_few(source: str, turns: Index) -> None:
    if turns.shape[0] < _FEWEST:
        raise IdentificationError(
            source,
            f"too few half cycles: {max(turns.shape[0] - 1, 0)} between reversals, at least {_FEWEST - 1} are needed",
            "release it from a larger deflection, or stiffen it by a proportional feedback (parametric oscillation)",
        )


def _refuse_clipped(source: str, position: Array, resolution: float, noise: float, half: float) -> None:
    """Raise when the position stays at its very largest or smallest value for longer than a peak does."""
    for sign, name in ((1.0, "largest"), (-1.0, "smallest")):
        top = float(np.max(sign * position))
        at = sign * position == top
        bounds = np.flatnonzero(np.diff(np.concatenate([[False], at, [False]]).astype(np.int8)))
        longest = int(np.max(bounds[1::2] - bounds[::2]))
        depth = max(2.0 * resolution, 4.0 * noise, 1e-9 * top) / max(0.5 * float(np.ptp(position)), 1e-300)
        peak = 2.0 * np.sqrt(2.0 * depth) * half / np.pi
        if longest > max(1.5 * peak, 0.08 * half) and longest > 4:
            raise IdentificationError(
                source,
                f"clipped: {longest} samples in a row at the {name} position {sign * top:.6g}",
                "widen the sensor's range or start from a smaller deflection",
            )
