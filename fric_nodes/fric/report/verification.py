"""The verification page: what the physics was held against, with the figures found and the pictures."""

from __future__ import annotations

from collections.abc import Sequence

from ..figure import Figure
from ..verification.verification import Evidence, Verification
from .page import Section, bullets, figure, paragraph, preformatted, render, table, tiles

__all__ = ["TITLE", "goal", "quantity", "verification_page"]

TITLE = "Verification of the physics"
"""Title of the page, by which an earlier one is known."""

_MARKS = {True: "reached", False: "MISSED", None: ""}


def number(value: float) -> str:
    """``value`` with four digits; exact where it is a whole number."""
    return f"{value:.0f}" if value == round(value) and abs(value) < 1e6 else f"{value:.4g}"


def quantity(value: float, unit: str) -> str:
    """``value`` with its unit, which a pure number has none of."""
    return f"{number(value)} {unit}".strip() if unit != "1" else number(value)


def goal(found: Figure) -> str:
    """The goal of ``found`` with its unit, or nothing."""
    return f"{found.goal} {found.unit}".strip() if found.goal and found.unit != "1" else found.goal


def _row(found: Figure) -> list[str]:
    return [found.name, quantity(found.value, found.unit), goal(found), _MARKS[found.reached]]


def _section(check: Verification, evidence: Evidence) -> Section:
    blocks = [
        paragraph(f"Compared with: {check.source}.", "note"),
        table(("figure", "found", "goal", ""), (_row(found) for found in evidence.figures), text_columns=(0, 2, 3), wrap=(0,)),
        *(figure(plot, caption) for plot, caption in evidence.plots),
    ]
    if evidence.notes:
        blocks.append(bullets(evidence.notes))
    blocks.append(preformatted(f"fric verify {check.id}"))
    return Section(check.title, tuple(blocks))


def verification_page(found: Sequence[tuple[Verification, Evidence]]) -> str:
    """The page as text."""
    figures = [each for _, evidence in found for each in evidence.figures]
    with_goal = [each for each in figures if each.reached is not None]
    missed = [f"{each.name}: {quantity(each.value, each.unit)}, goal {each.goal}" for each in with_goal if not each.reached]
    counts = tiles(
        (
            (f"{len(with_goal) - len(missed)} of {len(with_goal)}", "goals reached"),
            (str(len(found)), "verifications"),
            (str(len(figures)), "figures, all measured when this page was made"),
        )
    )
    summary = Section("In short", (counts, paragraph("Missed:"), bullets(missed)) if missed else (counts,))
    lead = (
        "The physics of fric, compared with something that does not come from fric: figures of the papers, closed forms, "
        "conservation laws, integrations by another method. Every number was measured when this page was made."
    )
    return render(TITLE, lead, [summary, *(_section(*each) for each in found)])
