"""The page around a report's sections, and the few blocks that sections are made of.

Every text that comes from a file, a bag or a user is escaped; only blocks made here are trusted.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib.metadata import PackageNotFoundError, version

import plotly.graph_objects as go
from jinja2 import Environment, PackageLoader, select_autoescape
from plotly.offline import get_plotlyjs

__all__ = ["Section", "bullets", "figure", "paragraph", "preformatted", "render", "table", "tiles"]


_BREAK = re.compile(r"([._])(?=\w)")  # where a name such as presliding.stiffness may go on in the next line


@dataclass(frozen=True)
class Section:
    """One part of a report: a heading and blocks of finished HTML."""

    title: str
    blocks: tuple[str, ...]


def paragraph(text: str, kind: str = "") -> str:
    """A paragraph; ``kind`` is ``note`` or empty."""
    return f'<p class="{kind}">{escape(text)}</p>'


def bullets(lines: Iterable[str]) -> str:
    """A list."""
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"


def preformatted(text: str) -> str:
    """Text as it is, such as a file or a command."""
    return f"<pre>{escape(text)}</pre>"


def tiles(entries: Iterable[tuple[str, str]]) -> str:
    """Large figures with a caption each: ``(figure, caption)``."""
    inner = "".join(
        f'<div class="tile"><b>{escape(value)}</b><span>{escape(caption)}</span></div>' for value, caption in entries
    )
    return f'<div class="tiles">{inner}</div>'


def table(
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    text_columns: Sequence[int] = (0,),
    wrap: Sequence[int] = (),
    names: Sequence[int] = (),
) -> str:
    """A table; columns not in ``text_columns`` are set as numbers, those in ``wrap`` may break even where there is room.

    Those in ``names`` stay on one line, as text does.

    On a narrow screen each row becomes a block of lines, a heading and a value each, so that nothing lies outside the page.
    """

    def kind(column: int) -> str:
        kinds = ["name"] if column in names else ["text"] if column in text_columns else ["number"]
        kinds += ["wrap"] if column in wrap else []
        return f' class="{" ".join(kinds)}"'

    def cell(column: int, text: str) -> str:
        heading = escape(head[column]) if column < len(head) else ""
        return f'<td{kind(column)} data-head="{heading}">{escape(text)}</td>'

    headings = (_BREAK.sub(r"\1<wbr>", escape(each)) for each in head)
    header = "".join(f"<th{kind(k)}>{each}</th>" for k, each in enumerate(headings))
    body = "".join("<tr>" + "".join(cell(k, text) for k, text in enumerate(row)) + "</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{header}</tr></thead><tbody>{body}</tbody></table></div>'


def figure(plot: go.Figure, caption: str) -> str:
    """An interactive plot with its caption."""
    inner = plot.to_html(
        full_html=False,
        include_plotlyjs=False,
        config={"displaylogo": False, "responsive": True},
        default_width="100%",
    )
    return f'<figure><div class="plot">{inner}</div><figcaption>{escape(caption)}</figcaption></figure>'


def render(title: str, lead: str, sections: Iterable[Section]) -> str:
    """The whole page as text."""
    environment = Environment(loader=PackageLoader(__package__), autoescape=select_autoescape(["html"]))
    held = list(sections)
    has_plots = any("plotly" in block for section in held for block in section.blocks)
    try:
        release = version("fric")
    except PackageNotFoundError:
        release = "from source"
    return environment.get_template("page.html").render(
        title=title,
        lead=lead,
        sections=held,
        plot_library=get_plotlyjs() if has_plots else "",
        footer=f"fric {release}. This page is one file: it opens without a network.",
    )
