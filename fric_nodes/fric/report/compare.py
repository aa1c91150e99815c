"""The page of ``fric compare``: both recordings over each other, their difference, and where it sits."""

from __future__ import annotations

import numpy as np

from ..diagnosis.compare import Agreement, Comparison
from .figures import Curve, shaded, stacked
from .kind import Report
from .numbers import significant
from .page import Section, bullets, figure, paragraph, render, table, tiles

__all__ = ["REPORT", "comparison_report"]

_MOST_SPANS = 120  # drawn; a page with thousands of them is slow


def comparison_report(found: Comparison) -> str:
    """The page as text."""
    entries = [_tile(each) for each in found.agreements]
    if found.clocks.offset_told:
        limit = f"± {1e3 * (found.clocks.interval[1] - found.clocks.offset):.2g} ms (95 %)"
        entries.append((f"{1e3 * found.clocks.offset:.4g} ms", f"offset of the clocks, {limit}"))
    sections = [
        Section("", (paragraph(found.sentence, "verdict"), tiles(entries))),
        _signals(found),
        _figures(found),
        _alignment(found),
    ]
    if found.notes:
        sections.append(Section("What to know", (bullets(found.notes),)))
    lead = f"Simulated: {found.simulated}. Real: {found.real}. Times are those of the real recording."
    return render(f"Simulated and real: '{found.joint}'", lead, sections)


def _tile(each: Agreement) -> tuple[str, str]:
    """A signal's difference as a share of its spread, or in its unit where it is no share."""
    if each.is_share:
        return f"{each.noe:.3g} %", f"of the variance of the {each.signal} is the difference (normalised output error)"
    return (
        f"{significant(each.rmse, 3)} {each.unit}",
        f"RMS difference of the {each.signal}, more than it moves about its mean: no share is stated",
    )


def _signals(found: Comparison) -> Section:
    head = ("signal", "RMSE", "mean difference", "largest", "unit", "NOE [%]", "correlation")
    rows = [
        (
            each.signal,
            significant(each.rmse),
            significant(each.bias),
            significant(each.largest),
            each.unit,
            significant(each.noe) if each.is_share else "no share",
            f"{each.correlation:.5f}",
        )
        for each in found.agreements
    ]
    note = (
        "Difference: simulated minus real. NOE: energy of the difference over that of the real signal about its mean; beyond "
        "100 % a constant would do as well, and no share is stated."
    )
    return Section("How well they agree", (table(head, rows, text_columns=(0, 4)), paragraph(note, "note")))


def _figures(found: Comparison) -> Section:
    panels = []
    for each in found.agreements:
        real, simulated = found.signals[each.signal]
        over = [Curve("real", found.time, real, "measured", width=2.4), Curve("simulated", found.time, simulated, "after")]
        panels.append((f"{each.signal} [{each.unit}]", over))
    by = found.located_by
    real, simulated = found.signals[by]
    unit = next(each.unit for each in found.agreements if each.signal == by)
    panels.append((f"difference of {by} [{unit}]", [Curve("simulated minus real", found.time, simulated - real, "before")]))
    plot = stacked(panels, "time [s]", height=190)
    spans = found.where.time[0] if found.where is not None and found.where.time else ()
    shaded(plot, sorted(spans, key=lambda span: span[0] - span[1])[:_MOST_SPANS])
    caption = "Drag to zoom, double click to go back."
    if found.where is not None:
        caption += f" Shaded: the spans that hold {100 * found.where.share:.0f} % of the energy of the difference."
    blocks = [figure(plot, caption)]
    if found.where is not None:
        blocks.insert(0, paragraph(f"The difference of {by} is largest at: {found.where.regime}."))
    return Section("Where they differ", tuple(blocks))


def _alignment(found: Comparison) -> Section:
    rows = [
        ("offset of the clocks", found.clocks.offset_in_words),
        ("ratio of the clocks", found.clocks.ratio_in_words),
        ("time in common", f"{significant(float(np.ptp(found.time)))} s"),
    ]
    note = "A time of the real recording is the offset plus the ratio times the simulated one's."
    return Section("Alignment in time", (table(("", "value"), rows, text_columns=(0, 1)), paragraph(note, "note")))


REPORT = Report(Comparison, lambda found, train, validation, options: comparison_report(found))
