"""The report of an experiment design: what to record next, what it is expected to bring, and what else was looked at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..identification.design import Proposal
from ..identification.design.proposal import gains_text
from ..identification.design.search import Candidate, best_of_each
from ..identification.design.trial import Choice
from ..record import Array
from .figures import Curve, stacked
from .numbers import significant
from .page import Section, bullets, figure, paragraph, preformatted, render, table, tiles

__all__ = ["design_report"]

_RANKED = 15


def _percent(value: float) -> str:
    return "not known" if not np.isfinite(value) else f"{100.0 * value:.3g} %" if value < 10.0 else "over 1000 %"


def _worst(found: Proposal, errors: Array) -> float:
    reachable = found.problem.reachable
    return float(np.max(errors if reachable is None else errors[reachable]))


def _expected(found: Proposal, candidate: Candidate) -> float:
    return _worst(found, found.problem.together(candidate.worth).total_errors)


def _settings_table(parts: Sequence[Choice]) -> str:
    rows = []
    for part in parts:
        for parameter in part.kind.parameters:
            value = f"{part.values[parameter.name]:.4g}"
            rows.append((part.kind.id, parameter.name, parameter.symbol, value, parameter.doc))
    return table(("excitation", "setting", "symbol", "value", "meaning"), rows, text_columns=(0, 1, 2, 4), wrap=(4,))


def _errors_table(found: Proposal) -> str:
    problem = found.problem
    before, after = found.before, found.after(found.trial.best)
    generic = np.full_like(after, np.nan) if found.generic is None else found.after(found.generic)
    rows = []
    for k, name in enumerate(problem.free.names):
        value = float(problem.model.values[problem.free.index[k]])
        shown = problem.reachable is None or bool(problem.reachable[k])
        rows.append(
            (
                name,
                significant(value),
                significant(float(before[k]), 2),
                significant(float(after[k]), 2) if shown else "not shown",
                _percent(float(after[k] / problem.size[k])) if shown else "",
                significant(float(generic[k]), 2),
                problem.model.unit(name),
            )
        )
    head = ("parameter", "value so far", "error so far", "expected", "relative", "with a multisine", "unit")
    return table(head, rows, text_columns=(0, 6))


def _motion_plot(found: Proposal) -> str:
    motion, limits, units = found.trial.motion, found.problem.limits, found.problem.model.units
    time = motion.time
    velocity = np.gradient(motion.position, time)
    ends = time[[0, -1]]

    def limit(value: float) -> Curve:
        return Curve("limit", ends, np.array([value, value]), "before", dash="dot")

    position = [Curve("position", time, motion.position, "after")]
    if np.all(np.isfinite(motion.reference)):
        position.insert(0, Curve("reference", time, motion.reference, "reference", dash="dash"))
    plot = stacked(
        [
            (f"position [{units.position}]", [*position, *(limit(v) for v in limits.position)]),
            (
                f"velocity [{units.position}/s]",
                [Curve("velocity", time, velocity, "second"), limit(limits.speed), limit(-limits.speed)],
            ),
            (f"force [{units.force}]", [Curve("force", time, motion.effort, "true"), *(limit(v) for v in limits.force)]),
        ],
        "time [s]",
    )
    return figure(plot, "Simulated with the values so far, under the controller named above, and without noise.")


def _ranking_table(found: Proposal) -> str:
    rows = []
    for number, candidate in enumerate(best_of_each(found.trial.ranking)[:_RANKED], start=1):
        errors = found.problem.together(candidate.worth).total_errors
        seen = errors if found.problem.reachable is None else np.where(found.problem.reachable, errors, -1.0)
        parts = " + ".join(part.kind.title for part in candidate.parts)
        length = sum(part.duration for part in candidate.parts)
        name = found.problem.free.names[int(np.argmax(seen))]
        rows.append((str(number), parts, f"{length:.3g} s", _percent(_expected(found, candidate)), name))
    return table(("", "excitation, best settings found", "length", "worst relative error", "of"), rows, text_columns=(1, 4))


def design_report(found: Proposal) -> str:
    """The page as text."""
    problem, trial = found.problem, found.trial
    after = _expected(found, trial.best)
    before = float(np.max(problem.before()))
    figures = [(_percent(before), "worst relative error so far"), (_percent(after), "expected after the proposed recording")]
    if found.generic is not None:
        generic = _expected(found, found.generic)
        figures.append((f"{generic / after:.3g} times", "smaller than with a random-phase multisine within the same limits"))
    kinds = " and ".join(part.kind.title for part in found.parts)
    units = problem.model.units
    limits = problem.limits
    lead = f"Next recording of '{problem.model.joint}': {kinds}, {trial.motion.time[-1]:.3g} s, as a {found.parts[0].output}."
    kept = (
        f"Within {limits.position[0]:g} to {limits.position[1]:g} {units.position} from where it starts, "
        f"{limits.speed:g} {units.position}/s, {limits.force[0]:g} to {limits.force[1]:g} {units.force} and "
        f"{limits.duration:g} s: simulated with the values so far and with each of them a standard error higher and lower. "
        f"Over these, the worst relative error is {_percent(trial.robust)} in the mean."
    )
    refused = ", ".join(f"{limit} {count}" for limit, count in sorted(trial.refused.items())) or "none"
    followed = f"Simulated under a PID controller with {gains_text(problem.gains)}; use gains that are about as stiff."
    play = "fric node excitation --ros-args --params-file excitation.yaml"
    sections = [
        Section("", (tiles(figures), paragraph(kept))),
        Section("The excitation", (_settings_table(found.parts), paragraph(followed, "note"), preformatted(play))),
        Section("Standard errors, before and expected", (_errors_table(found),)),
        Section("Motion", (_motion_plot(found),)),
        Section(
            "What else was looked at",
            (
                _ranking_table(found),
                paragraph(f"{trial.evaluated} simulations; left out for breaking a limit: {refused}.", "note"),
            ),
        ),
    ]
    if found.notes:
        sections.append(Section("What to know", (bullets(found.notes),)))
    sections.append(Section("excitation.yaml", (preformatted(found.parameters_file(problem.model.joint)),)))
    return render(f"Next experiment for '{problem.model.joint}'", lead, sections)
