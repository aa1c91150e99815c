"""Where a mismatch sits: when, and in which regime of the motion.

*When*: the shortest set of short cells of time that holds 97 % of the mismatch's energy, small gaps closed. *In which
regime*: for each quantity that a regime can hang on (speed, time and distance since the last reversal, position, the force,
load, temperature, time itself) the range that holds four fifths of the energy in the smallest share of the time. Energy spread
evenly would need four fifths of the time; a quantity of which the energy is independent comes out near that by chance, a
quantity that governs it far below, and the quantity with the smallest share is named.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model import Model
from ..record import Array
from .candidates import Scales
from .motion import smooth
from .track import Track

__all__ = ["Where", "direction", "locate"]

_CELL = 0.01  # [s]
_HELD = 0.97  # of the energy, by the spans of time: of the true one they hold less than of the one that is seen
_GAP = 2.5  # cells between two spans that are closed
_RANGE = 0.8  # of the energy, by the range of a quantity
_EVEN = 0.65  # share of the time from which on a range says nothing
_ONE_WAY = 0.85  # of the energy, for a mismatch of one direction


@dataclass(frozen=True)
class Where:
    """Where a mismatch sits.

    Attributes:
        time: per recording of the track, spans [s].
        share: of the energy within these spans.
        regime: in words.
        quantity: what the regime hangs on; empty when the mismatch is spread evenly.
        range: of that quantity, in SI.
        time_share: share of the time that the regime takes.
    """

    time: tuple[tuple[tuple[float, float], ...], ...]
    share: float
    regime: str
    quantity: str
    range: tuple[float, float]
    time_share: float


def locate(track: Track, energy: Sequence[Array], scales: Scales, model: Model) -> Where:
    """Where ``energy``, one value per interval of each run [F^2], sits."""
    spans, share = _spans(track, energy)
    found = _regimes(track, energy, scales)
    everything = np.concatenate(list(energy))
    velocity = np.concatenate([_velocity(track, k) for k in range(len(track.runs))])
    forward = float(np.sum(everything[velocity > 0.0])) / max(float(np.sum(everything)), 1e-300)
    way = direction(forward)
    best = min(found, key=lambda each: each[3], default=None)
    if best is None or best[3] > _EVEN:
        return Where(spans, share, f"everywhere, {way}", "", (-math.inf, math.inf), 1.0)
    name, low, high, part = best
    return Where(spans, share, f"{_words(name, low, high, scales, model)}, {way}", name, (low, high), part)


def direction(forward: float) -> str:
    """In which direction a mismatch shows of which the share ``forward`` is there where the axis moves forward."""
    return "forward only" if forward > _ONE_WAY else ("backward only" if forward < 1.0 - _ONE_WAY else "both directions")


def _spans(track: Track, energy: Sequence[Array]) -> tuple[tuple[tuple[tuple[float, float], ...], ...], float]:
    """Spans of time of each record that hold most of the energy, and the share that they hold."""
    cells: list[tuple[int, float, float]] = []  # record, start of the cell, energy
    for k, run in enumerate(track.runs):
        step = run.sample_time
        many = max(round(_CELL / step), 1)
        n = energy[k].shape[0] // many
        sums = np.sum(energy[k][: n * many].reshape(n, many), axis=1)
        begin = track.time[k][: n * many : many] - step
        cells += [(track.record[k], float(t), float(e)) for t, e in zip(begin, sums, strict=True)]
    width = max(_CELL, float(np.median(track.runs[0].step)))
    total = sum(each[2] for each in cells)
    held, kept = 0.0, []
    for cell in sorted(cells, key=lambda each: -each[2]):
        if held >= _HELD * total:
            break
        held += cell[2]
        kept.append(cell)
    spans = []
    for record in range(max(track.record, default=0) + 1):
        starts = sorted(start for number, start, _ in kept if number == record)
        merged: list[tuple[float, float]] = []
        for start in starts:
            if merged and start - merged[-1][1] <= _GAP * width:
                merged[-1] = (merged[-1][0], start + width)
            else:
                merged.append((start, start + width))
        spans.append(tuple((round(a, 4), round(b, 4)) for a, b in merged))
    return tuple(spans), held / max(total, 1e-300)


def _velocity(track: Track, k: int) -> Array:
    run = track.runs[k]
    step = run.sample_time
    return np.gradient(smooth(run.position, step, 2.0 * track.bandwidth), step)


def _regimes(track: Track, energy: Sequence[Array], scales: Scales) -> list[tuple[str, float, float, float]]:
    """Quantity, lower and upper end of its range, and the share of the time in it, for each quantity that varies."""
    signals: dict[str, list[Array]] = {}
    for k, run in enumerate(track.runs):
        velocity = _velocity(track, k)
        since_time, since_distance = _since_reversal(run.position, velocity, scales, run.sample_time)
        here = {
            "speed": np.abs(velocity),
            "time since reversal": since_time,
            "distance since reversal": since_distance,
            "position": run.position,
            "force": np.abs(run.effort),
            "time": track.time[k],
        }
        if run.load.shape[0] > 1:
            here["load"] = run.load
        if run.temperature.shape[0] > 1:
            here["temperature"] = run.temperature
        for name, signal in here.items():
            signals.setdefault(name, []).append(signal)
    everything = np.concatenate(list(energy))
    found = []
    for name, parts in signals.items():
        if len(parts) == len(track.runs):
            found.append((name, *_shortest_range(np.concatenate(parts), everything)))
    return found


def _since_reversal(position: Array, velocity: Array, scales: Scales, step: float) -> tuple[Array, Array]:
    """Time [s] and distance [x] since the last reversal, at each sample; a rest belongs to the motion before it."""
    moving = np.abs(velocity) > scales.slow
    sign = np.sign(np.where(moving, velocity, 0.0))
    last = np.maximum.accumulate(np.where(sign != 0.0, np.arange(sign.shape[0]), 0))
    held = sign[last]
    turned = np.flatnonzero(np.diff(held, prepend=held[0]) != 0.0)
    at = np.zeros(sign.shape[0], dtype=np.int64)
    at[turned] = turned
    at = np.maximum.accumulate(at)
    since = (np.arange(sign.shape[0]) - at).astype(np.float64) * step
    return since, np.abs(position - position[at])


def _shortest_range(quantity: Array, energy: Array) -> tuple[float, float, float]:
    """The range of ``quantity`` that holds most of the energy in the smallest share of the time."""
    order = np.argsort(quantity, kind="stable")
    bins = np.array_split(order, 200)
    share = np.array([float(np.sum(energy[part])) for part in bins])
    total = float(np.sum(share))
    if total <= 0.0:
        return float(np.min(quantity)), float(np.max(quantity)), 1.0
    sums = np.concatenate([[0.0], np.cumsum(share)]) / total
    best = (0, len(bins))
    for first in range(len(bins)):
        last = int(np.searchsorted(sums, sums[first] + _RANGE - 1e-12))
        if last > len(bins):
            break
        if last - first < best[1] - best[0]:
            best = (first, last)
    low, high = float(quantity[bins[best[0]][0]]), float(quantity[bins[min(best[1], len(bins)) - 1][-1]])
    return low, high, (best[1] - best[0]) / len(bins)


def _words(name: str, low: float, high: float, scales: Scales, model: Model) -> str:
    x, f = model.units.position, model.units.force
    if name == "speed":
        if high <= scales.slow:
            return "at rest, or next to it"
        if low <= 2.0 * scales.slow:
            return f"|v| < {high:.3g} {x}/s"
        return f"|v| > {low:.3g} {x}/s" if high >= 0.98 * scales.speed else f"|v| from {low:.3g} to {high:.3g} {x}/s"
    if name == "time since reversal":
        return (
            f"within {high:.3g} s after each reversal" if low < 0.1 * high else f"{low:.3g} to {high:.3g} s after each reversal"
        )
    if name == "distance since reversal":
        return (
            f"within {high:.3g} {x} after each reversal"
            if low < 0.1 * high
            else f"{low:.3g} to {high:.3g} {x} after each reversal"
        )
    if name == "position":
        return f"position from {low:.4g} to {high:.4g} {x}"
    if name == "force":
        return f"|force| > {low:.3g} {f}" if high >= 0.95 * scales.most else f"|force| from {low:.3g} to {high:.3g} {f}"
    if name == "time":
        return f"from {low:.2f} to {high:.2f} s of the recording"
    return f"{name} from {low:.4g} to {high:.4g}"


def steady(energy: Array, step: float) -> Array:
    """``energy`` averaged over 20 ms, shape ``(n,)``: single samples of noise don't make a place."""
    width = max(round(0.02 / step), 1)
    kernel = np.ones(width) / width
    result: Array = np.convolve(energy, kernel, mode="same")
    return result


def moved_back(signal: Array, step: float, bandwidth: float) -> Array:
    """A signal of the observer without its delay."""
    shift = round(2.0 / (bandwidth * step))
    return np.concatenate([signal[shift:], np.full(min(shift, signal.shape[0]), signal[-1] * 0.0)])
