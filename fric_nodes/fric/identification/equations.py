"""From a recording to the equations of inverse dynamics: filtered motion, matching force, decimated, edges and rest marked.

The position is low-pass filtered without phase (Butterworth, forward and backward) and differentiated; the force passes the
same filter. Both sides of u = f(q, v, a) are means about a sample with weights that fall to zero at the next ones: of the
acceleration that is the second difference of the position, of the force what its hold makes of it. Then both
pass the same decimation filter, so that no phase and no gain comes between them (the "parallel decimation" of Gautier 1997).

Where the joint sticks, a static law leaves the friction open, and a low-pass carries what it happens to be into the rows
around. The decimation filter is therefore a window of finite length (Parzen's, two row times wide), and ``clear`` marks the
rows within whose window the joint doesn't rest: at these a static law and its sgn(v) hold from end to end, reversals included.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy import signal

from ..model import Model
from ..record import Array, Index, Mask, Record, RecordError
from ..signals.instrument_noise import level_of
from ..signals.resolution import noise_of
from .differences import differentiated, smooth_mean
from .rests import MIN_ROWS, SLOW, Rests, at_rest, can_stand_for, velocity_noise
from .result import IdentificationError, Options
from .row_rate import decimation_of
from .stretch import Stretch

__all__ = ["Equations", "equations", "nominal_conditions", "surroundings"]

_FILTER_ORDER = 4
_EDGE_PERIODS = 5.0  # of the cutoff frequency, dropped at either end of a stretch
_WINDOW_BAND = 0.6  # of the row rate: band of white noise of as much power in the derivative
_AT_TURNS = 0.1  # of the acceleration's energy, and of what is known of the inertia; statistical: errors 3 times as large
_MARGIN = 0.25  # of the cutoff's period: how far the filter on the position carries a rest
_HIGHEST = 0.36  # of the sampling rate: above it a filter and differences of samples no longer go together
_MECHANICS = 100.0  # [Hz], the published choice for positioning axes
_LEAST_BAND = 30.0  # [Hz]; physical: a servo turns an axis within some 10 ms, and a lower cutoff would round that off
_QUIET = 2e-4  # noise of the velocity beside its own root mean square


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
        clear: True where the joint doesn't rest as long as the row's window lasts; the same as ``sliding`` where hardly any row
            is so.
        rest_velocity: speed below which it may be at rest [x/s].
        notes: what was left out, and why.
        rests: what tells them.
        cutoff: of the filter on the position [Hz].
        decimation: samples from row to row.
    """

    stretches: tuple[Stretch, ...]
    thin: Callable[[Stretch, Array], Array]
    force: Array
    velocity: Array
    time: Array
    starts: Index
    sliding: Mask
    clear: Mask
    rest_velocity: float
    notes: tuple[str, ...]
    rests: Rests
    cutoff: float = 0.0
    decimation: int = 1

    def rows(self, of_stretch: Callable[[Stretch], Array]) -> Array:
        """A full-rate quantity of every stretch, thinned out and joined, shape ``(n_rows, ...)``."""
        return np.concatenate([self.thin(stretch, of_stretch(stretch)) for stretch in self.stretches])


