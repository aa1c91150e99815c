"""The section of a report that tells what is wrong with the recordings themselves: a table of the checks.

Findings that are alike in several recordings share a row; faults come first, then warnings, what is in order, and what can't
be told.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..instrument import CHECKS, Finding
from .page import Section, paragraph, table

__all__ = ["checks_rows", "checks_section", "checks_sentence"]

_ORDER = ("fault", "warning", "ok", "unknown")
_WORDS = {"fault": "FAULT", "warning": "warning", "ok": "in order", "unknown": "can't be told"}


def _value(finding: Finding) -> str:
    if not math.isfinite(finding.value):
        return ""
    unit = "" if finding.unit == "1" else f" {finding.unit}"
    text = f"{finding.value:.3g}{unit}"
    if finding.interval is not None and all(math.isfinite(limit) for limit in finding.interval):
        text += f" ({finding.interval[0]:.3g} to {finding.interval[1]:.3g})"
    return text


def checks_rows(findings: Sequence[Finding], names: Sequence[str] = ()) -> list[tuple[str, str, str, str, str, str]]:
    """Check, verdict, recordings, value, what was found, and what to do; ``names`` are those of the recordings."""
    groups: dict[tuple[str, str], list[Finding]] = {}
    for finding in findings:
        groups.setdefault((finding.check, finding.verdict), []).append(finding)
    rows = []
    for check, verdict in sorted(groups, key=lambda key: (_ORDER.index(key[1]), list(CHECKS).index(key[0]))):
        held = groups[check, verdict]
        first = held[0]
        several = len(held) > 1 or len(names) > 1
        at = [held_one.recording for held_one in held if held_one.recording is not None]
        shown = [names[k] if k < len(names) else str(k + 1) for k in at[:3]]
        more = f" and {len(at) - 3} more" if len(at) > 3 else ""
        where = (", ".join(shown) + more if shown else "all together") if several else ""
        detail = first.detail + (f" (and {len(held) - 1} like it)" if len(held) > 1 and verdict in {"fault", "warning"} else "")
        remedy = first.remedy if verdict in {"fault", "warning"} else ""
        value = _value(first) if len(held) == 1 else ""
        rows.append(
            (CHECKS[check].title, _WORDS[verdict], where, value, detail if verdict != "ok" or not several else "", remedy)
        )
    return rows


def checks_sentence(findings: Sequence[Finding]) -> str:
    """The verdict in one sentence."""
    named = {verdict: sorted({CHECKS[f.check].title for f in findings if f.verdict == verdict}) for verdict in _ORDER}
    if named["fault"]:
        return f"The recordings have faults that would bias a fit: {', '.join(named['fault'])}."
    if named["warning"]:
        return f"No fault of the recordings was found. Warnings: {', '.join(named['warning'])}."
    return "No fault of the recordings was found."


def checks_section(findings: Sequence[Finding], names: Sequence[str] = ()) -> Section:
    """The section: one sentence, what is wrong and what to do about it, what is in order, and what can't be told.

    Args:
        findings: of :func:`fric.instrument.inspect`.
        names: of the recordings.
    """
    rows = checks_rows(findings, names)
    several = len(names) > 1
    blocks = [paragraph(checks_sentence(findings))]

    def add(words: Sequence[str], columns: Sequence[int], head: Sequence[str]) -> None:
        chosen = [c for c in columns if several or c != 2]
        shown = [[row[c] for c in chosen] for row in rows if row[1] in words]
        if shown:
            everything = range(len(chosen))
            blocks.append(table([head[c] for c in chosen], shown, text_columns=everything, wrap=everything))

    head = ("check", "verdict", "recording", "value", "what was found", "what to do")
    add((_WORDS["fault"], _WORDS["warning"]), (0, 1, 2, 4, 5), head)
    add((_WORDS["ok"],), (0, 1, 2, 3) if several else (0, 1, 3, 4), head)
    add((_WORDS["unknown"],), (0, 1, 2, 4), (*head[:4], "why", ""))
    if several:
        blocks.append(
            paragraph("Values are shown where a finding is about one recording, or about all of them together.", "note")
        )
    return Section("The instrument", tuple(blocks))
