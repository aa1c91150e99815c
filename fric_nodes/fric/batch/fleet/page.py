"""``fleet.html``: what to look at first, the axes over time with their intervals, drift, clusters, and what was refused."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from urllib.parse import quote

import numpy as np
import plotly.graph_objects as go
import pyarrow as pa
import pyarrow.compute as pc
from scipy.special import ndtri

from ...record import Array
from ...report.figures import Curve, scatter_and_curves
from ...report.numbers import significant
from ...report.page import Section, figure, paragraph, render, table, tiles
from ..task import NORMAL_95
from .changes import FALSE_ALARMS, without_common
from .look import Fleet, Item, Parameter

__all__ = ["fleet_page"]

_ROWS = 40  # of a table: more are in the Parquet file (layout)
_PLOTS = 8  # of single axes (layout)
_STRIPES = 24  # axes of a map (layout)
_DRIFT = "Slopes that the days show, the largest part of the value first; 5 % of those named are expected to be none."
_COLOURS_TO = 6.0  # [standard deviations] at which the colours of a map end (layout)


def fleet_page(fleet: Fleet, results: pa.Table, verb: str, reports: Mapping[str, str] | None = None) -> str:
    """The page as text.

    Args:
        fleet: what is known of all axes.
        results: the table.
        verb: by which it was made.
        reports: links to reports of single recordings, by axis.
    """
    refused = results.filter(pc.equal(results["status"], "refused"))
    sections = [
        Section("What to look at first", (*_first(fleet), *_links(reports or {}))),
        *_plots(fleet),
        *_maps(fleet),
        *_drift(fleet),
        *_causes(fleet),
        *_values(fleet),
        Section("Refused", _refused(refused)),
        Section("How this was judged", _method(fleet)),
    ]
    span = f" from {fleet.days[0]} to {fleet.days[-1]}" if fleet.days else ""
    lead = f"fric batch {verb}: {results.num_rows} recordings of {len(fleet.axes)} axes{span}, {refused.num_rows} refused."
    return render("All axes", lead, sections)


def _first(fleet: Fleet) -> tuple[str, ...]:
    entries = (
        (str(len({each.axis for each in fleet.items if each.since})), "axes with a change or refused of late"),
        (f"{fleet.axis_days:,}", "axis-days judged"),
        (f"{FALSE_ALARMS * fleet.axis_days:.2g}", "false alarms expected among them"),
    )
    if not fleet.items:
        return (tiles(entries), paragraph("Nothing stands out."))
    rows = [
        (str(k), i.axis, i.about, i.what, i.since, f"{i.z:+.1f}" if i.z else "") for k, i in enumerate(fleet.items[:_ROWS], 1)
    ]
    head = ("", "axis", "about", "what", "since", "standard deviations")
    blocks = [tiles(entries), table(head, rows, text_columns=(3,), wrap=(3,), names=(1, 2))]
    return (*blocks, *_more(len(fleet.items)))


def _links(reports: Mapping[str, str]) -> tuple[str, ...]:
    if not reports:
        return ()
    links = (f'<a href="{escape(quote(link), quote=True)}">{escape(axis)}</a>' for axis, link in reports.items())
    return (f'<p class="note">Reports of the newest recordings: {", ".join(links)}.</p>',)


def _more(count: int) -> tuple[str, ...]:
    return (paragraph(f"{count - _ROWS} more are not shown.", "note"),) if count > _ROWS else ()


def _plots(fleet: Fleet) -> list[Section]:
    """The axes that come first, each with its intervals among all others."""
    chosen: dict[tuple[str, str], Item] = {}
    for item in fleet.items:
        chosen.setdefault((item.axis, item.about), item)
    by_name = {each.name: each for each in fleet.parameters}
    shown = [item for (_, about), item in chosen.items() if about in by_name][:_PLOTS]
    if not shown and fleet.parameters and fleet.axes:
        blocks = [_plot(fleet, each, fleet.axes[0], "") for each in fleet.parameters[:_PLOTS]]
        return [Section("One axis among all", tuple(blocks))]
    blocks = [
        _plot(fleet, by_name[i.about], i.axis, f"{i.axis} {i.what}{f' since {i.since}' if i.since else ''}.") for i in shown
    ]
    return [Section("These axes over time", tuple(blocks))] if blocks else []


def _plot(fleet: Fleet, parameter: Parameter, axis: str, told: str) -> str:
    row = fleet.axes.index(axis)
    at = np.arange(len(fleet.days), dtype=np.float64)
    value, error = parameter.values[row], np.nan_to_num(parameter.errors[row])
    held = np.isfinite(value)
    curves = [
        Curve("95 % interval", *_bars(at[held], value[held], NORMAL_95 * error[held]), "reference", width=1.0),
        *(
            Curve(name, at, _quantile(parameter.values, share), "second", dash, 1.2)
            for name, share, dash in (("all axes: median", 0.5, "solid"), ("5 %", 0.05, "dot"), ("95 %", 0.95, "dot"))
        ),
    ]
    label = f"{parameter.name} [{parameter.unit}]" if parameter.unit else parameter.name
    plot = scatter_and_curves((axis, at[held], value[held]), curves, f"days since {fleet.days[0]}", label, height=320, size=6)
    return figure(plot, told or f"{axis}: median of each day.")


def _bars(x: Array, y: Array, wide: Array) -> tuple[Array, Array]:
    """Intervals as one line with breaks."""
    pause = np.full(x.shape, np.nan)
    return np.column_stack([x, x, pause]).ravel(), np.column_stack([y - wide, y + wide, pause]).ravel()


def _quantile(values: Array, share: float) -> Array:
    held = np.isfinite(values).any(axis=0)
    found = np.full(values.shape[1], np.nan)
    found[held] = np.nanquantile(values[:, held], share, axis=0)
    return found


def _maps(fleet: Fleet) -> list[Section]:
    """Axes by days: how far each is from its own median, in its own scatter."""
    if len(fleet.days) < 3 or not fleet.parameters:
        return []
    blocks = []
    for each in fleet.parameters:
        deviation = _deviation(each.values)
        if deviation is None:
            continue
        most = np.max(np.where(np.isfinite(deviation), np.abs(deviation), 0.0), axis=1)
        order = np.argsort(-most, kind="stable")[:_STRIPES]
        plot = go.Figure(
            go.Heatmap(
                z=np.round(deviation[order][::-1], 1),
                x=list(fleet.days),
                y=[fleet.axes[k] for k in order[::-1]],
                zmin=-_COLOURS_TO,
                zmax=_COLOURS_TO,
                colorscale="RdBu_r",
                colorbar={"title": "scatter"},
            )
        )
        plot.update_layout(template="plotly_white", height=120 + 16 * len(order), margin={"l": 130, "r": 16, "t": 30, "b": 40})
        plot.update_yaxes(tickfont={"size": 9}, automargin=True)
        told = f"the {len(order)} that move most" if len(order) < len(fleet.axes) else "all of them"
        blocks.append(figure(plot, f"{each.name}: distance of axes from their own medians, in day-to-day scatter; {told}."))
    return [Section("Axes and days", tuple(blocks))] if blocks else []


def _deviation(values: Array) -> Array | None:
    """Distance of each axis from its median over the days, in the scatter from day to day; None where there is no scatter."""
    left = without_common(values)
    filled = np.where(np.asarray(np.isfinite(left).any(axis=1))[:, None], left, 0.0)
    left = left - np.nanmedian(filled, axis=1)[:, None]
    step: Array = np.abs(np.diff(left, axis=1))
    step = step[np.isfinite(step)]
    scatter = float(np.median(step)) / (np.sqrt(2.0) * float(ndtri(0.75))) if step.size else 0.0
    return np.asarray(left / scatter, dtype=np.float64) if scatter > 0.0 else None


def _drift(fleet: Fleet) -> list[Section]:
    if not fleet.drifts:
        return []
    units = {each.name: each.unit for each in fleet.parameters}
    rows = [
        (
            d.axis,
            d.parameter,
            f"{d.slope:+.3g}",
            f"{d.lower:+.3g} to {d.upper:+.3g}",
            significant(d.level, 3),
            units[d.parameter],
        )
        for d in fleet.drifts[:_ROWS]
    ]
    head = ("axis", "parameter", "per 30 days", "95 % interval", "latest", "unit")
    note = paragraph(_DRIFT, "note")
    return [Section("Drift", (note, table(head, rows, text_columns=(3, 5), names=(0, 1)), *_more(len(fleet.drifts))))]


def _causes(fleet: Fleet) -> list[Section]:
    found = []
    if fleet.clusters:
        rows = [(name, str(len(axes)), f"{100.0 * sure:.0f} %", _listed(axes)) for name, axes, sure in fleet.clusters[:_ROWS]]
        head = ("missing physics", "axes", "presence", "which")
        found.append(Section("Axes with the same missing physics", (table(head, rows, text_columns=(0, 3), wrap=(0, 3)),)))
    if fleet.faults:
        rows_of_faults = [(check, str(len(axes)), _listed(axes)) for check, axes in fleet.faults[:_ROWS]]
        head_of_faults = ("fault", "axes", "which")
        found.append(
            Section("Faults of instruments", (table(head_of_faults, rows_of_faults, text_columns=(0, 2), wrap=(0, 2)),))
        )
    return found


def _listed(axes: Sequence[str], most: int = 12) -> str:
    return ", ".join(axes[:most]) + (f" and {len(axes) - most} more" if len(axes) > most else "")


def _values(fleet: Fleet) -> list[Section]:
    """The newest values of the axes."""
    if not fleet.parameters:
        return []
    head = ("axis", *(f"{p.name} [{p.unit}]" if p.unit else p.name for p in fleet.parameters))
    rows = []
    for axis, row in fleet.latest.head(_ROWS).iterrows():
        cells = []
        for p in fleet.parameters:
            wide = (row[f"{p.name}.upper"] - row[f"{p.name}.lower"]) / 2.0
            cells.append(
                f"{significant(row[p.name], 4)} ± {significant(wide, 2)}" if np.isfinite(wide) else significant(row[p.name], 4)
            )
        rows.append((str(axis), *cells))
    return [
        Section(
            "Newest values, with 95 % intervals", (table(head, rows, text_columns=(), names=(0,)), *_more(len(fleet.latest)))
        )
    ]


def _refused(refused: pa.Table) -> tuple[str, ...]:
    if refused.num_rows == 0:
        return (paragraph("None."),)
    reasons = Counter(refused["refusal"].to_pylist())
    first: dict[str, str] = {}
    for reason, path in zip(refused["refusal"].to_pylist(), refused["path"].to_pylist(), strict=True):
        first.setdefault(reason, path)
    rows = [(str(count), reason, first[reason]) for reason, count in reasons.most_common(_ROWS)]
    return (table(("recordings", "why", "such as"), rows, text_columns=(1, 2), wrap=(1, 2)), *_more(len(reasons)))


def _method(fleet: Fleet) -> tuple[str, ...]:
    alarms = (
        "Each day is judged from the days before it, from the eighth on: against a line through the last three weeks of the "
        "axis, and against what its twins have changed by since their first week. What all axes do on a day is taken off. "
        f"Both tests over all parameters give {1000.0 * FALSE_ALARMS:.2g} false alarms per 1,000 axis-days for scatter that is "
        "independent from day to day; scatter that is wider than that widens the limits."
    )
    undated = f" {fleet.undated} recordings say no time and are in no test." if fleet.undated else ""
    once = f"Levels among twins and drift are tested once, with 5 % of false discoveries.{undated}"
    return (paragraph(alarms, "note"), paragraph(once, "note"))