def equations(records: list[Record], options: Options, model: Model | None = None) -> Equations:
    """The equations of ``records``.

    Args:
        records: what was measured.
        options: of the filters.
        model: to be fitted; one with slip dynamics gets a cutoff as high as the noise of the position lets it be.

    Raises:
        IdentificationError: nothing usable is left.
    """
    notes: list[str] = []
    rate = 1.0 / max(record.sample_time for record in records)
    even = [_even(record, notes) for record in records]
    cutoff, decimation = _filter(records[0].source, even, options, rate, model is not None and model.has_slip_dynamics)
    edge = int(np.ceil(_EDGE_PERIODS / cutoff * rate - 1e-6))
    stretches = [
        replace(stretch, level=None if on_grid is record else level_of(record.position, record.time))
        for record, on_grid in zip(records, even, strict=True)
        for stretch in _stretches(on_grid, cutoff, edge, notes)
    ]
    if not stretches:
        raise IdentificationError(
            ", ".join(record.source for record in records),
            f"no valid part is longer than {(2 * edge + MIN_ROWS * (decimation or rate / cutoff)) / rate:.2f} s",
            "record for longer, or raise the cutoff",
        )
    if decimation is None:
        decimation = decimation_of(stretches, edge, max(round(rate / cutoff), 1), _thin)
    thin = partial(_thin, edge, decimation)
    force = [thin(stretch, stretch.smooth(stretch.force)) for stretch in stretches]
    velocity = np.concatenate([thin(stretch, stretch.velocity) for stretch in stretches])
    # Taken as they are: a time stamp needs no filter.
    time = np.concatenate([s.time[edge : s.time.shape[0] - edge : decimation] for s in stretches])
    starts: Index = np.cumsum([0, *(part.shape[0] for part in force[:-1])], dtype=np.int64)
    reach = (decimation if decimation > 1 else 0) + int(np.ceil(_MARGIN / cutoff * rate))
    noise, still, rest = _rest_limits(options.rest_velocity, stretches, velocity, cutoff, (rate, decimation))
    speeds, steps = tuple(s.velocity for s in stretches), tuple(s.sample_time for s in stretches)
    rests = Rests(speeds, steps, noise, edge, decimation, reach, cutoff < _MECHANICS)
    resting = [at_rest(part, rest, decimation / rate) for part in np.split(velocity, starts[1:])]
    sliding = ~np.concatenate(resting)
    rest_time = float(np.sum(~sliding)) * decimation / rate
    if rest_time > 0:
        notes.append(
            f"{rest_time:.2f} s at rest (slower than {rest:.3g} {records[0].units.position}/s) are left out: "
            "there the force doesn't show sliding friction"
        )
    rests, clear = _clear_rows(rests, sliding, still, lambda: np.concatenate([thin(s, s.acceleration) for s in stretches]))
    if not can_stand_for(clear, sliding, velocity):
        clear = sliding
        notes.append(
            "rests follow each other too closely for the filter: equations that they reach into are used too; record longer "
            "strokes, or raise the cutoff"
        )
    return Equations(
        tuple(stretches), thin, np.concatenate(force), velocity, time, starts, sliding, clear, rest, tuple(notes), rests,
        cutoff, decimation,
    )  # fmt: skip


def _rest_limits(
    given: float | None, stretches: list[Stretch], velocity: Array, cutoff: float, rates: tuple[float, int]
) -> tuple[float, float, float]:
    """Noise of the velocity, and the speeds below which a row counts as still and as at rest [x/s].

    Args:
        given: the limit asked for [x/s]; None: from the recordings.
        stretches: of the recordings.
        velocity: in the rows [x/s].
        cutoff: of the filter [Hz].
        rates: samples per second, and samples per row.
    """
    if given is not None:
        return 0.0, given, given
    noise = _unclear(stretches, cutoff)
    # Below its own noise a velocity says nothing, however slow the rest of the recording is.
    slow = SLOW * float(np.quantile(np.abs(velocity), 0.98))
    return noise, max(slow, noise), max(slow, _unclear(stretches, min(cutoff, _WINDOW_BAND * rates[0] / rates[1])))


def _clear_rows(rests: Rests, sliding: Mask, still: float, acceleration: Callable[[], Array]) -> tuple[Rests, Mask]:
    """Rows that no rest reaches into, where a joint slower than ``still`` [x/s] rests; and how they were told."""
    clear = sliding & rests.clear(still)
    if rests.rounds:
        turning = replace(rests, rounds=False)
        with_turns = sliding & turning.clear(still)
        square = acceleration() ** 2
        if np.sum(square[clear]) < _AT_TURNS * np.sum(square[with_turns]):
            # Strokes at constant speed show their inertia at the reversals only.
            return turning, with_turns
    return rests, clear


def _even(record: Record, notes: list[str]) -> Record:
    """``record`` on an even grid, with what was done to it said in ``notes``."""
    notes += [f"{record.source}: {note}" for note in record.notes]
    even = record.uniform()
    if even is not record:
        irregular = float(np.max(np.abs(np.diff(record.time) - record.sample_time)))
        notes.append(f"{record.source}: uneven stamps (up to {1e3 * irregular:.2f} ms off) interpolated to an even grid")
    return even


