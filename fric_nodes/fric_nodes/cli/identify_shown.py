"""What ``fric identify`` says: tables and the remarks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from .printed import console, plain_table

if TYPE_CHECKING:
    from fric.identification.design import Proposal
    from fric.identification.result import Identification
    from fric.identification.uncertainty import Uncertainty
    from fric.model import Model

__all__ = ["print_design", "print_intervals", "print_result"]


def print_intervals(found: Uncertainty, model: Model) -> None:
    """The intervals as a table."""
    numeric = ("from", "to", "std over restarts", "over recordings")
    shown = plain_table(("parameter", *numeric, "unit"), numeric)
    for k, name in enumerate(found.names):
        numbers = (found.lower[k], found.upper[k], found.restarts[k], found.recordings[k])
        texts = [f"{value:.5g}" if math.isfinite(value) else "-" for value in numbers]
        shown.add_row(name, *texts, model.unit(name))
    shell = console()
    shell.print(f"{found.kind}: {100 * found.probability:g} % intervals")
    shell.print(shown)
    for line in found.notes:
        shell.print(f"- {line}")


def print_result(result: Identification, out: Path) -> None:
    """Values, scores, remarks, and what was written."""
    shell = console()
    shown = plain_table(("parameter", "value", "standard error", "unit"), ("value", "standard error"))
    for parameter in result.model.parameters():
        error = result.model.standard_errors.get(parameter.name)
        text = "held" if parameter.name not in result.fitted else "not known" if error is None else f"{error:.2g}"
        shown.add_row(parameter.name, f"{parameter.value:.6g}", text, parameter.declaration.unit(result.model.units))
    shell.print(shown)
    units = result.model.units
    for name, score in (("train", result.train), ("validation", result.validation)):
        if score is not None:
            run = (
                f", free-run position RMSE {score.position_rmse:.3g} {units.position}"
                if math.isfinite(score.position_rmse)
                else ""
            )
            force = f"relative force error {score.relative_force_error_percent:.2f} %, NOE {score.noe:.4f} %"
            shell.print(f"{name}: {force}{run}")
    for line in (*result.notes, *result.warnings):
        shell.print(f"- {line}")
    shell.print(f"status: {result.status}")
    written = ", ".join([str(out / "model.yaml"), *result.attachments, "identification.json", "report.html"])
    shell.print(f"written: {written}")


def print_design(found: Proposal, out: Path, written: list[str]) -> None:
    """The excitations proposed, and what they are expected to bring."""
    problem = found.problem
    shell = console()
    for part in found.parts:
        settings = ", ".join(f"{name} {value:.4g}" for name, value in part.values.items())
        shell.print(f"{part.kind.title}, {part.duration:.3g} s ({part.kind.id}: {settings})")
    numeric = ("value", "error so far", "expected", "with a multisine")
    shown = plain_table(("parameter", *numeric, "unit"), numeric)
    before, after = found.before, found.after(found.trial.best)
    generic = None if found.generic is None else found.after(found.generic)
    for k, name in enumerate(problem.free.names):
        numbers = [before[k], after[k], math.inf if generic is None else generic[k]]
        texts = [f"{value:.2g}" if math.isfinite(value) else "not known" for value in numbers]
        value = problem.model.values[problem.free.index[k]]
        shown.add_row(name, f"{value:.5g}", *texts, problem.model.unit(name))
    shell.print(shown)
    for line in found.notes:
        shell.print(f"- {line}")
    for path in written:
        shell.print(f"written: {out / path}")
    play = f"fric node excitation --ros-args --params-file {out / 'excitation.yaml'}"
    shell.print(f"play it: {play}", soft_wrap=True)
