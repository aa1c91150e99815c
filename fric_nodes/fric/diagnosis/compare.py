"""A simulated recording against the real one: aligned in time, then what differs, by how much and where.

Both tell the same story from different beginnings and by different clocks. The offset that aligns them maximises how their
velocities correlate (a position that drifts would drown it), first over the samples of a common grid, then by Gauss-Newton
steps on the positions between the samples, together with the ratio of the clocks, an offset of the position and a drift of it.
The standard errors of offset and ratio are those of this fit, with the correlation of what remains counted in.

Where the two differ is said by the energy of the difference of velocities, or of efforts where the motions agree and the
efforts don't, as a diagnosis says it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, correlate, sosfiltfilt

from ..errors import InputError
from ..model import Model, build_model
from ..record import Array, Mask, Record
from ..signals.resolution import noise_of
from .candidates import scales_of
from .locate import Where, locate, steady
from .track import Track

__all__ = ["Agreement", "CompareError", "Comparison", "compare"]

_BANDWIDTH = 140.0  # [rad/s] of the velocities that are compared
_LEAST_CORRELATION = 0.5  # of the velocities, below which the two don't tell the same story
_LEAST_OVERLAP = 1.0  # [s]
_MOST_RATIO = 0.01  # of the clocks
_ITERATIONS = 12
_SAME = 1e-3  # NOE [%] below which two signals agree


class CompareError(InputError):
    """Recordings that can't be compared."""


@dataclass(frozen=True)
class Agreement:
    """How well one signal agrees.

    Attributes:
        signal: ``position``, ``velocity`` or ``effort``.
        unit: of the errors.
        rmse: root of the mean square of the difference.
        bias: mean of the difference, simulated minus real.
        largest: largest difference.
        noe: normalised output error [%], against the real signal's own spread.
        correlation: of the two signals.
    """

    signal: str
    unit: str
    rmse: float
    bias: float
    largest: float
    noe: float
    correlation: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """What a comparison found.

    Attributes:
        simulated: name of the recording.
        real: name of the recording.
        joint: name of the joint.
        offset: by which the simulated recording's clock is behind the real one's [s]: real = simulated + offset.
        offset_error: its standard error [s].
        ratio: of the clocks: a second of the simulated recording is so many of the real one's.
        ratio_error: its standard error.
        time: of the real recording where both are, shape ``(n,)`` [s].
        signals: per name, real and simulated, shape ``(n,)`` each.
        agreements: per signal.
        where: the difference sits there; None when there is none.
        located_by: signal whose difference was located.
        notes: what was left out, and why.
    """

    simulated: str
    real: str
    joint: str
    offset: float
    offset_error: float
    ratio: float
    ratio_error: float
    time: Array
    signals: dict[str, tuple[Array, Array]]
    agreements: tuple[Agreement, ...]
    where: Where | None
    located_by: str
    notes: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """The result in one sentence."""
        held = {each.signal: each for each in self.agreements}
        position = held["position"]
        parts = [f"position within {position.rmse:.3g} {position.unit} (NOE {position.noe:.3g} %)"]
        if "effort" in held:
            parts.append(f"effort within {held['effort'].rmse:.3g} {held['effort'].unit} (NOE {held['effort'].noe:.3g} %)")
        told = f"Over {self.time[-1] - self.time[0]:.3g} s simulated and real agree in " + " and ".join(parts)
        return f"{told}; the difference of {self.located_by} sits here: {self.where.regime}." if self.where else f"{told}."

    @property
    def interval(self) -> tuple[float, float]:
        """In which the offset lies with 95 % confidence [s]."""
        return self.offset - 1.96 * self.offset_error, self.offset + 1.96 * self.offset_error

    def report(self) -> dict[str, object]:
        """The contents of ``report.json``."""
        where = self.where
        return {
            "format": "fric-comparison/1",
            "verdict": self.sentence,
            "simulated": self.simulated,
            "real": self.real,
            "joint": self.joint,
            "offset": {"value": self.offset, "std": self.offset_error, "interval": list(self.interval), "unit": "s"},
            "clock_ratio": {"value": self.ratio, "std": self.ratio_error},
            "overlap": float(self.time[-1] - self.time[0]),
            "signals": {
                each.signal: {
                    "rmse": each.rmse,
                    "bias": each.bias,
                    "largest": each.largest,
                    "noe": each.noe,
                    "correlation": each.correlation,
                    "unit": each.unit,
                }
                for each in self.agreements
            },
            "where": None
            if where is None
            else {
                "signal": self.located_by,
                "time": [list(span) for span in where.time[0]] if where.time else [],
                "regime": where.regime,
                "share_in_time": where.share,
            },
            "notes": list(self.notes),
        }


