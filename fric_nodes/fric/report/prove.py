"""The page of an examination: what was concealed, what was found, every miss with its report, figures against goals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import numpy as np
import plotly.graph_objects as go

from ..diagnosis.prove.examination import Examination
from ..diagnosis.prove.scoring import Outcome, Rate, Score
from ..figure import Figure
from .figures import COLOURS
from .page import Section, bullets, figure, paragraph, preformatted, render, table, tiles
from .verification import goal, quantity

__all__ = ["prove_page"]

_MARKS = {True: "reached", False: "MISSED", None: ""}
_KINDS = {
    "moderate": "one effect, moderate",
    "weak": "one effect, weak",
    "pair": "two effects",
    "unknown": "outside the vocabulary",
    "nothing": "nothing missing",
    "mixed": "one effect, one outside the vocabulary",
    "compound": "three to five effects",
}


def _percent(value: float) -> str:
    return f"{100 * value:.1f} %" if math.isfinite(value) else "–"


def _shown(found: Figure, rate: Rate | None) -> list[str]:
    if rate is None:
        return [found.name, quantity(found.value, found.unit), "", goal(found), _MARKS[found.reached]]
    low, high = rate.interval
    wanted = ""
    if found.goal:
        relation, _, limit = found.goal.partition(" ")
        wanted = f"{relation} {100 * float(limit):g} %"
    interval = f"{rate.hits} of {rate.of}, {100 * low:.0f} to {100 * high:.0f} %"
    return [found.name, _percent(found.value), interval, wanted, _MARKS[found.reached]]


def _goals(score: Score) -> Section:
    rows = [_shown(each, score.rates.get(each.name)) for each in score.figures]
    head = ("figure", "found", "cases, 95 % interval", "goal", "")
    return Section("Figures", (table(head, rows, text_columns=(0, 2, 3, 4), wrap=(0,)),))


def _plain(plot: go.Figure, height: int) -> go.Figure:
    plot.update_layout(
        template="plotly_white",
        height=height,
        margin={"l": 64, "r": 16, "t": 28, "b": 46},
        font={"family": "system-ui, DejaVu Sans, sans-serif", "size": 13, "color": COLOURS["true"]},
    )
    return plot


def _confusion(score: Score) -> Section:
    concealed = sorted({each for each, _ in score.confusion})
    said = sorted({each for _, each in score.confusion} | set(concealed))
    counts = np.array([[score.confusion.get((row, column), 0) for column in said] for row in concealed], dtype=np.float64)
    text = [[str(int(value)) if value else "" for value in row] for row in counts]
    plot = go.Figure(
        go.Heatmap(
            z=np.where(counts > 0, counts, np.nan),
            x=said,
            y=concealed,
            text=text,
            texttemplate="%{text}",
            colorscale=[[0.0, "#dbe7f3"], [1.0, COLOURS["after"]]],
            showscale=False,
            hovertemplate="concealed: %{y}<br>named first: %{x}<br>cases: %{z}<extra></extra>",
        )
    )
    plot.update_xaxes(title_text="named first", tickangle=-50, automargin=True, showgrid=True)
    plot.update_yaxes(title_text="concealed", autorange="reversed", automargin=True, showgrid=True)
    caption = (
        "Concealed effect over the one named first; right answers lie on the diagonal. Cases with two effects are left out."
    )
    return Section("Taken for what", (figure(_plain(plot, 260 + 22 * len(concealed)), caption),))


def _calibration(score: Score) -> Section | None:
    if not score.bins:
        return None
    confidence, right, number = (np.array(column, dtype=np.float64) for column in zip(*score.bins, strict=True))
    plot = go.Figure()
    plot.add_trace(
        go.Scatter(x=[0, 1], y=[0, 1], mode="lines", name="calibrated", line={"color": COLOURS["measured"], "dash": "dot"})
    )
    rates = [Rate(round(r * n), int(n)) for r, n in zip(right, number, strict=True)]
    up = [rate.interval[1] - rate.value for rate in rates]
    down = [rate.value - rate.interval[0] for rate in rates]
    plot.add_trace(
        go.Scatter(
            x=confidence,
            y=right,
            mode="markers",
            name="findings",
            text=[f"{int(n)} findings" for n in number],
            marker={"color": COLOURS["after"], "size": 6 + 14 * np.sqrt(number / np.max(number))},
            error_y={"type": "data", "array": up, "arrayminus": down, "color": COLOURS["measured"], "thickness": 1},
        )
    )
    plot.update_xaxes(title_text="confidence stated", range=[0, 1.02])
    plot.update_yaxes(title_text="share that is right", range=[-0.02, 1.05])
    caption = "Share of right findings over the stated confidence. The area of a mark is the number of findings."
    return Section("How well the confidence is calibrated", (figure(_plain(plot, 420), caption),))


def _location(outcomes: Sequence[Outcome]) -> Section | None:
    located = [each for each in outcomes if each.held is not None and each.ratio is not None and math.isfinite(each.ratio)]
    if not located:
        return None
    plot = go.Figure()
    for kind, colour in (
        ("moderate", "after"),
        ("pair", "second"),
        ("unknown", "before"),
        ("weak", "measured"),
        ("mixed", "true"),
    ):
        part = [each for each in located if each.kind == kind]
        plot.add_trace(
            go.Scatter(
                x=[each.ratio for each in part],
                y=[each.held for each in part],
                text=[f"case {each.number:04d}: {_concealed(each)}" for each in part],
                mode="markers",
                name=_KINDS[kind],
                marker={"color": COLOURS[colour], "size": 7, "opacity": 0.7},
            )
        )
    plot.add_shape(type="rect", x0=1, x1=2, y0=0.8, y1=1, line={"color": COLOURS["second"], "dash": "dot"})
    plot.update_xaxes(title_text="length of the named spans over the shortest that hold as much", type="log")
    plot.update_yaxes(title_text="share of the energy held")
    caption = "Named spans of time compared with those in which the mismatch is. The dotted field is the goal."
    return Section("Where it shows", (figure(_plain(plot, 440), caption),))


def _concealed(outcome: Outcome) -> str:
    named = [each for each in outcome.effects if each != "unknown"]
    return " + ".join([*named, *([outcome.outside] if outcome.outside else [])]) or "nothing"


def _row(outcome: Outcome) -> str:
    folder = f"cases/{outcome.number:04d}"
    findings = ", ".join(f"{each.effect} ({each.confidence:.2f})" for each in outcome.findings) or outcome.said
    runner_up = outcome.findings[0].runner_up if outcome.findings else ""
    place = outcome.findings[0].component if outcome.findings else ""
    cells = [
        (f'<a href="{folder}/report.json">{outcome.number:04d}</a>', ""),
        (escape(_KINDS[outcome.kind]), ""),
        (escape(_concealed(outcome)), ""),
        (escape(outcome.failure or findings), "wrap"),
        (escape(runner_up), ""),
        (escape(place), ""),
        (f"{outcome.strength:.3g}", "number"),
        (f"{outcome.floor:.2g}", "number"),
        (f"{outcome.noe_refit:.3g}", "number"),
        (f"{outcome.noe_augmented:.3g}", "number"),
        (f"{outcome.noe_own:.3g}" if outcome.noe_own is not None else "", "number"),
        (f"{outcome.seconds:.1f}", "number"),
    ]
    return "<tr>" + "".join(f'<td class="{kind}">{text}</td>' for text, kind in cells) + "</tr>"


def _case_table(outcomes: Sequence[Outcome]) -> str:
    head = (
        "case", "kind", "concealed", "found (confidence)", "runner-up", "component", "strength [%]", "floor [%]",
        "NOE refit [%]", "NOE grown [%]", "NOE true structure [%]", "time [s]",
    )  # fmt: skip
    titles = "".join(f"<th>{escape(title)}</th>" for title in head)
    rows = "".join(_row(each) for each in outcomes)
    return f'<div class="scroll"><table><thead><tr>{titles}</tr></thead><tbody>{rows}</tbody></table></div>'


def _misses(outcomes: Sequence[Outcome]) -> Section:
    missed = [each for each in outcomes if not each.right]
    if not missed:
        return Section("Misses", (paragraph("None."),))
    lead = f"{len(missed)} of {len(outcomes)} cases, each with its report (beside this page, in cases/)."
    return Section("Misses", (paragraph(lead), _case_table(missed)))


def prove_page(held: Examination, command: str) -> str:
    """The page as text.

    Args:
        held: the examination.
        command: by which the reader gets the same page.
    """
    score, outcomes = held.score, held.outcomes
    with_goal = [each for each in score.figures if each.reached is not None]
    counts = tiles(
        (
            (f"{len(with_goal) - len(score.missed)} of {len(with_goal)}", "goals reached"),
            (str(len(outcomes)), "cases"),
            (f"{sum(each.right for each in outcomes)}", "right"),
            (f"{held.seconds / 60:.1f} min", "this run"),
        )
    )
    missed = [f"{row[0]}: {row[1]}, goal {row[3]}" for row in (_shown(e, score.rates.get(e.name)) for e in score.missed)]
    sealed = paragraph(f"The key was sealed before the first diagnosis began; sha256 {held.hash_of_key}.", "note")
    blocks = [counts, *((paragraph("Missed:"), bullets(missed)) if missed else ()), sealed, preformatted(command)]
    right = [each for each in outcomes if each.right]
    sections = [
        Section("In short", tuple(blocks)),
        _goals(score),
        _misses(outcomes),
        _confusion(score) if score.confusion else None,
        _calibration(score),
        _location(outcomes),
        Section("Right", (_case_table(right) if right else paragraph("None."),)),
    ]
    lead = (
        "Axes with concealed physics, simulated by an integrator that shares no code with fric's own. The diagnosis was given "
        "recordings and a nominal model, in another process. Then its answers were compared with the sealed key."
    )
    return render("Examination of the diagnosis", lead, [each for each in sections if each is not None])
