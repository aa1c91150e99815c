"""From a recording to the equations of inverse dynamics: filtered motion, matching force, decimated, edges and rest marked.

The position is low-pass filtered without phase (Butterworth, forward and backward) and differentiated by central
differences; the force is shifted to the sample's own instant according to how the recording holds it; both sides of u =
f(q, v, a) then pass the same zero-phase decimation filter, so that no phase comes between them (the "parallel decimation"
of Gautier 1997).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal

from ..record import Array, Mask, Record, RecordError
from .result import IdentificationError, Options

__all__ = ["Equations", "Stretch", "at_rest", "equations", "nominal_conditions", "surroundings"]

_FILTER_ORDER = 4
_EDGE_PERIODS = 5.0  # of the cutoff frequency, dropped at either end of a stretch
_MIN_ROWS = 20
_REST_TIME = 0.015  # [s] slower than the limit before it counts as rest
_REST_ROWS = 2


@dataclass(frozen=True, eq=False)
class Stretch:
    """One contiguous, evenly sampled, valid part of a recording at full rate; arrays of shape ``(n,)``.

    Attributes:
        time: [s] from the start of the recording.
        sample_time: [s].
        raw_position: as recorded [x].
        position: filtered [x].
        velocity: [x/s].
        acceleration: [x/s^2].
        effort: force as recorded [F].
        force: force at the samples' own instants [F].
        hold: how the recording holds its force.
        load: relative normal load [1], one value or ``(n,)``.
        temperature: [K] from reference, one value or ``(n,)``.
    """

    time: Array
    sample_time: float
    raw_position: Array
    position: Array
    velocity: Array
    acceleration: Array
    effort: Array
    force: Array
    hold: str
    load: Array
    temperature: Array


@dataclass(frozen=True, eq=False)
class Equations:
    """All equations of one or several recordings.

    Attributes:
        stretches: the full-rate parts.
        thin: filters and decimates a full-rate signal of a stretch, ``(n,)`` or ``(n, columns)``.
        force: the measured side, shape ``(n_rows,)`` [F].
        velocity: at the rows [x/s].
        time: at the rows [s].
        starts: first row of each stretch.
        sliding: False where the joint rests, so that the row tells nothing about sliding friction.
        rest_velocity: speed below which it may be at rest [x/s].
        notes: what was left out, and why.
    """

    stretches: tuple[Stretch, ...]
    thin: Callable[[Stretch, Array], Array]
    force: Array
    velocity: Array
    time: Array
    starts: Array
    sliding: Mask
    rest_velocity: float
    notes: tuple[str, ...]

    def rows(self, of_stretch: Callable[[Stretch], Array]) -> Array:
        """A full-rate quantity of every stretch, thinned out and joined, shape ``(n_rows, ...)``."""
        return np.concatenate([self.thin(stretch, of_stretch(stretch)) for stretch in self.stretches])


def equations(records: list[Record], options: Options) -> Equations:
    """The equations of ``records``.

    Raises:
        IdentificationError: nothing usable is left.
    """
    notes: list[str] = []
    stretches: list[Stretch] = []
    rate = 1.0 / max(record.sample_time for record in records)
    cutoff = min(0.1 * rate, 100.0) if options.cutoff is None else options.cutoff
    if not 0 < cutoff < 0.5 * rate:
        raise IdentificationError(
            records[0].source,
            f"cutoff of {cutoff:g} Hz for a recording at {rate:.4g} Hz",
            f"choose a cutoff between 0 and {0.5 * rate:.4g} Hz",
        )
    decimation = max(round(rate / cutoff), 1) if options.decimation is None else options.decimation
    edge = int(np.ceil(_EDGE_PERIODS / cutoff * rate))
    for record in records:
        notes += [f"{record.source}: {note}" for note in record.notes]
        even = record.uniform()
        if even is not record:
            irregular = float(np.max(np.abs(np.diff(record.time) - record.sample_time)))
            notes.append(f"{record.source}: uneven stamps (up to {1e3 * irregular:.2f} ms off) interpolated to an even grid")
        stretches += _stretches(even, cutoff, edge, notes)
    if not stretches:
        raise IdentificationError(
            ", ".join(record.source for record in records),
            f"no valid part is longer than {(2 * edge + _MIN_ROWS * decimation) / rate:.2f} s",
            "record for longer, or raise the cutoff",
        )
    sos = signal.cheby1(8, 0.05, 0.8 / decimation, output="sos") if decimation > 1 else None

    def thin(stretch: Stretch, values: Array) -> Array:
        smooth: Array = values if sos is None else signal.sosfiltfilt(sos, values, axis=0)
        return smooth[edge : values.shape[0] - edge : decimation]

    force = [thin(stretch, stretch.force) for stretch in stretches]
    velocity = np.concatenate([thin(stretch, stretch.velocity) for stretch in stretches])
    # Taken as they are: a time stamp needs no filter.
    time = np.concatenate([s.time[edge : s.time.shape[0] - edge : decimation] for s in stretches])
    starts = np.cumsum([0, *(part.shape[0] for part in force[:-1])])
    rest = options.rest_velocity
    if rest is None:
        # Below its own noise a velocity says nothing, however slow the rest of the recording is.
        band = min(cutoff, 0.4 * rate / decimation)
        noise = max(_velocity_noise(stretch, band) for stretch in stretches)
        rest = max(0.02 * float(np.quantile(np.abs(velocity), 0.98)), 4.0 * noise)
    resting = [at_rest(part, rest, decimation / rate) for part in np.split(velocity, starts[1:])]
    sliding = ~np.concatenate(resting)
    rest_time = float(np.sum(~sliding)) * decimation / rate
    if rest_time > 0:
        notes.append(
            f"{rest_time:.2f} s at rest (slower than {rest:.3g} {records[0].units.position}/s) don't count for sliding friction"
        )
    return Equations(tuple(stretches), thin, np.concatenate(force), velocity, time, starts, sliding, rest, tuple(notes))


def _velocity_noise(stretch: Stretch, band: float) -> float:
    """Standard deviation [x/s] of the filtered velocity due to noise and steps of the position signal, were it to stand still.

    White noise of s on the position gives s 2 pi band^1.5 sqrt(2/3 sample_time) after filtering to ``band`` [Hz] and
    differentiation. What the filter took away from the position is noise, and motion too quick for it: the quieter windows hold
    the noise.
    """
    length = max(round(0.1 / stretch.sample_time), 4)
    away = stretch.raw_position - stretch.position
    windows = away[: away.shape[0] // length * length].reshape(-1, length)
    quiet = float(np.sqrt(np.quantile(np.mean(windows**2, axis=1), 0.25)))
    # Rounding of the position itself, which filters add up over many samples.
    rounding = 1e-13 * float(np.max(np.abs(stretch.raw_position)))
    return float((quiet + rounding) * 2.0 * np.pi * band**1.5 * np.sqrt(2.0 / 3.0 * stretch.sample_time))


def at_rest(velocity: Array, limit: float, row_time: float) -> Mask:
    """True where the joint stays slower than ``limit`` for a while; passing through zero at a reversal is no rest."""
    slow = np.abs(velocity) <= limit
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]]).astype(np.int8)))
    resting = np.zeros(velocity.shape[0], dtype=np.bool_)
    for first, last in zip(bounds[::2], bounds[1::2], strict=True):
        if (last - first) * row_time > _REST_TIME and last - first >= _REST_ROWS:
            resting[first:last] = True
    return resting


def _stretches(record: Record, cutoff: float, edge: int, notes: list[str]) -> list[Stretch]:
    """The valid contiguous parts of an evenly sampled record that are long enough to filter."""
    mask = record.mask
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    found = []
    too_short = 0.0
    for first, last in zip(bounds[::2], bounds[1::2], strict=True):
        if last - first < 2 * edge + _MIN_ROWS:
            too_short += (last - first) * record.sample_time
            continue
        found.append(_stretch(record, int(first), int(last), cutoff))
    if too_short > 0 and found:
        notes.append(f"{record.source}: {too_short:.2f} s in parts too short to filter left out")
    return found


def _stretch(record: Record, first: int, last: int, cutoff: float) -> Stretch:
    sample_time = record.sample_time
    raw = record.position[first:last]
    sos: Any = signal.butter(_FILTER_ORDER, 2.0 * cutoff * sample_time, output="sos")
    position = signal.sosfiltfilt(sos, raw)
    velocity = np.gradient(position, sample_time)
    effort = record.effort[first:last]
    before = np.concatenate([effort[:1], effort[:-1]])
    after = np.concatenate([effort[1:], effort[-1:]])
    neighbour = {"following": before, "preceding": after, "linear": effort}[record.effort_hold]
    load, temperature = surroundings(record)
    return Stretch(
        time=record.time[first:last],
        sample_time=sample_time,
        raw_position=raw,
        position=position,
        velocity=velocity,
        acceleration=np.gradient(velocity, sample_time),
        effort=effort,
        force=0.5 * (effort + neighbour),
        hold=record.effort_hold,
        load=load[first:last] if load.shape[0] > 1 else load,
        temperature=temperature[first:last] if temperature.shape[0] > 1 else temperature,
    )


def surroundings(record: Record) -> tuple[Array, Array]:
    """Normal load relative to nominal, and temperature less nominal [K]; one value each where not recorded, else ``(n,)``."""
    nominal = nominal_conditions([record]) | dict(record.nominal)
    load = record.extra.get("normal_load")
    temperature = record.extra.get("temperature")
    return (
        np.ones(1) if load is None else np.ascontiguousarray(load) / nominal["normal_load"],
        np.zeros(1) if temperature is None else np.ascontiguousarray(temperature) - nominal["temperature"],
    )


def nominal_conditions(records: Sequence[Record]) -> dict[str, float]:
    """Mean normal load and mean temperature over ``records``, those that were recorded.

    Raises:
        RecordError: the mean load is zero, so that nothing can be relative to it.
    """
    found = {}
    for name in ("normal_load", "temperature"):
        signals = [record.extra[name] for record in records if name in record.extra]
        if signals:
            found[name] = float(np.mean(np.concatenate(signals)))
    if found.get("normal_load") == 0.0:
        raise RecordError(records[0].source, "the mean of 'normal_load' is 0", "leave the signal out, or correct its offset")
    return found
