"""The report of static maps: friction over velocity or load, pre-sliding, break-away, stick-slip, each with its intervals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from ..identification.static_maps.curve import Curve as FrictionCurve
from ..identification.static_maps.presliding import LEVELS, SHARE
from ..identification.static_maps.result import StaticMap
from ..identification.static_maps.verdict import stribeck_sentence
from ..model_file import model_to_text
from ..record import Array
from .figures import COLOURS, Curve, scatter_and_curves
from .identification import parameter_table, significant
from .kind import Report
from .page import Section, bullets, figure, paragraph, preformatted, render, table, tiles

__all__ = ["REPORT", "static_map_report"]

_QUANTILE = 1.96
_SHOWN_REVERSALS = 12
_SHADES = ("#1f6fb2", "#c4522d", "#2c9a6a", "#8a5fb0", "#b58a1c", "#3a8ea5", "#a8456b", "#5b6b7c")


def _band(plot: go.Figure, x: Array, low: Array, high: Array, name: str) -> None:
    outline = {"x": np.concatenate([x, x[::-1]]), "y": np.concatenate([high, low[::-1]])}
    style = {"fill": "toself", "fillcolor": "rgba(31,111,178,0.16)", "line": {"width": 0}}
    plot.add_trace(go.Scatter(**outline, **style, name=name, mode="lines", hoverinfo="skip", showlegend=bool(name)))


def _points(plot: go.Figure, name: str, x: Array, y: Array, half: Array, colour: str = "") -> None:
    """Markers with error bars."""
    colour = colour or COLOURS["true"]
    bars = {"type": "data", "array": half, "thickness": 1.2, "width": 3}
    plot.add_trace(go.Scatter(x=x, y=y, error_y=bars, mode="markers", name=name, marker={"size": 6, "color": colour}))


def _curve_section(found: StaticMap) -> Section:
    assert found.choice is not None
    units, choice = found.model.units, found.choice
    velocity = np.array([mean.velocity for mean in found.means])
    force = np.array([mean.friction for mean in found.means])
    half = _QUANTILE * np.hypot([mean.force[1] for mean in found.means], choice.best.scatter)
    plot = scatter_and_curves(None, [], f"speed [{units.position}/s]", f"force in the direction of motion [{units.force}]")
    fitted: tuple[tuple[FrictionCurve | None, str, str], ...] = (
        (choice.best, "chosen", "solid"),
        (choice.rival, "rival", "dash"),
    )
    for sign, side, colour in ((1.0, "forward", "after"), (-1.0, "backward", "before")):
        own = velocity * sign > 0
        speeds = np.abs(velocity[own])
        if speeds.size and np.ptp(speeds) > 0.1 * np.max(speeds):
            grid = np.geomspace(min(0.02 * float(np.max(speeds)), float(np.min(speeds))), np.max(speeds), 200)
            middle, width = sign * choice.best.force(sign * grid), choice.best.half_width(sign * grid)
            _band(plot, grid, middle - width, middle + width, "95 % of the chosen curve" if sign > 0 else "")
            for curve, name, dash in fitted:
                if curve is not None:
                    style = {"color": COLOURS[colour], "width": 2.0 if dash == "solid" else 1.4, "dash": dash}
                    label = f"{name}: {curve.candidate.title}" if sign > 0 else ""
                    y = sign * curve.force(sign * grid)
                    plot.add_trace(go.Scatter(x=grid, y=y, mode="lines", line=style, name=label, showlegend=sign > 0))
        _points(plot, f"settled parts {side}, 95 %", speeds, sign * force[own], half[own], COLOURS[colour])
    scatter = (
        f"{significant(choice.best.scatter, 2)} {units.force}"
        if choice.best.scatter
        else "none beyond the errors of the points"
    )
    caption = (
        "Mean force of the settled parts at constant velocity, with intervals from the correlation of the force in time and "
        f"what the curve leaves beyond that ({scatter}). Dashed: the best curve of the other kind, with or without a Stribeck "
        "effect. The two directions are a bias force apart."
    )
    blocks = [paragraph(stribeck_sentence(choice) + "."), figure(plot, caption)]
    if len(choice.all) > 1:
        least = choice.best.criterion
        rows = [
            (
                curve.candidate.title,
                str(len(curve.candidate.names)),
                f"{curve.cost:.3g}",
                f"{curve.criterion - least:+.2f}" if curve is not choice.best else "chosen",
            )
            for curve in choice.all[:8]
        ]
        blocks.append(table(("curve", "parameters", "weighted squares", "AICc less the chosen's"), rows, wrap=(0,)))
    return Section("Friction over velocity", tuple(blocks))


def _load_section(found: StaticMap) -> Section:
    assert found.loads is not None
    units, law = found.model.units, found.loads
    scale, unit = (1e-5, "bar") if found.load_unit == "Pa" else (1.0, found.load_unit)
    load = np.array([point.load for point in law.points])
    friction = np.array([point.friction[0] for point in law.points])
    half = np.array([point.interval()[1] - point.friction[0] for point in law.points])
    plot = scatter_and_curves(None, [], f"load [{unit}]", f"friction [{units.force}]")
    blocks = []
    if law.line is not None:
        grid = np.linspace(0.0, 1.08 * float(np.max(load)), 100)
        middle, width = law.line.at(grid)
        style = {"color": COLOURS["after"], "width": 2.2}
        plot.add_trace(go.Scatter(x=scale * grid, y=middle, mode="lines", name="F_0 + mu N", line=style))
        _band(plot, scale * grid, middle - width, middle + width, "95 % of the line")
        fitted = []
        for name, value, dimension, factor in (
            ("friction without load F_0", law.line.intercept, units.force, 1.0),
            ("friction per load mu", law.line.slope, f"{units.force}/{unit}", 1.0 / scale),
        ):
            low, high = law.line.interval(value)
            text = (
                significant(factor * value[0]),
                f"{significant(factor * low, 3)} to {significant(factor * high, 3)}",
                dimension,
            )
            fitted.append((name, *text))
        blocks.append(table(("", "value", "95 %", "unit"), fitted, text_columns=(0, 3)))
        if law.line.scatter > float(np.median(half)):
            blocks.append(
                paragraph("The points scatter about the line by more than their intervals: friction isn't linear in the load.")
            )
    _points(plot, "half the difference of both directions, 95 %", scale * load, friction, half)
    caption = (
        "Friction at each load: half the difference of the forces forward and backward, free of what pushes alike in both."
    )
    head = (f"load [{unit}]", f"friction [{units.force}]", "95 %", f"bias [{units.force}]", f"speeds [{units.position}/s]")
    rows = []
    for point in law.points:
        low, high = point.interval()
        interval = f"{significant(low, 3)} to {significant(high, 3)}"
        speeds = f"{significant(point.speeds[0], 3)}, {significant(point.speeds[1], 3)}"
        rows.append(
            (f"{scale * point.load:.3g}", significant(point.friction[0]), interval, significant(point.bias[0], 3), speeds)
        )
    return Section("Friction over load", (figure(plot, caption), *blocks, table(head, rows, text_columns=())))


def _presliding_section(found: StaticMap) -> Section:
    units = found.model.units
    micro = 1e6 if units.position == "m" else 1e3
    small = "um" if units.position == "m" else "mrad"
    plot = scatter_and_curves(None, [], f"way from the turning point [{small}]", f"change of force [{units.force}]")
    shown = 0
    by_source = dict(zip(found.sources, found.reversals, strict=True))
    for k, each in enumerate(found.presliding):
        colour = _SHADES[k % len(_SHADES)]
        own = [turn for turn in by_source[each.source] if turn.direction == each.direction]
        for turn in own[:: max(len(own) // _SHOWN_REVERSALS, 1)]:
            style = {"color": colour, "width": 0.7}
            plot.add_trace(
                go.Scatter(
                    x=micro * turn.way, y=turn.change * turn.share, mode="lines", line=style, opacity=0.35, showlegend=False
                )
            )
            shown += 1
        name = f"{Path(each.source).stem} {'forward' if each.direction > 0 else 'backward'}"
        x, y = micro * each.ways, LEVELS * each.change[0]
        style = {"color": colour, "width": 2.4}
        plot.add_trace(go.Scatter(x=x, y=y, mode="lines", line=style, name=name))
        low, high = each.interval(each.distance)
        bars = {"type": "data", "array": [micro * (high - each.distance[0])], "thickness": 1.4}
        marker = {"size": 8, "color": colour}
        at = {"x": [micro * each.distance[0]], "y": [SHARE * each.change[0]], "error_x": bars, "marker": marker}
        plot.add_trace(go.Scatter(**at, mode="markers", showlegend=False))
    caption = (
        f"Reversals ({shown} drawn thin) and their means; dots: break-away, 90 % of what the force comes to, "
        "with the 95 % interval of the distance."
    )
    head = ("recording", "way", "n", f"distance [{small}]", "95 %", f"half of it [{small}]", f"change [{units.force}]")
    rows = []
    for each in found.presliding:
        low, high = each.interval(each.distance)
        rows.append(
            (
                Path(each.source).stem,
                "forward" if each.direction > 0 else "backward",
                str(each.n),
                significant(micro * each.distance[0], 3),
                f"{significant(micro * low, 3)} to {significant(micro * high, 3)}",
                significant(micro * each.half[0], 3),
                significant(each.change[0], 3),
            )
        )
    blocks = [
        figure(plot, caption),
        table((*head, f"stiffness at first [{units.force}/{small}]"), _with_stiffness(found, rows, micro)),
    ]
    if found.compliance is not None:
        text = found.compliance.text
        blocks.append(paragraph(text[0].upper() + text[1:] + "."))
        if np.isfinite(found.compliance.misfit):
            blocks.append(
                figure(_compliance_plot(found, micro, small), "A rig in series adds a way in proportion to the force.")
            )
    return Section("Pre-sliding", tuple(blocks))


def _with_stiffness(found: StaticMap, rows: Sequence[tuple[str, ...]], micro: float) -> list[tuple[str, ...]]:
    cells = []
    for each in found.presliding:
        value, error = (part / micro for part in each.stiffness)
        cells.append("too coarse" if each.coarse or not np.isfinite(value) else f"{value:.3g} +- {error:.1g}")
    return [(*row, cell) for row, cell in zip(rows, cells, strict=True)]


def _compliance_plot(found: StaticMap, micro: float, small: str) -> go.Figure:
    assert found.compliance is not None
    units = found.model.units
    change = np.array([each.change[0] for each in found.presliding])
    grid = np.linspace(0.0, 1.05 * float(np.max(change)), 50)
    line = found.compliance.distance[0] + SHARE * found.compliance.compliance[0] * grid
    curves = [
        Curve("distance of the contact + compliance of the rig x force, mean of both directions", grid, micro * line, "after")
    ]
    plot = scatter_and_curves(None, curves, f"change of force [{units.force}]", f"break-away distance [{small}]", 340)
    for sign, name, colour in ((1.0, "forward, 95 %", "true"), (-1.0, "backward, 95 %", "before")):
        own = [each for each in found.presliding if each.direction == sign]
        half = micro * np.array([each.interval(each.distance)[1] - each.distance[0] for each in own])
        x = np.array([each.change[0] for each in own])
        _points(plot, name, x, micro * np.array([each.distance[0] for each in own]), half, COLOURS[colour])
    return plot


def _break_away_section(found: StaticMap) -> Section:
    units = found.model.units
    rows = []
    for start in found.break_away:
        kind = "led by the drive: largest force on the way" if start.led else "at the onset"
        side = "forward" if start.direction > 0 else "backward"
        force = (significant(start.force[0]), significant(start.force[1], 2))
        rows.append((Path(start.source).stem, side, str(start.n), *force, f"{start.rest:.3g}", kind))
    head = ("recording", "direction", "n", f"force [{units.force}]", "standard error", "rest before [s]", "taken")
    return Section("Break-away after rest", (table(head, rows, text_columns=(0, 1, 6)),))


def _stick_slip_section(found: StaticMap) -> Section:
    units = found.model.units
    plot = scatter_and_curves(None, [], f"speed [{units.position}/s]", f"friction in the direction of motion [{units.force}]")
    lines = []
    for k in found.slips:
        side = "forward" if k.direction > 0 else "backward"
        for branch, y, e, colour in (
            ("speeding up", k.rising, k.rising_error, "after"),
            ("slowing down", k.falling, k.falling_error, "before"),
        ):
            _points(plot, f"{side}, {branch}, 95 %", k.speed, y, _QUANTILE * e, COLOURS[colour])
        lines.append(
            f"{side}: {k.n} slips; speeding up lies above slowing down by {k.loop[0]:.3g} +- {k.loop[1]:.2g} {units.force} on"
            f" average; break-away at {k.break_away[0]:.4g} +- {k.break_away[1]:.2g} {units.force}"
        )
    caption = "Force less mass times acceleration over the integral of the acceleration, averaged over the slips."
    return Section("Stick-slip", (figure(plot, caption), bullets(lines)))


def static_map_report(found: StaticMap) -> str:
    """The page as text."""
    units = found.model.units
    entries = []
    if found.choice is not None:
        entries.append((found.choice.best.candidate.title, "the friction curve, chosen by the method"))
    if found.several_loads and found.loads is not None:
        entries.append((str(len(found.loads.points)), "loads with both directions"))
    entries.append(
        (str(sum(mean.n for mean in found.means)), f"settled parts at {len(found.means)} speeds, directions and recordings")
    )
    if found.presliding:
        distance = float(np.mean([each.distance[0] for each in found.presliding]))
        entries.append((f"{significant(distance, 3)} {units.position}", "mean break-away distance, rig included"))
    sections = [Section("", (tiles(entries), paragraph(f"Status: {found.status}.")))]
    if found.model.terms:
        sections.append(Section("Parameters", (parameter_table(found),)))
    if found.choice is not None:
        sections.append(_curve_section(found))
    if found.several_loads:
        sections.append(_load_section(found))
    if found.presliding:
        sections.append(_presliding_section(found))
    if found.break_away:
        sections.append(_break_away_section(found))
    if found.slips:
        sections.append(_stick_slip_section(found))
    remarks = [*found.warnings, *found.notes]
    if remarks:
        sections.append(Section("What to know", (bullets(remarks),)))
    sections.append(Section("Model file", (preformatted(model_to_text(found.model)),)))
    lead = f"Static maps of '{found.model.joint}' from {len(found.sources)} recording(s)."
    return render(f"Static maps of '{found.model.joint}'", lead, sections)


REPORT = Report(StaticMap, lambda found, train, validation, options: static_map_report(found))
