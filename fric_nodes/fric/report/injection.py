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
            f"{significant(each.rest, 3)} {unit}",
            f"{significant(each.rms, 3)} {unit}" if each.asked else "",
            f"{100 * each.presence:.0f} %" if each.asked else "",
            each.failure or ("found" if each.found else "not found"),
            ", ".join(each.wrong),
        )
        for each in outcomes
    ]
    asked = [each for each in outcomes if each.asked]
    hits = sum(each.found for each in asked)
    wrong = sum(bool(each.wrong) for each in outcomes)
    note = (
        "Each effect was added to the recorded effort as the force that it would have needed along the measured motion; a "
        "delay is the effort ahead of its time. Its size is what it leaves missing beside the nominal model's parameters, "
        "where it acts, as a multiple of what stays unexplained there in the recordings as they are."
    )
    head = ("effect", "times the rest", "rest there, rms", "added force, rms", "presence", "", "named wrongly")
    return render(
        f"What a diagnosis finds in recordings of '{bare.given.joint}'",
        f"Made by {command}",
        [
            Section(
                "", (paragraph(f"{hits} of {len(asked)} concealed effects found; in {wrong} another was named.", "verdict"),)
            ),
            Section("Concealed effects", (table(head, rows, text_columns=(0, 5, 6)), paragraph(note, "note"))),
            Section("The recordings as they are", (paragraph(bare.sentence),)),
        ],
    )