def compare(simulated: Record, real: Record) -> Comparison:
    """Align ``simulated`` with ``real`` and say where and by how much they differ.

    Raises:
        CompareError: they have no excitation in common, or no units.
    """
    _refuse(simulated, real)
    step = max(simulated.sample_time, real.sample_time)
    rough = _rough(simulated.uniform(step), real.uniform(step), step)
    offset, ratio, errors = _refined(simulated, real, rough)
    notes = [*_efforts_missing(simulated, real)]
    first = max(float(real.time[0]), offset)
    last = min(float(real.time[-1]), offset + ratio * simulated.duration)
    if last - first < _LEAST_OVERLAP:
        raise CompareError(simulated.source, f"overlaps with {real.source} for {max(last - first, 0.0):.2g} s", "record longer")
    left_out = real.duration - (last - first)
    if left_out > 2.0 * step:
        notes.append(f"{left_out:.3g} s of the real recording have no counterpart")
    use = (real.time >= first) & (real.time <= last) & real.mask
    time = real.time[use]
    there = (time - offset) / ratio
    signals = {
        "position": (real.position[use], np.interp(there, simulated.time, simulated.position)),
        "velocity": (_velocity(real)[use], np.interp(there, simulated.time, _velocity(simulated))),
    }
    if not notes or not notes[0].startswith("effort"):
        signals["effort"] = (real.effort[use], _effort_at(simulated, there, real))
    x, f = real.units.position, real.units.force
    units = {"position": x, "velocity": f"{x}/s", "effort": f}
    agreements = tuple(_agreement(name, units[name], *pair) for name, pair in signals.items())
    where, by = _where(real, use, signals, agreements)
    return Comparison(
        simulated.source, real.source, real.joint, offset, errors[0], ratio, errors[1], time, signals, agreements, where, by,
        tuple(notes),
    )  # fmt: skip


def _refuse(simulated: Record, real: Record) -> None:
    for record in (simulated, real):
        if record.duration < _LEAST_OVERLAP:
            raise CompareError(record.source, f"is {record.duration:.2g} s long", f"record at least {_LEAST_OVERLAP:.0f} s")
        if float(np.ptp(record.position)) == 0.0:
            raise CompareError(record.source, "holds nothing but rest", "record the axis in motion")
    if simulated.units.position != real.units.position:
        units = f"{simulated.units.position} and {real.units.position}"
        raise CompareError(simulated.source, f"and {real.source} have positions in {units}", "compare recordings of one kind")


def _efforts_missing(simulated: Record, real: Record) -> list[str]:
    without = [record.source for record in (simulated, real) if float(np.ptp(record.effort)) == 0.0]
    if without:
        return [f"effort was left out: {' and '.join(without)} has no effort that changes"]
    if simulated.units.force != real.units.force:
        return [f"effort was left out: it is in {simulated.units.force} and in {real.units.force}"]
    return []


def _velocity(record: Record) -> Array:
    """From the position, low-passed without phase, at the record's own stamps [x/s]."""
    even = record.uniform()
    rate = np.gradient(_low(even.position, even.sample_time), even.sample_time)
    return np.interp(record.time, even.time, rate)


def _low(signal: Array, step: float) -> Array:
    edge = _BANDWIDTH * step / math.pi
    if edge >= 0.9:
        return signal
    result: Array = sosfiltfilt(butter(2, edge, output="sos"), signal)
    return result


def _rough(simulated: Record, real: Record, step: float) -> float:
    """Offset [s] at which the velocities correlate most, to a sample; overlaps of less than a fifth don't count."""
    a, b = _velocity(real), _velocity(simulated)
    a, b = a - np.mean(a), b - np.mean(b)
    cross = correlate(a, b, mode="full", method="fft")
    lag = np.arange(-(b.shape[0] - 1), a.shape[0])
    # Energies of both within the overlap, so that a short one isn't at a disadvantage.
    sums_a = np.concatenate([[0.0], np.cumsum(a**2)])
    sums_b = np.concatenate([[0.0], np.cumsum(b**2)])
    first, last = np.maximum(lag, 0), np.minimum(lag + b.shape[0], a.shape[0])
    energy = (sums_a[last] - sums_a[first]) * (sums_b[last - lag] - sums_b[first - lag])
    shorter = min(a.shape[0], b.shape[0])
    able = (last - first >= max(0.2 * shorter, _LEAST_OVERLAP / step)) & (energy > 1e-4 * sums_a[-1] * sums_b[-1])
    score = np.where(able, cross / np.sqrt(np.maximum(energy, 1e-300)), -1.0)
    # Among places that are as good as equal, the one with the longest overlap: a periodic motion has many.
    good = np.flatnonzero(score > np.max(score) - 0.02)
    best = int(good[np.argmax((last - first)[good] + score[good])])
    if float(score[best]) < _LEAST_CORRELATION:
        raise CompareError(
            simulated.source,
            f"has no motion in common with {real.source}: their velocities correlate by {float(np.max(score)):.2f} at best",
            "compare recordings of one excitation",
        )
    return float(lag[best] * step)


