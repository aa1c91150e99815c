"""The plots of the reports, drawn with plotly: zoomable on screen, plain on paper.

Long signals are thinned to the smallest and largest value of each of a few thousand slots, which keeps every peak visible.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from ..record import Array

__all__ = ["COLOURS", "Curve", "in_parts", "scatter_and_curves", "shaded", "stacked", "thinned"]

COLOURS: Mapping[str, str] = {
    "measured": "#8593a3",
    "before": "#c4522d",
    "after": "#1f6fb2",
    "true": "#1d2733",
    "reference": "#5b6b7c",
    "second": "#2c9a6a",
}
_SLOTS = 2000
_GAP = 50.0  # samples without any, after which a line breaks


@dataclass(frozen=True, eq=False)
class Curve:
    """One line: ``x`` and ``y`` of shape ``(n,)``, a name and a colour of :data:`COLOURS`."""

    name: str
    x: Array
    y: Array
    colour: str
    dash: str = "solid"
    width: float = 1.4


def in_parts(x: Array, y: Array) -> tuple[Array, Array]:
    """``x`` and ``y`` thinned, with a break (NaN) where an ``x`` that always grows does so by far more than else."""
    step = np.diff(x)
    grows = x.shape[0] > 2 and bool(np.all(step > 0.0))
    ends = np.flatnonzero(step > _GAP * np.median(step)) + 1 if grows else np.zeros(0, np.int64)
    parts = [thinned(a, b) for a, b in zip(np.split(x, ends), np.split(y, ends), strict=True)]
    pause = np.array([np.nan])
    joined = [np.concatenate([each for part in parts for each in (part[k], pause)][:-1]) for k in (0, 1)]
    return joined[0], joined[1]


def thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """``x`` and ``y`` with no more than two points (least and greatest) in each of a fixed number of slots."""
    n = x.shape[0]
    if n <= 2 * _SLOTS:
        return x, y
    edges = np.linspace(0, n, _SLOTS + 1).astype(np.int64)
    keep = set()
    for first, last in pairwise(edges.tolist()):
        keep.add(first + int(np.argmin(y[first:last])))
        keep.add(first + int(np.argmax(y[first:last])))
    index = np.array(sorted(keep))
    return x[index], y[index]


def _layout(plot: go.Figure, height: int) -> go.Figure:
    plot.update_layout(
        template="plotly_white",
        height=height,
        margin={"l": 64, "r": 16, "t": 48, "b": 46},  # above, the tools' row and the legend's: neither may cover the other
        font={"family": "system-ui, DejaVu Sans, sans-serif", "size": 13, "color": "#1d2733"},
        legend={"orientation": "h", "yanchor": "bottom", "y": 1.0, "x": 0.0},
        modebar={"bgcolor": "rgba(255, 255, 255, 0)"},
        hovermode="closest",
    )
    plot.update_xaxes(gridcolor="#e8edf2", zerolinecolor="#c9d2dc")
    plot.update_yaxes(gridcolor="#e8edf2", zerolinecolor="#c9d2dc")
    return plot


def _line(curve: Curve, thin: bool = True) -> go.Scattergl | go.Scatter:
    x, y = in_parts(curve.x, curve.y) if thin else (curve.x, curve.y)
    style = {"color": COLOURS[curve.colour], "width": curve.width, "dash": curve.dash}
    return go.Scatter(x=x, y=y, mode="lines", name=curve.name, line=style)


def stacked(panels: Sequence[tuple[str, Sequence[Curve]]], x_label: str, height: int = 220) -> go.Figure:
    """Panels one above the other over a common x axis, each ``(y label, curves)``."""
    plot = make_subplots(rows=len(panels), cols=1, shared_xaxes=True, vertical_spacing=0.05)
    named: set[str] = set()
    for row, (label, curves) in enumerate(panels, start=1):
        for curve in curves:
            line = _line(curve)
            line.legendgroup = curve.name
            line.showlegend = curve.name not in named
            named.add(curve.name)
            plot.add_trace(line, row=row, col=1)
        plot.update_yaxes(title_text=label, row=row, col=1)
    plot.update_xaxes(title_text=x_label, row=len(panels), col=1)
    return _layout(plot, 80 + height * len(panels))


def shaded(plot: go.Figure, spans: Iterable[tuple[float, float]]) -> go.Figure:
    """``plot`` with the ``spans`` of its x axis shaded in every panel.

    All at once: the library's own way looks through the figure for each span anew, which took most of a report's time.
    """
    look = {
        "type": "rect",
        "y0": 0,
        "y1": 1,
        "fillcolor": COLOURS["before"],
        "opacity": 0.13,
        "layer": "below",
        "line_width": 0,
    }
    panels = sorted({(trace.xaxis or "x", trace.yaxis or "y") for trace in plot.data})
    plot.layout.shapes = [
        {**look, "xref": x, "yref": f"{y} domain", "x0": first, "x1": last} for first, last in spans for x, y in panels
    ]
    return plot


def scatter_and_curves(
    points: tuple[str, Array, Array] | None,
    curves: Sequence[Curve],
    x_label: str,
    y_label: str,
    height: int = 420,
    size: int = 3,
) -> go.Figure:
    """A cloud of measured points with curves over it; curves aren't thinned."""
    plot = go.Figure()
    if points is not None:
        name, x, y = points
        step = max(x.shape[0] // 4000, 1)
        marker = {"size": size, "color": COLOURS["measured"], "opacity": 0.45 if size < 5 else 0.9}
        plot.add_trace(go.Scatter(x=x[::step], y=y[::step], mode="markers", name=name, marker=marker))
    for curve in curves:
        plot.add_trace(_line(curve, thin=False))
    plot.update_xaxes(title_text=x_label)
    plot.update_yaxes(title_text=y_label)
    return _layout(plot, height)
