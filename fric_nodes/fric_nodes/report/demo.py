"""The page of the demonstration: what was done, what was found, what it gained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..identification.result import Identification
from ..model import Model
from ..record import Array
from .figures import Curve, scatter_and_curves, stacked
from .identification import friction_curve, significant
from .page import Section, bullets, figure, paragraph, preformatted, render, table, tiles

if TYPE_CHECKING:
    from ..demo.outcome import Run

__all__ = ["DemoOutcome", "demo_report"]


@dataclass(frozen=True, eq=False)
class DemoOutcome:
    """All that the page shows.

    Attributes:
        clock: ``lock-step`` or ``wall``.
        period: sample time [s].
        truth: the simulated axis.
        result: the identification from the first recording.
        before: run with the PID alone, which is also the recording that was identified from.
        after: the same motion with the identified model fed forward.
        unseen_before: another motion with the PID alone.
        unseen_after: that motion with the identified model.
        margins: of the PID loop, text by name.
        gains: of the PID, text by name.
        commands: how to repeat the steps by hand.
        rate: lock-step samples per second of wall time; None in wall time.
    """

    clock: str
    period: float
    truth: Model
    result: Identification
    before: Run
    after: Run
    unseen_before: Run
    unseen_after: Run
    margins: Mapping[str, str]
    gains: Mapping[str, str]
    commands: Sequence[str]
    rate: float | None


def micrometres(metres: float) -> str:
    """A length as text in a unit that reads well."""
    return f"{1e6 * metres:.3g} µm" if metres < 1e-3 else f"{1e3 * metres:.3g} mm"


def _gain(before: Run, after: Run) -> float:
    return before.rms / after.rms


def _headline(outcome: DemoOutcome) -> str:
    return (
        f"With the friction model identified from one recording, the tracking error falls from {micrometres(outcome.before.rms)} to "
        f"{micrometres(outcome.after.rms)} RMS, {_gain(outcome.before, outcome.after):.0f} times less; on a motion that the "
        f"identification had not seen, {_gain(outcome.unseen_before, outcome.unseen_after):.0f} times less."
    )


def _tracking(title: str, before: Run, after: Run, note: str) -> Section:
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
    return Section(title, (table(head, rows), figure(plot, note)))


def _curve(outcome: DemoOutcome) -> Section:
    top = float(np.quantile(np.abs(np.gradient(outcome.before.record.position, outcome.period)), 0.999))
    side = np.geomspace(1e-4 * top, top, 300)
    grid: Array = np.concatenate([-side[::-1], side])
    plot = scatter_and_curves(
        None,
        [
            Curve("true", 1e3 * grid, friction_curve(outcome.truth, grid), "true", "dash", 2.0),
            Curve("identified", 1e3 * grid, friction_curve(outcome.result.model, grid), "after", width=2.4),
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


def demo_report(outcome: DemoOutcome) -> str:
    """The page as text."""
    gain, unseen = _gain(outcome.before, outcome.after), _gain(outcome.unseen_before, outcome.unseen_after)
    if outcome.clock == "lock-step":
        clock = f"Lock-step at {1 / outcome.period:.0f} Hz: the plant waits for every command, so that the result doesn't depend on this machine"
        clock += f" ({outcome.rate:.0f} samples per second were reached)." if outcome.rate else "."
    else:
        clock = (
            f"Wall time at {1 / outcome.period:.0f} Hz, on this machine as it is; deadlines missed are counted in the tables."
        )
    steps = [
        "Five node processes were started: plant, excitation, compensator, PID and recorder. The identifier knows nothing of the plant's friction.",
        f"The axis followed a reference under the PID alone; everything was recorded to {outcome.before.bag}.",
        "The friction model was identified from that recording alone, and written to model.yaml.",
        "The compensator got the model, and the motion was repeated.",
        "Both were done again on a motion that the identification had not seen.",
    ]
    loop = [*outcome.gains.items(), *outcome.margins.items()]
    sections = [
        Section(
            "",
            (
                tiles(
                    [
                        (
                            f"{gain:.0f} ×",
                            f"less tracking error: {micrometres(outcome.before.rms)} to {micrometres(outcome.after.rms)} RMS",
                        ),
                        (f"{unseen:.0f} ×", "less on a motion not seen before"),
                        (
                            f"{outcome.result.train.relative_force_error_percent:.2g} %",
                            "relative force error of the identified model on its recording",
                        ),
                    ]
                ),
            ),
        ),
        Section("What was done", (bullets(steps), paragraph(clock, "note"))),
        _tracking(
            "Tracking, the motion that was identified from",
            outcome.before,
            outcome.after,
            "Zoom with the mouse; double click to go back.",
        ),
        _tracking(
            "Tracking, a motion not seen before",
            outcome.unseen_before,
            outcome.unseen_after,
            "Another seed of the same kind of motion.",
        ),
        _curve(outcome),
        _parameters(outcome),
        Section(
            "The controller it is compared with",
            (
                paragraph(
                    "The PID has the largest integral gain that keeps the sensitivity within its bound, for the true mass and damping: it is tuned "
                    "as well as this axis and its delay allow, and is the same in every run."
                ),
                table(("", ""), loop, text_columns=(0, 1)),
            ),
        ),
        Section("By hand", (paragraph("The same steps as commands:"), preformatted("\n".join(outcome.commands)))),
    ]
    return render("Friction found and compensated", _headline(outcome), sections)
