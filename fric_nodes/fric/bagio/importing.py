"""Recordings of other programs, by a mapping, as :class:`~fric.record.Record`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..importers import ImportingError, Table, TextOptions, load_table
from ..importers.errors import one_line
from ..importers.table import Source, closest
from ..importers.units import closest_units, known_units, unit
from ..record import Array, Mask, Record, Units
from .checks import Samples, check_samples
from .clocks import place
from .mapping import ImportMap, PeriodMap, SignalMap, load_mapping
from .other_clocks import Taken, explain_clocks, lengths_differ, refuse_pairs

__all__ = ["import_recording"]

_QUANTITIES = {
    "time": ("time",),
    "position": ("length", "angle"),
    "reference": ("length", "angle"),
    "effort": ("force", "torque"),
    "velocity": ("speed", "angular speed"),
    "normal_load": ("force",),
    "temperature": ("temperature",),
    "acceleration": ("acceleration", "angular acceleration"),
}
_DRIVE_UNITS = ("current", "voltage", "per cent", "counts", "number")  # what a drive gives in place of a force
_LONGEST = 1e8  # [s], three years
_POSITION_OF = {"m/s": "m", "rad/s": "rad"}


def import_recording(
    file: str | Path,
    mapping: ImportMap | Mapping[str, Any] | str | Path,
    *,
    repair: bool = False,
    delimiter: str | None = None,
    decimal: str | None = None,
    skip_rows: int | None = None,
    header: bool | None = None,
) -> Record:
    """Read a file of another program.

    Args:
        file: any that :mod:`fric.importers` reads: ``.mat`` (up to version 7), ``.csv``, ``.txt``, ``.json``, ``.npz``,
            ...
        mapping: where each signal comes from; a YAML file, a dictionary or a mapping.
        repair: as for :func:`fric.bagio.read_record`.
        delimiter: between the columns of a text file; like the next three it goes before what the mapping says.
        decimal: decimal sign of a text file.
        skip_rows: lines of a text file to pass over.
        header: whether the first line of a text file after those holds names.

    Returns:
        The record, in SI; an effort in a unit without SI meaning (``A``, ``V``, ``%``) stays in that unit.

    Raises:
        ImportingError: the file cannot be read or the mapping does not fit it.
        BagError: the signals are unusable, see :mod:`.checks`.
    """
    chosen = load_mapping(mapping)
    options = TextOptions(
        delimiter if delimiter is not None else chosen.delimiter,
        decimal if decimal is not None else chosen.decimal,
        skip_rows if skip_rows is not None else chosen.skip_rows,
        header if header is not None else chosen.header,
        repair,
    )
    return _Import(Path(file), chosen, options).record(repair)


class _Import:
    """One file with its mapping; further files are read once each."""

    def __init__(self, path: Path, mapping: ImportMap, options: TextOptions) -> None:
        self.path = path
        self.mapping = mapping
        # A mean over the sample before is, to a model, a force that was held over it.
        self._hold = "preceding" if mapping.effort_hold == "mean" else mapping.effort_hold
        self.options = options
        self.tables: dict[Path, Table] = {}
        self.si: dict[str, str] = {}
        self.notes: list[str] = []
        self.midnight: float | None = None  # [s since 1970] from which clock times count
        named: dict[str, SignalMap | None] = {
            "position": mapping.position,
            "effort": mapping.effort,
            "velocity": mapping.velocity,
            "reference": mapping.reference,
            "normal_load": mapping.normal_load,
            "temperature": mapping.temperature,
        }
        clash = set(mapping.extra) & {"time", *named}
        if clash:
            problem = f"extra signal has the name of a usual one: {', '.join(sorted(clash))}"
            raise ImportingError(path, problem, "give it another name")
        self.named = {name: entry for name, entry in {**named, **mapping.extra}.items() if entry is not None}
        self.wanted: dict[Path, list[Source]] = {}
        for entry in (*self.named.values(), mapping.time):
            self._want(entry, None)

    def _want(self, entry: SignalMap | PeriodMap | None, file: str | None) -> None:
        """Note which columns of which file an entry asks for."""
        if not isinstance(entry, SignalMap):
            return
        file = entry.file or file
        self.wanted.setdefault(self._path(file), []).append(entry.source)
        self._want(entry.minus, None)
        self._want(entry.time, file)

    def _path(self, file: str | None) -> Path:
        return self.path if file is None else self.path.parent / file

    def record(self, repair: bool) -> Record:
        mapping = self.mapping
        together = {name: self._signal(name, entry) for name, entry in self.named.items() if entry.time is None}
        time = self._time(together)
        short = next((name for name, signal in together.items() if signal.size != time.size), None)
        if short is not None:
            table = self._table(self.named[short].file)
            raise lengths_differ(table, short, self._columns(), together[short].size, time.size)
        explain_clocks(self._table(None), self._columns(), together, self.options)
        position_unit = self._position_unit()
        time, together, start = self._finite_time(time, together, repair)
        time_ns = np.rint(time * 1e9).astype(np.int64)
        samples = Samples(time_ns, together, np.ones(time.size, dtype=np.bool_), self.notes, self._hold)
        check_samples(self.path, samples, repair=repair, received=False)
        self._own_times(samples, start, repair)
        kept = samples.signals
        seconds = (samples.time_ns - samples.time_ns[0]) * 1e-9
        if "position" not in kept:
            kept["position"] = _integrated(seconds, kept["velocity"])
            self.notes.append("the file has no position: velocity integrated by the trapezoidal rule, from 0")
        return Record(
            time=seconds,
            position=kept.pop("position"),
            effort=kept.pop("effort"),
            velocity=kept.pop("velocity", None),
            reference=kept.pop("reference", None),
            extra=kept,
            valid=None if samples.valid.all() else samples.valid,
            joint=mapping.joint,
            units=Units(position_unit, self.si["effort"]),
            source=str(self.path),
            effort_hold=samples.hold,
            notes=tuple(self.notes),
        )

    def _table(self, file: str | None) -> Table:
        path = self._path(file)
        if path not in self.tables:
            self.tables[path] = load_table(path, self.options, self.wanted.get(path, ()))
            self.notes += self.tables[path].notes
            if path == self.path:
                refuse_pairs(self.tables[path], self._columns(), self.wanted.get(path, ()))
        return self.tables[path]

    def _columns(self) -> dict[str, Taken]:
        """What the mapping takes from columns of the main file, by signal, those with a time of their own left out."""
        entries: dict[str, SignalMap | PeriodMap] = {"time": self.mapping.time, **self.named}
        plain = {name: entry for name, entry in entries.items() if isinstance(entry, SignalMap)}
        return {
            name: Taken(entry.source, entry.unit) for name, entry in plain.items() if entry.file is None and entry.time is None
        }

    def _raw(self, name: str, entry: SignalMap, file: str | None = None) -> Array:
        """A signal in SI units, without what is taken away from it."""
        table = self._table(entry.file or file)
        column = table.find(name, entry.source)
        values = table.columns[column]
        if name == "time" and column in table.clocks:
            self.si[name] = "s"
            if entry.unit.strip() != "s":
                self.notes.append(f"time is given by the clock: taken in seconds, not in {one_line(entry.unit)}")
            self.midnight = table.clocks[column] if self.midnight is None else self.midnight
            return values + (table.clocks[column] - self.midnight)
        if column in table.clocks:
            what = f"signal '{name}' is to come from '{one_line(entry.source)}', which holds clock times"
            raise ImportingError(table.path, what, "map a column of numbers")
        with np.errstate(all="ignore"):  # what is not finite is found later, and said
            return self._to_si(name, values * _factor(table, name, entry.scale) + entry.offset, entry.unit)

    def _signal(self, name: str, entry: SignalMap) -> Array:
        """A signal at its own samples."""
        values = self._raw(name, entry)
        if entry.minus is None:
            return values
        if entry.minus.time is not None:
            raise ImportingError(
                self.path, f"what is taken away from '{name}' has a time of its own", "give both the same time"
            )
        own = self.si[name]
        taken = self._signal(name, entry.minus)
        if self.si[name] != own or taken.shape != values.shape:
            has = f"{values.size} samples in {own}, what is taken away {taken.size} in {self.si[name]}"
            raise ImportingError(self.path, f"signal '{name}' has {has}", "map columns of one length and one quantity")
        with np.errstate(all="ignore"):
            return values - taken

    def _to_si(self, name: str, values: Array, text: str) -> Array:
        wanted = _QUANTITIES.get(name, ())
        found = unit(text, *wanted)
        if found is None:
            near = closest_units(text, *wanted, *(_DRIVE_UNITS if name == "effort" else ()))
            what = f"signal '{name}' has the unit '{one_line(text)}', which is not known"
            raise ImportingError(self.path, what, f"use a known one, with a scale where that is needed; the closest: {near}")
        allowed = (*wanted, *_DRIVE_UNITS) if name == "effort" else wanted
        if wanted and found.quantity not in allowed:
            drive = ", A, V, % or counts" if name == "effort" else ""
            raise ImportingError(
                self.path,
                f"signal '{name}' has the unit '{one_line(text)}', which is no unit of {' or '.join(wanted)}",
                f"use one of {known_units(*wanted)}{drive}, with a scale where that is needed",
            )
        self.si[name] = found.si
        converted: Array = values * found.factor + found.offset
        return converted

    def _time(self, together: dict[str, Array]) -> Array:
        entry = self.mapping.time
        if isinstance(entry, PeriodMap):
            if not together:
                problem = "every signal has a time of its own, and the time of the mapping is a period"
                raise ImportingError(self.path, problem, "leave the position's time out, and map it as the time of the mapping")
            return np.arange(max(signal.size for signal in together.values()), dtype=np.float64) * self._period(entry)
        return self._raw("time", entry)

    def _period(self, entry: PeriodMap) -> float:
        return float(self._to_si("time", np.array([entry.period]), entry.unit)[0])

    def _own_times(self, samples: Samples, start: float, repair: bool) -> None:
        """Bring the signals that have a time of their own onto that of the others."""
        base = (samples.time_ns - samples.time_ns[0]) * 1e-9
        start += float(samples.time_ns[0]) * 1e-9  # of the first sample that is left, on the clock of the file
        outside = np.zeros(base.size, dtype=np.bool_)
        separate = [name for name, entry in self.named.items() if entry.time is not None]
        for name in sorted(separate, key=lambda name: name != "position"):  # the motion first: by it a force is judged
            entry = self.named[name]
            values = self._signal(name, entry)
            if isinstance(entry.time, PeriodMap):
                own = np.arange(values.size, dtype=np.float64) * self._period(entry.time)
            else:
                assert entry.time is not None  # as chosen above
                own = self._raw("time", entry.time, entry.file) - start
            own, values = self._own_samples(name, own, values, repair)
            placed = place(name, base, own, values, self._hold, samples.signals.get("position"))
            out = ~np.isfinite(placed.values)
            outside |= out
            samples.signals[name] = placed.values
            samples.valid = samples.valid & ~placed.bridged
            step = float(np.median(np.diff(own)))
            what = f"{name} has {own.size} samples at a time of its own (every {step * 1e3:.4g} ms)"
            gaps = f"; {int(placed.bridged.sum())} samples in its gaps marked as not to be used" if placed.bridged.any() else ""
            self.notes.append(f"{what}: brought onto the others' {placed.how}{gaps}")
        if not outside.any():
            return
        if np.count_nonzero(outside) > 0.5 * base.size:
            covered = f"only {base.size - int(outside.sum())} of {base.size} samples of the others"
            problem = f"signals with a time of their own cover {covered}"
            raise ImportingError(self.path, problem, "map times of one clock, in the right unit")
        samples.keep(~outside)
        self.notes.append(f"{int(outside.sum())} samples that not all signals cover left out")

    def _own_samples(self, name: str, own: Array, values: Array, repair: bool) -> tuple[Array, Array]:
        """Samples of a signal with a time of its own: empty rows at the end left out, in the order of time."""
        if own.size != values.size:
            problem = f"signal '{name}' has {values.size} samples, its own time has {own.size}"
            raise ImportingError(self.path, problem, "map columns of one length")
        last = int(np.max(np.flatnonzero(np.isfinite(values)), initial=-1)) + 1
        own, values = own[:last], values[:last]
        good = np.isfinite(own) & np.isfinite(values)
        newest = np.maximum.accumulate(np.where(good, own, -np.inf)) if last else own
        later = np.ones(last, dtype=np.bool_)
        later[1:] = own[1:] > newest[:-1]
        wrong = int(np.count_nonzero(~(good & later)))
        if wrong:
            what = f"signal '{name}' has {wrong} of {last} samples without a value, or whose own time doesn't increase"
            if not repair or wrong > 0.5 * last:
                remedy = (
                    "drop these samples with --repair, or correct the file" if wrong <= 0.5 * last else "map the right columns"
                )
                raise ImportingError(self.path, what, remedy)
            self.notes.append(f"{what}: dropped")
        own, values = own[good & later], values[good & later]
        if own.size < 4:
            raise ImportingError(self.path, f"signal '{name}' has only {own.size} samples of its own", "map other columns")
        return own, values

    def _position_unit(self) -> str:
        """Unit of the position, with which velocity and reference must agree."""
        from_velocity = _POSITION_OF.get(self.si.get("velocity", ""))
        position = self.si.get("position") or from_velocity or "m"
        for name, other in (("velocity", from_velocity), ("reference", self.si.get("reference"))):
            if other is not None and other != position:
                raise ImportingError(
                    self.path, f"position is in {position} but {name} in a unit of {other}", "give both for the same motion"
                )
        return position

    def _finite_time(self, time: Array, signals: dict[str, Array], repair: bool) -> tuple[Array, dict[str, Array], float]:
        """Times from the first one [s], the signals at them, and the first time on the file's clock [s]."""
        good = np.isfinite(time)
        rows = np.flatnonzero(good)
        if not rows.size:
            raise ImportingError(self.path, "time is not finite (NaN or inf) at any sample", "map another column")
        start = float(time[rows[0]])
        if np.ptp(time[good]) > _LONGEST:
            problem = f"time runs over {np.ptp(time[good]):.3g} s, which no recording does"
            raise ImportingError(self.path, problem, "give the right unit of the time, or correct the file")
        if not good.all():
            bad = np.flatnonzero(~good)
            what = f"time is not finite (NaN or inf) at {bad.size} of {time.size} samples, first at row {bad[0]}"
            if not repair or bad.size > 0.5 * time.size:
                remedy = "fill or drop these samples with --repair, or correct the file" if not repair else "correct the file"
                raise ImportingError(self.path, what, remedy)
            time = _filled_time(time, good)
            good = np.isfinite(time)
            filled = bad.size - int(np.count_nonzero(~good))
            self.notes.append(f"{what}: {filled} filled between even stamps, {bad.size - filled} dropped")
        return time[good] - start, {name: signal[good] for name, signal in signals.items()}, start


