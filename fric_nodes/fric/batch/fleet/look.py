"""From the table of results to what is to be looked at, in order.

Values of an axis on a day (UTC) are joined by their median. Axes with the same joint name are twins where there are fewer such
names than axes, else all are. Beside the alarms of :mod:`.changes`, whose rate is stated per axis-day, each report tests two
things once: the slope of each axis over the whole time (Theil and Sen's median of slopes with Sen's interval, Kendall's test)
and level and slope among its twins. Their share of false discoveries is held at 5 % (Benjamini and Hochberg 1995).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from scipy.stats import kendalltau, norm, theilslopes

from ...record import Array, Index
from ..task import NORMAL_95
from .changes import Alarm, alarms_of, robust_z

__all__ = ["Drift", "Fleet", "Item", "Parameter", "fleet_of"]

_DISCOVERIES = 0.05  # share of false ones among those named (statistical level)
_FOR_A_SLOPE = 10  # days (statistical: fewer order statistics give no interval at the level of many axes)
_LATEST = 7  # [d] whose median is the level of an axis (physical: a week)
_MEDIAN = float(np.sqrt(np.pi / 2.0))  # standard error of a median of normal values over that of their mean
_PRESENT = 0.5  # probability from which a cause counts as found (statistical: more likely than not)


@dataclass(frozen=True)
class Item:
    """One thing to look at.

    Attributes:
        axis: its name.
        about: parameter, or what else is meant.
        what: in one phrase.
        since: day from which on, as text; empty for the whole time.
        z: how far out it is, in standard deviations.
    """

    axis: str
    about: str
    what: str
    since: str
    z: float


@dataclass(frozen=True)
class Drift:
    """Slope of a parameter over the whole time, per 30 days, with its interval (95 %)."""

    axis: str
    parameter: str
    slope: float
    lower: float
    upper: float
    level: float


@dataclass(frozen=True, eq=False)
class Parameter:
    """One parameter of all axes; arrays of shape ``(n_axes, n_days)``, NaN where there is no recording."""

    name: str
    unit: str
    values: Array
    errors: Array


@dataclass(frozen=True, eq=False)
class Fleet:
    """What is known of all axes.

    Attributes:
        axes: their names.
        days: dates, without gaps.
        parameters: those that the recordings determine.
        items: what to look at, first things first.
        drifts: slopes that the days do show, the largest first.
        clusters: causes that were found, the axes that have them, and the mean of their probabilities.
        faults: of instruments by check, with the axes.
        axis_days: days with a recording, over all axes.
        undated: rows without a time, which are in no test.
        latest: the newest row of each axis.
    """

    axes: tuple[str, ...]
    days: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    items: tuple[Item, ...]
    drifts: tuple[Drift, ...]
    clusters: tuple[tuple[str, tuple[str, ...], float], ...]
    faults: tuple[tuple[str, tuple[str, ...]], ...]
    axis_days: int
    undated: int
    latest: pd.DataFrame


def fleet_of(table: pa.Table, parameters: Sequence[str], units: Mapping[str, str] | None = None) -> Fleet:
    """What the results say about all axes.

    Args:
        table: of :func:`fric.batch.table.table_of`.
        parameters: names of the model's parameters.
        units: of the parameters, by name.
    """
    ends = [f"{name}{end}" for name in parameters for end in ("", ".lower", ".upper")]
    # What else the table holds is taken for the newest rows alone: lists of 10^6 rows are no matter for pandas.
    frame = table.select(["axis", "joint", "time", "status", "refusal", *ends]).to_pandas()
    good = frame[frame["status"] == "ok"]
    dated = good[good["time"].notna()]
    newest = good.sort_values("time", na_position="first", kind="stable").groupby("axis").tail(1).index
    latest = table.take(pa.array(newest.to_numpy(), pa.int64())).to_pandas().set_index("axis").sort_index()
    axes = tuple(sorted(dated["axis"].unique()))
    ordinal = dated["time"].dt.floor("D")
    days = pd.date_range(ordinal.min(), ordinal.max(), freq="D") if len(dated) else pd.DatetimeIndex([])
    held = [_arrays(dated, ordinal, name, (units or {}).get(name, ""), axes, days) for name in parameters]
    varied = [each for each in held if _varies(each.values)]
    twins = _twins(dated, axes)
    names = tuple(str(day.date()) for day in days)
    items = [item for each in varied for item in _changes(each, twins, axes, names, len(varied))]
    items += _among_twins(varied, twins, axes, {(each.axis, each.about) for each in items})
    items.sort(key=lambda each: (not each.since, -abs(each.z), each.axis))
    clusters, faults = _clusters(latest), _faults(latest)
    items += [Item(axis, "refused", text, since, 0.0) for axis, text, since in _silent(frame)]
    return Fleet(
        axes=axes or tuple(sorted(good["axis"].unique())),
        days=names,
        parameters=tuple(varied),
        items=tuple(items),
        drifts=_drifts(varied, axes),
        clusters=clusters,
        faults=faults,
        axis_days=len(pd.MultiIndex.from_arrays([dated["axis"], ordinal]).unique()) if len(dated) else 0,
        undated=len(good) - len(dated),
        latest=latest,
    )


def _arrays(
    dated: pd.DataFrame, day: pd.Series, name: str, unit: str, axes: Sequence[str], days: pd.DatetimeIndex
) -> Parameter:
    errors = (dated[f"{name}.upper"] - dated[f"{name}.lower"]) / (2.0 * NORMAL_95)
    held = pd.DataFrame({"axis": dated["axis"], "day": day, "value": dated[name], "error": errors}).dropna(subset=["value"])
    groups = held.groupby(["axis", "day"])
    count = groups["value"].count()
    error = groups["error"].median() / np.sqrt(count) * np.where(count > 2, _MEDIAN, 1.0)

    def wide(series: pd.Series) -> Array:
        return np.asarray(series.unstack("day").reindex(index=list(axes), columns=days).to_numpy(dtype=float))

    if held.empty:
        nothing = np.full((len(axes), len(days)), np.nan)
        return Parameter(name, unit, nothing, nothing)
    return Parameter(name, unit, wide(groups["value"].median()), wide(error))


def _varies(values: Array) -> bool:
    """False for a parameter that was held: it is the same everywhere."""
    held = values[np.isfinite(values)]
    return held.size > 0 and (held.size == 1 or bool(np.ptp(held) > 0.0))


def _twins(dated: pd.DataFrame, axes: Sequence[str]) -> list[Index]:
    """Indices of axes that are compared with each other."""
    joints = dated.groupby("axis")["joint"].first().reindex(list(axes))
    if joints.nunique() in (0, len(axes)):
        return [np.arange(len(axes))] if axes else []
    return [np.flatnonzero((joints == joint).to_numpy()) for joint in sorted(joints.unique())]


def _changes(
    parameter: Parameter, twins: Sequence[Index], axes: Sequence[str], days: Sequence[str], n_parameters: int
) -> list[Item]:
    """What changed, an item for each axis: from its first alarm on, with the first and the largest one told."""
    found = []
    for group in twins:
        values = parameter.values[group]
        held: dict[int, list[Alarm]] = {}
        for alarm in alarms_of(values, parameter.errors[group], n_parameters):
            held.setdefault(alarm.axis, []).append(alarm)
        for axis, alarms in held.items():
            first, most = min(alarms, key=lambda each: each.day), max(alarms, key=lambda each: abs(each.z))
            told = dict.fromkeys(_told(each, values[axis], parameter.unit) for each in (first, most))
            found.append(Item(axes[int(group[axis])], parameter.name, ", ".join(told), days[first.day], most.z))
    return found


def _told(alarm: Alarm, values: Array, unit: str) -> str:
    before = values[: alarm.day]
    before = before[np.isfinite(before)][-_LATEST:]
    usual = float(np.median(before)) if before.size else float("nan")
    share = f" ({100.0 * alarm.size / abs(usual):+.0f} %)" if usual else ""
    text = {"step": "steps by", "one day": "differs for one day by", "apart": "leaves its twins by"}[alarm.kind]
    return f"{text} {alarm.size:+.3g} {unit}{share}".replace("  ", " ")


def _among_twins(
    parameters: Sequence[Parameter], twins: Sequence[Index], axes: Sequence[str], told: set[tuple[str, str]]
) -> list[Item]:
    """Axes whose level or slope is not that of their twins, those left out that have an alarm already."""
    found: list[tuple[float, Item]] = []
    for each in parameters:
        days = np.arange(each.values.shape[1], dtype=np.float64)
        level = np.array([_last(row) for row in each.values])
        slope = np.array([30.0 * _slope(days, row)[0] for row in each.values])
        for values, text in (
            (level, "is {:.3g} {unit}, its twins {:.3g} {unit}"),
            (slope, "drifts {:+.3g} {unit} in 30 days, its twins {:+.3g} {unit}"),
        ):
            for group in twins:
                z, _ = robust_z(values[group])
                for k in np.flatnonzero(np.isfinite(z)):
                    what = text.format(values[group[k]], np.nanmedian(values[group]), unit=each.unit)
                    item = Item(axes[int(group[k])], each.name, what.replace(" ,", ",").strip(), "", float(z[k]))
                    found.append((2.0 * float(norm.sf(abs(z[k]))), item))
    chosen = _discovered([p for p, _ in found])
    return [item for k, (_, item) in enumerate(found) if chosen[k] and (item.axis, item.about) not in told]


def _slope(days: Array, row: Array) -> tuple[float, float, float]:
    """Median of slopes per day with its 95 % interval; NaN where there are too few days."""
    held = np.isfinite(row)
    if held.sum() < _FOR_A_SLOPE or np.ptp(row[held]) == 0.0:
        return (float("nan"),) * 3
    slope, _, lower, upper = theilslopes(row[held], days[held], 0.95)
    return float(slope), float(lower), float(upper)


def _last(row: Array) -> float:
    held = row[np.isfinite(row)][-_LATEST:]
    return float(np.median(held)) if held.size else float("nan")


def _discovered(p: Sequence[float]) -> Any:
    """Which of the tests are discoveries, by Benjamini and Hochberg."""
    values = np.asarray(p, dtype=np.float64)
    order = np.argsort(values, kind="stable")
    below = np.flatnonzero(values[order] <= _DISCOVERIES * np.arange(1, values.size + 1) / max(values.size, 1))
    chosen = np.zeros(values.size, dtype=bool)
    chosen[order[: below[-1] + 1] if below.size else []] = True
    return chosen


def _drifts(parameters: Sequence[Parameter], axes: Sequence[str]) -> tuple[Drift, ...]:
    tests, found = [], []
    for each in parameters:
        days = np.arange(each.values.shape[1], dtype=np.float64)
        for axis, row in zip(axes, each.values, strict=True):
            slope, lower, upper = _slope(days, row)
            held = np.isfinite(row)
            if not np.isfinite(slope):
                continue
            tests.append(float(kendalltau(days[held], row[held]).pvalue))
            found.append(Drift(axis, each.name, 30.0 * slope, 30.0 * lower, 30.0 * upper, _last(row)))
    chosen = _discovered(tests)
    named = [each for k, each in enumerate(found) if chosen[k]]
    return tuple(sorted(named, key=lambda each: -abs(each.slope) / (abs(each.level) or 1.0)))


def _clusters(latest: pd.DataFrame) -> tuple[tuple[str, tuple[str, ...], float], ...]:
    """Axes with the same causes in their newest recording, the largest group first."""
    if "causes" not in latest:
        return ()
    groups: dict[str, list[tuple[str, float]]] = {}
    for axis, causes in latest["causes"].items():
        found = {each["effect"]: each["presence"] or 0.0 for each in (causes if causes is not None else ())}
        found = {effect: presence for effect, presence in found.items() if presence >= _PRESENT}
        if found:
            groups.setdefault(", ".join(sorted(found)), []).append((str(axis), float(np.mean(list(found.values())))))
    ordered = sorted(groups.items(), key=lambda entry: (-len(entry[1]), entry[0]))
    return tuple((name, tuple(axis for axis, _ in held), float(np.mean([p for _, p in held]))) for name, held in ordered)


def _faults(latest: pd.DataFrame) -> tuple[tuple[str, tuple[str, ...]], ...]:
    if "faults" not in latest:
        return ()
    groups: dict[str, list[str]] = {}
    for axis, faults in latest["faults"].items():
        for check in faults if faults is not None else ():
            groups.setdefault(check, []).append(str(axis))
    return tuple(sorted(((check, tuple(held)) for check, held in groups.items()), key=lambda entry: -len(entry[1])))


def _silent(frame: pd.DataFrame) -> list[tuple[str, str, str]]:
    """Axes whose newest recordings were all refused, with the last refusal and the day of the first of them."""
    found = []
    dated = frame[frame["time"].notna()].sort_values("time", kind="stable")
    for axis, held in dated.groupby("axis"):
        bad = (held["status"] == "refused").to_numpy()
        if bad.size and bad[-1]:
            run = int(np.argmin(bad[::-1])) if not bad.all() else bad.size
            since = str(held["time"].iloc[-run].date())
            found.append((str(axis), f"its last {run} recording(s) are refused: {held['refusal'].iloc[-1]}", since))
    return found
