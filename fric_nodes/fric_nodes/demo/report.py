"""The page of the demonstration: what was done, what was found, what it gained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from fric.identification.result import Identification
from fric.model import Model
from fric.record import Array
from fric.report.figures import Curve, scatter_and_curves, stacked
from fric.report.identification import friction_curve, significant
from fric.report.page import Section, bullets, figure, paragraph, preformatted, render, table, tiles

if TYPE_CHECKING:
    from .outcome import Run

__all__ = ["DemoOutcome", "demo_report"]


@dataclass(frozen=True, eq=False)
class DemoOutcome:
    """All that the page shows.

    Attributes:
        clock: ``lock-step`` or ``wall``.
        period: sample time [s].
        truth: the simulated axis.
        result: the identification from the first recording.
        excitation: the recording that was identified from, under the PID alone.
        before: the contour with the PID alone.
        after: the same contour with the identified model fed forward.
        margins: of the PID loop, text by name.
        gains: of the PID, text by name.
        commands: how to repeat the steps by hand.
        rate: lock-step samples per second of wall time; None in wall time.
    """

    clock: str
    period: float
    truth: Model
    result: Identification
    excitation: Run
    before: Run
    after: Run
    margins: Mapping[str, str]
    gains: Mapping[str, str]
    commands: Sequence[str]
    rate: float | None


def micrometres(metres: float) -> str:
    """A length as text in a unit that reads well."""
    return f"{1e6 * metres:.3g} µm" if metres < 1e-3 else f"{1e3 * metres:.3g} mm"


def _headline(outcome: DemoOutcome) -> str:
    return (
        f"With the friction model identified from one recording, the tracking error along a contour that this recording did "
        f"not contain falls from {micrometres(outcome.before.rms)} to {micrometres(outcome.after.rms)} RMS: "
        f"{outcome.before.rms / outcome.after.rms:.0f} times less."
    )


def _tracking(before: Run, after: Run) -> Section:
    assert before.record.reference is not None
    plot = stacked(
        [
            ("position [mm]", [Curve("reference", before.record.time, 1e3 * before.record.reference, "reference")]),
            (
                "tracking error [µm]",
                [
                    Curve("PID alone", before.record.time, 1e6 * before.error, "before"),
                    Curve("PID with identified friction model", after.record.time, 1e6 * after.error, "after"),
                ],
            ),
            (
                "force [N]",
                [
                    Curve("PID alone", before.record.time, before.record.effort, "before"),
                    Curve("PID with identified friction model", after.record.time, after.record.effort, "after"),
                ],
            ),
        ],
        "time [s]",
    )
    rows = [
        (name, micrometres(run.rms), micrometres(run.peak), str(run.record.n_samples), str(run.missed))
        for name, run in (("PID alone", before), ("PID with identified friction model", after))
    ]
    head = ("", "RMS error", "largest error", "samples", "missed deadlines")
    note = "Zoom with the mouse; double click to go back."
    return Section("Tracking, before and after", (table(head, rows), figure(plot, note)))


def _excitation(outcome: DemoOutcome) -> Section:
    record = outcome.excitation.record
    plot = stacked(
        [
            ("position [mm]", [Curve("position", record.time, 1e3 * record.position, "reference")]),
            ("force [N]", [Curve("force", record.time, record.effort, "second")]),
        ],
        "time [s]",
        170,
    )
    note = (
        "Slow reversals through the Stribeck range, moves from rest, and a multisine, under the PID alone. Position and force "
        f"of this recording are all that the identification was given: {outcome.excitation.bag}."
    )
    return Section("The recording", (figure(plot, note),))


def _curve(outcome: DemoOutcome) -> Section:
    top = float(np.quantile(np.abs(np.gradient(outcome.excitation.record.position, outcome.period)), 0.999))
    side = np.geomspace(1e-4 * top, top, 300)
    grid: Array = np.concatenate([-side[::-1], side])
    plot = scatter_and_curves(
        None,
        [
            Curve("identified", 1e3 * grid, friction_curve(outcome.result.model, grid), "after", width=3.0),
            Curve("true", 1e3 * grid, friction_curve(outcome.truth, grid), "true", "dash", 1.4),
        ],
        "velocity [mm/s]",
        "friction and bias force [N]",
    )
    off = friction_curve(outcome.result.model, grid) - friction_curve(outcome.truth, grid)
    note = f"Largest difference between the two curves: {significant(float(np.max(np.abs(off))), 2)} N."
    return Section("Friction curve, found and true", (figure(plot, note),))


def _parameters(outcome: DemoOutcome) -> Section:
    model = outcome.result.model
    true = {p.name: p.value for p in outcome.truth.parameters()}
    rows = []
    for p in model.parameters():
        error = model.standard_errors.get(p.name)
        rows.append(
            (
                p.name,
                significant(p.value),
                significant(error, 2) if error is not None else "held",
                significant(true[p.name]) if p.name in true else "none",
                p.declaration.unit(model.units),
            )
        )
    blocks = [table(("parameter", "identified", "standard error", "true", "unit"), rows, text_columns=(0, 4))]
    blocks.append(paragraph(f"Status: {outcome.result.status}."))
    if outcome.result.warnings:
        blocks.append(bullets(outcome.result.warnings))
    return Section("Parameters", tuple(blocks))


def _clock(outcome: DemoOutcome) -> str:
    rate = 1.0 / outcome.period
    if outcome.clock == "lock-step":
        text = f"Lock-step at {rate:.0f} Hz: the plant waits for every command, and the result doesn't depend on the machine."
        return text + (f" {outcome.rate:.0f} samples per second of wall time were reached." if outcome.rate else "")
    missed, n_samples = outcome.after.missed, outcome.after.record.n_samples
    return f"Wall time at {rate:.0f} Hz, on this machine as it is: {missed} of {n_samples} deadlines missed in the last run."


def _controller(outcome: DemoOutcome) -> Section:
    text = (
        "The PID has the largest integral gain that keeps the sensitivity within its bound, for the true mass and damping: it "
        "is tuned as well as this axis and its delay allow, and is the same in every run."
    )
    loop = [*outcome.gains.items(), *outcome.margins.items()]
    return Section("The controller it is compared with", (paragraph(text), table(("", ""), loop, text_columns=(0, 1))))


def demo_report(outcome: DemoOutcome) -> str:
    """The page as text."""
    steps = [
        "Five node processes were started for each run: plant, excitation, compensator, PID and recorder.",
        f"The axis was excited under the PID alone, and recorded to {outcome.excitation.bag}.",
        "The friction model was identified from that recording alone, by prediction error, and written to model.yaml.",
        "The axis followed a contour under the PID alone, and again with the model in the compensator.",
    ]
    score = outcome.result.validation or outcome.result.train
    figures = [
        (f"{outcome.before.rms / outcome.after.rms:.0f} ×", "less tracking error, RMS"),
        (micrometres(outcome.before.rms), "RMS error with the PID alone"),
        (micrometres(outcome.after.rms), "RMS error with the identified model"),
        (f"{score.relative_force_error_percent:.2g} %", "relative force error on the contour, not seen by the fit"),
    ]
    sections = [
        Section("", (tiles(figures),)),
        Section("What was done", (bullets(steps), paragraph(_clock(outcome), "note"))),
        _tracking(outcome.before, outcome.after),
        _excitation(outcome),
        _curve(outcome),
        _parameters(outcome),
        _controller(outcome),
        Section("By hand", (paragraph("The same steps as commands:"), preformatted("\n".join(outcome.commands)))),
    ]
    return render("Friction found and compensated", _headline(outcome), sections)