def _filled_time(time: Array, good: Mask) -> Array:
    """Stamps filled where those on either side are as far apart as the rows between say."""
    rows = np.flatnonzero(good)
    steps = np.diff(time[rows])
    single = steps[np.diff(rows) == 1]
    if single.size < 1 or rows.size < 3:
        return time
    step = float(np.median(single))
    line = np.interp(np.arange(time.size), rows, time[rows])
    place = np.clip(np.searchsorted(rows, np.arange(time.size)) - 1, 0, rows.size - 2)
    even = np.abs(steps - step * np.diff(rows)) < 0.5 * abs(step)
    inside = ~good & even[place]
    inside[: rows[0]] = inside[rows[-1] + 1 :] = False
    return np.where(inside, line, time)


def _integrated(time: Array, velocity: Array) -> Array:
    """Position from 0 by the trapezoidal rule."""
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)
    return np.concatenate((np.zeros(1), np.cumsum(steps)))


def _factor(table: Table, signal: str, scale: float | str) -> float:
    """A factor given as a number or as the name of a scalar variable, with a minus before it where the sign is turned."""
    if not isinstance(scale, str):
        return float(scale)
    name = scale.strip()
    sign = -1.0 if name.startswith("-") else 1.0
    name = name.removeprefix("-").strip()
    if name in table.scalars:
        return sign * table.scalars[name]
    there = ", ".join(table.scalars) or "none"
    near = closest(name, list(table.scalars))
    raise ImportingError(
        table.path,
        f"scale of signal '{signal}' is '{scale}', which is no scalar variable of the file{near}",
        f"give a number, or one of its scalar variables: {there}",
    )