def _refined(simulated: Record, real: Record, rough: float) -> tuple[float, float, tuple[float, float]]:
    """Offset [s] and ratio of the clocks between the samples, and their standard errors."""
    rate = _velocity(simulated)
    low_s, low_r = _resampled(simulated), _resampled(real)
    offset, ratio = rough, 1.0
    errors = (math.nan, math.nan)
    # A ratio of clocks is told from a drift only when there is time for it.
    for _ in range(_ITERATIONS):
        there = (real.time - offset) / ratio
        use = (there >= 0.0) & (there <= simulated.time[-1]) & real.mask
        if np.sum(use) < 50:
            break
        t = there[use]
        difference = low_r[use] - np.interp(t, simulated.time, low_s)
        v = np.interp(t, simulated.time, rate)
        centred = (t - np.mean(t)) / max(float(np.ptp(t)), 1e-12)
        columns = np.column_stack([-v, -v * centred, np.ones_like(t), centred])
        scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        found, *_ = np.linalg.lstsq(columns / scale, difference, rcond=None)
        rest = difference - columns / scale @ found
        inverse = np.linalg.pinv((columns / scale).T @ (columns / scale))
        variance = float(rest @ rest) / rest.size * _correlated(rest)
        spread = np.sqrt(np.maximum(np.diag(inverse), 0.0) * variance) / scale
        change = found / scale
        stretch = float(change[1]) / max(float(np.ptp(t)), 1e-12)
        # The clocks' ratio turns about the middle of the overlap.
        middle = float(np.mean(t))
        new_ratio = float(np.clip(ratio + stretch, 1.0 - _MOST_RATIO, 1.0 + _MOST_RATIO))
        moved = float(change[0]) - (new_ratio - ratio) * middle
        offset, ratio = offset + moved, new_ratio
        errors = (
            float(math.hypot(spread[0], spread[1] * middle / max(float(np.ptp(t)), 1e-12))),
            float(spread[1] / max(float(np.ptp(t)), 1e-12)),
        )
        if abs(moved) < 1e-9:
            break
    return offset, ratio, errors


def _resampled(record: Record) -> Array:
    """The position as a common band shows it, at the record's own stamps."""
    even = record.uniform()
    return np.interp(record.time, even.time, _low(even.position, even.sample_time))


def _correlated(rest: Array) -> float:
    """Factor by which correlated errors count more than independent ones in a variance."""
    if rest.size < 10 or not np.any(rest):
        return 1.0
    first = float(rest[1:] @ rest[:-1]) / float(rest @ rest)
    first = min(max(first, 0.0), 1.0 - 2.0 / rest.size)
    return (1.0 + first) / (1.0 - first)


def _effort_at(simulated: Record, there: Array, real: Record) -> Array:
    """The simulated effort at the real one's stamps: held ones as they are held."""
    if simulated.hold == "linear":
        return np.interp(there, simulated.time, simulated.effort)
    side = "right" if simulated.hold == "following" else "left"
    # Half a sample of the real recording to the side on which its effort acts, so that rounding decides nothing.
    half = 0.5 * real.sample_time * {"following": 1.0, "preceding": -1.0, "linear": 0.0}[real.hold]
    at = np.searchsorted(simulated.time, there + half, side="right" if side == "right" else "left")
    at = at - 1 if side == "right" else at
    return simulated.effort[np.clip(at, 0, simulated.n_samples - 1)]


def _agreement(signal: str, unit: str, real: Array, simulated: Array) -> Agreement:
    off = simulated - real
    spread = real - float(np.mean(real))
    energy = float(spread @ spread)
    other = simulated - float(np.mean(simulated))
    return Agreement(
        signal=signal,
        unit=unit,
        rmse=float(np.sqrt(np.mean(off**2))),
        bias=float(np.mean(off)),
        largest=float(np.max(np.abs(off))),
        noe=100.0 * float(off @ off) / energy if energy > 0.0 else math.inf,
        correlation=float(spread @ other) / max(math.sqrt(energy * float(other @ other)), 1e-300),
    )


def _where(
    real: Record, use: Mask, signals: dict[str, tuple[Array, Array]], agreements: Sequence[Agreement]
) -> tuple[Where | None, str]:
    """Where the difference sits: that of efforts when it is the larger one, else that of velocities."""
    held = {each.signal: each for each in agreements}
    by = "velocity"
    if "effort" in held and held["effort"].noe > held["velocity"].noe:
        by = "effort"
    off = signals[by][1] - signals[by][0]
    noise = noise_of(off)
    if held[by].noe < _SAME or float(np.mean(off**2)) < 1.5 * noise**2:
        return None, by
    index = np.flatnonzero(use)
    part = replace(real, valid=None).slice(int(index[0]), int(index[-1]) + 1)
    # The carrier of the units; its dynamics play no part.
    model: Model = build_model("rigid", {"mass": 1.0}, [], joint=real.joint, units=real.units)
    track = Track.of([part], min(_BANDWIDTH, 1.0 / part.sample_time), model)
    energy = []
    for run, begun in zip(track.runs, track.time, strict=True):
        values = np.interp(begun + float(real.time[index[0]]), real.time[index], off)
        energy.append(np.maximum(steady(values**2, run.sample_time) - 2.0 * noise**2, 0.0))
    where = locate(track, energy, scales_of(track), model)
    begin = float(real.time[index[0]])
    spans = tuple(tuple((round(a + begin, 4), round(b + begin, 4)) for a, b in each) for each in where.time)
    return replace(where, time=spans), by
