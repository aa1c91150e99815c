"""The page of a comparison: gains of all methods on all axes, every figure of every axis, and the errors at reversals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from ...report.figures import COLOURS, Curve, stacked
from ...report.page import Section, bullets, figure, paragraph, preformatted, render, table, tiles
from .catalogue import AXES
from .circle import circle_plot, rounds
from .competition import Cell, interval, text_of

__all__ = ["circle_section", "competition_page", "gains", "text_of_gain"]

_SHOWN = 4  # physical: curves in a plot that an eye tells apart
_HUES = ("before", "measured", "second", "after", "true")


def gains(cells: Sequence[Cell], name: str = "rms") -> dict[tuple[str, str], tuple[float, float, float]]:
    """Geometric mean and interval of the first method's figure over each method's, by axis and method."""
    first: dict[str, Cell] = {}
    found = {}
    for cell in cells:
        base = first.setdefault(cell.axis, cell)
        found[cell.axis, cell.method] = interval(base.values(name) / cell.values(name))
    return found


def text_of_gain(gain: tuple[float, float, float]) -> str:
    """A gain in words; one whose interval holds 1, or that comes from a single seed, doesn't count and is in brackets."""
    middle, low, high = gain
    if not np.isfinite(middle):
        return "–"
    text = f"{middle:.3g}"
    return text if low > 1.0 or high < 1.0 else f"({text})"


def _heat(cells: Sequence[Cell], axes: Sequence[str], methods: Sequence[str]) -> str:
    found = gains(cells)
    missing = (np.nan, np.nan, np.nan)
    z = np.array([[np.log10(found.get((axis, method), missing)[0]) for axis in axes] for method in methods])
    text = [[text_of_gain(found[axis, method]) if (axis, method) in found else "" for axis in axes] for method in methods]
    plot = go.Figure(
        go.Heatmap(
            z=z, x=list(axes), y=list(methods), text=text, texttemplate="%{text}", zmid=0.0, showscale=False,
            colorscale=[[0.0, COLOURS["before"]], [0.5, "#ffffff"], [1.0, COLOURS["after"]]],
            hovertemplate="%{y} on %{x}: %{text}<extra></extra>",
        )
    )  # fmt: skip
    plot.update_layout(
        template="plotly_white",
        height=120 + 26 * len(methods),
        margin={"l": 64, "r": 16, "t": 28, "b": 46},
        font={"family": "system-ui, DejaVu Sans, sans-serif", "size": 13, "color": COLOURS["true"]},
    )
    plot.update_yaxes(autorange="reversed", automargin=True)
    caption = (
        "Tracking RMS of the first method over that of each, geometric mean of the seeds; blue is better. In brackets: the "
        "90 % interval holds 1, or there is one seed only, so that the gain doesn't count."
    )
    return figure(plot, caption)


def _row(cell: Cell, gain: tuple[float, float, float]) -> list[str]:
    good = [each for each in cell.outcomes if not each.failed]
    if not good:
        return [cell.method, cell.outcomes[0].failed, *[""] * 10]
    rms = cell.values("rms")
    middle, low, high = gain
    within = f"{low:.3g} to {high:.3g}" if len(good) > 1 and np.isfinite(middle) else ""
    hunting = sum(each.hunts for each in good)
    unsettled = sum(each.unsettled for each in good)
    return [
        cell.method,
        text_of(cell.values("rms")),
        f"{np.nanmin(rms):.3g} to {np.nanmax(rms):.3g}" if len(good) > 1 else "",
        text_of_gain(gain),
        within,
        text_of(cell.values("without_lag")),
        text_of(cell.values("peak")),
        text_of(cell.values("settling")) + (f", {unsettled} not" if unsettled else ""),
        f"{hunting} of {len(good)}",
        text_of(cell.values("force")),
        text_of(cell.values("power")),
        f"{text_of(100.0 * cell.values('share'))} %",
    ]


