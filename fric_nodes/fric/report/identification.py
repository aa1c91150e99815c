"""The report of an identification: what was found, how sure, how well it fits, what was left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..identification.equations import Equations, equations
from ..identification.result import Identification, Options, Score
from ..identification.scoring import driving_force, force_along, free_run
from ..model import Model
from ..model_file import model_to_text
from ..record import Array, Record
from ..simulation import predict_force
from .checks import checks_section
from .figures import Curve, scatter_and_curves, stacked
from .identifiability import identifiability_section
from .kind import Report
from .numbers import significant
from .page import Section, bullets, figure, paragraph, preformatted, render, table, tiles

__all__ = ["REPORT", "friction_curve", "identification_report", "parameter_table", "significant"]


def friction_curve(model: Model, velocity: Array) -> Array:
    """Steady friction and bias force of ``model`` at ``velocity`` [F], shape ``(n,)``; inertia and slip dynamics left out."""
    static = model.with_terms(held for held in model.terms if held.effect.slip is None)
    zero = np.zeros_like(velocity)
    return predict_force(static, zero, zero, np.ascontiguousarray(velocity), zero, 1.0)


def parameter_table(result: Identification) -> str:
    """Values with standard errors and units."""
    rows = []
    for parameter in result.model.parameters():
        error = result.model.standard_errors.get(parameter.name)
        fitted = parameter.name in result.fitted
        relative = f"{100 * error / abs(parameter.value):.2g} %" if error is not None and parameter.value else ""
        rows.append(
            (
                parameter.name,
                parameter.declaration.symbol,
                significant(parameter.value),
                (significant(error, 2) if error is not None else "not known") if fitted else "held",
                relative if fitted else "",
                parameter.declaration.unit(result.model.units),
                parameter.declaration.doc,
            )
        )
    head = ("parameter", "symbol", "value", "standard error", "relative", "unit", "meaning")
    return table(head, rows, text_columns=(0, 1, 5, 6), wrap=(6,))


def _score_rows(result: Identification) -> list[tuple[str, ...]]:
    units = result.model.units

    def row(name: str, score: Score) -> tuple[str, ...]:
        return (
            name,
            f"{score.noe:.4g} %",
            f"{score.relative_force_error_percent:.3g} %",
            f"{significant(score.force_rmse, 3)} {units.force}",
            f"{significant(score.position_rmse, 3)} {units.position}",
            str(score.n_samples),
        )

    rows = [row("fitted recordings", result.train)]
    if result.validation is not None:
        rows.append(row("validation, not used by the fit", result.validation))
    return rows


def _force_section(name: str, model: Model, found: Equations) -> Section:
    measured = driving_force(model, found)
    predicted = found.rows(lambda stretch: force_along(model, stretch))
    off = [free_run(model, stretch) - stretch.raw_position for stretch in found.stretches]
    units = model.units
    time = np.concatenate([stretch.time for stretch in found.stretches])
    plot = stacked(
        [
            (
                f"force [{units.force}]",
                [
                    Curve("measured", found.time, measured, "measured", width=2.2),
                    Curve("predicted from the motion", found.time, predicted, "after"),
                ],
            ),
            (f"difference [{units.force}]", [Curve("measured minus predicted", found.time, measured - predicted, "before")]),
            (
                f"free run, position error [{units.position}]",
                [Curve("simulated minus measured position", time, np.concatenate(off), "second")],
            ),
        ],
        "time [s]",
    )
    caption = (
        "Filtered and decimated as in the fit. The free run starts in the recorded state and takes the measured force alone."
    )
    return Section(f"Measured and predicted force, {name}", (figure(plot, caption),))


def _curve_section(model: Model, found: Equations) -> Section:
    static = [held for held in model.terms if held.effect.slip is None]
    inertial = model.with_terms(())
    friction = driving_force(model, found) - found.rows(lambda stretch: force_along(inertial, stretch))
    top = float(np.max(np.abs(found.velocity)))
    side = np.geomspace(1e-4 * top, top, 200)
    grid = np.concatenate([-side[::-1], side])
    units = model.units
    curves = [Curve("model", grid, friction_curve(model, grid), "after", width=2.4)] if static else []
    use = found.sliding
    plot = scatter_and_curves(
        ("measured force less inertia", found.velocity[use], friction[use]),
        curves,
        f"velocity [{units.position}/s]",
        f"friction force [{units.force}]",
    )
    return Section("Friction curve", (figure(plot, "Each point is one equation of the fit; resting samples are left out."),))


def _correlation_section(result: Identification) -> Section:
    correlation = result.correlation
    rows = [
        (name, *("" if not np.isfinite(value) else f"{value:+.2f}" for value in correlation[k, : k + 1]))
        for k, name in enumerate(result.fitted)
    ]
    padded = [row + ("",) * (len(result.fitted) + 1 - len(row)) for row in rows]
    note = (
        "Near +1 or -1 the recording determines only a combination of two parameters. The covariance includes the "
        "correlation of the residuals in time."
    )
    return Section("Correlation of the estimates", (table(("", *result.fitted), padded), paragraph(note, "note")))


_FREE_RUN = (
    "The position error of a free run is no measure of the force error: the simulated position is the force error integrated "
    "twice, with nothing that corrects it, so it drifts even where the force is described to a few percent. It says how long "
    "a simulation without feedback follows the machine."
)


def _verdict_section(result: Identification) -> Section:
    """How well the model explains the recordings, in three numbers and a sentence."""
    score = result.validation if result.validation is not None else result.train
    which = "on the validation recording" if result.validation is not None else "on the recording it was fitted to"
    units = result.model.units
    return Section(
        "",
        (
            tiles(
                [
                    (f"{score.relative_force_error_percent:.3g} %", f"relative force error {which}"),
                    (f"{score.noe:.3g} %", f"of the force's variance left over (normalised output error), {which}"),
                    (
                        f"{significant(score.position_rmse, 3)} {units.position}",
                        f"position error (RMS) of a simulation from the force alone (free run), {which}",
                    ),
                ]
            ),
            paragraph(_FREE_RUN, "note"),
            paragraph(f"Status: {result.status}."),
        ),
    )


def identification_report(
    result: Identification, train: Sequence[Record], validation: Sequence[Record], options: Options
) -> str:
    """The page as text.

    Args:
        result: of the fit.
        train: the recordings that were fitted.
        validation: recordings kept apart; may be empty.
        options: as in the fit.
    """
    effects = ", ".join(held.effect.title for held in result.model.terms) or "no friction"
    title = result.model.plant.title
    lead = (
        f"{title[0].upper()}{title[1:]} '{result.model.joint}' with {effects}, "
        f"from {len(train)} recording(s) by {result.method}."
    )
    found = equations(list(train), options)
    sections = [
        _verdict_section(result),
        Section("Parameters", (parameter_table(result),)),
        Section(
            "Fit",
            (
                table(
                    ("recording", "NOE", "relative force error", "force RMSE", "free-run position RMSE", "equations"),
                    _score_rows(result),
                ),
            ),
        ),
        _curve_section(result.model, found),
        _force_section("fitted recording", result.model, found),
    ]
    if validation:
        sections.append(_force_section("validation recording", result.model, equations(list(validation), options)))
    sections.append(_correlation_section(result))
    if result.foreseen is not None:
        names = {p.name: p.declaration.unit(result.model.units) for p in result.model.parameters()}
        sections.append(identifiability_section(result.foreseen, names))
    if result.checks:
        sections.append(checks_section(result.checks, [record.source for record in train]))
    remarks = [*result.warnings, *result.notes]
    if remarks:
        sections.append(Section("What to know", (bullets(remarks),)))
    sections.append(Section("Model file", (preformatted(model_to_text(result.model)),)))
    return render(f"Identification of '{result.model.joint}'", lead, sections)


REPORT = Report(Identification, identification_report)
