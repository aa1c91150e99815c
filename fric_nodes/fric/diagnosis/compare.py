"""A simulated recording against the real one: aligned in time, then what differs, by how much and where.

Both show one excitation from different beginnings and by different clocks, which :mod:`fric.diagnosis.align` relates.

A figure is stated only where the recordings determine it. The offset is, when its 95 % limits are closer than the time in which
the velocity changes by its own size (RMS of the velocity over RMS of the acceleration, a physical scale): a larger shift is
another motion, not a late one. The ratio of the clocks is, when its limits lie within the range in which it is searched. The
normalised error of a signal is a share only below 100 %, where a constant would do as well; beyond, the difference is given in
the signal's unit. A position that differs that much while the velocity or the effort agrees drifts.

Where the two differ is said by the energy of the difference of velocities, or of efforts where the motions agree and the
efforts don't, as a diagnosis says it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model import Model, build_model
from ..record import Array, Mask, Record
from ..signals.resolution import noise_of
from .align import BANDWIDTH, LEAST_OVERLAP, Alignment, CompareError, align, velocity_of
from .candidates import scales_of
from .locate import Where, locate, steady
from .track import Track

__all__ = ["Agreement", "CompareError", "Comparison", "compare"]

_SAME = 1e-3  # NOE [%] below which two signals agree


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

    @property
    def is_share(self) -> bool:
        """True where the normalised output error is a share of the signal's own spread: a constant leaves 100 %."""
        return self.noe < 100.0

    @property
    def in_words(self) -> str:
        """How far the signals differ, as a sentence's part."""
        share = f"NOE {self.noe:.3g} %" if self.is_share else "more than the real one moves about its mean"
        return f"{self.signal} within {self.rmse:.3g} {self.unit} RMS ({share})"


@dataclass(frozen=True, eq=False)
class Comparison:
    """What a comparison found.

    Attributes:
        simulated: name of the recording.
        real: name of the recording.
        joint: name of the joint.
        clocks: how the times of both are related.
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
    clocks: Alignment
    time: Array
    signals: dict[str, tuple[Array, Array]]
    agreements: tuple[Agreement, ...]
    where: Where | None
    located_by: str
    notes: tuple[str, ...]

    @property
    def drifts(self) -> bool:
        """True where the position differs by more than its own spread while the velocity or the effort agrees."""
        held = {each.signal: each for each in self.agreements}
        return not held["position"].is_share and any(held[name].is_share for name in ("velocity", "effort") if name in held)

    @property
    def sentence(self) -> str:
        """The result in one sentence."""
        held = {each.signal: each for each in self.agreements}
        position = held["position"]
        parts = [each.in_words for each in (position, held["velocity"] if self.drifts else None, held.get("effort")) if each]
        told = f"Over {self.time[-1] - self.time[0]:.3g} s simulated and real differ by this: {', '.join(parts)}"
        if self.drifts:
            told += "; the position drifts, since a simulation without feedback integrates every error of the force twice"
        return f"{told}; the difference of {self.located_by} sits here: {self.where.regime}." if self.where else f"{told}."

    def report(self) -> dict[str, object]:
        """The contents of ``report.json``."""
        where, clocks = self.where, self.clocks
        return {
            "format": "fric-comparison/1",
            "verdict": self.sentence,
            "simulated": self.simulated,
            "real": self.real,
            "joint": self.joint,
            "offset": {
                "value": clocks.offset,
                "std": clocks.offset_error,
                "interval": list(clocks.interval),
                "unit": "s",
                "determined": clocks.offset_told,
            },
            "clock_ratio": {
                "value": clocks.ratio,
                "std": clocks.ratio_error if math.isfinite(clocks.ratio_error) else None,
                "determined": clocks.ratio_told,
            },
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
    notes = [*_efforts_missing(simulated, real)]
    with_effort = not notes
    clocks = align(simulated, real, with_effort)
    first = max(float(real.time[0]), clocks.offset)
    last = min(float(real.time[-1]), clocks.offset + clocks.ratio * simulated.duration)
    if last - first < LEAST_OVERLAP:
        raise CompareError(simulated.source, f"overlaps with {real.source} for {max(last - first, 0.0):.2g} s", "record longer")
    left_out = real.duration - (last - first)
    if left_out > 2.0 * step:
        notes.append(f"{left_out:.3g} s of the real recording have no counterpart")
    use = (real.time >= first) & (real.time <= last) & real.mask
    time = real.time[use]
    there = (time - clocks.offset) / clocks.ratio
    signals = {
        "position": (real.position[use], np.interp(there, simulated.time, simulated.position)),
        "velocity": (velocity_of(real)[use], np.interp(there, simulated.time, velocity_of(simulated))),
    }
    if with_effort:
        signals["effort"] = (real.effort[use], _effort_at(simulated, there, real))
    x, f = real.units.position, real.units.force
    units = {"position": x, "velocity": f"{x}/s", "effort": f}
    agreements = tuple(_agreement(name, units[name], *pair) for name, pair in signals.items())
    where, by = _where(real, use, signals, agreements)
    return Comparison(
        simulated.source, real.source, real.joint, clocks, time, signals, agreements, where, by, tuple(notes)
    )  # fmt: skip


def _refuse(simulated: Record, real: Record) -> None:
    for record in (simulated, real):
        if record.duration < LEAST_OVERLAP:
            raise CompareError(record.source, f"is {record.duration:.2g} s long", f"record at least {LEAST_OVERLAP:.0f} s")
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
    track = Track.of([part], min(BANDWIDTH, 1.0 / part.sample_time), model)
    energy = []
    for run, begun in zip(track.runs, track.time, strict=True):
        values = np.interp(begun + float(real.time[index[0]]), real.time[index], off)
        energy.append(np.maximum(steady(values**2, run.sample_time) - 2.0 * noise**2, 0.0))
    where = locate(track, energy, scales_of(track), model)
    begin = float(real.time[index[0]])
    spans = tuple(tuple((round(a + begin, 4), round(b + begin, 4)) for a, b in each) for each in where.time)
    return replace(where, time=spans), by