def _errors(cells: Sequence[Cell]) -> str | None:
    """The first method, and the best of the others by peak, over the last part of the task."""
    held = [cell for cell in cells if cell.error is not None]
    if not held:
        return None
    others = sorted(held[1:], key=lambda cell: float(np.nanmedian(cell.values("peak"))))
    chosen = [held[0], *others[:: max(len(others) // _SHOWN, 1)][:_SHOWN]]
    curves = [
        Curve(cell.method, cell.error[0], cell.error[1], hue)
        for cell, hue in zip(chosen, _HUES, strict=False)
        if cell.error is not None
    ]
    unit = AXES[cells[0].axis].nominal.units.position
    caption = "Tracking error in the last part of the task, first seed: the first method, and others from the best on."
    return figure(stacked([(f"error [{unit}]", curves)], "time [s]"), caption)


def _axis_section(axis: str, cells: Sequence[Cell], found: dict[tuple[str, str], tuple[float, float, float]]) -> Section:
    held = AXES[axis]
    x, f = held.nominal.units.position, held.nominal.units.force
    head = (
        "method", f"RMS [{x}]", "of the seeds", "gain", "90 %", f"RMS without lag [{x}]", f"peak at reversal [{x}]",
        "settling [s]", "hunts", f"command RMS [{f}]", f"power [{f} {x}/s]", "of the limit",
    )  # fmt: skip
    ordered = sorted(cells, key=lambda cell: -1.0 if np.all(np.isnan(cell.values("rms"))) else -found[axis, cell.method][0])
    rows = [_row(cell, found[axis, cell.method]) for cell in ordered]
    tolerance = f"A move counts as settled within {held.tolerance:g} {x}; an axis hunts whose position still moves at rest."
    blocks = [
        paragraph(f"{held.title}."),
        table(head, rows, text_columns=(0, 2, 4, 7), wrap=(0,)),
        paragraph(tolerance, "note"),
    ]
    plot = _errors(cells)
    return Section(axis, tuple([*blocks, plot] if plot else blocks))


def circle_section(seed: int) -> Section:
    """The circle test of two slides, the first of this seed."""
    plot, caption = circle_plot(rounds(seed, 0.1))
    lead = "Each axis reverses twice in a turn, and friction draws a peak there. Feed 50 mm/s; legend: largest deviation."
    return Section("circle", (paragraph(lead), figure(plot, caption)))


def competition_page(cells: Sequence[Cell], command: str, seconds: float, aged: bool, further: Sequence[Section] = ()) -> str:
    """The page as text.

    Args:
        cells: of the comparison.
        command: by which the reader gets the same page.
        seconds: that it took.
        aged: whether the friction changed after the recording.
        further: sections at the end.
    """
    axes = list(dict.fromkeys(cell.axis for cell in cells))
    methods = list(dict.fromkeys(cell.method for cell in cells))
    found = gains(cells)
    counted = [key for key, (_, low, high) in found.items() if low > 1.0 or high < 1.0]
    seeds = max(len(cell.outcomes) for cell in cells)
    best = []
    for axis in axes:
        good = [cell for cell in cells if cell.axis == axis and np.any(np.isfinite(cell.values("rms")))]
        if not good:
            best.append(f"{axis}: no method follows")
            continue
        top = max(good, key=lambda cell: found[axis, cell.method][0])
        resting = [cell.method for cell in good if not any(each.hunts for each in cell.outcomes if not each.failed)]
        hunting = f"; {len(good) - len(resting)} of {len(good)} hunt at rest on a seed" if len(resting) < len(good) else ""
        best.append(f"{axis}: {top.method}, {text_of_gain(found[axis, top.method])} times below {good[0].method}{hunting}")
    short = (
        tiles(
            (
                (f"{len(methods)} × {len(axes)}", "methods × axes"),
                (str(seeds), "seeds"),
                (f"{len(counted)} of {len(found)}", "gains that count"),
                (f"{seconds / 60.0:.1f} min", "this run"),
            )
        ),
        bullets(best),
        _heat(cells, axes, methods),
        preformatted(command),
    )
    sections = [Section("In short", short)]
    sections += [_axis_section(axis, [cell for cell in cells if cell.axis == axis], found) for axis in axes]
    lead = (
        "Each seed draws every axis within 20 % of its nominal values and records it. Each method is then identified and tuned "
        "from that recording alone"
        + (", and works on the axis after its friction has changed by up to 20 % more." if aged else ".")
    )
    return render("Methods of friction compensation", lead, [*sections, *further])
