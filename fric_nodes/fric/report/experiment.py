"""The page of an experiment that conducted itself: what it found, run by run, and how sure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..identification.result import Identification
from ..model_file import model_to_text
from .figures import Curve, scatter_and_curves, stacked
from .identification import significant
from .page import Section, bullets, figure, paragraph, preformatted, render, table, tiles

if TYPE_CHECKING:
    from ..experiment.conductor import Outcome
    from ..experiment.knowledge import Run

__all__ = ["experiment_report"]

_NAMES = {
    "inertia": "mass",
    "damping": "viscous.coefficient",
    "stiffness": "stiffness.stiffness",
    "dry friction": "coulomb.force",
}


def _text(found: Identification | None, name: str) -> str:
    if found is None or name not in found.model.names:
        return "none"
    error = found.model.standard_errors.get(name)
    sure = f" ± {significant(error, 2)}" if error is not None else ""
    return f"{significant(found.model.value(name))}{sure}"


def _headline(outcome: Outcome) -> str:
    best = outcome.knowledge.best
    runs = len(outcome.knowledge.runs)
    if best is None:
        return f"{runs} runs, and nothing could be identified: {outcome.end.reason}."
    parts = [f"{what} {_text(best, name)} {best.model.unit(name)}" for what, name in _NAMES.items() if name in best.model.names]
    return f"From {runs} runs: {', '.join(parts)}. It ended because {outcome.end.reason}."


def _findings(outcome: Outcome) -> Section:
    known = outcome.knowledge
    both = [found for found in (known.oscillation, known.dynamics) if found is not None]
    if not both:
        return Section("What was found", (paragraph(f"Nothing: {known.trouble}."),))
    rows = [
        (what, *(_text(found, name) for found in both), both[0].model.unit(name))
        for what, name in _NAMES.items()
        if name in both[0].model.names
    ]
    head = ("", *(found.method for found in both), "unit")
    best = known.best
    assert best is not None
    note = (
        f"model.yaml holds the result of {best.method}. The oscillations are described by one damping and one dry friction;"
        " prediction error weighs the force at every speed. Where the two differ by more than their errors, friction is more"
        " than that."
    )
    blocks = [table(head, rows, text_columns=(0, len(both) + 1)), paragraph(note, "note")]
    warnings = [f"{found.method}: {warning}" for found in both for warning in found.warnings]
    return Section("What was found", (*blocks, bullets(warnings)) if warnings else tuple(blocks))


def _row(run: Run, forced: bool) -> tuple[str, ...]:
    setting = run.setting

    def shown(value: float, digits: int = 4) -> str:
        return significant(value, digits) if math.isfinite(value) else "-"

    acting = () if forced else (shown(run.gains[0]), shown(run.gains[1], 3))
    return (
        str(run.number),
        shown(setting.proportional),
        shown(setting.derivative, 3),
        *acting,
        shown(setting.force, 3) if forced else shown(setting.deflection, 3),
        shown(run.frequency, 5),
        *(() if forced else (shown(run.damping, 3),)),
        "used" if not run.problem else "left out",
    )


def _runs(outcome: Outcome) -> Section:
    runs = outcome.knowledge.runs
    units = runs[0].record.units
    x, f = units.position, units.force
    blocks = []
    for kind, heads in (
        ("free oscillation", ("P acting", "D acting", f"from [{x}]", "frequency [rad/s]", "damping ratio")),
        ("forced run", (f"force [{f}]", "frequency [rad/s]")),
    ):
        rows = [_row(run, kind == "forced run") for run in runs if run.setting.kind == kind]
        head = (kind, f"P [{f}/{x}]", f"D [{f} s/{x}]", *heads, "")
        if rows:
            blocks.append(table(head, rows, text_columns=(0, len(head) - 1)))
    note = (
        "P and D acting are the gains estimated from the recorded force. They include the delay of sampling and drive: a delay"
        " T reduces the damping by P T."
    )
    problems = [f"run {run.number} is left out: {run.problem}" for run in runs if run.problem]
    more = (bullets(problems),) if problems else ()
    return Section("Run by run", (*blocks, *more, paragraph(note, "note")))


def _line(outcome: Outcome) -> list[Section]:
    """The squared frequencies over the gains, which one mass and one spring put on a straight line."""
    used = [run for run in outcome.knowledge.usable if math.isfinite(run.gains[0])]
    found = outcome.knowledge.oscillation
    if len(used) < 2 or found is None:
        return []
    gains = np.array([run.gains[0] for run in used])
    squares = np.array([run.frequency**2 for run in used])
    mass = found.model.value("mass")
    stiffness = found.model.value("stiffness.stiffness") if "stiffness.stiffness" in found.model.names else 0.0
    grid = np.linspace(min(0.0, float(gains.min())), 1.05 * float(gains.max()), 50)
    units = used[0].record.units
    plot = scatter_and_curves(
        None,
        [Curve("one mass, one spring", grid, (stiffness + grid) / mass, "after")],
        f"P acting [{units.force}/{units.position}]",
        "squared natural frequency [1/s²]",
    )
    plot.add_scatter(
        x=gains, y=squares, mode="markers", name="runs", marker={"size": 9, "color": "#c4522d"},
        text=[f"run {run.number}" for run in used],
    )  # fmt: skip
    off = 100.0 * np.max(np.abs(squares * mass / (stiffness + gains) - 1.0))
    note = f"Slope 1/m, intercept k/m. The runs lie within {significant(float(off), 2)} % of the line."
    return [Section("Frequency over gain", (figure(plot, note),))]


def _motions(outcome: Outcome) -> Section:
    runs = outcome.knowledge.runs
    shown = [runs[k] for k in sorted({0, len(runs) // 2, len(runs) - 1})] if runs else []
    units = shown[0].record.units
    colours = ("before", "after", "second")
    panels = [
        (f"position [{units.position}]", [_curve(run, run.record.position, c) for run, c in zip(shown, colours, strict=False)]),
        (f"force [{units.force}]", [_curve(run, run.record.effort, c) for run, c in zip(shown, colours, strict=False)]),
    ]
    note = "Time from the release, or from where a forced run counts as steady. Every run is a bag of its own in this folder."
    return Section("Motion and force", (figure(stacked(panels, "time [s]"), note),))


def _curve(run: Run, values: np.ndarray, colour: str) -> Curve:
    return Curve(f"run {run.number}", run.record.time - run.span[0], values, colour)


def experiment_report(outcome: Outcome) -> str:
    """The page as text."""
    known = outcome.knowledge
    best = known.best
    errors = known.relative_errors()
    figures = [(str(len(known.usable)), f"of {len(known.runs)} runs used")]
    figures += [(f"{100 * value:.2g} %", f"relative standard error of the {what}") for what, value in errors.items()]
    sections = [Section("", (tiles(figures),)), _findings(outcome)]
    if known.runs:
        sections += [_runs(outcome), *_line(outcome), _motions(outcome)]
    sections.append(Section("What happened", (bullets(outcome.messages),)))
    if best is not None:
        sections.append(Section("model.yaml", (preformatted(model_to_text(best.model)),)))
    return render("An experiment on the axis", _headline(outcome), sections)
