"""The page of an axis of one's own: effects concealed in its recordings, and what the diagnosis said of each."""

from __future__ import annotations

from collections.abc import Sequence

from ..diagnosis.prove.injection_exam import InjectionOutcome
from ..diagnosis.result import Diagnosis
from .numbers import significant
from .page import Section, paragraph, render, table

__all__ = ["injection_page"]


def injection_page(bare: Diagnosis, outcomes: Sequence[InjectionOutcome], command: str) -> str:
    """One HTML page.

    Args:
        bare: diagnosis of the recordings as they are.
        outcomes: of every injection.
        command: that makes the page again.
    """
    unit = bare.given.units.force
    rows = [
        (
            each.what.effect,
            f"{each.what.times:g}",
            f"{significant(each.rms, 3)} {unit}",
            f"{100 * each.presence:.0f} %",
            each.failure or ("found" if each.found else "not found"),
            ", ".join(each.wrong),
        )
        for each in outcomes
    ]
    hits = sum(each.found for each in outcomes)
    wrong = sum(bool(each.wrong) for each in outcomes)
    note = (
        "Each effect was added to the recorded effort as the force that it would have needed along the measured motion; a "
        "delay is the effort ahead of its time. The size is a multiple of the force that stays unexplained in the recordings "
        "as they are."
    )
    head = ("effect", "times the rest", "added force, rms", "presence", "", "named wrongly")
    return render(
        f"What a diagnosis finds in recordings of '{bare.given.joint}'",
        f"Made by {command}",
        [
            Section(
                "", (paragraph(f"{hits} of {len(outcomes)} concealed effects found; in {wrong} another was named.", "verdict"),)
            ),
            Section("Concealed effects", (table(head, rows, text_columns=(0, 4, 5)), paragraph(note, "note"))),
            Section("The recordings as they are", (paragraph(bare.sentence),)),
        ],
    )
