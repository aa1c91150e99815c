"""The report of a diagnosis: the verdict in one sentence, the picture that convinces, then the rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from ..diagnosis.limits import EVIDENCE
from ..diagnosis.motion import smooth
from ..diagnosis.result import Diagnosis, Finding, Prediction
from ..model_file import model_to_text
from ..record import Array, Record
from .checks import checks_section
from .figures import Curve, scatter_and_curves, shaded, stacked
from .kind import Report
from .numbers import significant
from .page import Section, bullets, figure, paragraph, preformatted, render, table, tiles

__all__ = ["REPORT", "diagnosis_report"]

_MOST_SPANS = 120  # drawn; a page with thousands of them is slow


def diagnosis_report(found: Diagnosis, train: Sequence[Record], validation: Sequence[Record]) -> str:
    """The page as text.

    Args:
        found: the verdict.
        train: the recordings that were learnt from.
        validation: the recordings that were not.
    """
    v = found.validation
    title = found.given.plant.title
    learnt = f"{len(train)} recording{'s' if len(train) > 1 else ''} for training, {len(validation)} held back"
    lead = (
        f"{title[0].upper()}{title[1:]} '{found.given.joint}': {learnt}. Every error here is on recordings "
        "that no fit has used. They add no effect; they can withdraw what was found, and what they show to be left counts."
    )
    sections = [
        Section(
            "",
            (
                paragraph(found.sentence, "verdict"),
                tiles(
                    [
                        (f"{v.noe_nominal:.3g} %", "normalised output error of the nominal model as given"),
                        (f"{v.noe_refit:.3g} %", "with its parameters fitted anew"),
                        (f"{v.noe_augmented:.3g} %", "with the missing effects added"),
                        (f"{v.noise_floor:.3g} %", "noise of the instruments alone"),
                    ]
                ),
                *([paragraph(found.force_errors_in_words)] if found.force_errors_in_words else []),
            ),
        ),
    ]
    if found.by_means:
        sections.append(_over_speed(found, validation))
    elif found.prediction and found.prediction[0].time.size:
        sections.append(_picture(found, found.prediction[0]))
        sections.append(_whole(found))
        sections.append(_regimes(found, validation[0]))
    sections += [_finding_section(each, k) for k, each in enumerate(found.findings)]
    if found.components:
        sections.append(_components_section(found))
    if found.limits:
        sections.append(_limits_section(found))
    sections += [_growth_section(found), _candidates_section(found), _parameters_section(found), _rest_section(found)]
    if found.checks:
        sections.append(checks_section(found.checks, [record.source for record in train]))
    remarks = [*found.notes]
    if remarks:
        sections.append(Section("What to know", (bullets(remarks),)))
    sections.append(
        Section(
            "Grown model",
            (
                paragraph("This file runs as it is in the plant, the compensator and every other node.", "note"),
                preformatted(model_to_text(found.model)),
            ),
        )
    )
    return render(f"Diagnosis of '{found.given.joint}'", lead, sections)


def _spans(found: Diagnosis, number: int) -> list[tuple[float, float]]:
    where = found.where
    return list(where.time[number]) if where is not None and number < len(where.time) else []


def _shaded(plot: go.Figure, spans: Sequence[tuple[float, float]], low: float, high: float) -> go.Figure:
    inside = [(max(first, low), min(last, high)) for first, last in spans if last >= low and first <= high]
    return shaded(plot, sorted(inside, key=lambda span: span[0] - span[1])[:_MOST_SPANS])


def _curves(found: Diagnosis, p: Prediction, use: slice) -> list[Curve]:
    curves = [
        Curve("measured", p.time[use], p.force_measured[use], "measured", width=2.4),
        Curve("nominal, refitted", p.time[use], p.force_refit[use], "before"),
    ]
    if found.mismatch:
        curves.append(Curve("with what was missing", p.time[use], p.force_augmented[use], "after"))
    return curves


def _picture(found: Diagnosis, p: Prediction) -> Section:
    """The second or so in which the difference shows most."""
    step = float(np.median(np.diff(p.time)))
    width = min(max(round(2.0 / step), 50), p.time.shape[0])
    gain = np.convolve((p.force_refit - p.force_measured) ** 2, np.ones(width), mode="valid")
    lasting = p.time[width - 1 :] - p.time[: p.time.shape[0] - width + 1]
    # What was held back may be in several parts.
    first = int(np.argmax(np.where(lasting < 1.2 * width * step, gain, -1.0)))
    use = slice(first, first + width)
    plot = stacked([(f"force [{found.given.units.force}]", _curves(found, p, use))], "time [s]", height=340)
    _shaded(plot, _spans(found, 0), float(p.time[use][0]), float(p.time[use][-1]))
    caption = (
        f"{p.source}, where the refitted model is off most. A model's force is what it would have needed for the measured "
        "motion; shaded: where the mismatch was located."
    )
    return Section("The difference", (figure(plot, caption),))


def _whole(found: Diagnosis) -> Section:
    figures = []
    for number, p in enumerate(found.prediction):
        if not p.time.size:
            continue
        missing = [Curve("missing in the refitted nominal", p.time, p.force_measured - p.force_refit, "before")]
        if found.mismatch:
            missing.append(Curve("missing in the grown model", p.time, p.force_measured - p.force_augmented, "after"))
        unit = found.given.units.force
        plot = stacked([(f"force [{unit}]", _curves(found, p, slice(None))), (f"missing [{unit}]", missing)], "time [s]")
        _shaded(plot, _spans(found, number), float(p.time[0]), float(p.time[-1]))
        figures.append(figure(plot, f"{p.source}, the whole recording. Drag to zoom, double click to go back."))
    return Section("Measured and predicted", tuple(figures))


def _over_speed(found: Diagnosis, validation: Sequence[Record]) -> Section:
    """Mean forces of the runs held back over their speed, measured and predicted."""
    pairs = [(p, record) for p, record in zip(found.prediction, validation, strict=True) if p.time.size]
    units = found.given.units
    velocity = np.array([np.polyfit(record.time[record.mask], record.position[record.mask], 1)[0] for _, record in pairs])
    measured, refit, grown = (
        np.array([float(np.mean(signal)) for signal in signals])
        for signals in zip(*((p.force_measured, p.force_refit, p.force_augmented) for p, _ in pairs), strict=True)
    )
    order = np.argsort(velocity)
    curves = []
    for sign in (-1.0, 1.0):
        way = order[sign * velocity[order] > 0.0]
        name = "forward" if sign > 0.0 else "backward"
        curves.append(Curve(f"nominal, refitted, {name}", velocity[way], refit[way], "before"))
        if found.mismatch:
            curves.append(Curve(f"with what was missing, {name}", velocity[way], grown[way], "after"))
    label = f"velocity [{units.position}/s]"
    points = ("measured, mean of each run held back", velocity, measured)
    force = scatter_and_curves(points, curves, label, f"force [{units.force}]", size=8)
    lacking = ("missing in the refitted nominal", velocity, measured - refit)
    more = [Curve("missing in the grown model", velocity[order], (measured - grown)[order], "after")] if found.mismatch else []
    rest = scatter_and_curves(lacking, more, label, f"missing force [{units.force}]", 340, size=8)
    caption = "Each point is one run held back. Drag to zoom, double click to go back."
    return Section("The difference", (figure(force, caption), figure(rest, "What is missing over velocity.")))


def _regimes(found: Diagnosis, record: Record) -> Section:
    """What is missing over speed and over position, before and after."""
    p = found.prediction[0]
    units = found.given.units
    h = record.sample_time
    rate = np.gradient(smooth(record.position, h, min(200.0, 0.5 / h)), h)
    velocity = np.interp(p.time, record.time, rate)
    position = np.interp(p.time, record.time, record.position)
    blocks = []
    for name, x, label in (
        ("velocity", velocity, f"velocity [{units.position}/s]"),
        ("position", position, f"position [{units.position}]"),
    ):
        before, after = p.force_measured - p.force_refit, p.force_measured - p.force_augmented
        curves = [Curve("mean, refitted nominal", *_binned(x, before), "before", width=2.6)]
        if found.mismatch:
            curves.append(Curve("mean, grown model", *_binned(x, after), "after", width=2.6))
        plot = scatter_and_curves(
            ("missing in the refitted nominal", x, before), curves, label, f"missing force [{units.force}]", 340
        )
        blocks.append(figure(plot, f"What is missing over {name}."))
    return Section("Where it depends on what", tuple(blocks))


def _binned(x: Array, y: Array) -> tuple[Array, Array]:
    edges = np.linspace(float(np.quantile(x, 0.005)), float(np.quantile(x, 0.995)), 61)
    index = np.digitize(x, edges)
    centres, means = [], []
    for k in range(1, edges.shape[0]):
        here = index == k
        if np.sum(here) > 5:
            centres.append(0.5 * (edges[k - 1] + edges[k]))
            means.append(float(np.mean(y[here])))
    return np.array(centres), np.array(means)


def _finding_section(each: Finding, number: int) -> Section:
    rows = [
        ("confidence", f"{100 * each.confidence:.1f} %"),
        (
            "runner-up",
            "none" if each.runner_up is None else f"{each.runner_up.effect} ({100 * each.runner_up.confidence:.1f} %)",
        ),
        ("component", each.component),
        ("regime", each.where.regime),
        ("share of the mismatch", f"{100 * each.share:.3g} %"),
        ("law", each.law or "the only one"),
    ]
    blocks = [paragraph(f"{each.evidence}."), table(("", ""), rows, text_columns=(0, 1), wrap=(1,))]
    if each.parameters:
        values = [
            (name, significant(e.value), "not known" if e.std is None else significant(e.std, 2), e.unit)
            for name, e in each.parameters.items()
        ]
        blocks.append(table(("parameter", "value", "standard error", "unit"), values, text_columns=(0, 3)))
    return Section(f"{number + 1}. {each.title[0].upper()}{each.title[1:]}", tuple(blocks))


def _components_section(found: Diagnosis) -> Section:
    """Where something is still missing, each component weighed beside all others."""
    unit = found.given.units.force
    rows = []
    for each in found.components:
        best = each.laws[0] if each.laws and each.is_there else None
        rows.append(
            (
                each.title,
                each.place,
                f"{significant(each.force, 2)} {unit}",
                f"{100 * each.share:.2g} %",
                f"{each.evidence:.1f}",
                "" if best is None else best.title,
                "" if best is None else f"{100 * best.explained:.0f} %",
            )
        )
    head = ("component", "part of the machine", "force, rms", "share", "evidence [nats]", "best law", "explains")
    note = (
        "What the grown model still lacks in the recordings learnt from, as a sum of one flexible function per component, all "
        "fitted together. The share is that of the missing energy that comes back without the component; the evidence compares "
        "the sum with and without it. The last column is the part of that evidence that the best law reaches; where it is "
        "small, no law of the vocabulary describes what is missing. Physics that belongs to no component shows in several."
    )
    return Section(
        "What is still missing, by component",
        (table(head, rows, text_columns=(0, 1, 5), wrap=(0, 5)), paragraph(note, "note")),
    )


def _limits_section(found: Diagnosis) -> Section:
    """How large what was not found would have to be."""
    rows = [
        (
            each.title,
            "" if each.size is None else f"{'below' if each.softer else 'above'} {significant(each.size, 2)} {each.unit}",
            each.parameter,
            f"perhaps as {each.like_title}" if each.like else each.why,
        )
        for each in found.limits
    ]
    note = (
        "The size at which an effect that was not found would have been named with 50 %, at first order, beside everything "
        f"that the model has and leaves, and where the log likelihood rises by {EVIDENCE:g} nats at least. Smaller ones may "
        "be there, or show as something unknown."
    )
    head = ("effect", "would have shown", "parameter", "but, or why not")
    return Section("Detection limits", (table(head, rows, text_columns=(0, 1, 2, 3), wrap=(3,)), paragraph(note, "note")))


def _growth_section(found: Diagnosis) -> Section:
    rows = [
        (f"with {each.term}" if each.term else "refitted nominal", f"{100 * each.left:.3g} %", each.beside)
        for each in found.grown
    ]
    note = "Share of the missing force's energy that is left above the noise floor, on training blocks left out in turn."
    if found.by_means:
        note = "Share of the weighted squared errors of the training means that is left, above chance."
    return Section(
        "How the model grew",
        (table(("model", "left", "with the next best instead"), rows, text_columns=(0, 2)), paragraph(note, "note")),
    )


def _candidates_section(found: Diagnosis) -> Section:
    rows = [(each.effect, each.why) for each in found.rejected]
    return Section("Effects that are not there", (table(("effect", "why"), rows, text_columns=(0, 1), wrap=(1,)),))


def _parameters_section(found: Diagnosis) -> Section:
    part = found.nominal
    rows = []
    for p in found.model.parameters():
        given, refit = part.parameters.get(p.name), part.refit_parameters.get(p.name)
        error = found.model.standard_errors.get(p.name)
        rows.append(
            (
                p.name,
                "" if given is None else significant(given),
                "" if refit is None else significant(refit),
                significant(p.value),
                "held" if error is None else significant(error, 2),
                p.declaration.unit(found.model.units),
            )
        )
    head = ("parameter", "given", "refitted", "grown model", "standard error", "unit")
    return Section("Parameters", (table(head, rows, text_columns=(0, 5)),))


def _rest_section(found: Diagnosis) -> Section:
    rest = found.unexplained
    if rest.where is None:
        text = "Nothing is left above the noise of the instruments."
    else:
        within = ""
        if rest.interval is not None:
            within = f" (95 %: {100 * rest.interval[0]:.2g} to {100 * rest.interval[1]:.2g} %)"
        text = f"{100 * rest.share:.3g} % of the missing force's energy is left{within}, mostly at: {rest.where.regime}."
    return Section(
        "What is left, and what to record next", (paragraph(text), paragraph(f"Next experiment: {found.next_experiment}."))
    )


REPORT = Report(Diagnosis, lambda found, train, validation, options: diagnosis_report(found, train, validation))
