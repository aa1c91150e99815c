"""Faults of moderate strength, put into clean recordings.

Each fault says which check must find it, and with which verdicts it counts as found: a limit that may be meant so (a constant
force, a filtered velocity, a vibration) is a warning by design. What acts on the axis itself (a limit, an end stop) is
simulated; the rest is done to the recording. Only motions are drawn that can show the fault: a delay does not show in a slow
triangle, and no check claims it would. Whether one can is told by the truth, not by the check: a shift of the effort has to
change the inertial force by a tenth of the effort, a limit has to be reached more than once, and where friction is hidden
inertia has to be left. Where it can't, another recording is drawn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ...model import Model
from ...record import Array, Record
from ...signals.resolution import noise_of, step_of
from ..view import runs
from .axes import ACTIVE, AXES, Rig, draw_rig, record_of, run_rig, scaled_nominal

__all__ = ["FAULTS", "Fault", "Trial"]

_FOLLOWED = ("multisine", "chirp", "point_to_point")
_BUSY = (*ACTIVE, "reversals", "steps", "ramps")
_APART = 1_000_000  # from the seed of a recording to that of the next one drawn; the kinds of axes take turns alike
_TRIES = 40
_SHOWS = 0.1  # of the effort's standard deviation
_REACHED = 0.02  # [s] at the limit that counts as a visit


@dataclass(frozen=True, eq=False)
class Trial:
    """Recordings with what is known of them."""

    records: tuple[Record, ...]
    model: Model | None = None


@dataclass(frozen=True, eq=False)
class Fault:
    """One kind of fault.

    Attributes:
        name: of the fault.
        check: id of the check that must find it.
        verdicts: that count as found.
        make: the trial for a seed.
    """

    name: str
    check: str
    make: Callable[[int], Trial]
    verdicts: tuple[str, ...] = ("fault",)


def _base(seed: int, motions: tuple[str, ...], change: Callable[[Rig, np.random.Generator], Rig] | None = None) -> Any:
    """A clean recording, its rig, and the generator of the fault."""
    random = np.random.default_rng([seed, 2])
    rig = draw_rig(seed, AXES[seed % len(AXES)], str(random.choice(motions)))
    if change is not None:
        rig = change(rig, random)
    raw = run_rig(rig)
    return record_of(rig, raw, seed), rig, raw, random


def _done(motions: tuple[str, ...], change: Callable[[Record, np.random.Generator], Record]) -> Callable[[int], Trial]:
    """A fault that is done to the recording."""

    def make(seed: int) -> Trial:
        record, _, _, random = _base(seed, motions)
        return Trial((change(record, random),))

    return make


def _sign(random: np.random.Generator) -> float:
    return float(random.choice([-1.0, 1.0]))


def _short(record: Record, random: np.random.Generator) -> Record:
    # Half a second from the middle of the motion.
    speed = np.abs(np.gradient(gaussian_filter1d(record.position, 10.0), record.time))
    first = float(record.time[int(np.argmax(speed))]) - 0.2
    return record.between(max(first, 0.0), max(first, 0.0) + float(random.uniform(0.3, 0.5)))


def _still(seed: int) -> Trial:
    record, rig, _, random = _base(seed, ("multisine",))
    n = record.n_samples
    position = record.position[0] + rig.scale[0] * rig.resolution * (random.uniform(size=n) < 0.01)
    effort = 0.5 * rig.nominal.value("coulomb.force") * np.sin(3.0 * record.time) * rig.scale[1]
    return Trial((replace(record, position=position, effort=effort + record.effort * 0.001, reference=None),))


def _one_speed(seed: int) -> Trial:
    # Without a Stribeck effect: that one makes such a slow motion stick and slip, through many speeds.
    rig = draw_rig(seed, ("rigid", "bristles")[seed % 2], "slow_triangles")
    return Trial((record_of(rig, run_rig(rig), seed),))


def _one_way(record: Record, random: np.random.Generator) -> Record:
    # Only the strokes of one direction are kept, one after the other, as from a machine that records under load only.
    rising = np.gradient(gaussian_filter1d(record.position, 5.0)) > 0.0
    keep = np.flatnonzero(rising)
    n = keep.size
    position = np.concatenate([[0.0], np.cumsum(np.maximum(np.diff(record.position)[keep[:-1]], 0.0))])
    return replace(
        record, time=record.time[:n], position=position, effort=record.effort[keep],
        reference=None, valid=None, velocity=None,
    )  # fmt: skip


def _clipped(record: Record, random: np.random.Generator) -> Record:
    limit = float(random.uniform(0.6, 0.75)) * float(np.max(np.abs(record.effort)))
    return replace(record, effort=np.clip(record.effort, -limit, limit))


def _limited(seed: int) -> Trial | None:
    def change(rig: Rig, random: np.random.Generator) -> Rig:
        most = float(np.max(np.abs(run_rig(rig).force)))
        limit = max(float(random.uniform(0.6, 0.75)) * most, 1.3 * rig.nominal.value("coulomb.force"))
        return replace(rig, force_limit=limit)

    record, rig, raw, _ = _base(seed, ("multisine", "point_to_point"), change)
    visits = [b - a for a, b in runs(np.abs(raw.force) >= rig.force_limit) if (b - a) * rig.sample_time >= _REACHED]
    return Trial((record,)) if len(visits) > 2 else None


def _walled(seed: int) -> Trial:
    def change(rig: Rig, random: np.random.Generator) -> Rig:
        return replace(rig, wall=float(random.uniform(0.5, 0.7)) * float(np.max(rig.wanted.position)))

    return Trial((_base(seed, ("point_to_point", "ramps", "multisine", "steps"), change)[0],))


def _thinned(seed: int) -> Trial:
    record, _, _, random = _base(seed, ("chirp", "point_to_point"))
    every = max(round(float(random.uniform(0.03, 0.04)) / record.sample_time), 2)
    return Trial((_every(record, every),))


def _every(record: Record, every: int) -> Record:
    signals = {name: values[::every] for name, values in record.signals().items()}
    return Record(**signals, units=record.units, source=record.source, effort_hold=record.effort_hold)  # type: ignore[arg-type]


def _folded(record: Record, random: np.random.Generator) -> Record:
    rate = 1.0 / record.sample_time
    frequency = rate * float(random.uniform(0.55, 0.85))  # its fold lies at 0.15 to 0.45 of the rate
    size = float(random.uniform(0.1, 0.2)) * float(np.std(record.effort)) * math.sqrt(2.0)
    return replace(record, effort=record.effort + size * np.sin(2.0 * np.pi * frequency * record.time + 1.0))


def _first(make: Callable[[int], Trial | None]) -> Callable[[int], Trial]:
    """The trial of the first seed, from the one asked for, whose recording can show the fault."""

    def found(seed: int) -> Trial:
        trials = (make(seed + _APART * attempt) for attempt in range(_TRIES))
        return next(trial for trial in trials if trial is not None)

    return found


def _late(motions: tuple[str, ...], shift: Callable[[Record, np.random.Generator], Array | float]) -> Callable[[int], Trial]:
    """A fault that shifts the effort in time."""

    def make(seed: int) -> Trial | None:
        record, rig, raw, random = _base(seed, motions)
        time = rig.sample_time * np.arange(raw.velocity.size)
        force = rig.nominal.value("mass") * np.gradient(gaussian_filter1d(raw.velocity, 2.0), rig.sample_time)
        late = shift(record, random)
        changed = force - np.interp(time - late, time, force)
        if float(np.std(changed)) < _SHOWS * float(np.std(raw.force)):
            return None
        return Trial((_shifted(record, late),))

    return _first(make)


def _shifted(record: Record, shift: Array | float) -> Record:
    moved = replace(record, effort=np.interp(record.time - shift, record.time, record.effort))
    return moved.between(0.05, record.duration - 0.05)  # where the effort is known


def _delayed(record: Record, random: np.random.Generator) -> float:
    return _sign(random) * float(random.uniform(0.008, 0.02))


def _drifting(record: Record, random: np.random.Generator) -> Array:
    total = _sign(random) * float(random.uniform(0.015, 0.03))
    return np.asarray(total * (record.time / record.duration - 0.5))


def _holes(record: Record, random: np.random.Generator) -> Record:
    keep = random.uniform(size=record.n_samples) > float(random.uniform(0.06, 0.15))
    keep[0] = True
    signals = {name: values[keep] for name, values in record.signals().items()}
    return Record(**signals, units=record.units, source=record.source, effort_hold=record.effort_hold)  # type: ignore[arg-type]


def _repeats(record: Record, random: np.random.Generator) -> Record:
    again = random.uniform(size=record.n_samples) < float(random.uniform(0.08, 0.2))
    again[0] = False
    last = np.maximum.accumulate(np.where(again, 0, np.arange(record.n_samples)))
    return replace(record, position=record.position[last], effort=record.effort[last])


def _jittering(record: Record, random: np.random.Generator) -> Record:
    off = 0.4 * float(random.uniform(0.8, 1.0)) * record.sample_time * random.uniform(-1.0, 1.0, record.n_samples)
    time = record.time + off * 1.2
    time = np.maximum.accumulate(time - time[0])
    return replace(record, time=time + 1e-9 * np.arange(record.n_samples))


def _coarse_position(record: Record, random: np.random.Generator) -> Record:
    step = float(np.ptp(record.position)) / float(random.uniform(10.0, 25.0))
    return replace(record, position=step * np.round(record.position / step))


def _interpolated(record: Record, random: np.random.Generator) -> Record:
    """An encoder whose signals have an offset and unequal amplitudes: first and second harmonic of its lines."""
    pitch = float(np.ptp(record.position)) / float(np.exp(random.uniform(*np.log((40.0, 400.0)))))
    size = float(random.uniform(1.0, 4.0)) * max(step_of(record.position), 3.0 * noise_of(record.position))
    angle = 2.0 * np.pi * record.position / pitch
    first, second = random.uniform(0.0, 2.0 * np.pi, 2)
    error = size * (0.8 * np.sin(angle + first) + 0.6 * np.sin(2.0 * angle + second))
    return replace(record, position=record.position + error)


def _coarse_effort(record: Record, random: np.random.Generator) -> Record:
    step = float(np.ptp(record.effort)) / float(random.uniform(6.0, 14.0))
    return replace(record, effort=step * np.round(record.effort / step))


def _stuck(record: Record, random: np.random.Generator, name: str) -> Record:
    values = getattr(record, name).copy()
    speed = np.abs(np.gradient(gaussian_filter1d(record.position, 10.0)))
    n = record.n_samples
    middle = slice(n // 8, -n // 4)
    first = n // 8 + int(np.argmax(speed[middle]))
    last = min(first + round(float(random.uniform(0.1, 0.4)) / record.sample_time), n - 1)
    values[first:last] = values[first]
    return replace(record, **{name: values})


def _spiked(record: Record, random: np.random.Generator, name: str) -> Record:
    """Single samples that are off by one to three times the range of the signal."""
    signal = record.signals()[name].copy()
    at = random.choice(np.arange(50, record.n_samples - 50), 3, replace=False)
    signal[at] += float(np.ptp(signal)) * random.uniform(1.0, 3.0, 3) * random.choice([-1.0, 1.0], 3)
    return replace(record, position=signal) if name == "position" else replace(record, effort=signal)


def _with_model(motions: tuple[str, ...], change: Callable[[Record, np.random.Generator], Record]) -> Callable[[int], Trial]:
    def make(seed: int) -> Trial:
        record, rig, _, random = _base(seed, motions)
        return Trial((replace(change(record, random), reference=None),), scaled_nominal(rig))

    return make


def _factor(random: np.random.Generator) -> float:
    factor = float(random.choice([1000.0, 100.0, 2.0 * math.pi, 60.0, 180.0 / math.pi, 9.80665]))
    return factor if _sign(random) > 0.0 else 1.0 / factor


def _velocity(record: Record, random: np.random.Generator) -> Array:
    return np.gradient(record.position, record.time)


def _late_velocity(record: Record, random: np.random.Generator) -> Record:
    late = float(random.uniform(0.015, 0.03))
    return replace(record, velocity=np.interp(record.time - late, record.time, _velocity(record, random)))


def _offset(seed: int) -> Trial:
    record, rig, _, random = _base(seed, _BUSY)
    size = _sign(random) * float(random.uniform(0.8, 1.5)) * rig.nominal.value("coulomb.force")
    return Trial((replace(record, effort=record.effort + rig.scale[1] * size),))


def _helped(seed: int) -> Trial | None:
    """The drive adds most of the friction by itself, and only the controller's part is recorded.

    It goes by the velocity that it measures or, where the axis follows closely, by the one that is wanted.
    """
    by_reference = seed // len(AXES) % 2 == 0
    record, rig, raw, random = _base(seed, ("multisine", "point_to_point") if by_reference else _BUSY)
    share = float(random.uniform(0.8, 1.0))
    coulomb, viscous = rig.nominal.value("coulomb.force"), rig.nominal.value("viscous.coefficient")
    inertial = rig.nominal.value("mass") * np.gradient(gaussian_filter1d(raw.velocity, 2.0), rig.sample_time)
    if float(np.std(inertial)) < coulomb * _SHOWS:
        return None
    wanted = rig.wanted.velocity if by_reference else raw.velocity
    added = share * (coulomb * np.tanh(wanted / 1e-3) + viscous * wanted)
    seen = raw.force - added + rig.force_noise * random.standard_normal(raw.force.size)
    return Trial((replace(record, effort=rig.scale[1] * seen),), scaled_nominal(rig))


def _fault(name: str, check: str, make: Callable[[int], Trial], *verdicts: str) -> Fault:
    return Fault(name, check, make, verdicts or ("fault",))


FAULTS: tuple[Fault, ...] = (
    _fault("too short", "length", _done(("multisine", "point_to_point"), _short), "warning"),
    _fault("at rest", "excitation", _still, "warning"),
    _fault("one speed", "excitation", _one_speed, "warning"),
    _fault("one direction", "direction", _done(("multisine", "ramps", "reversals"), _one_way), "warning"),
    _fault("force signal clipped", "saturation", _done(("multisine", "point_to_point", "force"), _clipped)),
    _fault("drive at its limit", "saturation", _first(_limited), "warning", "fault"),
    _fault("end stop", "end_stop", _walled),
    _fault("sampled too slowly", "sampling", _thinned),
    _fault("folded line", "aliasing", _done(_BUSY, _folded), "warning", "fault"),
    _fault("clock drift", "clock_drift", _late(("multisine", "point_to_point", "force"), _drifting)),
    _fault("delay", "delay", _late(ACTIVE, _delayed)),
    _fault("dropped samples", "stamps", _done(_BUSY, _holes)),
    _fault("repeated samples", "stamps", _done(ACTIVE, _repeats)),
    _fault("jitter", "stamps", _done(_BUSY, _jittering), "warning", "fault"),
    _fault("coarse position", "resolution", _done(_BUSY, _coarse_position)),
    _fault("errors within an encoder's lines", "interpolation", _done(_BUSY, _interpolated), "warning"),
    _fault("coarse effort", "resolution", _done(_BUSY, _coarse_effort)),
    _fault("effort of wrong sign", "effort_sign", _done(_BUSY, lambda r, _: replace(r, effort=-r.effort))),
    _fault("position of wrong sign", "position_sign", _done(_FOLLOWED, lambda r, _: replace(r, position=-r.position))),
    _fault("unit of position", "units", _with_model(ACTIVE, lambda r, g: replace(r, position=_factor(g) * r.position))),
    _fault("unit of effort", "units", _with_model(_BUSY, lambda r, g: replace(r, effort=_factor(g) * r.effort))),
    _fault("offset of the force", "offset", _offset, "warning", "fault"),
    _fault("velocity in another unit", "velocity_signal",
           _done(_BUSY, lambda r, g: replace(r, velocity=_factor(g) * _velocity(r, g)))),
    _fault("velocity of wrong sign", "velocity_signal", _done(_BUSY, lambda r, g: replace(r, velocity=-_velocity(r, g)))),
    _fault("late velocity", "velocity_signal", _done(ACTIVE, _late_velocity), "warning", "fault"),
    _fault("drive compensates friction", "compensated_drive", _first(_helped)),
    _fault("frozen effort", "frozen", _done(_BUSY, lambda r, g: _stuck(r, g, "effort"))),
    _fault("frozen position", "frozen", _done(ACTIVE, lambda r, g: _stuck(r, g, "position"))),
    _fault("spikes of the position", "position_steps", _done(_BUSY, lambda r, g: _spiked(r, g, "position")), "warning"),
    _fault("spikes of the effort", "position_steps", _done(_BUSY, lambda r, g: _spiked(r, g, "effort")), "warning"),
    _fault("effort missing", "frozen", _done(_BUSY, lambda r, _: replace(r, effort=np.zeros(r.n_samples)))),
)  # fmt: skip
"""Every fault."""