def _filter(source: str, records: Sequence[Record], options: Options, rate: float, slips: bool) -> tuple[float, int | None]:
    """Cutoff [Hz], and the decimation where it is given or follows from it."""
    cutoff = options.cutoff
    if cutoff is None:
        cutoff = min(_HIGHEST * rate, _MECHANICS, *(_clear_band(record) for record in records))
        cutoff = max(cutoff, min(_LEAST_BAND, _HIGHEST * rate))
        if slips:
            cutoff = max(cutoff, min(_HIGHEST * rate, *(_quiet_band(record) for record in records)))
    if not 0 < cutoff < 0.5 * rate:
        raise IdentificationError(
            source,
            f"cutoff of {cutoff:g} Hz for a recording at {rate:.4g} Hz",
            f"choose a cutoff between 0 and {0.5 * rate:.4g} Hz",
        )
    if options.decimation is not None:
        return cutoff, options.decimation
    return cutoff, max(round(rate / cutoff), 1) if options.cutoff is not None or slips else None


def _clear_band(record: Record) -> float:
    """Cutoff up to which the speed that the position's errors may show stays below what counts as rest [Hz]."""
    position = record.position[record.mask]
    speed = float(np.quantile(np.abs(np.gradient(position, record.sample_time)), 0.98))
    noise = max(level_of(position), 1e-300)
    return float((0.25 * SLOW * speed / (2.0 * np.pi * noise * np.sqrt(2.0 / 3.0 * record.sample_time))) ** (2.0 / 3.0))


def _quiet_band(record: Record) -> float:
    """Cutoff up to which noise of the position is a small share of the velocity [Hz]."""
    noise = noise_of(record.position[record.mask]) + 1e-13 * float(np.max(np.abs(record.position)))
    speed = float(np.sqrt(np.mean(np.gradient(record.position[record.mask], record.sample_time) ** 2)))
    return float((_QUIET * speed / (2.0 * np.pi * noise * np.sqrt(2.0 / 3.0 * record.sample_time))) ** (2.0 / 3.0))


def _thin(edge: int, decimation: int, stretch: Stretch, values: Array) -> Array:
    """Rows of a full-rate signal of ``stretch``, ``(n,)`` or ``(n, columns)``: means over windows two row times wide."""
    n = values.shape[0]
    if decimation == 1:
        return values[edge : n - edge]
    window = signal.windows.parzen(2 * decimation + 1)
    window /= np.sum(window)
    rows = np.lib.stride_tricks.sliding_window_view(values, 2 * decimation + 1, axis=0)[edge - decimation :: decimation]
    wanted = len(range(edge, n - edge, decimation))
    return np.asarray(rows[:wanted] @ window, dtype=np.float64)


def _unclear(stretches: Sequence[Stretch], band: float) -> float:
    """Velocity that noise alone may show in ``band`` [Hz]."""
    return 4.0 * max(velocity_noise(s.raw_position, s.position, s.sample_time, band) for s in stretches)


def _stretches(record: Record, cutoff: float, edge: int, notes: list[str]) -> list[Stretch]:
    """The valid contiguous parts of an evenly sampled record that are long enough to filter."""
    mask = record.mask
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    found = []
    too_short = 0.0
    for first, last in zip(bounds[::2], bounds[1::2], strict=True):
        if last - first < 2 * edge + MIN_ROWS:
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
    position, velocity, acceleration = differentiated(signal.sosfiltfilt(sos, raw), sample_time)
    effort = record.effort[first:last]
    before = np.concatenate([effort[:1], effort[:-1]])
    after = np.concatenate([effort[1:], effort[-1:]])
    held = {"following": before + effort, "preceding": effort + after}.get(record.hold)
    load, temperature = surroundings(record)
    return Stretch(
        time=record.time[first:last],
        sample_time=sample_time,
        raw_position=raw,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        effort=effort,
        force=smooth_mean(effort) if held is None else 0.5 * held,
        hold=record.hold,
        timing_error=record.timing_error,
        load=load[first:last] if load.shape[0] > 1 else load,
        temperature=temperature[first:last] if temperature.shape[0] > 1 else temperature,
        smooth=partial(signal.sosfiltfilt, sos),
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
