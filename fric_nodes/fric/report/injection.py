"""The page of an axis of one's own: effects concealed in its recordings, and what the diagnosis said of each."""

from __future__ import annotations

from collections.abc import Sequence

from ..diagnosis.prove.injection_exam import InjectionOutcome
from ..diagnosis.result import Diagnosis
from .numbers import significant
from .page import Section, paragraph, render, table

__all__ = ["found_in_words", "injection_page"]

_BY_REST = (
    "Each effect was added to the recorded effort as the force that it would have needed along the measured motion; a "
    "delay is the effort ahead of its time. Its size is what it leaves missing beside the nominal model's parameters, "
    "where it acts, as a multiple of what stays unexplained there in the recordings as they are."
)
_AT_LIMITS = (
    "Each effect was added to the recorded effort as the force that it would have needed along the measured motion; a "
    "delay is the effort ahead of its time. Its size is a multiple of the detection limit that the diagnosis of the recordings "
    "as they are states for it: one and a half of it should be found, half of it not."
)


def found_in_words(outcomes: Sequence[InjectionOutcome]) -> str:
    """How many of the concealed effects were found, by their size where it is one of a detection limit."""
    asked = [each for each in outcomes if each.asked]
    if not any(each.limit for each in asked):
        return f"{sum(each.found for each in asked)} of {len(asked)} concealed effects found"
    parts = []
    for times in sorted({each.what.times for each in asked}, reverse=True):
        of = [each for each in asked if each.what.times == times]
        parts.append(f"{sum(each.found for each in of)} of {len(of)} effects at {times:g} times their detection limit found")
    return ", ".join(parts)


def injection_page(bare: Diagnosis, outcomes: Sequence[InjectionOutcome], command: str) -> str:
    """One HTML page.

    Args:
        bare: diagnosis of the recordings as they are.
        outcomes: of every injection.
        command: that makes the page again.
    """
    unit = bare.given.units.force
    by_limits = any(each.limit for each in outcomes)
    rows = [
        (
            each.what.effect,
            f"{each.what.times:g}",
            each.limit if each.rest is None else f"{significant(each.rest, 3)} {unit}",
            f"{significant(each.rms, 3)} {unit}" if each.asked else "",
            f"{100 * each.presence:.0f} %" if each.asked else "",
            each.failure or ("found" if each.found else "not found"),
            ", ".join(each.wrong),
        )
        for each in outcomes
    ]
    beside = ("times its limit", "detection limit") if by_limits else ("times the rest", "rest there, rms")
    head = ("effect", *beside, "added force, rms", "presence", "", "named wrongly")
    wrong = sum(bool(each.wrong) for each in outcomes)
    note = _AT_LIMITS if by_limits else _BY_REST
    columns = (0, 2, 5, 6) if by_limits else (0, 5, 6)
    found = f"{found_in_words(outcomes)}; in {wrong} another was named."
    return render(
        f"What a diagnosis finds in recordings of '{bare.given.joint}'",
        f"Made by {command}",
        [
            Section("", (paragraph(found, "verdict"),)),
            Section("Concealed effects", (table(head, rows, text_columns=columns), paragraph(note, "note"))),
            Section("The recordings as they are", (paragraph(bare.sentence),)),
        ],
    )
