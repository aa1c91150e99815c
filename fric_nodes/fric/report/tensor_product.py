"""The report of tensor-product friction: the map with its intervals, vertices and weights, how the cells were chosen."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from ..identification.methods.tensor_product import TensorProductIdentification
from ..model_file import model_to_text
from .figures import COLOURS, Curve, scatter_and_curves
from .identification import parameter_table, significant
from .kind import Report
from .page import Section, bullets, figure, paragraph, preformatted, render, table, tiles

__all__ = ["REPORT", "tensor_product_report"]

_STYLES = {True: ("after", "speeding up"), False: ("before", "slowing down"), None: ("after", "both branches")}
_SHOWN = 10


def _map_section(found: TensorProductIdentification) -> Section:
    assert found.law is not None
    assert found.samples is not None
    units, samples = found.model.units, found.samples
    cloud = ("samples", samples.velocity, samples.friction)
    plot = scatter_and_curves(cloud, [], f"velocity [{units.position}/s]", f"friction [{units.force}]")
    for branch in found.branches:
        colour, name = _STYLES[branch.speeding_up]
        for side in (1.0, -1.0):
            if branch.side not in (side, 0.0) or not np.any(samples.velocity * side > 0.0):
                continue
            half = np.where(np.isfinite(branch.error), branch.half_width(), 0.0)
            bars = {"type": "data", "array": half if side > 0 else half[::-1], "thickness": 1.2, "width": 3}
            x, y = (side * values if side > 0 else -values[::-1] for values in (branch.speed, branch.force))
            label = f"{name}, 95 %" + ("" if branch.side == 0.0 else ", forward" if side > 0 else ", backward")
            shown = bool(side > 0 or branch.side != 0.0 or not np.any(samples.velocity > 0.0))
            style = {"color": COLOURS[colour], "width": 1.6}
            plot.add_trace(go.Scatter(x=x, y=y, error_y=bars, mode="lines+markers", name=label, line=style, showlegend=shown))
    caption = (
        "Grid points: mean friction of each cell of speed, with intervals from the scatter over slips or strokes. Between them"
        " the map is a straight line; below the innermost one friction is held."
    )
    return Section("Friction map", (figure(plot, caption),))


def _vertex_section(found: TensorProductIdentification) -> Section:
    assert found.law is not None
    law, units = found.law, found.model.units
    rows, curves = [], []
    for branch, name, colours in (
        (law.speeding_up, "speeding up", ("after", "second")),
        (law.slowing_down, "slowing down", ("before", "reference")),
    ):
        grid = branch.grids[0]
        for k, (value, colour) in enumerate(zip(branch.vertices[:, 0, 0].tolist(), colours, strict=False), start=1):
            rows.append((name, f"a_{k}", significant(value), f"{grid[np.argmax(branch.weights[0][:, k - 1])]:.3g}"))
            dash = "solid" if name == "speeding up" else "dot"
            curves.append(Curve(f"w_{k}, {name}", grid, branch.weights[0][:, k - 1], colour, dash))
    plot = scatter_and_curves(None, curves, f"velocity [{units.position}/s]", "weight", 320)
    head = ("branch", "vertex", "value [1/s]", f"weighs most at [{units.position}/s]")
    text = "a_22(v) = -F(v)/(m v) as a combination of constant vertices, with weights that sum to one and are never negative."
    return Section("Vertices and weights", (paragraph(text), table(head, rows, text_columns=(0, 1)), figure(plot, "Weights.")))


def _choice_section(found: TensorProductIdentification) -> Section:
    unit = found.model.units.force
    rows = [
        (
            trial.candidate.text + (" (chosen)" if trial is found.chosen else ""),
            str(trial.n_points),
            significant(trial.error, 4),
        )
        for trial in found.trials
        if trial is found.chosen or trial in found.trials[:_SHOWN]
    ]
    text = (
        "Each candidate is fitted to three quarters of the slips or strokes and scored on the last one, in turn. Of those"
        " that aren't worse than the best by more than a standard error, the simplest is taken."
    )
    return Section("Choice of the cells", (paragraph(text), table(("grid", "points", f"held-out error [{unit}]"), rows)))


def tensor_product_report(found: TensorProductIdentification) -> str:
    """The page as text."""
    assert found.samples is not None
    assert found.chosen is not None
    units = found.model.units
    slowest = min(float(branch.speed[0]) for branch in found.branches)
    entries = [
        (str(found.chosen.n_points), "grid points"),
        (f"{significant(found.chosen.error, 3)} {units.force}", "force error on samples held out"),
        (f"{significant(slowest, 2)} {units.position}/s", "slowest grid point"),
        (str(int(np.unique(found.samples.block).shape[0])), "slips or stretches of motion"),
    ]
    note = "The law of effects nearest to the map, which plant and compensator run; the map itself is in tensor_product.yaml."
    sections = [
        Section("", (tiles(entries), paragraph(f"Status: {found.status}."))),
        _map_section(found),
        Section("Law through the map", (paragraph(note), parameter_table(found))),
        _vertex_section(found),
        _choice_section(found),
        Section("What to know", (bullets([*found.warnings, *found.notes]),)),
        Section("Model file", (preformatted(model_to_text(found.model)),)),
    ]
    lead = f"Tensor-product friction of '{found.model.joint}', directly from measured data."
    return render(f"Tensor-product friction of '{found.model.joint}'", lead, sections)


REPORT = Report(TensorProductIdentification, lambda found, train, validation, options: tensor_product_report(found))
