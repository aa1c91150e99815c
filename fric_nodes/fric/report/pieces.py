"""The page of an identification piece by piece: each parameter over time, its mean and its drift."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from ..identification.piecewise import Combined, Piecewise
from .figures import COLOURS, Curve, scatter_and_curves
from .numbers import significant
from .page import Section, bullets, figure, paragraph, render, table

__all__ = ["pieces_report"]

_SHOWN = 200  # pieces that are listed as refused


def pieces_report(found: Piecewise, source: str) -> str:
    """The page as text.

    Args:
        found: the result.
        source: name of the recording.
    """
    rows = [
        (
            each.name,
            significant(each.value, 6),
            f"{significant(each.value - each.half, 6)} to {significant(each.value + each.half, 6)}",
            significant(each.scatter, 2),
            significant(each.drift, 3),
            f"{significant(each.drift - each.drift_half, 3)} to {significant(each.drift + each.drift_half, 3)}",
            each.unit,
        )
        for each in found.combined
    ]
    head = ("parameter", "value", "95 % interval", "scatter between pieces", "drift per hour", "95 % interval of it", "unit")
    sections = [Section("Parameters", (table(head, rows, text_columns=(0, 6)), bullets(found.notes)))]
    sections.append(Section("Over time", tuple(_over_time(found, each) for each in found.combined)))
    refused = [(f"{row.begin:.6g} s to {row.end:.6g} s", row.refused) for row in found.rows if row.refused]
    if refused:
        more = [paragraph(f"and {len(refused) - _SHOWN} more, in pieces.csv")] if len(refused) > _SHOWN else []
        listed = table(("piece", "why"), refused[:_SHOWN], text_columns=(0, 1), wrap=(1,))
        sections.append(Section("Pieces left out", (listed, *more)))
    lead = f"{source}: {len(found.used)} of {len(found.rows)} pieces were identified by {found.method}."
    return render("Identification piece by piece", lead, sections)


def _over_time(found: Piecewise, each: Combined) -> str:
    rows = [row for row in found.used if each.name in row.values]
    hours = np.array([0.5 * (row.begin + row.end) for row in rows]) / 3600.0
    values = np.array([row.values[each.name] for row in rows])
    half = np.array([row.half(each.name) for row in rows])
    ends = np.array([found.rows[0].begin, found.rows[-1].end]) / 3600.0
    curves = [Curve("mean", ends, np.full(2, each.value), "after")]
    if np.isfinite(each.drift):
        middle = float(np.mean(hours[np.isfinite(half) & (half > 0.0)]))
        curves.append(Curve("drift", ends, each.value + each.drift * (ends - middle), "before", dash="dash"))
    plot = scatter_and_curves(None, curves, "time [h]", f"{each.name} [{each.unit}]", height=300)
    bars = {"type": "data", "array": np.nan_to_num(half), "color": COLOURS["measured"], "thickness": 1}
    marker = {"color": COLOURS["measured"], "size": 5}
    plot.add_trace(go.Scatter(x=hours, y=values, error_y=bars, mode="markers", marker=marker, name="pieces"))
    return figure(plot, f"{each.name}: each piece with its 95 % interval")
