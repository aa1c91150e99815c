"""Recordings of other programs, by a mapping, as :class:`~fric_nodes.record.Record`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..record import Array, Record, Units
from .checks import Samples, check_samples
from .errors import ImportingError
from .mapping import ImportMap, PeriodMap, SignalMap, closest, load_mapping
from .tables import Table, TextOptions, load_table
from .units import known_units, unit

__all__ = ["import_recording"]

_QUANTITIES = {
    "time": ("time",),
    "position": ("length", "angle"),
    "reference": ("length", "angle"),
    "effort": ("force", "torque"),
    "velocity": ("speed", "angular speed"),
    "normal_load": ("force",),
    "temperature": ("temperature",),
}
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
        file: ``.mat`` (up to version 7), ``.csv``, ``.txt``, ``.tsv``, ``.npz`` or ``.parquet``.
        mapping: where each signal comes from; a YAML file, a dictionary or a mapping.
        repair: as for :func:`fric_nodes.bagio.read_record`.
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
    )
    return _Import(Path(file), chosen, options).record(repair)


class _Import:
    """One file with its mapping; further files are read once each."""

    def __init__(self, path: Path, mapping: ImportMap, options: TextOptions) -> None:
        self.path = path
        self.mapping = mapping
        self.options = options
        self.tables: dict[Path, Table] = {}
        self.si: dict[str, str] = {}
        self.notes: list[str] = []

    def record(self, repair: bool) -> Record:
        mapping = self.mapping
        named: dict[str, SignalMap | None] = {
            "position": mapping.position,
            "effort": mapping.effort,
            "velocity": mapping.velocity,
            "reference": mapping.reference,
            "normal_load": mapping.normal_load,
            "temperature": mapping.temperature,
            **mapping.extra,
        }
        clash = set(mapping.extra) & {"time", "position", "effort", "velocity", "reference", "normal_load", "temperature"}
        if clash:
            problem = f"extra signal has the name of a usual one: {', '.join(sorted(clash))}"
            raise ImportingError(self.path, problem, "give it another name")
        signals = {name: self._signal(name, entry) for name, entry in named.items() if entry is not None}
        time = self._time(signals["effort"].size)
        for name, signal in signals.items():
            if signal.size != time.size:
                raise ImportingError(
                    self.path, f"signal '{name}' has {signal.size} samples, time has {time.size}", "map columns of one length"
                )
        position_unit = self._position_unit()
        time, signals = self._finite_time(time, signals, repair)
        time_ns = np.rint((time - (time[0] if time.size else 0.0)) * 1e9).astype(np.int64)
        samples = Samples(time_ns, signals, np.ones(time.size, dtype=np.bool_), self.notes)
        check_samples(self.path, samples, repair=repair, received=False)
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
            effort_hold=mapping.effort_hold,
            notes=tuple(self.notes),
        )

    def _table(self, file: str | None) -> Table:
        path = self.path if file is None else self.path.parent / file
        if path not in self.tables:
            self.tables[path] = load_table(path, self.options)
        return self.tables[path]

    def _signal(self, name: str, entry: SignalMap) -> Array:
        """A signal in SI units."""
        table = self._table(entry.file)
        values = _column(table, name, entry.source) * _factor(table, name, entry.scale) + entry.offset
        values = self._to_si(name, values, entry.unit)
        if entry.minus is None:
            return values
        own = self.si[name]
        taken = self._signal(name, entry.minus)
        if self.si[name] != own or taken.shape != values.shape:
            has = f"{values.size} samples in {own}, what is taken away {taken.size} in {self.si[name]}"
            raise ImportingError(self.path, f"signal '{name}' has {has}", "map columns of one length and one quantity")
        return values - taken

    def _to_si(self, name: str, values: Array, text: str) -> Array:
        found = unit(text)
        wanted = _QUANTITIES.get(name)
        own = found is None and bool(text.strip()) and (wanted is None or name == "effort")
        if own or (wanted is None and found is None):
            self.si[name] = text.strip()  # a drive's own unit: A, V, %
            return values
        if found is None or (wanted is not None and found.quantity not in wanted):
            assert wanted is not None
            raise ImportingError(
                self.path,
                f"signal '{name}' has the unit '{text}', which is no unit of {' or '.join(wanted)}",
                f"use one of {known_units(*wanted)}, with a scale where that is needed",
            )
        self.si[name] = found.si
        converted: Array = values * found.factor + found.offset
        return converted

    def _time(self, n_samples: int) -> Array:
        entry = self.mapping.time
        if isinstance(entry, PeriodMap):
            period = self._to_si("time", np.array([entry.period]), entry.unit)
            return np.arange(n_samples, dtype=np.float64) * float(period[0])
        return self._signal("time", entry)

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

    def _finite_time(self, time: Array, signals: dict[str, Array], repair: bool) -> tuple[Array, dict[str, Array]]:
        good = np.isfinite(time)
        if good.all():
            return time, signals
        bad = np.flatnonzero(~good)
        what = f"time is not finite (NaN or inf) at {bad.size} of {time.size} samples, first at row {bad[0]}"
        if not repair:
            raise ImportingError(self.path, what, "drop these samples with --repair, or correct the file")
        self.notes.append(f"{what}: dropped")
        return time[good], {name: signal[good] for name, signal in signals.items()}


def _integrated(time: Array, velocity: Array) -> Array:
    """Position from 0 by the trapezoidal rule."""
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)
    return np.concatenate((np.zeros(1), np.cumsum(steps)))


def _column(table: Table, signal: str, source: str | int) -> Array:
    """A column by its name, or by its number from 0."""
    names = list(table.columns)
    if isinstance(source, str) and source in table.columns:
        return table.columns[source]
    number = source if isinstance(source, int) else int(source) if source.isdigit() else None
    if number is not None and 0 <= number < len(names):
        return table.columns[names[number]]
    raise ImportingError(
        table.path,
        f"signal '{signal}' is to come from '{source}', which is not there{closest(str(source), names)}",
        f"columns there: {', '.join(names)}",
    )


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
