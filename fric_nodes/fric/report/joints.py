"""One page about the identification of several joints: what was found of each, with a link to its report, and what failed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any
from urllib.parse import quote

from .numbers import significant
from .page import Section, paragraph, render

__all__ = ["joints_overview"]


def _cell(entry: Mapping[str, Any], name: str) -> str:
    """Value, standard error and unit of a parameter; empty where the joint does not have it."""
    found = entry["parameters"].get(name)
    if found is None:
        return ""
    error = f" ± {significant(found['std'], 2)}" if found["std"] is not None else "" if found["fitted"] else " (held)"
    return f"{significant(found['value'])}{error} {found['unit']}"


def _rows(found: Mapping[str, Mapping[str, Any]], links: Mapping[str, str]) -> tuple[list[str], list[list[str]]]:
    names = list(dict.fromkeys(name for entry in found.values() for name in entry["parameters"]))
    rows = []
    for joint, entry in found.items():
        link = f'<a href="{escape(quote(links[joint]), quote=True)}">{escape(joint)}</a>'
        error = f"{entry['train']['relative_force_error_percent']:.3g} %"
        rows.append([link, *(escape(text) for text in (*(_cell(entry, name) for name in names), error, entry["status"]))])
    return ["joint", *names, "force error", "status"], rows


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table whose cells are finished HTML."""
    header = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f'<td class="wrap">{cell}</td>' for cell in row) + "</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{header}</tr></thead><tbody>{body}</tbody></table></div>'


def joints_overview(
    source: str, found: Mapping[str, Mapping[str, Any]], failed: Mapping[str, str], links: Mapping[str, str]
) -> str:
    """The page as text.

    Args:
        source: the recordings.
        found: the JSON object of ``fric identify`` by joint.
        failed: why a joint was not identified, by joint.
        links: report of each joint that was identified, relative to the page.
    """
    sections = []
    if found:
        sections.append(Section("Identified", (_table(*_rows(found, links)),)))
    if failed:
        rows = [[escape(joint), escape(reason)] for joint, reason in failed.items()]
        sections.append(Section("Not identified", (_table(("joint", "why"), rows),)))
    else:
        sections.append(Section("Not identified", (paragraph("None: every joint was identified."),)))
    lead = f"{len(found)} of {len(found) + len(failed)} joints of {source} were identified."
    return render("Identification of all joints", lead, sections)
